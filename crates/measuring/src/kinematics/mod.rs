//! Position, velocity and acceleration of a target, each with its covariance, by one of three ways.

mod breaks;
mod likelihood;
mod path;
mod polynomial;
mod smoother;
mod state;

pub use state::State;

use crate::{MeasuringError, Result, Ruler};
use nalgebra::{Matrix2, Vector2};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// What is known of a target in one frame of the run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sighting {
    /// Number of the frame.
    pub frame: u64,
    /// Time of the frame in seconds.
    pub time_s: f64,
    /// The pixel at which it was measured, where it was.
    pub at: Option<[f64; 2]>,
    /// Width and height of its box in pixels, where it was measured.
    pub size: Option<[f64; 2]>,
}

/// A target through a run, frame by frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Track {
    /// Number of the target.
    pub target: u64,
    /// In order of time, each frame once.
    pub sightings: Vec<Sighting>,
}

/// How velocity and acceleration are made of places.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// The two-pass smoother (Rauch, Tung, Striebel 1965) of a constant acceleration or a constant jerk, disturbed by white noise
    /// in its derivative; which of both, and how large the noises are, is found from the track by its likelihood.
    #[default]
    Smoother,
    /// Cubics fitted to a window of frames (Savitzky and Golay 1964), with its own times where frames are missing.
    SavitzkyGolay,
    /// Differences of what was measured, as they are.
    Differences,
}

impl Method {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Smoother, Self::SavitzkyGolay, Self::Differences];

    /// Its name.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Smoother => "smoother",
            Self::SavitzkyGolay => "savitzky-golay",
            Self::Differences => "differences",
        }
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Method {
    type Err = MeasuringError;

    fn from_str(text: &str) -> Result<Self> {
        let names = || Self::ALL.map(Self::name).join(", ");
        let unknown = || MeasuringError::Option(format!("there is no method `{text}`; use one of {}", names()));
        Self::ALL.into_iter().find(|m| m.name() == text).ok_or_else(unknown)
    }
}

/// How to measure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// The way.
    pub method: Method,
    /// How many frames a cubic of [`Method::SavitzkyGolay`] is fitted to: odd, 5 to 1001.
    pub window: usize,
    /// Whether places where the velocity jumps (a bounce, a blow) are looked for, and the smoother begins anew there.
    pub bounces: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self { method: Method::Smoother, window: 11, bounces: true }
    }
}

impl Options {
    fn check(&self) -> Result<()> {
        if self.window % 2 == 1 && (5..=1001).contains(&self.window) {
            return Ok(());
        }
        Err(MeasuringError::Option(format!(
            "the window is {} frames; give an odd number of 5 to 1001, for example 11",
            self.window
        )))
    }
}

/// Where a row comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum How {
    /// The target was measured in this frame.
    Measured,
    /// It was not, but before and after: what is said is bridged from both sides.
    Bridged,
    /// Before it was measured first or after it was measured last: nothing is said.
    Outside,
}

impl How {
    /// The word of it.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Measured => "measured",
            Self::Bridged => "bridged",
            Self::Outside => "outside",
        }
    }
}

/// What is found of a target in one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Moment {
    /// Number of the frame.
    pub frame: u64,
    /// Time in seconds.
    pub time_s: f64,
    /// Whether it was measured here.
    pub how: How,
    /// Where it was measured, in the ruler's unit.
    pub measured: Option<[f64; 2]>,
    /// Position, velocity and acceleration; none outside of what was measured.
    pub state: Option<State>,
    /// How far it has come since it was measured first, and the standard deviation of that.
    pub path: Option<(f64, f64)>,
}

/// A jump of the velocity: a bounce, a blow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jump {
    /// The first moment after it in which the target was measured.
    pub index: usize,
    /// When it was, in seconds: where the paths before and after meet.
    pub time_s: f64,
    /// The standard deviation of that.
    pub error_s: f64,
}

/// What is found of a target.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    /// Number of the target.
    pub target: u64,
    /// Frame by frame.
    pub moments: Vec<Moment>,
    /// Standard deviation of a measurement across and down, in pixels, as the track itself says.
    pub noise_px: f64,
    /// How many derivatives the smoother's model has, as the track itself says: 3 a constant acceleration, 4 a constant jerk.
    pub order: usize,
    /// Intensity of the white noise that disturbs the highest of them, in the ruler's unit²/s^(2 order − 1), as the track itself
    /// says.
    pub density: f64,
    /// How alike the errors of one frame and the next are, −1 to 1: 0 where they are independent, as the standard deviations
    /// suppose.
    pub correlation: f64,
    /// Where the velocity jumped.
    pub jumps: Vec<Jump>,
    /// Frames whose measurement has no place: above the horizon of the plane, or off the lens.
    pub unplaced: usize,
    /// What should be looked at.
    pub warnings: Vec<String>,
}

/// A measurement as a place, and what is needed of it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Place {
    /// Which sighting.
    pub index: usize,
    /// Seconds.
    pub time_s: f64,
    /// In the ruler's unit.
    pub at: Vector2<f64>,
    /// How the place changes with the pixel.
    pub slope: Matrix2<f64>,
}

/// The least number of places of which anything is said.
pub const LEAST_PLACES: usize = 6;

/// Measures a target.
///
/// # Errors
/// Options out of range, times that do not rise, or fewer than [`LEAST_PLACES`] measurements.
pub fn measure(track: &Track, ruler: &Ruler, options: &Options) -> Result<Measured> {
    options.check()?;
    let (places, unplaced) = places(track, ruler)?;
    let found = smoother::run(track, &places, ruler, options)?;
    let mut warnings = found.warnings;
    if unplaced > 0 {
        warnings.push(format!(
            "target {}: {unplaced} measurements lie above the plane's horizon or off the lens, and were left out",
            track.target
        ));
    }
    let mut states = match options.method {
        Method::Smoother => found.states,
        Method::SavitzkyGolay => polynomial::savitzky_golay(track, &places, options.window, found.noise),
        Method::Differences => polynomial::differences(track, &places, found.noise),
    };
    let paths = match options.method {
        Method::Smoother => found.paths,
        Method::SavitzkyGolay | Method::Differences => path::lengths(&states, ruler),
    };
    for state in states.iter_mut().flatten() {
        state.add(&ruler.changes(state.mean()));
    }
    let mut at = vec![None; track.sightings.len()];
    for place in &places {
        if let Some(slot) = at.get_mut(place.index) {
            *slot = Some([place.at.x, place.at.y]);
        }
    }
    let span = places.first().map_or(0, |p| p.index)..=places.last().map_or(0, |p| p.index);
    let rows = track.sightings.iter().zip(states).zip(at).zip(paths).enumerate();
    let moments = rows.map(|(i, (((sighting, state), measured), path))| {
        let how = match (measured, span.contains(&i)) {
            (Some(_), _) => How::Measured,
            (None, true) => How::Bridged,
            (None, false) => How::Outside,
        };
        Moment { frame: sighting.frame, time_s: sighting.time_s, how, measured, state, path }
    });
    Ok(Measured {
        target: track.target,
        moments: moments.collect(),
        noise_px: found.noise.sqrt(),
        order: found.order,
        density: found.density,
        correlation: found.correlation,
        jumps: found.jumps,
        unplaced,
        warnings,
    })
}

/// The measurements as places, and how many have none.
fn places(track: &Track, ruler: &Ruler) -> Result<(Vec<Place>, usize)> {
    let wrong = |what: String| Err(MeasuringError::Track(format!("target {}: {what}", track.target)));
    let mut last = f64::NEG_INFINITY;
    for sighting in &track.sightings {
        if !(sighting.time_s.is_finite() && sighting.time_s > last) {
            return wrong(format!(
                "the time of frame {} is {} s after {last} s; times must rise, give the frame rate: --true-fps F",
                sighting.frame, sighting.time_s
            ));
        }
        last = sighting.time_s;
    }
    let (mut places, mut unplaced) = (Vec::new(), 0);
    for (index, sighting) in track.sightings.iter().enumerate() {
        let Some(at) = sighting.at else { continue };
        match ruler.place(at) {
            Some((place, slope)) => places.push(Place { index, time_s: sighting.time_s, at: place.into(), slope }),
            None => unplaced += 1,
        }
    }
    if places.len() < LEAST_PLACES {
        return wrong(format!(
            "it was measured in {} frames that have a place; {LEAST_PLACES} are the least that say anything of velocity and acceleration",
            places.len()
        ));
    }
    Ok((places, unplaced))
}
