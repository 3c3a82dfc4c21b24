use super::{Judgement, PursuitLocalizer, PursuitParams, PursuitSettings};
use crate::correlation::NearThenWide;
use crate::motion::{BoxFilter, BoxNoise, MeasurementNoise, RelativeNoise};
use crate::parameters::Parameters;
use crate::policy::{ConfidencePolicy, ConfidenceThresholds};
use crate::regularised::SolverSettings;
use crate::scale::ScaleSettings;
use crate::{Result, SingleTarget, TrackerRecipe, TrackingError};
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;

/// The default tracker.
pub type PursuitTracker = SingleTarget<NearThenWide, PursuitLocalizer, ConfidencePolicy, BoxFilter>;

impl PursuitParams {
    fn settings(&self, color: bool) -> PursuitSettings {
        PursuitSettings {
            color,
            search: self.search,
            cells: self.cells,
            cell_px: self.cell_px,
            label_sigma: self.label_sigma,
            learning_rate: self.learning_rate,
            solver: SolverSettings {
                temporal_weight: 0.0,
                spatial_weight: 0.0,
                penalty: self.penalty,
                penalty_growth: self.penalty_growth,
                iterations: self.iterations,
            },
            scale: ScaleSettings {
                learning_rate: self.scale_learning_rate,
                area_px: self.scale_area_px,
                ..ScaleSettings::danelljan2017()
            },
            size_trust_px: (self.size_kept_px, self.size_followed_px),
            candidates: self.candidates,
            runner_up: self.runner_up,
            color_inner_margin: self.color_inner_margin,
            color_learning_rate: self.color_learning_rate,
            wide_windows: self.wide_windows,
            side_windows: self.side_windows,
            sure_from: self.seen_from,
            lead: self.lead,
            judgement: Judgement {
                bias: self.score_bias,
                peak: self.score_peak,
                likeness: self.score_likeness,
                color: self.score_color,
            },
        }
    }
}

impl TrackerRecipe for PursuitParams {
    type Tracker = PursuitTracker;

    const SUMMARY: &'static str = "the default: accurate and quick, says when the target is hidden, finds it again";
    const PAPER: &'static str = "pursuit";

    fn start(&self, frame: &Frame, bbox: BBox) -> Result<PursuitTracker> {
        let noise = RelativeNoise {
            acceleration: self.acceleration,
            // The filter measures to a fraction of a cell: its word is taken as it is, the motion filter adds the velocity.
            measurement: MeasurementNoise { position: 0.003, size: 0.003, floor_px: 0.05 },
            ..RelativeNoise::agile()
        };
        let failed = |e| TrackingError::Computation { tracker: Self::OWNER, index: frame.index(), source: Box::new(e) };
        let motion = BoxFilter::new(BoxNoise::Relative(noise), bbox).map_err(failed)?;
        let localizer = PursuitLocalizer::new(self.settings(frame.has_color()), frame, &bbox);
        let policy = ConfidencePolicy::new(ConfidenceThresholds {
            occluded_below: self.occluded_below,
            seen_from: self.seen_from,
            found_from: self.found_from,
            learn_from: self.learn_from,
            lost_below: self.lost_below,
            lost_after_s: self.lost_after_s,
            occluded_score: 1.0,
        });
        let proposer = NearThenWide { reach: self.search };
        Ok(SingleTarget::new(Self::OWNER, frame, proposer, localizer, policy, motion))
    }

    fn revive(&self, saved: PursuitTracker) -> Result<PursuitTracker> {
        let bad = |problem| TrackingError::Snapshot { tracker: Self::OWNER, problem };
        saved.revived(Self::OWNER, |_, localizer, _, _| localizer.revive().map_err(bad))
    }
}
