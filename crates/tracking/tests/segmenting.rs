//! Masks after the loop: a recipe around any other.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod scripted;

use pursuit_geometry::{BBox, Mask, Size};
use pursuit_imaging::Frame;
use pursuit_tracking::many::TargetSet;
use pursuit_tracking::{
    Estimate, MultiTracker, Recipe, Result, Segmenter, SegmenterRecipe, SegmentingRecipe, TrackState,
};
use scripted::{ENTRY, HEIGHT, WIDTH, asked, at, frame, show, table};
use serde::{Deserialize, Serialize};

pursuit_parameters::parameters! {
    /// Says the box, smaller by a border, or nothing at all.
    pub struct InnerParams {
        /// Whether masks are wanted.
        pub wanted: bool = true;
        /// The border.
        pub border: f64 = 2.0, in 0.0..=9.0, unit "px";
    }
}

pursuit_parameters::parameters! {
    /// The group.
    pub struct InnerGroup {
        /// Masks.
        pub mask: InnerParams = InnerParams::default();
    }
}

/// Counts the frames it was asked in.
#[derive(Clone, Serialize, Deserialize)]
pub struct Inner {
    border: f64,
    asked: u32,
}

impl Segmenter for Inner {
    fn segment(&mut self, _: &Frame, estimate: &Estimate) -> Result<Option<Mask>> {
        self.asked += 1;
        let b = estimate.bbox;
        let inner = BBox::from_ltrb(
            b.left() + self.border,
            b.top() + f64::from(self.asked),
            b.right() - self.border,
            b.bottom() - self.border,
        );
        // Beyond the picture too: whoever asks clips it.
        let far = Size::new(9 * WIDTH, 9 * HEIGHT);
        Ok((estimate.state == TrackState::Tracking).then(|| Mask::from_bbox(&inner, far)))
    }

    fn restart(&mut self, _: &Frame, _: BBox) -> Result<()> {
        self.asked = 0;
        Ok(())
    }
}

impl SegmenterRecipe for InnerGroup {
    type Segmenter = Inner;

    fn segmenter(&self, _: &Frame, _: BBox) -> Result<Option<Inner>> {
        Ok(self.mask.wanted.then_some(Inner { border: self.mask.border, asked: 0 }))
    }
}

fn masked(changes: &str) -> Box<dyn Recipe> {
    let inner = ENTRY.default_recipe();
    SegmentingRecipe::new(inner, InnerGroup::default()).with(&table(changes)).unwrap()
}

#[test]
fn masks_are_said_of_what_is_seen_and_lie_in_the_picture() {
    let mut tracker = masked("mask.border = 3.0").init(&frame(0), at(100.0, 100.0)).unwrap();
    show(Some((at(100.0, 100.0), 0.9)), None);
    let said = tracker.update(&frame(1)).unwrap();
    let b = said.bbox;
    let wanted = BBox::from_ltrb(b.left() + 3.0, b.top() + 1.0, b.right() - 3.0, b.bottom() - 3.0);
    let whole = Size::new(WIDTH, HEIGHT);
    assert_eq!(said.mask.as_deref(), Some(&Mask::from_bbox(&wanted, whole)));
    show(None, None);
    let hidden = tracker.update(&frame(2)).unwrap();
    assert!(hidden.state != TrackState::Tracking && hidden.mask.is_none(), "{hidden:?}");
    let edge = at(WIDTH as f64 - 4.0, 100.0);
    tracker.reinit(&frame(3), edge).unwrap();
    show(Some((edge, 0.9)), None);
    let said = tracker.update(&frame(4)).unwrap();
    let mask = said.mask.unwrap();
    assert!(mask.clipped_to(whole) == *mask && !mask.is_empty());
    assert_eq!(mask.bounds().unwrap().top(), (said.bbox.top() + 0.5).floor() + 1.0, "it was started again");
    asked();
}

#[test]
fn without_masks_it_is_the_tracker_inside() {
    let run = |recipe: Box<dyn Recipe>| {
        let mut tracker = recipe.init(&frame(0), at(100.0, 100.0)).unwrap();
        show(Some((at(103.0, 100.0), 0.9)), None);
        (tracker.update(&frame(1)).unwrap(), tracker.save().unwrap())
    };
    let plain = run(ENTRY.default_recipe());
    assert_eq!(run(masked("mask.wanted = false")), plain, "to the byte of what is saved");
    let (with, saved) = run(masked(""));
    assert!(with.mask.is_some() && saved != plain.1);
    assert_eq!(Estimate { mask: None, ..with }, plain.0);
    // What was saved without masks is read by the recipe that wants some.
    assert!(masked("").restore(&plain.1).unwrap().update(&frame(2)).unwrap().mask.is_none());
    asked();
}

#[test]
fn parameters_of_both_are_one_table() {
    let recipe = masked("growth = 1.5\nmask.border = 4.0\nmotion.model = 'imm'");
    let table_of = recipe.parameters().unwrap();
    assert_eq!((table_of["growth"].as_float(), table_of["mask"]["border"].as_float()), (Some(1.5), Some(4.0)));
    assert_eq!(table_of["motion"]["model"].as_str(), Some("imm"));
    let names: Vec<&str> = recipe.schema().iter().map(|p| p.name).collect();
    assert_eq!(names, ["growth", "motion", "policy", "search", "mask"]);
    let refused = |changes: &str| recipe.with(&table(changes)).err().unwrap().to_string();
    assert!(refused("mask.border = 10.0").contains("`mask.border` of `scripted`: must be between 0 and 9"));
    assert!(refused("speed = 1").contains("`speed` of `scripted`"));
}

#[test]
fn saved_targets_go_on_with_their_masks() {
    let mut set = TargetSet::new();
    show(Some((at(100.0, 100.0), 0.9)), None);
    set.add(&*masked("mask.border = 5.0"), &frame(0), at(100.0, 100.0)).unwrap();
    let mut tracks = Vec::new();
    set.step(&frame(1), &mut tracks).unwrap();
    let saved = set.save().unwrap();
    let recipe_of = |name: &str| {
        assert_eq!(name, "scripted");
        Ok(masked(""))
    };
    let mut restored = TargetSet::restore(&saved, &recipe_of).unwrap();
    let mut step = |set: &mut TargetSet| {
        set.step(&frame(2), &mut tracks).unwrap();
        tracks[0].estimate.clone().unwrap()
    };
    let (own, theirs) = (step(&mut set), step(&mut restored));
    assert!(own.mask.is_some() && own == theirs);
    assert_eq!(set.save().unwrap(), restored.save().unwrap());
    for length in 0..saved.len() {
        assert!(TargetSet::restore(&saved[..length], &recipe_of).is_err(), "cut to {length}");
    }
    asked();
}
