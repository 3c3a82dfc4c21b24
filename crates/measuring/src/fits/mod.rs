//! Lines, parabolas and sines fitted to what was measured, with their parameters and errors.
//!
//! By least squares weighted with how uncertain each place is; the size of that uncertainty is what the fit itself leaves over.
//! What the ruler's own errors do to a parameter is found by fitting again with each of them turned up.

mod polynomial;
mod sine;

use crate::{MeasuringError, Moment, Result, Ruler, Track};
use serde::Serialize;
use std::str::FromStr;

/// The least number of measurements that a fit takes more than it has parameters.
const SPARE: usize = 3;

/// What is fitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Shape {
    /// Constant velocity.
    Line,
    /// Constant acceleration.
    Parabola,
    /// A swing: `c + A sin(2π (t − t₀) / T + φ)`.
    Sine,
}

impl Shape {
    /// Its name.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Line => "line",
            Self::Parabola => "parabola",
            Self::Sine => "sine",
        }
    }
}

/// An axis of the plane.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Axis {
    /// x.
    X,
    /// y.
    Y,
}

impl Axis {
    const fn index(self) -> usize {
        match self {
            Self::X => 0,
            Self::Y => 1,
        }
    }
}

/// A fit that is asked for, written `parabola`, `sine:x` or `line@0.5-1.2`: shape, axis of a sine (else the one that moves
/// more), and the span of time in seconds.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Asked {
    /// What is fitted.
    pub shape: Shape,
    /// Along which axis a sine swings.
    pub axis: Option<Axis>,
    /// From when to when, in seconds; all where it is not said.
    pub span: Option<(f64, f64)>,
}

impl FromStr for Asked {
    type Err = MeasuringError;

    fn from_str(text: &str) -> Result<Self> {
        let wrong = || {
            MeasuringError::Option(format!(
                "`{text}` is no fit; give line, parabola or sine, an axis of a sine (sine:x) and a span of seconds, for example parabola@0.2-0.9"
            ))
        };
        let (what, span) = match text.split_once('@') {
            Some((what, span)) => (what, Some(span)),
            None => (text, None),
        };
        let (shape, axis) = match what.split_once(':') {
            Some((shape, axis)) => (shape, Some(axis)),
            None => (what, None),
        };
        let shape = match shape.trim() {
            "line" => Shape::Line,
            "parabola" => Shape::Parabola,
            "sine" => Shape::Sine,
            _ => return Err(wrong()),
        };
        let axis = match (shape, axis.map(str::trim)) {
            (_, None) => None,
            (Shape::Sine, Some("x")) => Some(Axis::X),
            (Shape::Sine, Some("y")) => Some(Axis::Y),
            _ => return Err(wrong()),
        };
        let seconds = |span: &str| -> Option<(f64, f64)> {
            let (from, to) = span.split_once('-')?;
            let (from, to): (f64, f64) = (from.trim().parse().ok()?, to.trim().parse().ok()?);
            (from < to && from.is_finite() && to.is_finite()).then_some((from, to))
        };
        let span = span.map(|span| seconds(span).ok_or_else(wrong)).transpose()?;
        Ok(Self { shape, axis, span })
    }
}

/// One number that a fit found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Parameter {
    /// Its name: `ax`, `period` …
    pub name: &'static str,
    /// Its value.
    pub value: f64,
    /// Its standard deviation, the ruler's errors included.
    pub error: f64,
    /// Its unit, with the ruler's in place: `m/s^2`.
    pub unit: String,
}

/// What a fit found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Fitted {
    /// Number of the target.
    pub target: u64,
    /// What was asked for.
    pub asked: Asked,
    /// The axis of a sine.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub axis: Option<Axis>,
    /// Time of the first measurement, to which the parameters belong, in seconds.
    pub from_s: f64,
    /// Time of the last.
    pub to_s: f64,
    /// How many measurements there are.
    pub count: usize,
    /// What was found.
    pub parameters: Vec<Parameter>,
    /// Root mean square of what is left over on each axis fitted, in the ruler's unit.
    pub residual_rms: Vec<f64>,
    /// Time, and what is left over on each axis fitted.
    #[serde(skip)]
    pub residuals: Vec<(f64, Vec<f64>)>,
}

impl Fitted {
    /// The parameter called `name`.
    pub fn parameter(&self, name: &str) -> Option<&Parameter> {
        self.parameters.iter().find(|p| p.name == name)
    }
}

/// A measurement that a fit is made to: time since the first, place, and variances relative to each other.
#[derive(Debug, Clone, Copy)]
struct Sample {
    t: f64,
    at: [f64; 2],
    variance: [f64; 2],
}

/// Numbers found with their variances, and what is left over.
struct Found {
    values: Vec<f64>,
    variances: Vec<f64>,
    residuals: Vec<(f64, Vec<f64>)>,
}

/// Fits what is asked for to what was measured of a target.
///
/// # Errors
/// Fewer measurements in the span than the fit needs, or a swing of which there is less than half a period.
pub fn fit(track: &Track, moments: &[Moment], ruler: &Ruler, asked: &Asked) -> Result<Fitted> {
    let inside = |t: f64| asked.span.is_none_or(|(from, to)| (from..=to).contains(&t));
    let rows: Vec<_> = track.sightings.iter().zip(moments).filter(|(_, m)| inside(m.time_s)).collect();
    let mut samples = Vec::new();
    for (sighting, moment) in &rows {
        let (Some(pixel), Some(at)) = (sighting.at, moment.measured) else { continue };
        let Some((_, slope)) = ruler.place(pixel) else { continue };
        let error = slope * slope.transpose();
        samples.push(Sample { t: moment.time_s, at, variance: [error[(0, 0)], error[(1, 1)]] });
    }
    let needed = SPARE + if asked.shape == Shape::Line { 2 } else { 4 };
    let (Some(first), Some(last)) = (samples.first().copied(), samples.last().copied()) else {
        return Err(too_few(track.target, 0, needed));
    };
    if samples.len() < needed {
        return Err(too_few(track.target, samples.len(), needed));
    }
    samples.iter_mut().for_each(|s| s.t -= first.t);
    let axis = asked.axis.unwrap_or_else(|| livelier(&samples));
    let solve = |samples: &[Sample]| match asked.shape {
        Shape::Line => polynomial::line(samples),
        Shape::Parabola => polynomial::parabola(samples),
        Shape::Sine => sine::fit(samples, axis.index()),
    };
    let failed = || {
        MeasuringError::Track(format!(
            "target {}: no {} fits what was measured from {:.3} s to {:.3} s; give another span, SHAPE@FROM-TO",
            track.target,
            asked.shape.name(),
            first.t,
            last.t
        ))
    };
    let mut found = solve(&samples).ok_or_else(failed)?;
    for error in 0..ruler.error_count() {
        let turned = samples.iter().filter_map(|s| Some(Sample { at: ruler.place_with_error(error, s.at)?, ..*s }));
        let Some(other) = solve(&turned.collect::<Vec<_>>()) else { continue };
        for ((variance, value), other) in found.variances.iter_mut().zip(&found.values).zip(&other.values) {
            *variance += (other - value).powi(2);
        }
    }
    let unit = ruler.unit().symbol();
    let names: &[(&'static str, i32)] = match asked.shape {
        Shape::Line => polynomial::LINE,
        Shape::Parabola => polynomial::PARABOLA,
        Shape::Sine => sine::NAMES,
    };
    let parameter = |((name, power), (value, variance)): (&(&'static str, i32), (&f64, &f64))| Parameter {
        name,
        value: *value,
        error: variance.max(0.0).sqrt(),
        unit: unit_of(unit, *power),
    };
    let parameters = names.iter().zip(found.values.iter().zip(&found.variances)).map(parameter).collect();
    let axes = found.residuals.first().map_or(0, |r| r.1.len());
    let rms = |axis: usize| {
        let squares = found.residuals.iter().filter_map(|r| r.1.get(axis)).map(|r| r * r).sum::<f64>();
        (squares / samples.len() as f64).sqrt()
    };
    let residual_rms = (0..axes).map(rms).collect();
    let residuals = found.residuals.into_iter().map(|(t, r)| (t + first.t, r)).collect();
    let axis = (asked.shape == Shape::Sine).then_some(axis);
    let (from_s, to_s, count) = (first.t, last.t, samples.len());
    Ok(Fitted { target: track.target, asked: *asked, axis, from_s, to_s, count, parameters, residual_rms, residuals })
}

fn too_few(target: u64, got: usize, needed: usize) -> MeasuringError {
    MeasuringError::Track(format!(
        "target {target} was measured in {got} frames of the span, and the fit needs {needed}; give a longer span"
    ))
}

/// The axis along which there is more motion.
fn livelier(samples: &[Sample]) -> Axis {
    let spread = |axis: usize| {
        let mean = samples.iter().map(|s| s.at[axis]).sum::<f64>() / samples.len() as f64;
        samples.iter().map(|s| (s.at[axis] - mean).powi(2)).sum::<f64>()
    };
    if spread(0) >= spread(1) { Axis::X } else { Axis::Y }
}

/// A length over a power of seconds; −1 is seconds, −2 radians, −3 hertz.
fn unit_of(length: &str, power: i32) -> String {
    match power {
        0 => length.to_owned(),
        1 => format!("{length}/s"),
        2 => format!("{length}/s^2"),
        -1 => "s".to_owned(),
        -3 => "Hz".to_owned(),
        _ => "rad".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fits_are_asked_for_in_words() {
        let read = |text: &str| text.parse::<Asked>();
        assert_eq!(read("parabola").unwrap(), Asked { shape: Shape::Parabola, axis: None, span: None });
        let swing = Asked { shape: Shape::Sine, axis: Some(Axis::Y), span: Some((0.5, 2.0)) };
        assert_eq!(read("sine:y@0.5-2").unwrap(), swing);
        for wrong in ["", "cubic", "sine:z", "line:x", "line@2-1", "line@x", "line@1", "parabola@1-1e999"] {
            let message = read(wrong).unwrap_err().to_string();
            assert!(message.contains("no fit") && message.contains("parabola@"), "{wrong}: {message}");
        }
    }
}
