//! What a registry holds: trackers and detectors by name. The lists themselves stand where the algorithms are.

use crate::motion::MotionParams;
use crate::{Detector, Figure, Needs, Recipe, Result, TrackingError};
use pursuit_parameters::{Parameter, Parameters};
use std::fmt;

/// A tracker in a registry.
#[derive(Clone, Copy)]
pub struct TrackerEntry {
    /// Its name.
    pub name: &'static str,
    /// One line on what it does and when to use it.
    pub summary: &'static str,
    /// The page under `docs/papers/` with its source, without `.md`.
    pub paper: &'static str,
    recipe: fn(&'static str) -> Box<dyn Recipe>,
}

impl fmt::Debug for TrackerEntry {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("TrackerEntry").field("name", &self.name).finish_non_exhaustive()
    }
}

impl TrackerEntry {
    /// An entry; `recipe` makes its recipe, with default parameters, under the name it is given. A preset is an entry whose
    /// recipe has other defaults.
    pub const fn new(
        name: &'static str,
        summary: &'static str,
        paper: &'static str,
        recipe: fn(&'static str) -> Box<dyn Recipe>,
    ) -> Self {
        Self { name, summary, paper, recipe }
    }

    /// Its recipe with default parameters.
    pub fn default_recipe(&self) -> Box<dyn Recipe> {
        (self.recipe)(self.name)
    }

    /// Its recipe: defaults, with the values of `parameters` in their place.
    ///
    /// # Errors
    /// [`TrackingError::Parameter`] for an unknown name or a bad value.
    pub fn recipe(&self, parameters: &toml::Table) -> Result<Box<dyn Recipe>> {
        self.default_recipe().with(parameters)
    }
}

/// A detector in a registry.
#[derive(Debug, Clone, Copy)]
pub struct DetectorEntry {
    /// Its name.
    pub name: &'static str,
    /// One line on what it finds.
    pub summary: &'static str,
    /// The tracker to use for what it finds unless the user names one.
    pub default_tracker: &'static str,
    /// What it cannot do without.
    pub needs: Needs,
    motion: fn() -> MotionParams,
    schema: fn() -> Vec<Parameter>,
    figures: &'static [&'static [Figure]],
    renamed: fn(&str) -> Option<Vec<String>>,
    parameters: fn(&'static str, &toml::Table) -> Result<toml::Table>,
    detector: fn(&'static str, &toml::Table) -> Result<Box<dyn Detector>>,
}

/// What an implementer writes to have a detector: parameters that make it.
pub trait DetectorRecipe: Parameters + Default {
    /// What it cannot do without.
    const NEEDS: Needs = Needs { color: false, file: false };

    /// The figures it reports of a frame, in groups that are reported together.
    const FIGURES: &'static [&'static [Figure]] = &[];

    /// The detector with these parameters.
    ///
    /// # Errors
    /// When the parameters do not fit each other.
    fn detector(&self) -> Result<Box<dyn Detector>>;
}

impl DetectorEntry {
    /// The entry of the detector whose parameters are `P`; `motion` says how what it finds moves.
    pub const fn of<P: DetectorRecipe>(
        name: &'static str,
        summary: &'static str,
        default_tracker: &'static str,
        motion: fn() -> MotionParams,
    ) -> Self {
        Self {
            name,
            summary,
            default_tracker,
            needs: P::NEEDS,
            motion,
            schema: || P::default().schema(),
            figures: P::FIGURES,
            renamed: |path| P::default().renamed(path),
            parameters: |name, table| Ok(P::default().with(name, table)?.to_table(name)?),
            detector: |name, table| P::default().with(name, table)?.detector(),
        }
    }

    /// How what it finds moves, and how exactly it finds it: the defaults where many targets are followed.
    pub fn motion(&self) -> MotionParams {
        (self.motion)()
    }

    /// Every parameter with its default.
    pub fn schema(&self) -> Vec<Parameter> {
        (self.schema)()
    }

    /// Every figure that it may add to those of the targets.
    pub fn figures(&self) -> impl Iterator<Item = &'static Figure> {
        self.figures.iter().copied().flatten()
    }

    /// The paths of today for a parameter that a former version knew; none where it is no former one.
    pub fn renamed(&self, path: &str) -> Option<Vec<String>> {
        (self.renamed)(path)
    }

    /// Every parameter with its value: defaults, with the values of `parameters` in their place.
    ///
    /// # Errors
    /// [`TrackingError::Parameter`] for an unknown name or a bad value.
    pub fn parameters(&self, parameters: &toml::Table) -> Result<toml::Table> {
        (self.parameters)(self.name, parameters)
    }

    /// The detector: defaults, with the values of `parameters` in their place.
    ///
    /// # Errors
    /// [`TrackingError::Parameter`] for an unknown name or a bad value.
    pub fn detector(&self, parameters: &toml::Table) -> Result<Box<dyn Detector>> {
        (self.detector)(self.name, parameters)
    }
}

/// The error about a `kind` of which none is called `name`.
pub fn unknown(kind: &'static str, name: &str, available: impl Iterator<Item = &'static str>) -> TrackingError {
    let available = available.collect::<Vec<_>>().join(", ");
    TrackingError::UnknownName { kind, name: name.to_owned(), available }
}
