use super::{Assembly, CorrelationLocalizer, NearThenWide};
use crate::motion::{BoxFilter, BoxNoise, MeasurementNoise, RelativeNoise};
use crate::policy::{ConfidencePolicy, ConfidenceThresholds};
use crate::{Result, SingleTarget, TrackingError};
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;

/// The loop filled with a correlation localizer, a confidence policy and a constant-velocity filter.
pub type CorrelationTracker<A> = SingleTarget<NearThenWide, CorrelationLocalizer<A>, ConfidencePolicy, BoxFilter>;

/// How far the search reaches, as a multiple of the target's size.
const REACH: f64 = 2.5;

/// Starts a correlation tracker on the target at `bbox`. `acceleration` (sizes² per s³) says how suddenly targets move.
pub(crate) fn start<A: Assembly>(
    name: &'static str,
    assembly: A,
    acceleration: f64,
    thresholds: ConfidenceThresholds,
    frame: &Frame,
    bbox: BBox,
) -> Result<CorrelationTracker<A>> {
    let noise = RelativeNoise {
        acceleration,
        // Correlation finds the centre to a fraction of a cell: what is measured is believed nearly as it is, and the
        // filter's part is the velocity.
        measurement: MeasurementNoise { position: 0.003, size: 0.003, floor_px: 0.05 },
        ..RelativeNoise::agile()
    };
    let failed = |source| TrackingError::Computation { tracker: name, index: frame.index(), source: Box::new(source) };
    let motion = BoxFilter::new(BoxNoise::Relative(noise), bbox).map_err(failed)?;
    let localizer = CorrelationLocalizer::new(assembly, frame, &bbox);
    let policy = ConfidencePolicy::new(thresholds);
    Ok(SingleTarget::new(name, frame, NearThenWide { reach: REACH }, localizer, policy, motion))
}

/// Rebuilds what is not saved.
pub(crate) fn revive<A: Assembly>(name: &'static str, saved: CorrelationTracker<A>) -> Result<CorrelationTracker<A>> {
    let bad = |problem| TrackingError::Snapshot { tracker: name, problem };
    saved.revived(name, |_, localizer, _, _| localizer.revive().map_err(bad))
}
