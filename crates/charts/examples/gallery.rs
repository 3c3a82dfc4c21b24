//! Writes a picture of every kind of chart into a folder: to look at after a change.

use pursuit_charts::{Axis, Chart, Color, Series};
use std::path::Path;

fn main() -> std::io::Result<()> {
    let folder = std::env::args().nth(1).unwrap_or_else(|| "gallery".to_owned());
    std::fs::create_dir_all(&folder)?;
    for (name, chart) in [("time", over_time()), ("plane", plane()), ("speed", speed()), ("many", many())] {
        chart.write(&Path::new(&folder).join(format!("{name}.svg")))?;
    }
    Ok(())
}

fn wave(step: f64, phase: f64) -> Vec<(f64, f64)> {
    let at = |i: i32| (f64::from(i) * step, 240.0 + 160.0 * (f64::from(i) * step * 1.7 + phase).sin());
    (0..300).map(at).collect()
}

fn over_time() -> Chart {
    let mut measured = wave(0.033, 0.05);
    measured.iter_mut().enumerate().for_each(|(i, p)| p.1 += f64::from((i as i32 * 37) % 23 - 11));
    measured.iter_mut().skip(120).take(40).for_each(|p| p.1 = f64::NAN);
    Chart::new("Centre, horizontal", Axis::new("time (s)"), Axis::new("x (px)"))
        .with_band(4.0, 5.3, "target away")
        .with(Series::points("measured", Color::Measured, measured))
        .with(Series::dashed("predicted", Color::Predicted, wave(0.033, 0.12)))
        .with(Series::line("estimate", Color::Estimate, wave(0.033, 0.0)))
        .with(Series::line("truth", Color::Truth, wave(0.033, -0.03)))
}

fn plane() -> Chart {
    let circle =
        (0..=100).map(|i| (f64::from(i) / 16.0).sin_cos()).map(|(s, c)| (320.0 + 200.0 * c, 240.0 + 200.0 * s));
    Chart::new("A path in the plane, a unit as long across as upward", Axis::new("x (px)"), Axis::new("y (px)"))
        .with_equal_units()
        .with(Series::line("true", Color::Truth, circle.collect()))
        .with(Series::points("lone", Color::Other, vec![(320.0, 240.0)]))
}

fn speed() -> Chart {
    let empty = Chart::new(
        "Speed and accuracy",
        Axis::new("updates a second").logarithmic(),
        Axis::new("success AUC").over(0.0, 1.0),
    );
    let trackers = [("kcf", 620.0, 0.46), ("mosse", 2900.0, 0.31), ("staple", 140.0, 0.53), ("pursuit", 120.0, 0.55)];
    let more = [("bacf", 60.0, 0.54), ("strcf", 55.0, 0.55), ("dsst", 150.0, 0.47), ("fdsst", 210.0, 0.47)];
    let named =
        |(i, (name, fps, auc)): (usize, (&str, f64, f64))| Series::named(name, Color::Number(i), vec![(fps, auc)]);
    trackers.into_iter().chain(more).enumerate().map(named).fold(empty, Chart::with)
}

fn many() -> Chart {
    let empty = Chart::new(
        "Ten of a kind, and a diagonal",
        Axis::new("score").over(0.0, 1.0),
        Axis::new("frames").over(0.0, 1.0),
    );
    let curve = |k: usize| (0..=20).map(|i| f64::from(i) / 20.0).map(|x| (x, x.powf(0.4 + 0.2 * k as f64))).collect();
    let all = (0..10).map(|k| Series::line(format!("tracker number {k}"), Color::Number(k), curve(k)));
    all.fold(empty.with_diagonal(), Chart::with)
}
