//! A tracker of your own: say how a patch is found, and the loop around it predicts, judges, coasts, searches and finds again. This one
//! compares grey values.

use pursuit::imaging::Frame;
use pursuit::tracking::motion::MotionParams;
use pursuit::tracking::{GroupParams, Localizer, LocalizerRecipe, Measurement, Result, Search, TrackerRecipe};
use pursuit::{BBox, open, track};
use serde::{Deserialize, Serialize};

pursuit::parameters::parameters! {
    /// What a user may set: type, default, range and unit, from which the command line and the check follow.
    pub struct PatchParams {
        /// How far it looks, each way.
        pub reach_px: u32 = 8, in 1..=50, unit "px";
    }
}

/// Grey values on a grid over the box.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(remote = "Patch")]
pub struct Patch {
    reach_px: i32,
    values: Vec<u8>,
}

const GRID: usize = 12;

// A state that is read back is checked.
pursuit::estimation::checked!(Patch);

impl Patch {
    fn restored(self) -> std::result::Result<Self, &'static str> {
        if self.values.len() == GRID * GRID { Ok(self) } else { Err("the patch has another size") }
    }

    fn sample(frame: &Frame, b: BBox) -> impl Iterator<Item = u8> {
        let gray = frame.gray();
        let at = |origin: f64, side: f64, k: usize| (origin + side * (k as f64 + 0.5) / GRID as f64).floor() as isize;
        (0..GRID * GRID)
            .map(move |i| gray.clamped(at(b.left(), b.width(), i % GRID), at(b.top(), b.height(), i / GRID)))
    }
}

impl LocalizerRecipe for PatchParams {
    type Localizer = Patch;

    fn localizer(&self, frame: &Frame, bbox: BBox) -> Result<Patch> {
        Ok(Patch { reach_px: self.reach_px as i32, values: Patch::sample(frame, bbox).collect() })
    }
}

impl Localizer for Patch {
    type Finding = ();

    /// Where the patch is most alike, near where the loop expects it.
    fn locate(&mut self, frame: &Frame, search: &Search) -> Result<Option<(Measurement, ())>> {
        let reach = -self.reach_px..=self.reach_px;
        let places =
            reach.clone().flat_map(|y| reach.clone().map(move |x| search.expected.translated(x.into(), y.into())));
        let difference = |bbox: &BBox| -> u32 {
            Self::sample(frame, *bbox).zip(&self.values).map(|(a, b)| u32::from(a.abs_diff(*b))).sum()
        };
        let best = places.map(|bbox| (difference(&bbox), bbox)).min_by_key(|(difference, _)| *difference);
        Ok(best.map(|(difference, bbox)| {
            let mean = f64::from(difference) / (GRID * GRID) as f64;
            (Measurement { sigma_px: Some(0.5), ..Measurement::new(bbox, (1.0 - mean / 24.0).clamp(0.0, 1.0)) }, ())
        }))
    }

    /// Learning: nothing here. The loop asks for it only where the target was seen.
    fn adapt(&mut self, _: &Frame, _: BBox, (): &()) -> Result<()> {
        Ok(())
    }

    fn restart(&mut self, frame: &Frame, bbox: BBox) -> Result<()> {
        self.values = Self::sample(frame, bbox).collect();
        Ok(())
    }
}

/// Runs it.
pub fn main() -> std::result::Result<(), Box<dyn std::error::Error>> {
    let motion = MotionParams { acceleration: 10.0, ..MotionParams::default() };
    let groups = GroupParams { motion, ..GroupParams::default() };
    let recipe = TrackerRecipe { name: "patch", localizer: PatchParams::default(), groups };

    let source = open("scene:drift?seed=7&duration=2")?;
    let target = source.info().truth_at(0).bbox().ok_or("the scene begins without its target")?;
    let last = track(source, &recipe, target).last().ok_or("no frames")??;
    println!("{:.2} s: {} with probability {:.2} at {}", last.time_s, last.state, last.score, last.bbox);
    Ok(())
}
