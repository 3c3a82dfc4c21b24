//! Targets by boxes: put onto the next frame, or moved in it.

use super::Session;
use crate::RunError;
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_media::View;
use pursuit_tracking::many::{Elapsed, WallClock};
use pursuit_tracking::{Estimate, Recipe, TargetId, Track, TrackingError, check_box};

/// A box for the next frame, or, of a target to add, for the first frame of this number or a later one.
pub(super) enum Placement {
    Add(Option<Box<dyn Recipe>>, BBox, u64),
    Move(TargetId, BBox),
}

impl Session {
    /// One target for each box, in the first frame.
    #[must_use]
    pub fn starting_on(self, boxes: Vec<BBox>) -> Self {
        self.starting_at(0, boxes)
    }

    /// One target for each box, in the frame of this number; in the next one, where the input has no such frame.
    #[must_use]
    pub fn starting_at(mut self, frame: u64, boxes: Vec<BBox>) -> Self {
        let view = self.view;
        self.pending.extend(boxes.into_iter().map(|bbox| Placement::Add(None, of_input(view, bbox), frame)));
        self
    }

    /// For each box a target of each of these trackers, whose name stands where else the class of the target does.
    #[must_use]
    pub(crate) fn comparing_at(mut self, frame: u64, boxes: Vec<BBox>, recipes: Vec<Box<dyn Recipe>>) -> Self {
        let (view, mut number) = (self.view, 0);
        for bbox in boxes {
            for recipe in &recipes {
                number += 1;
                self.names.push((TargetId(number), recipe.name().into()));
                self.pending.push(Placement::Add(Some(recipe.boxed_clone()), of_input(view, bbox), frame));
            }
        }
        self
    }

    /// Starts or moves a target in this frame, and says so in place of what the step said of it.
    pub(super) fn place(&mut self, frame: &Frame, placement: Placement) -> Result<(), TrackingError> {
        let (targets, own) = (&mut self.targets, &*self.recipe);
        let (bbox, (id, elapsed)) = match placement {
            Placement::Add(recipe, bbox, _) => {
                let recipe = recipe.as_deref().unwrap_or(own);
                (bbox, Elapsed::of(&WallClock::default(), || targets.add(recipe, frame, bbox)))
            }
            Placement::Move(id, bbox) => {
                let moved = || targets.reinit(id, frame, bbox).map(|()| id);
                (bbox, Elapsed::of(&WallClock::default(), moved))
            }
        };
        let id = id?;
        let estimate = Some(Estimate::started(frame.time_s(), bbox, 1.0));
        self.tracks.retain(|t| t.id != id);
        let at = self.tracks.partition_point(|t| t.id < id);
        self.tracks.insert(at, Track { id, estimate, started: true, elapsed, class: None, detection: None });
        Ok(())
    }

    pub(super) fn add(&mut self, recipe: Option<Box<dyn Recipe>>, bbox: BBox) -> Result<Option<TargetId>, RunError> {
        let Some(frame) = &self.frame else {
            self.pending.push(Placement::Add(recipe, bbox, 0));
            return Ok(None);
        };
        let recipe = recipe.as_deref().unwrap_or(&*self.recipe);
        Ok(Some(self.targets.add(recipe, frame, bbox)?))
    }

    pub(super) fn reinit(&mut self, target: TargetId, bbox: BBox) -> Result<(), RunError> {
        if !self.targets.ids().contains(&target) {
            return Err(TrackingError::UnknownTarget { id: target.0 }.into());
        }
        match &self.frame {
            Some(frame) => {
                check_box(frame, bbox)?;
                self.targets.reinit(target, frame, bbox)?;
            }
            None => self.pending.push(Placement::Move(target, bbox)),
        }
        Ok(())
    }
}

/// A box of the input in pixels of the frames.
pub(super) fn of_input(view: Option<View>, bbox: BBox) -> BBox {
    view.map_or(bbox, |view| view.of_input(bbox))
}
