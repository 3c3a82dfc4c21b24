//! What `measure.json` holds: how it was measured, by what ruler, what came out of it, and what should be looked at.

use super::{MeasureOptions, Measurement, RecordedRun};
use pursuit_measuring::events::{Event, Stay};
use pursuit_measuring::fits::Fitted;
use pursuit_measuring::{Calibration, How, Measured, RulerFacts};
use serde::Serialize;
use std::path::PathBuf;

/// What `measure.json` holds.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Facts {
    /// What measured it, and its version.
    pub measured_by: String,
    /// The trajectory that was measured.
    pub trajectory: PathBuf,
    /// The calibration's file, where it is from one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub calibration_file: Option<PathBuf>,
    /// The calibration.
    pub calibration: Calibration,
    /// The ruler that it made.
    pub ruler: Option<RulerFacts>,
    /// How.
    pub options: MeasureOptions,
    /// The targets.
    pub targets: Vec<TargetFacts>,
    /// What happened, in order of time.
    pub events: Vec<Event>,
    /// The time of each target in each zone.
    pub stays: Vec<Stay>,
    /// What was fitted.
    pub fits: Vec<Fitted>,
    /// What should be looked at before the numbers are believed.
    pub warnings: Vec<String>,
}

/// What is known of a target as a whole.
#[derive(Debug, Clone, Serialize)]
pub struct TargetFacts {
    /// Its number.
    pub target: u64,
    /// Frames in which it was measured.
    pub measured: usize,
    /// Frames in between in which it was not, and that are bridged.
    pub bridged: usize,
    /// Frames before and after, of which nothing is said.
    pub outside: usize,
    /// The first moment at which it was measured, seconds.
    pub from_s: f64,
    /// The last.
    pub to_s: f64,
    /// Standard deviation of a measurement across and down, in pixels, as the track itself says.
    pub noise_px: f64,
    /// 3 where the smoother's model is a constant acceleration, 4 where it is a constant jerk.
    pub model_order: usize,
    /// How alike the errors of one frame and the next are; standard deviations suppose that they are not.
    pub correlation: f64,
    /// How long its path is, and the standard deviation of that.
    pub path: [f64; 2],
    /// Its highest speed, and the standard deviation of that.
    pub top_speed: [f64; 2],
}

impl Facts {
    pub(super) fn of(
        run: &RecordedRun,
        calibration_file: Option<PathBuf>,
        calibration: &Calibration,
        options: &MeasureOptions,
        found: &Measurement,
    ) -> Self {
        let ruler = found.ruler.facts();
        let mut warnings = ruler.warnings.clone();
        warnings.extend(found.targets.iter().flat_map(|t| t.warnings.iter().cloned()));
        warnings.extend(found.facts.warnings.iter().cloned());
        Self {
            measured_by: format!("pursuit measure {}", env!("CARGO_PKG_VERSION")),
            trajectory: run.trajectory.clone(),
            calibration_file,
            calibration: calibration.clone(),
            ruler: Some(ruler.clone()),
            options: options.clone(),
            targets: found.targets.iter().map(TargetFacts::of).collect(),
            events: found.events.clone(),
            stays: found.stays.clone(),
            fits: found.fits.clone(),
            warnings,
        }
    }
}

impl TargetFacts {
    fn of(target: &Measured) -> Self {
        let count = |how: How| target.moments.iter().filter(|m| m.how == how).count();
        let seen = || target.moments.iter().filter(|m| m.how == How::Measured);
        let pair = |p: Option<(f64, f64)>| p.map_or([f64::NAN; 2], |(value, error)| [value, error]);
        let speeds = target.moments.iter().filter_map(|m| m.state.as_ref()).map(pursuit_measuring::State::speed);
        Self {
            target: target.target,
            measured: count(How::Measured),
            bridged: count(How::Bridged),
            outside: count(How::Outside),
            from_s: seen().next().map_or(f64::NAN, |m| m.time_s),
            to_s: seen().next_back().map_or(f64::NAN, |m| m.time_s),
            noise_px: target.noise_px,
            model_order: target.order,
            correlation: target.correlation,
            path: pair(target.moments.iter().rev().find_map(|m| m.path)),
            top_speed: pair(speeds.max_by(|a, b| a.0.total_cmp(&b.0))),
        }
    }
}
