use crate::belief::{Belief, failed};
use crate::motion::{CameraShift, Motion, MotionFilter};
use crate::searcher::Searcher;
use crate::{Estimate, Forecast, GroupParams, Localizer, Measurement, Prior, Result, Tracker, check_box, snapshot};
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use serde::{Deserialize, Serialize, de::DeserializeOwned};

/// The one loop: predict → search → judge → correct or coast → learn.
///
/// Each clause has one owner: the proposer says where to look, the localizer `L` finds, the policy judges, the motion model
/// predicts and corrects, and appearance learns only when the policy says so.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct SingleTarget<L> {
    belief: Belief,
    camera: CameraShift,
    searcher: Searcher<L>,
}

impl<L: Localizer> SingleTarget<L> {
    /// A loop that starts on `frame`: `localizer` knows the target at `bbox`, the groups say how the rest works.
    ///
    /// # Errors
    /// When the motion model cannot start from the box.
    pub fn new(name: &str, frame: &Frame, bbox: BBox, localizer: L, groups: &GroupParams) -> Result<Self> {
        let belief = Belief::new(&groups.motion, &groups.policy, frame, bbox);
        let mut camera = CameraShift::new(groups.motion.camera);
        camera.at(frame, &bbox);
        Ok(Self {
            belief: belief.map_err(|e| failed(name, frame.index(), e))?,
            camera,
            searcher: Searcher::new(name, groups.search.clone(), localizer, &bbox),
        })
    }

    /// The localizer, to look inside.
    pub const fn localizer(&self) -> &L {
        &self.searcher.localizer
    }

    /// The motion model, to look inside.
    pub const fn motion(&self) -> &Motion {
        &self.belief.motion
    }

    /// Goes on to `frame`: where the target should be there.
    fn predict(&mut self, frame: &Frame) -> Result<Prior> {
        let dt_s = self.belief.last.advance(frame)?;
        if let Some(shift) = self.camera.at(frame, &self.belief.motion.bbox()) {
            self.belief.carry(shift);
            self.searcher.proposer.carry(shift);
        }
        let prior = self.belief.predict(dt_s).map_err(|e| failed(&self.searcher.name, frame.index(), e))?;
        Ok(self.belief.keep_near(frame.size(), self.searcher.proposer.params().outside, prior))
    }
}

impl<L: Localizer + Clone + Serialize + DeserializeOwned + 'static> Tracker for SingleTarget<L> {
    fn update(&mut self, frame: &Frame) -> Result<Estimate> {
        let prior = self.predict(frame)?;
        self.searcher.step(frame, &mut self.belief, &prior, None, &|_| true)
    }

    fn peek(&mut self, frame: &Frame) -> Result<Option<Measurement>> {
        let (belief, camera, proposer) = (self.belief.clone(), self.camera.clone(), self.searcher.proposer.clone());
        let looked = self.predict(frame).and_then(|prior| {
            let situation = self.searcher.situation(frame, &self.belief, &prior);
            self.searcher.look(frame, &situation)
        });
        (self.belief, self.camera, self.searcher.proposer) = (belief, camera, proposer);
        looked.map(|(found, _)| found.map(|f| f.measurement))
    }

    fn forecast(&self, seconds: f64) -> Result<Forecast> {
        self.belief.forecast(seconds).map_err(|e| failed(&self.searcher.name, 0, e))
    }

    fn reinit(&mut self, frame: &Frame, bbox: BBox) -> Result<()> {
        check_box(frame, bbox)?;
        self.searcher.restart_on(frame, bbox)?;
        self.belief.restart(frame, bbox);
        self.camera = CameraShift::new(self.belief.motion.params().camera);
        self.camera.at(frame, &bbox);
        Ok(())
    }

    fn change(&mut self, changes: &toml::Table) -> Result<()> {
        let groups = GroupParams {
            motion: self.belief.motion.params().clone(),
            policy: self.belief.policy.params().clone(),
            search: self.searcher.proposer.params().clone(),
        };
        let name = &self.searcher.name;
        let changed = groups.with_changes(name, changes)?;
        self.belief.change(&changed.motion, &changed.policy).map_err(|e| failed(name, 0, e))?;
        if changed.motion != groups.motion {
            self.camera = CameraShift::new(changed.motion.camera);
        }
        self.searcher.proposer.change(changed.search);
        Ok(())
    }

    fn save(&self) -> Result<Vec<u8>> {
        snapshot::write(&self.searcher.name, self)
    }

    fn boxed_clone(&self) -> Box<dyn Tracker> {
        Box::new(self.clone())
    }
}
