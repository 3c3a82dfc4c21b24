//! A recipe as a value: a localizer with its parameters, and the groups `[motion]`, `[policy]` and `[search]`.

use crate::motion::MotionParams;
use crate::parameters::{Kind, Parameter, Parameters, nested};
use crate::policy::PolicyParams;
use crate::search::SearchParams;
use crate::{Localizer, Needs, Recipe, Result, SingleTarget, Tracker, TrackingError, check_box, snapshot};
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use serde::{Serialize, de::DeserializeOwned};

crate::parameters! {
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
            return Err(TrackingError::Parameter {
                owner: owner.to_owned(),
                name: key.clone(),
                problem: "cannot be changed while running; what can are the groups motion, policy and search"
                    .to_owned(),
            });
        }
        self.with(owner, &changes)
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

impl<P: LocalizerRecipe> TrackerRecipe<P> {
    fn merged(own: toml::Table, groups: toml::Table) -> toml::Table {
        own.into_iter().chain(groups).collect()
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
        self.localizer.schema().into_iter().chain(self.groups.schema()).collect()
    }

    fn parameters(&self) -> Result<toml::Table> {
        Ok(Self::merged(self.localizer.to_table(self.name)?, self.groups.to_table(self.name)?))
    }

    fn with(&self, changes: &toml::Table) -> Result<Box<dyn Recipe>> {
        let group_names: Vec<&str> = self.groups.schema().iter().map(|g| g.name).collect();
        let (groups, own): (toml::Table, toml::Table) =
            nested(changes).into_iter().partition(|(key, _)| group_names.contains(&key.as_str()));
        let known = self.schema();
        if let Some(key) = own.keys().find(|k| known.iter().all(|p| p.name != *k)) {
            let names = known.iter().map(|p| match p.kind {
                Kind::Group { .. } => format!("{}.…", p.name),
                _ => p.name.to_owned(),
            });
            return Err(TrackingError::Parameter {
                owner: self.name.to_owned(),
                name: key.clone(),
                problem: format!("there is no such parameter; there are: {}", names.collect::<Vec<_>>().join(", ")),
            });
        }
        Ok(Box::new(Self {
            name: self.name,
            localizer: self.localizer.with(self.name, &own)?,
            groups: self.groups.with(self.name, &groups)?,
        }))
    }

    fn init(&self, frame: &Frame, bbox: BBox) -> Result<Box<dyn Tracker>> {
        self.localizer.validate(self.name)?;
        self.groups.validate(self.name)?;
        check_box(frame, bbox)?;
        if P::NEEDS.color && !frame.has_color() {
            let (tracker, index) = (self.name.to_owned(), frame.index());
            return Err(TrackingError::MissingPlane { tracker, needed: "colour", index });
        }
        let localizer = self.localizer.localizer(frame, bbox)?;
        Ok(Box::new(SingleTarget::new(self.name, frame, bbox, localizer, &self.groups)?))
    }

    fn restore(&self, saved: &[u8]) -> Result<Box<dyn Tracker>> {
        Ok(Box::new(snapshot::read::<SingleTarget<P::Localizer>>(self.name, saved)?))
    }

    fn boxed_clone(&self) -> Box<dyn Recipe> {
        Box::new(self.clone())
    }
}
