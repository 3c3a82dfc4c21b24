//! A tracker in one file, made of public parts: matches a patch of grey by the mean absolute difference.

use pursuit_geometry::{BBox, Point};
use pursuit_imaging::Frame;
use pursuit_tracking::motion::{BoxFilter, BoxNoise, RelativeNoise};
use pursuit_tracking::parameters::Parameters;
use pursuit_tracking::{
    Diagnostics, Evidence, Localizer, Measurement, Policy, Prior, Proposer, Result, Search, SingleTarget, TrackState,
    TrackerRecipe, TrackingError, Verdict,
};
use serde::{Deserialize, Serialize};

pursuit_tracking::parameters! {
    /// Parameters of the toy tracker.
    pub struct ToyParams for "toy" {
        /// Half width of the square searched, in pixels, in [1, 50].
        pub reach_px: u32 = 8,
        /// Mean absolute difference, in grey levels, at which a match is worth nothing, > 0.
        pub worst_difference: f64 = 24.0,
    }
    validate(self) {
        if !(1..=50).contains(&self.reach_px) {
            return Err(Self::reject("reach_px", "must be between 1 and 50"));
        }
        if self.worst_difference.is_nan() || self.worst_difference <= 0.0 {
            return Err(Self::reject("worst_difference", "must be positive"));
        }
    }
}

/// Grey values on a grid over the box the tracker was started on.
const GRID: usize = 12;

#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Patch {
    reach_px: u32,
    worst_difference: f64,
    values: Vec<u8>,
}

impl Patch {
    fn sample(frame: &Frame, bbox: &BBox) -> impl Iterator<Item = u8> {
        let gray = frame.gray();
        let at = |origin: f64, side: f64, k: usize| (origin + side * (k as f64 + 0.5) / GRID as f64).floor() as isize;
        let b = *bbox;
        (0..GRID * GRID)
            .map(move |i| gray.clamped(at(b.left(), b.width(), i % GRID), at(b.top(), b.height(), i / GRID)))
    }
}

impl Localizer for Patch {
    fn locate(&mut self, frame: &Frame, search: &Search) -> Result<Option<Measurement>> {
        let reach = self.reach_px as i32;
        let offsets = (-reach..=reach).flat_map(|dy| (-reach..=reach).map(move |dx| (dx, dy)));
        let difference = |(dx, dy): (i32, i32)| {
            let bbox = search.expected.translated(f64::from(dx), f64::from(dy));
            let sum: u32 = Self::sample(frame, &bbox).zip(&self.values).map(|(a, b)| u32::from(a.abs_diff(*b))).sum();
            (sum, dx * dx + dy * dy, (dx, dy))
        };
        let Some((sum, _, (dx, dy))) = offsets.map(difference).min() else { return Ok(None) };
        let difference = f64::from(sum) / (GRID * GRID) as f64;
        Ok(Some(Measurement {
            bbox: search.expected.translated(f64::from(dx), f64::from(dy)),
            confidence: (1.0 - difference / self.worst_difference).clamp(0.0, 1.0),
            sigma_px: Some(0.3),
            diagnostics: Diagnostics::default().with("difference", difference),
        }))
    }

    fn adapt(&mut self, _: &Frame, _: BBox) -> Result<()> {
        Ok(())
    }

    fn restart(&mut self, frame: &Frame, bbox: BBox) -> Result<()> {
        self.values = Self::sample(frame, &bbox).collect();
        Ok(())
    }
}

#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct NearPrediction;

impl Proposer for NearPrediction {
    fn propose(&mut self, frame: &Frame, prior: &Prior, _: TrackState) -> Search {
        let size = frame.size();
        let (x, y) = (prior.bbox.center().x, prior.bbox.center().y);
        let center = Point::new(x.clamp(0.0, size.width as f64), y.clamp(0.0, size.height as f64));
        let expected = prior.bbox.centered_at(center);
        Search { expected, region: expected.expanded(8.0), gate: prior.innovation_covariance, wide: false }
    }
}

#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct HalfSure;

impl Policy for HalfSure {
    fn judge(&mut self, evidence: &Evidence<'_>) -> Verdict {
        let score = evidence.found.map_or(0.0, |f| f.confidence);
        let inside = evidence.found.is_some_and(|f| f.bbox.clipped_to(evidence.frame.size()).is_some());
        let state = if score >= 0.5 && inside { TrackState::Tracking } else { TrackState::Occluded };
        Verdict { state, score: if state == TrackState::Tracking { score } else { 0.2 }, learn: false }
    }

    fn restart(&mut self) {}
}

impl TrackerRecipe for ToyParams {
    type Tracker = SingleTarget<NearPrediction, Patch, HalfSure, BoxFilter>;

    const SUMMARY: &'static str = "a grey patch by its mean absolute difference";
    const PAPER: &'static str = "none";

    fn start(&self, frame: &Frame, bbox: BBox) -> Result<Self::Tracker> {
        let failed = |e| TrackingError::Computation { tracker: Self::OWNER, index: frame.index(), source: Box::new(e) };
        let motion = BoxFilter::new(BoxNoise::Relative(RelativeNoise::agile()), bbox).map_err(failed)?;
        let values = Patch::sample(frame, &bbox).collect();
        let patch = Patch { reach_px: self.reach_px, worst_difference: self.worst_difference, values };
        Ok(SingleTarget::new(Self::OWNER, frame, NearPrediction, patch, HalfSure, motion))
    }

    fn revive(&self, saved: Self::Tracker) -> Result<Self::Tracker> {
        saved.revived(Self::OWNER, |_, patch, _, _| {
            if patch.values.len() == GRID * GRID && (1..=50).contains(&patch.reach_px) {
                return Ok(());
            }
            Err(TrackingError::Snapshot { tracker: Self::OWNER, problem: "the patch has another size".to_owned() })
        })
    }
}
