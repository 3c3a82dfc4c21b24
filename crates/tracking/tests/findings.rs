//! What a look saw reaches the later stages of the frame in its finding, whichever look came last.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use pursuit_geometry::{BBox, Mask};
use pursuit_imaging::{Frame, Image};
use pursuit_tracking::{
    Doubt, GroupParams, Localizer, LocalizerRecipe, Measurement, Outcome, Prior, Result, Search, TrackState, Tracker,
    TrackerRecipe, Weighed,
};
use serde::{Deserialize, Serialize};
use std::cell::{Cell, RefCell};

thread_local! {
    /// The stages that used a finding, and the number of the place that it was of.
    static USED: RefCell<Vec<(&'static str, usize)>> = const { RefCell::new(Vec::new()) };
    /// How sure each of the three places looks, and the prediction.
    static LOOKS: RefCell<[f64; 4]> = const { RefCell::new([0.0; 4]) };
    /// Why it says that the target is not seen.
    static WHY: Cell<Option<Doubt>> = const { Cell::new(Some(Doubt::Changed)) };
}

fn used(stage: &'static str, place: usize) {
    USED.with_borrow_mut(|used| used.push((stage, place)));
}

pursuit_parameters::parameters! {
    /// Suggests three places.
    pub struct ThreeParams {
        /// How far apart the places are.
        pub apart_px: f64 = 40.0, in 0.0..=100.0;
    }
}

/// Knows three places besides the expected one, and numbers them from 1 on.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Three(f64);

impl Three {
    fn place(&self, k: usize) -> BBox {
        BBox::from_ltwh(100.0 + self.0 * k as f64, 100.0, 20.0, 20.0)
    }
}

impl Localizer for Three {
    type Finding = usize;

    fn suggest(&mut self, _: &Frame, _: &Prior, _: TrackState, places: &mut Vec<BBox>) -> Result<()> {
        places.extend((1..=3).map(|k| self.place(k)));
        Ok(())
    }

    fn locate(&mut self, _: &Frame, search: &Search) -> Result<Option<(Measurement, usize)>> {
        let place = (1..=3).find(|k| self.place(*k) == search.expected).unwrap_or(0);
        let confidence = LOOKS.with_borrow(|looks| looks[place]);
        Ok((confidence > 0.0).then(|| (Measurement::new(search.expected, confidence), place)))
    }

    fn refine(&mut self, _: &Frame, search: &Search, found: &mut Measurement, place: &mut usize) -> Result<()> {
        assert_eq!((search.expected, found.bbox), (self.place(*place), self.place(*place)));
        used("refine", *place);
        Ok(())
    }

    fn adapt(&mut self, _: &Frame, _: BBox, place: &usize) -> Result<()> {
        used("adapt", *place);
        Ok(())
    }

    fn weigh(&mut self, _: &Frame, place: &usize, _: &BBox) -> Result<Weighed> {
        used("weigh", *place);
        Ok(Weighed::Measured)
    }

    fn doubt(&self, _: &Frame, _: &BBox, place: Option<&usize>) -> Option<Doubt> {
        used("doubt", *place?);
        WHY.get()
    }

    fn mask(&self, frame: &Frame, place: &usize) -> Option<Mask> {
        (*place > 0).then(|| Mask::from_bbox(&self.place(*place), frame.size()))
    }

    fn observe(&mut self, _: &Frame, outcome: &Outcome<'_, usize>) -> Result<()> {
        outcome.found.iter().for_each(|(_, place)| used("observe", **place));
        Ok(())
    }

    fn restart(&mut self, _: &Frame, _: BBox) -> Result<()> {
        Ok(())
    }
}

impl LocalizerRecipe for ThreeParams {
    type Localizer = Three;

    fn localizer(&self, _: &Frame, _: BBox) -> Result<Three> {
        Ok(Three(self.apart_px))
    }
}

fn frame(k: u64) -> Frame {
    Frame::new(k, k as f64 / 10.0, Image::filled(320, 240, 9_u8).unwrap())
}

/// A target that was not seen in the frame before, so that the places suggested are looked at.
fn unseen() -> Box<dyn Tracker> {
    let recipe = TrackerRecipe { name: "three", localizer: ThreeParams::default(), groups: GroupParams::default() };
    let mut tracker = pursuit_tracking::Recipe::init(&recipe, &frame(0), Three(40.0).place(0)).unwrap();
    LOOKS.set([0.0; 4]);
    assert_eq!(tracker.update(&frame(1)).unwrap().state, TrackState::Occluded);
    USED.take();
    tracker
}

#[test]
fn the_best_look_is_learned_though_others_follow() {
    for best in 1..=3 {
        let mut tracker = unseen();
        let mut looks = [0.3; 4];
        looks[best] = 0.95;
        LOOKS.set(looks);
        let estimate = tracker.update(&frame(2)).unwrap();
        assert_eq!((estimate.state, estimate.score), (TrackState::Tracking, 0.95), "{best}");
        assert_eq!(estimate.bbox, Three(40.0).place(best));
        assert_eq!(USED.take(), ["refine", "weigh", "adapt", "observe"].map(|stage| (stage, best)));
    }
}

#[test]
fn a_doubt_is_of_the_best_look() {
    let mut tracker = unseen();
    LOOKS.set([0.1, 0.4, 0.3, 0.2]);
    let estimate = tracker.update(&frame(2)).unwrap();
    assert_eq!((estimate.state, estimate.doubt), (TrackState::Unsure, Some(Doubt::Changed)));
    assert_eq!(USED.take(), ["refine", "doubt", "observe"].map(|stage| (stage, 1)));
}

#[test]
fn what_is_hidden_by_its_reason_is_occluded_and_followed() {
    let mut boxes = Vec::new();
    for (why, state) in [
        (Some(Doubt::Covered), TrackState::Occluded),
        (Some(Doubt::Gone), TrackState::Occluded),
        (Some(Doubt::Confused), TrackState::Unsure),
        (None, TrackState::Unsure),
    ] {
        WHY.set(why);
        let mut tracker = unseen();
        LOOKS.set([0.1, 0.4, 0.3, 0.2]);
        let estimate = tracker.update(&frame(2)).unwrap();
        assert_eq!((estimate.state, estimate.doubt), (state, why));
        boxes.push(estimate.bbox);
    }
    assert!(boxes[0].iou(&Three(40.0).place(1)) > 0.99, "{}", boxes[0]);
    assert!(boxes.iter().all(|b| *b == boxes[0]), "the word moves no box: {boxes:?}");
}

#[test]
fn a_mask_is_of_the_best_look_where_the_target_is_seen() {
    let mask_of = |place: usize| Some(Mask::from_bbox(&Three(40.0).place(place), frame(0).size()));
    let said = |looks: [f64; 4], why: Option<Doubt>| {
        WHY.set(why);
        let mut tracker = unseen();
        LOOKS.set(looks);
        let estimate = tracker.update(&frame(2)).unwrap();
        (estimate.state, estimate.mask.map(|mask| (*mask).clone()))
    };
    assert_eq!(said([0.3, 0.3, 0.95, 0.3], None), (TrackState::Tracking, mask_of(2)));
    assert_eq!(said([0.1, 0.4, 0.3, 0.2], None), (TrackState::Unsure, mask_of(1)));
    assert_eq!(said([0.1, 0.4, 0.3, 0.2], Some(Doubt::Covered)), (TrackState::Occluded, None));
    // The place expected has no mask here.
    assert_eq!(said([0.95, 0.0, 0.0, 0.0], None), (TrackState::Tracking, None));
    // One that was lost has none, whatever is found of it, and none for the frame before.
    WHY.set(None);
    let mut tracker = unseen();
    LOOKS.set([0.0; 4]);
    let states: Vec<TrackState> = (2..400)
        .map(|k| tracker.update(&frame(k)).map(|e| (e.mask.is_none(), e.state)).unwrap())
        .map(|(none, state)| {
            assert!(none);
            state
        })
        .collect();
    assert!(states.contains(&TrackState::Lost), "{states:?}");
}
