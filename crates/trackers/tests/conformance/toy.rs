//! A tracker in one file, made of public parts: matches a patch of grey by the mean absolute difference.

use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_tracking::motion::MotionParams;
use pursuit_tracking::{
    Figure, Figures, GroupParams, Localizer, LocalizerRecipe, Measurement, Result, Search, TrackerEntry, TrackerRecipe,
};
use serde::{Deserialize, Serialize};

pursuit_parameters::parameters! {
    /// Parameters of the toy tracker.
    pub struct ToyParams {
        /// Half width of the square searched.
        pub reach_px: u32 = 8, in 1..=50, unit "px";
        /// Mean absolute difference, in grey levels, at which a match is worth nothing.
        pub worst_difference: f64 = 24.0, in above(0.0);
    }
}

pursuit_tracking::figures! {
    /// What it says of a match.
    struct ToyFigures {
        /// Mean absolute difference, in grey levels.
        difference;
    }
}

/// The line it takes in a registry.
pub const ENTRY: TrackerEntry =
    TrackerEntry::new("toy", "a grey patch by its mean absolute difference", "none", |name| Box::new(toy(name)));

/// It measures whole pixels, so its velocity is believed slowly.
fn toy(name: &'static str) -> TrackerRecipe<ToyParams> {
    let motion = MotionParams { acceleration: 10.0, ..MotionParams::default() };
    TrackerRecipe { name, localizer: ToyParams::default(), groups: GroupParams { motion, ..GroupParams::default() } }
}

impl LocalizerRecipe for ToyParams {
    type Localizer = Patch;

    fn localizer(&self, frame: &Frame, bbox: BBox) -> Result<Patch> {
        let values = Patch::sample(frame, &bbox).collect();
        Ok(Patch { reach_px: self.reach_px, worst_difference: self.worst_difference, values })
    }
}

/// Grey values on a grid over the box the tracker was started on.
const GRID: usize = 12;

#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(remote = "Patch")]
pub struct Patch {
    reach_px: u32,
    worst_difference: f64,
    values: Vec<u8>,
}

pursuit_estimation::checked!(Patch);

impl Patch {
    fn restored(self) -> Result<Self, &'static str> {
        let fits = self.values.len() == GRID * GRID && (1..=50).contains(&self.reach_px);
        if fits { Ok(self) } else { Err("the patch has another size") }
    }
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
    type Finding = ();

    const FIGURES: &[&[Figure]] = &[ToyFigures::ALL];

    fn locate(&mut self, frame: &Frame, search: &Search) -> Result<Option<(Measurement, ())>> {
        let reach = self.reach_px as i32;
        let offsets = (-reach..=reach).flat_map(|dy| (-reach..=reach).map(move |dx| (dx, dy)));
        let difference = |(dx, dy): (i32, i32)| {
            let bbox = search.expected.translated(f64::from(dx), f64::from(dy));
            let sum: u32 = Self::sample(frame, &bbox).zip(&self.values).map(|(a, b)| u32::from(a.abs_diff(*b))).sum();
            (sum, dx * dx + dy * dy, (dx, dy))
        };
        let Some((sum, _, (dx, dy))) = offsets.map(difference).min() else { return Ok(None) };
        let difference = f64::from(sum) / (GRID * GRID) as f64;
        let confidence = (1.0 - difference / self.worst_difference).clamp(0.0, 1.0);
        let measurement = Measurement {
            sigma_px: Some(0.3),
            diagnostics: ToyFigures { difference }.into(),
            ..Measurement::new(search.expected.translated(f64::from(dx), f64::from(dy)), confidence)
        };
        Ok(Some((measurement, ())))
    }

    fn adapt(&mut self, _: &Frame, _: BBox, (): &()) -> Result<()> {
        Ok(())
    }

    fn restart(&mut self, frame: &Frame, bbox: BBox) -> Result<()> {
        self.values = Self::sample(frame, &bbox).collect();
        Ok(())
    }
}
