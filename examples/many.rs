//! Everything that moves before a camera that stands still, each with an id, and files of what became of it.

use pursuit::media::OpenOptions;
use pursuit::{Run, RunConfig};

/// Runs it.
pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    let config = RunConfig {
        input: Some("scene:person?seed=2&width=240&height=180&fps=15".into()),
        detect: Some("motion".into()),
        many: Some(true),
        video: Some(false),
        out: Some("people".into()),
        ..RunConfig::default()
    };
    let mut seen = std::collections::BTreeSet::new();
    let finished = Run::prepare(config, &OpenOptions::default())?.run(|progress| {
        for record in progress.records {
            if seen.insert(record.target) {
                println!("frame {}: target {} appears", progress.frames, record.target);
            }
        }
    })?;
    println!("{} frames; people/trajectory.csv has a line per frame and target", finished.outcome.frames);
    Ok(())
}
