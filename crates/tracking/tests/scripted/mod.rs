//! A localizer that says what a script tells it, and writes down what it is asked: to test the loop without pixels.
#![allow(dead_code, reason = "not every test uses all of it")]

use pursuit_geometry::BBox;
use pursuit_imaging::{Frame, Image};
use pursuit_tracking::{
    GroupParams, Localizer, LocalizerRecipe, Look, Measurement, Outcome, Recipe, Result, Search, TrackState, Tracker,
    TrackerEntry, TrackerRecipe, ViewSize, Weighed,
};
use serde::{Deserialize, Serialize};
use std::cell::{Cell, RefCell};

pub const WIDTH: usize = 320;
pub const HEIGHT: usize = 240;

/// What a localizer was asked to do.
#[derive(Debug, Clone, PartialEq)]
pub enum Asked {
    Locate(Look, BBox),
    Refine(BBox),
    Adapt(BBox),
    Restart(BBox),
}

thread_local! {
    /// What is seen at the place of a search: box and probability.
    static SCRIPT: RefCell<Option<(BBox, f64)>> = const { RefCell::new(None) };
    /// What is seen by a sweep over the frame.
    static FAR: RefCell<Option<(BBox, f64)>> = const { RefCell::new(None) };
    static CONCLUDED: RefCell<Vec<(Option<BBox>, TrackState)>> = const { RefCell::new(Vec::new()) };
    /// Which box the localizer prefers.
    static WEIGHED: Cell<Weighed> = const { Cell::new(Weighed::Filtered) };
    /// The filtered box it was shown last, and what it was told at the end of the frame.
    static FILTERED: Cell<Option<BBox>> = const { Cell::new(None) };
    static PASSED: Cell<Option<(BBox, BBox)>> = const { Cell::new(None) };
    static ASKED: RefCell<Vec<Asked>> = const { RefCell::new(Vec::new()) };
}

/// From now on `near` is seen near the prediction, `far` elsewhere.
pub fn show(near: Option<(BBox, f64)>, far: Option<(BBox, f64)>) {
    SCRIPT.set(near);
    FAR.set(far);
}

/// From now on the localizer prefers this.
#[allow(dead_code, reason = "not every test that uses the script weighs")]
pub fn prefer(weighed: Weighed) {
    WEIGHED.set(weighed);
}

/// The filtered box that was weighed last; the measured box and the one to go on from that the frame ended with.
#[allow(dead_code, reason = "not every test that uses the script weighs")]
pub fn passed() -> (Option<BBox>, Option<(BBox, BBox)>) {
    (FILTERED.take(), PASSED.take())
}

/// What was asked since the last call.
pub fn asked() -> Vec<Asked> {
    ASKED.take()
}

/// What it was told that the loop made of the frames since the last call.
#[allow(dead_code, reason = "not every test asks")]
pub fn concluded() -> Vec<(Option<BBox>, TrackState)> {
    CONCLUDED.take()
}

fn note(what: Asked) {
    ASKED.with_borrow_mut(|asked| asked.push(what));
}

pursuit_parameters::parameters! {
    /// Parameters of the scripted localizer.
    pub struct ScriptedParams {
        /// What `refine` multiplies sizes by.
        pub growth: f64 = 1.0, in 0.5..=2.0;
    }
}

#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Scripted {
    growth: f64,
    learned: u32,
}

impl Localizer for Scripted {
    type Finding = ();

    fn locate(&mut self, _: &Frame, search: &Search) -> Result<Option<(Measurement, ())>> {
        note(Asked::Locate(search.look, search.expected));
        let seen = if search.look == Look::Near { SCRIPT.take() } else { FAR.take() };
        match search.look {
            Look::Near => SCRIPT.set(seen),
            Look::Sweep | Look::Centred => FAR.set(seen),
        }
        Ok(seen.map(|(bbox, confidence)| (Measurement::new(bbox, confidence), ())))
    }

    fn refine(&mut self, _: &Frame, _: &Search, measurement: &mut Measurement, (): &mut ()) -> Result<()> {
        note(Asked::Refine(measurement.bbox));
        measurement.bbox = measurement.bbox.scaled(self.growth);
        Ok(())
    }

    fn adapt(&mut self, _: &Frame, bbox: BBox, (): &()) -> Result<()> {
        self.learned += 1;
        note(Asked::Adapt(bbox));
        Ok(())
    }

    fn weigh(&mut self, _: &Frame, (): &(), filtered: &BBox) -> Result<Weighed> {
        FILTERED.set(Some(*filtered));
        Ok(WEIGHED.get())
    }

    fn observe(&mut self, _: &Frame, outcome: &Outcome<'_, ()>) -> Result<()> {
        CONCLUDED.with_borrow_mut(|all| all.push((outcome.found.map(|(found, ())| found), outcome.state)));
        PASSED.set(outcome.found.zip(outcome.followed).map(|((found, ()), bbox)| (found, bbox)));
        Ok(())
    }

    fn restart(&mut self, _: &Frame, bbox: BBox) -> Result<()> {
        self.learned = 0;
        note(Asked::Restart(bbox));
        Ok(())
    }

    fn view(&self, _: &BBox) -> Option<ViewSize> {
        Some(ViewSize { width: 160.0, height: 120.0 })
    }
}

impl LocalizerRecipe for ScriptedParams {
    type Localizer = Scripted;

    fn localizer(&self, _: &Frame, _: BBox) -> Result<Scripted> {
        Ok(Scripted { growth: self.growth, learned: 0 })
    }
}

pub const ENTRY: TrackerEntry = TrackerEntry::new("scripted", "says what it is told", "none", |name| {
    Box::new(TrackerRecipe { name, localizer: ScriptedParams::default(), groups: GroupParams::default() })
});

pub fn table(text: &str) -> toml::Table {
    text.parse().unwrap()
}

pub fn recipe(changes: &str) -> Box<dyn Recipe> {
    ENTRY.recipe(&table(changes)).unwrap()
}

/// Frame `k`, ten a second.
pub fn frame(k: u64) -> Frame {
    frame_at(k, k as f64 / 10.0)
}

pub fn frame_at(k: u64, time_s: f64) -> Frame {
    Frame::new(k, time_s, Image::filled(WIDTH, HEIGHT, 9_u8).unwrap())
}

pub fn at(x: f64, y: f64) -> BBox {
    BBox::from_ltwh(x, y, 20.0, 20.0)
}

/// A tracker started on frame 0 at (100, 100).
pub fn start(changes: &str) -> Box<dyn Tracker> {
    let tracker = recipe(changes).init(&frame(0), at(100.0, 100.0)).unwrap();
    asked();
    tracker
}
