//! Writes sequences with truth, as `pursuit eval` reads them: a folder each, with pictures and a list of frames and true boxes.

use pursuit::media::Source;
use pursuit::media::output::encode_jpeg;
use pursuit::open;
use std::fmt::Write as _;
use std::path::Path;

/// Runs it.
pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    for scene in ["drift", "scale-ramp", "occluding-bar", "lighting-step", "look-alike", "leave-and-return"] {
        let mut source = open(format!("scene:{scene}?seed=11&duration=5"))?;
        write(&mut *source, &Path::new("data").join(scene))?;
    }
    println!("data/: six sequences; now: pursuit eval data --trackers kcf,mosse --out results");
    Ok(())
}

/// A sequence of the project's own layout: `frames.csv` with a line per frame, `nan` where the target is away.
fn write(source: &mut dyn Source, folder: &Path) -> Result<(), Box<dyn std::error::Error>> {
    std::fs::create_dir_all(folder)?;
    let truth = source.info().clone();
    let mut list = String::from("index,image,x,y,w,h\n");
    while let Some(frame) = source.next_frame()? {
        let (k, image) = (frame.index(), format!("{:06}.jpg", frame.index()));
        std::fs::write(folder.join(&image), encode_jpeg(frame.color(), 95)?)?;
        match truth.truth_at(k).bbox() {
            Some(b) => writeln!(list, "{k},{image},{},{},{},{}", b.left(), b.top(), b.width(), b.height())?,
            None => writeln!(list, "{k},{image},nan,nan,nan,nan")?,
        }
    }
    std::fs::write(folder.join("frames.csv"), list)?;
    Ok(())
}
