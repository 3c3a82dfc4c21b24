//! Tracks from the boxes of your own detector: two people cross, detections flicker, ids stay. No picture is needed.

use crate::noise::normal;
use pursuit::BBox;
use pursuit::charts::{Axis, Chart, Color, Series};
use pursuit::tracking::Detection;
use pursuit::tracking::many::{Associating, ManyParams};
use std::collections::BTreeMap;
use std::path::Path;

/// Runs it.
pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut targets = Associating::fed(ManyParams::default())?;
    let mut paths: BTreeMap<u64, Vec<(f64, f64)>> = BTreeMap::new();
    let mut detected = Vec::new();
    for k in 0..100 {
        let detections = detections(k);
        detected.extend(detections.iter().map(|d| (d.bbox.center().x, d.bbox.center().y)));
        for track in targets.update(k as f64 / 25.0, None, &detections)? {
            if let Some(e) = &track.estimate {
                paths.entry(track.id.0).or_default().push((e.bbox.center().x, e.bbox.center().y));
            }
        }
    }
    println!("{} targets of two, {} detections of {}", paths.len(), detected.len(), 2 * 100);

    let axis = |name: &str| Axis::new(format!("{name} (px)"));
    let chart = Chart::new("Two that cross, from detections that flicker", axis("x"), axis("y")).with(Series::points(
        "detections",
        Color::Measured,
        detected,
    ));
    let line =
        |(id, path): (u64, Vec<(f64, f64)>)| Series::line(format!("target {id}"), Color::Number(id as usize), path);
    paths.into_iter().map(line).fold(chart, Chart::with).write(Path::new("associate.svg"))?;
    Ok(())
}

/// What a detector says of frame `k`: two boxes, each missed in one frame of eight and a few pixels off.
fn detections(k: u64) -> Vec<Detection> {
    let t = k as f64;
    let true_centers = [(40.0 + 4.0 * t, 60.0 + 1.6 * t), (440.0 - 4.0 * t, 60.0 + 1.6 * t)];
    let each = true_centers.into_iter().zip(0_u64..).filter(|(_, which)| (k + 3 * which) % 8 != 5);
    let off = |which: u64, axis: u64| 2.0 * normal(4 * k + 2 * which + axis);
    each.map(|((x, y), which)| {
        let bbox = BBox::from_ltwh(x - 15.0 + off(which, 0), y - 35.0 + off(which, 1), 30.0, 70.0);
        Detection::new(bbox, 0.9)
    })
    .collect()
}
