//! Plots of what was measured, with bands of two standard deviations.

use super::Measurement;
use pursuit_charts::{Axis, Chart, Color, Series};
use pursuit_measuring::fits::{Axis as FitAxis, Fitted};
use pursuit_measuring::{How, Measured, State};

/// More points than this help nobody: longer tracks are thinned evenly.
const MOST_POINTS: usize = 4_000;

/// The charts by the names of their files, without ending.
pub(super) fn charts(found: &Measurement) -> Vec<(String, Chart)> {
    let unit = found.ruler.unit().symbol();
    let many = found.targets.len() > 1;
    let mut charts = Vec::new();
    for target in &found.targets {
        let suffix = if many { format!("-{}", target.target) } else { String::new() };
        let mut add = |name: &str, chart: Chart| charts.push((format!("measure-{name}{suffix}"), chart));
        let curve = |of: &dyn Fn(&State) -> (f64, f64)| curve(target, of);
        let component = |i: usize| curve(&move |s: &State| (s.mean()[i], s.deviation(i)));
        let chart = |title: &str, label: String| Chart::new(title, Axis::new("time (s)"), Axis::new(label));
        let axes = [("x", Color::Number(0)), ("y", Color::Number(1))];
        for (name, title, first, per) in [
            ("position", "Position", 0, ""),
            ("velocity", "Velocity", 2, "/s"),
            ("acceleration", "Acceleration", 4, "/s²"),
        ] {
            let mut drawn = bridged(target, chart(title, format!("{name} ({unit}{per})")));
            for (i, (axis, color)) in axes.into_iter().enumerate() {
                drawn = with_band(drawn, axis, color, component(first + i));
            }
            add(name, drawn);
        }
        let speed = bridged(target, chart("Speed", format!("speed ({unit}/s)")));
        add("speed", with_band(speed, "speed", Color::Estimate, curve(&State::speed)));
        add("path", path(target, unit));
    }
    for (i, fit) in found.fits.iter().enumerate() {
        charts.push((format!("measure-fit-{}", i + 1), residuals(fit, unit)));
    }
    charts
}

/// Time, value and standard deviation; what is not known interrupts.
type Curve = Vec<(f64, f64, f64)>;

fn curve(target: &Measured, of: &dyn Fn(&State) -> (f64, f64)) -> Curve {
    let every = target.moments.len().div_ceil(MOST_POINTS).max(1);
    let one = |moment: &pursuit_measuring::Moment| {
        let (value, error) = moment.state.as_ref().map_or((f64::NAN, f64::NAN), of);
        (moment.time_s, value, error)
    };
    target.moments.iter().step_by(every).map(one).collect()
}

fn with_band(chart: Chart, name: &str, color: Color, curve: Curve) -> Chart {
    let band: Vec<(f64, f64, f64)> = curve.iter().map(|(t, v, e)| (*t, v - 2.0 * e, v + 2.0 * e)).collect();
    let line = curve.into_iter().map(|(t, v, _)| (t, v)).collect();
    chart.with(Series::area(format!("{name} ± 2 σ"), color, &band)).with(Series::line(name, color, line))
}

/// The chart with the stretches shaded in which nothing was measured.
fn bridged(target: &Measured, chart: Chart) -> Chart {
    let stretches = target.moments.chunk_by(|a, b| a.how == b.how).filter(|s| s[0].how == How::Bridged);
    stretches.fold(chart, |chart, stretch| match stretch {
        [first, .., last] => chart.with_band(first.time_s, last.time_s, "bridged"),
        [only] => chart.with_band(only.time_s, only.time_s, "bridged"),
        [] => chart,
    })
}

fn path(target: &Measured, unit: &str) -> Chart {
    let every = target.moments.len().div_ceil(MOST_POINTS).max(1);
    let moments = || target.moments.iter().step_by(every);
    let measured = moments().filter_map(|m| m.measured.map(|[x, y]| (x, y))).collect();
    let smooth =
        moments().map(|m| m.state.as_ref().map_or((f64::NAN, f64::NAN), |s| (s.position()[0], s.position()[1])));
    Chart::new("Path", Axis::new(format!("x ({unit})")), Axis::new(format!("y ({unit})")))
        .with_equal_units()
        .with(Series::points("measured", Color::Measured, measured))
        .with(Series::line("estimate", Color::Estimate, smooth.collect()))
}

/// What a fit leaves over.
fn residuals(fit: &Fitted, unit: &str) -> Chart {
    let names = match fit.axis {
        Some(FitAxis::X) => &["x"][..],
        Some(FitAxis::Y) => &["y"],
        None => &["x", "y"],
    };
    let every = fit.residuals.len().div_ceil(MOST_POINTS).max(1);
    let axis = |i: usize| fit.residuals.iter().step_by(every).filter_map(|(t, r)| Some((*t, *r.get(i)?))).collect();
    let title = format!("What the fit leaves over, target {}", fit.target);
    let chart = Chart::new(title, Axis::new("time (s)"), Axis::new(format!("residual ({unit})")));
    names
        .iter()
        .enumerate()
        .fold(chart, |chart, (i, name)| chart.with(Series::points(*name, Color::Number(i), axis(i))))
}
