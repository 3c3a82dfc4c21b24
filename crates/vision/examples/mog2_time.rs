//! Runs the mixture of Gaussians over raw RGB pictures, for `benches/mog2.py` to take the time of:
//! `mog2_time FILE WIDTH HEIGHT ROUNDS`; each round goes through the file once.

use pursuit_imaging::{Image, Rgb8};
use pursuit_vision::background::{BackgroundModel, FOREGROUND, Learning, Mog2, Mog2Params};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [file, width, height, rounds] = arguments.as_slice() else { return Err("FILE WIDTH HEIGHT ROUNDS".into()) };
    let (width, height, rounds): (usize, usize, usize) = (width.parse()?, height.parse()?, rounds.parse()?);
    let bytes = std::fs::read(file)?;
    let frames: Vec<Image<Rgb8>> = bytes
        .chunks_exact(3 * width * height)
        .map(|frame| Image::from_vec(frame.as_chunks::<3>().0.to_vec(), width, height))
        .collect::<Result<_, _>>()?;
    let mut model = Mog2::<Rgb8>::new(Mog2Params::default())?;
    let mut mask = Image::filled(1, 1, 0)?;
    let mut foreground = 0;
    for frame in (0..rounds).flat_map(|_| &frames) {
        model.apply(frame.view(), &Learning::default(), &mut mask)?;
        foreground += mask.as_slice().iter().filter(|v| **v == FOREGROUND).count();
    }
    println!("{} frames a round, {foreground} pixels of foreground in all", frames.len());
    Ok(())
}
