//! A recipe as a value: a localizer with its parameters, and the groups `[motion]`, `[policy]` and `[search]`.

use crate::motion::MotionParams;
use crate::policy::PolicyParams;
use crate::search::SearchParams;
use crate::searcher::{Appearance, Searcher};
use crate::{Figure, Localizer, Needs, Recipe, Result, SingleTarget, Tracker, TrackingError, check_box, snapshot};
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_parameters::{Parameter, ParameterError, Parameters, Value, nested};
use serde::{Serialize, de::DeserializeOwned};

pursuit_parameters::parameters! {
    /// The roles of the loop that every tracker has.
    pub struct GroupParams {
        /// How the target's motion is modelled.
        pub motion: MotionParams = MotionParams::default();
        /// How the loop judges what it found.
        pub policy: PolicyParams = PolicyParams::default();
        /// Where the loop looks.
        pub search: SearchParams = SearchParams::default();
    }
}

impl GroupParams {
    /// These with the values of `changes` in their place; errors name `owner`.
    ///
    /// # Errors
    /// [`TrackingError::Parameter`] for what is no parameter of a group, or a bad value.
    pub(crate) fn with_changes(&self, owner: &str, changes: &toml::Table) -> Result<Self> {
        let changes = nested(changes);
        let groups = self.schema();
        if let Some(key) = changes.keys().find(|k| groups.iter().all(|g| g.name != *k)) {
            let problem = "cannot be changed while running; what can are the groups motion, policy and search";
            return Err(ParameterError::new(owner, key, problem).into());
        }
        Ok(self.with(owner, &changes)?)
    }
}

/// What an implementer writes to have a tracker: parameters that make a localizer.
pub trait LocalizerRecipe: Parameters {
    /// The localizer made.
    type Localizer: Localizer + Clone + Serialize + DeserializeOwned + 'static;

    /// What it cannot do without.
    const NEEDS: Needs = Needs { color: false, file: false };

    /// A localizer that knows the target at `bbox`, which has been checked to be finite, not empty and to overlap the frame.
    ///
    /// # Errors
    /// When the frame lacks what the method needs.
    fn localizer(&self, frame: &Frame, bbox: BBox) -> Result<Self::Localizer>;
}

/// A tracker: a localizer's parameters and the three groups, under a name.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackerRecipe<P> {
    /// Name in the registry.
    pub name: &'static str,
    /// Parameters of the localizer.
    pub localizer: P,
    /// Parameters of the other roles.
    pub groups: GroupParams,
}

impl<P: LocalizerRecipe> Parameters for TrackerRecipe<P> {
    fn schema(&self) -> Vec<Parameter> {
        self.localizer.schema().into_iter().chain(self.groups.schema()).collect()
    }

    fn check_all(&self) -> Result<(), (String, String)> {
        self.localizer.check_all()?;
        self.groups.check_all()
    }

    fn set(&mut self, path: &str, value: &Value) -> Result<(), String> {
        let group = path.split('.').next();
        if self.groups.schema().iter().any(|g| Some(g.name) == group) {
            self.groups.set(path, value)
        } else {
            self.localizer.set(path, value)
        }
    }

    fn renamed(&self, path: &str) -> Option<Vec<String>> {
        self.localizer.renamed(path).or_else(|| self.groups.renamed(path))
    }
}

impl<P: LocalizerRecipe> TrackerRecipe<P> {
    /// A localizer of the target at `bbox`, once everything was checked.
    fn start(&self, frame: &Frame, bbox: BBox) -> Result<P::Localizer> {
        self.validate(self.name)?;
        check_box(frame, bbox)?;
        if P::NEEDS.color && !frame.has_color() {
            let (tracker, index) = (self.name.to_owned(), frame.index());
            return Err(TrackingError::MissingPlane { tracker, needed: "colour", index });
        }
        self.localizer.localizer(frame, bbox)
    }
}

impl<P: LocalizerRecipe> Recipe for TrackerRecipe<P> {
    fn name(&self) -> &str {
        self.name
    }

    fn needs(&self) -> Needs {
        P::NEEDS
    }

    fn schema(&self) -> Vec<Parameter> {
        Parameters::schema(self)
    }

    fn renamed(&self, path: &str) -> Option<Vec<String>> {
        Parameters::renamed(self, path)
    }

    fn figures(&self) -> Vec<&'static Figure> {
        P::Localizer::FIGURES.iter().copied().flatten().collect()
    }

    fn parameters(&self) -> Result<toml::Table> {
        Ok(self.to_table(self.name)?)
    }

    fn with(&self, changes: &toml::Table) -> Result<Box<dyn Recipe>> {
        Ok(Box::new(Parameters::with(self, self.name, changes)?))
    }

    fn init(&self, frame: &Frame, bbox: BBox) -> Result<Box<dyn Tracker>> {
        let localizer = self.start(frame, bbox)?;
        Ok(Box::new(SingleTarget::new(self.name, frame, bbox, localizer, &self.groups)?))
    }

    fn appearance(&self, frame: &Frame, bbox: BBox) -> Result<Box<dyn Appearance>> {
        let localizer = self.start(frame, bbox)?;
        Ok(Box::new(Searcher::new(self.name, self.groups.search.clone(), localizer, &bbox)))
    }

    fn restore(&self, saved: &[u8]) -> Result<Box<dyn Tracker>> {
        Ok(Box::new(snapshot::read::<SingleTarget<P::Localizer>>(self.name, saved)?))
    }

    fn restore_appearance(&self, saved: &[u8]) -> Result<Box<dyn Appearance>> {
        Ok(Box::new(snapshot::read::<Searcher<P::Localizer>>(self.name, saved)?))
    }

    fn boxed_clone(&self) -> Box<dyn Recipe> {
        Box::new(self.clone())
    }
}
