//! How well a click becomes a box: `clicks SEQUENCE…` clicks on the middle of the true box, every 40th frame, and says how much what was
//! found overlaps it.

use pursuit::trackers::at_point::{AtPoint, AtPointParams, Because};
use std::sync::Arc;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("{:<28} {:>6} {:>7} {:>7} {:>10} {:>7}", "sequence", "clicks", "overlap", "moves", "stands out", "radius");
    let mut all = Vec::new();
    for input in std::env::args().skip(1) {
        let mut source = match pursuit::open(input.as_str()) {
            Ok(source) => source,
            Err(error) => {
                eprintln!("{error}");
                continue;
            }
        };
        let truth = source.info().clone();
        let mut at_point = AtPoint::new(AtPointParams::default())?;
        let mut clicks = Vec::new();
        while let Some(frame) = source.next_frame()? {
            let frame = Arc::new(frame);
            at_point.see(&frame);
            let index = frame.index();
            if let (Some(bbox), 20, true) = (truth.truth_at(index).bbox(), index % 40, index < 600)
                && let Some((found, because)) = at_point.find(bbox.center(), None)
            {
                clicks.push((found.iou(&bbox), because));
            }
        }
        let mean = |of: &[(f64, Because)]| of.iter().map(|click| click.0).sum::<f64>() / of.len().max(1) as f64;
        let part = |wanted: Because| {
            let of: Vec<_> = clicks.iter().filter(|click| click.1 == wanted).copied().collect();
            format!("{} {:.2}", of.len(), mean(&of))
        };
        let name = input.rsplit('/').next().unwrap_or_default();
        let parts = [Because::Moves, Because::StandsOut, Because::Radius].map(part);
        println!(
            "{name:<28} {:>6} {:>7.3} {:>7} {:>10} {:>7}",
            clicks.len(),
            mean(&clicks),
            parts[0],
            parts[1],
            parts[2]
        );
        all.extend(clicks);
    }
    let overlaps = all.iter().map(|click| click.0);
    let good = overlaps.clone().filter(|overlap| *overlap >= 0.5).count();
    println!(
        "{} clicks, mean overlap {:.3}, {good} of .5 or more",
        all.len(),
        overlaps.sum::<f64>() / all.len().max(1) as f64
    );
    for because in [Because::Moves, Because::StandsOut, Because::Radius] {
        let of: Vec<f64> = all.iter().filter(|click| click.1 == because).map(|click| click.0).collect();
        let good = of.iter().filter(|overlap| **overlap >= 0.5).count();
        println!(
            "{}: {} clicks, mean {:.3}, {good} of .5 or more",
            because.as_str(),
            of.len(),
            of.iter().sum::<f64>() / of.len().max(1) as f64
        );
    }
    Ok(())
}
