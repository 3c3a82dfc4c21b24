//! What callers ask of [`Associating`].

use super::super::{MultiTracker, TargetId, Track};
use super::{Associating, NAME, Standing, Target, association, failed, saved};
use crate::motion::{CameraShift, Motion};
use crate::{Forecast, Recipe, Result, TrackingError, check_box};
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_parameters::{ParameterError, Parameters};

impl Associating {
    fn at(&self, id: TargetId) -> Result<usize> {
        let at = self.targets.iter().position(|t| t.id() == Some(id));
        at.ok_or(TrackingError::UnknownTarget { id: id.0 })
    }
}

impl MultiTracker for Associating {
    fn step(&mut self, frame: &Frame, tracks: &mut Vec<Track>) -> Result<()> {
        self.look(frame, tracks)
    }

    /// The tracker of `recipe` answers when no detection is associated. A target that a user pointed at is never given up.
    fn add(&mut self, recipe: &dyn Recipe, frame: &Frame, bbox: BBox) -> Result<TargetId> {
        let appearance = recipe.appearance(frame, bbox)?;
        let id = TargetId(self.last_id + 1);
        let given = Target::new(Standing::Given(id), frame.into(), bbox, &self.params);
        let mut target = given.map_err(|e| failed(frame.index(), e))?;
        target.appearance = Some(appearance);
        self.targets.push(target);
        self.last_id = id.0;
        Ok(id)
    }

    fn remove(&mut self, id: TargetId) -> Result<()> {
        let at = self.at(id)?;
        self.targets.remove(at);
        Ok(())
    }

    fn reinit(&mut self, id: TargetId, frame: &Frame, bbox: BBox) -> Result<()> {
        check_box(frame, bbox)?;
        let at = self.at(id)?;
        self.targets[at].put(frame, bbox)
    }

    /// Parameters of the group `[many]` belong to all targets at once, so `id` must be `None`.
    fn change(&mut self, id: Option<TargetId>, changes: &toml::Table) -> Result<()> {
        if let Some(id) = id {
            self.at(id)?;
            let name = changes.keys().next().map_or("", String::as_str);
            return Err(ParameterError::new(NAME, name, "belongs to all targets together; change it for all").into());
        }
        let params = self.params.with(NAME, changes)?;
        if params.embedding.model != self.params.embedding.model
            || params.embedding.network != self.params.embedding.network
        {
            let why = "what says what detections look like cannot be changed while it runs; start again";
            return Err(ParameterError::new(NAME, "embedding", why).into());
        }
        let association = association(&params)?;
        // The motion is tried on its own first, so that an error changes no target.
        for target in &self.targets {
            Motion::new(params.motion.clone(), target.bbox()).map_err(|e| failed(0, e))?;
        }
        self.targets.iter_mut().try_for_each(|t| t.change(&params)).map_err(|e| failed(0, e))?;
        if params.motion.camera != self.params.motion.camera {
            self.camera = CameraShift::new(params.motion.camera);
        }
        (self.association, self.params) = (association, params);
        Ok(())
    }

    fn forecast(&self, id: TargetId, seconds: f64) -> Result<Forecast> {
        self.targets[self.at(id)?].known.belief.forecast(seconds).map_err(|e| failed(0, e))
    }

    fn ids(&self) -> Vec<TargetId> {
        let mut ids: Vec<_> = self.targets.iter().filter_map(Target::id).collect();
        ids.sort_unstable();
        ids
    }

    fn save(&self) -> Result<Vec<u8>> {
        saved::save(self)
    }
}
