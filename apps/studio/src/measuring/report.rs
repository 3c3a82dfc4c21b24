//! What was measured, as the page draws it.

use pursuit::measure::Measurement;
use pursuit::measuring::fits::Fitted;
use pursuit::measuring::{Measured, Moment, Ruler, State};
use serde_json::{Value, json};

/// More moments of one target are thinned evenly: no screen shows them.
const MOST_MOMENTS: usize = 5_000;
/// Events that one answer holds at most.
const MOST_EVENTS: usize = 500;
/// How far ahead the direction of a velocity is taken, seconds.
const AHEAD_S: f64 = 1e-4;

/// Everything of one version of a trajectory.
pub(super) fn results(version: u32, found: &Measurement) -> Value {
    let targets: Vec<Value> = found.targets.iter().map(|target| of_target(target, &found.ruler)).collect();
    let facts = &found.facts;
    json!({
        "version": version,
        "problem": null,
        "unit": found.ruler.unit().symbol(),
        "ruler": facts.ruler,
        "targets": targets,
        "facts": facts.targets,
        "events": facts.events.iter().take(MOST_EVENTS).collect::<Vec<_>>(),
        "stays": facts.stays.iter().take(MOST_EVENTS).collect::<Vec<_>>(),
        "fits": found.fits.iter().map(of_fit).collect::<Vec<_>>(),
        "warnings": facts.warnings,
    })
}

fn of_fit(fit: &Fitted) -> Value {
    let every = fit.residuals.len().div_ceil(MOST_MOMENTS).max(1);
    let mut told = json!(fit);
    told["residuals"] = json!(fit.residuals.iter().step_by(every).collect::<Vec<_>>());
    told
}

/// Columns over the moments of a target: values and standard deviations, and where they are in the picture.
fn of_target(target: &Measured, ruler: &Ruler) -> Value {
    let every = target.moments.len().div_ceil(MOST_MOMENTS).max(1);
    let moments: Vec<&Moment> = target.moments.iter().step_by(every).collect();
    let column = |of: &dyn Fn(&Moment) -> Option<f64>| -> Vec<Option<f64>> { moments.iter().map(|m| of(m)).collect() };
    let pair = |of: &dyn Fn(&State) -> Option<(f64, f64)>| {
        let both = moments.iter().map(|m| m.state.as_ref().and_then(of));
        let (values, errors): (Vec<_>, Vec<_>) = both.map(Option::unzip).unzip();
        json!([values, errors])
    };
    let component = |i: usize| pair(&move |s: &State| Some((s.mean()[i], s.deviation(i))));
    let seen: Vec<Option<[f64; 6]>> = moments.iter().map(|m| m.state.as_ref().and_then(|s| shown(s, ruler))).collect();
    json!({
        "target": target.target,
        "every": every,
        "frame": moments.iter().map(|m| m.frame).collect::<Vec<_>>(),
        "time_s": column(&|m| Some(m.time_s)),
        "how": moments.iter().map(|m| m.how.as_str()).collect::<Vec<_>>(),
        "measured_x": column(&|m| m.measured.map(|p| p[0])),
        "measured_y": column(&|m| m.measured.map(|p| p[1])),
        "x": component(0), "y": component(1), "vx": component(2), "vy": component(3), "ax": component(4), "ay": component(5),
        "speed": pair(&|s| Some(s.speed())),
        "acceleration": pair(&|s| Some(s.acceleration_magnitude())),
        "heading": pair(&State::heading_deg),
        "path": json!([column(&|m| m.path.map(|p| p.0)), column(&|m| m.path.map(|p| p.1))]),
        // Where it is, and how velocity and acceleration are seen there: pixels, pixels a second, pixels a square second.
        "seen": seen,
    })
}

fn shown(state: &State, ruler: &Ruler) -> Option<[f64; 6]> {
    let at = state.position();
    let [x, y] = ruler.pixel(at)?;
    let toward = |[a, b]: [f64; 2]| {
        let [u, v] = ruler.pixel([at[0] + a * AHEAD_S, at[1] + b * AHEAD_S])?;
        Some([(u - x) / AHEAD_S, (v - y) / AHEAD_S])
    };
    let ([u, v], [a, b]) = (toward(state.velocity())?, toward(state.acceleration())?);
    Some([x, y, u, v, a, b])
}
