//! Times the mixture of Gaussians over raw RGB pictures, for `benches/mog2.py`: `mog2_time FILE WIDTH HEIGHT ROUNDS`; each round
//! goes through the file once. Printed are the least, the tenth percentile and the median of the frames' times, in
//! milliseconds, without those of the first round.

use pursuit_imaging::{Image, Rgb8};
use pursuit_vision::background::{BackgroundModel, Learning, Mog2, Mog2Params};
use std::time::Instant;

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
    let mut times_ms = Vec::new();
    for (k, frame) in (0..rounds).flat_map(|_| &frames).enumerate() {
        let start = Instant::now();
        model.apply(frame.view(), &Learning::default(), &mut mask)?;
        if k >= frames.len() {
            times_ms.push(1e3 * start.elapsed().as_secs_f64());
        }
    }
    times_ms.sort_by(f64::total_cmp);
    let at = |share: f64| times_ms.get((share * times_ms.len() as f64) as usize).copied().unwrap_or(f64::NAN);
    println!("{:.4} {:.4} {:.4}", at(0.0), at(0.1), at(0.5));
    Ok(())
}
