//! The pictures: the path of a bouncing ball, its coordinates against time, and the errors.

use super::{Boxes, Filter, READINGS, follow};
use crate::ExperimentError;
use pursuit_charts::{Axis, Chart, Color, Series};
use pursuit_geometry::{BBox, Point};
use pursuit_scenes::ball::{BallMotion, BallParams, BallTrack, ball_track};

/// All pictures of the experiment: seed 0 of each motion.
pub(super) fn charts() -> Result<Vec<(String, Chart)>, ExperimentError> {
    let mut all = Vec::new();
    for (motion, file) in
        [(BallMotion::Linear, "linear"), (BallMotion::Rolling, "rolling"), (BallMotion::Bouncing, "bouncing")]
    {
        let track = ball_track(motion, &BallParams::reference(), 0);
        let printed = follow(&track, Filter::Printed, READINGS[0].1)?;
        let own = follow(&track, Filter::Own, READINGS[0].1)?;
        let name = motion.name();
        all.push((format!("{file}_path"), path(&format!("ball, {name}: the path"), &track, &printed)));
        all.push((format!("{file}_x"), coordinate(&format!("ball, {name}: x"), "x, px", &track, &printed, |p| p.x)));
        all.push((format!("{file}_y"), coordinate(&format!("ball, {name}: y"), "y, px", &track, &printed, |p| p.y)));
        all.push((format!("{file}_error"), error(&format!("ball, {name}: error"), &track, &printed, &own)));
    }
    Ok(all)
}

fn path(title: &str, track: &BallTrack, printed: &Boxes) -> Chart {
    let of = |boxes: &[BBox]| boxes.iter().map(|b| (b.center().x, -b.center().y)).collect();
    Chart::new(title, Axis::new("x, px"), Axis::new("−y, px (up)"))
        .with_equal_units()
        .with(Series::line("true", Color::Truth, of(&track.truth)))
        .with(Series::points("detected", Color::Measured, of(&track.measured)))
        .with(Series::dashed("predicted, printed", Color::Predicted, of(&printed.predicted)))
        .with(Series::line("estimate, printed", Color::Estimate, of(&printed.filtered)))
}

fn coordinate(
    title: &str,
    label: &str,
    track: &BallTrack,
    printed: &Boxes,
    pick: impl Fn(Point) -> f64 + Copy,
) -> Chart {
    let of = |boxes: &[BBox]| track.time_s.iter().zip(boxes).map(|(t, b)| (*t, pick(b.center()))).collect();
    Chart::new(title, Axis::new("time, s"), Axis::new(label))
        .with(Series::line("true", Color::Truth, of(&track.truth)))
        .with(Series::points("detected", Color::Measured, of(&track.measured)))
        .with(Series::dashed("predicted, printed", Color::Predicted, of(&printed.predicted)))
        .with(Series::line("estimate, printed", Color::Estimate, of(&printed.filtered)))
}

fn error(title: &str, track: &BallTrack, printed: &Boxes, own: &Boxes) -> Chart {
    let of = |boxes: &[BBox]| {
        let errors = boxes.iter().zip(&track.truth).map(|(a, b)| a.center().distance(b.center()));
        track.time_s.iter().copied().zip(errors).collect()
    };
    Chart::new(title, Axis::new("time, s"), Axis::new("error of the centre, px"))
        .with(Series::points("detected", Color::Measured, of(&track.measured)))
        .with(Series::dashed("predicted, printed", Color::Predicted, of(&printed.predicted)))
        .with(Series::dashed("predicted, own mode", Color::Other, of(&own.predicted)))
        .with(Series::line("estimate, own mode", Color::Estimate, of(&own.filtered)))
}
