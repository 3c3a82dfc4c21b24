//! Every tracker and detector by name: the one list that the command line, the conformance suite, the benches and the
//! documentation read. Adding a tracker is one line in [`trackers`].

use crate::parameters::Parameters;
use crate::{Detector, DetectorRecipe, Recipe, Result, TrackerRecipe, TrackingError};

/// A tracker in the registry.
#[derive(Debug, Clone, Copy)]
pub struct TrackerEntry {
    /// Its name.
    pub name: &'static str,
    /// One line on what it does and when to use it.
    pub summary: &'static str,
    /// The page under `docs/papers/` with its source, without `.md`.
    pub paper: &'static str,
    /// Whether it can only work on colour frames.
    pub needs_color: bool,
    parameter_names: fn() -> Vec<&'static str>,
    template: fn() -> Result<String>,
    recipe: fn(toml::Table) -> Result<Box<dyn Recipe>>,
}

impl TrackerEntry {
    /// The entry of the tracker whose parameters are `P`.
    pub const fn of<P: TrackerRecipe>() -> Self {
        Self {
            name: P::OWNER,
            summary: P::SUMMARY,
            paper: P::PAPER,
            needs_color: P::NEEDS_COLOR,
            parameter_names: names::<P>,
            template: P::template,
            recipe: |table| Ok(Box::new(P::from_table(table)?)),
        }
    }

    /// The names of its parameters.
    pub fn parameter_names(&self) -> Vec<&'static str> {
        (self.parameter_names)()
    }

    /// Its parameters with their defaults as commented TOML.
    ///
    /// # Errors
    /// When a default cannot be written as TOML.
    pub fn template(&self) -> Result<String> {
        (self.template)()
    }

    /// Its recipe: defaults, with the values of `parameters` in their place.
    ///
    /// # Errors
    /// [`TrackingError::Parameter`] for an unknown name or a bad value.
    pub fn recipe(&self, parameters: toml::Table) -> Result<Box<dyn Recipe>> {
        (self.recipe)(parameters)
    }
}

/// A detector in the registry.
#[derive(Debug, Clone, Copy)]
pub struct DetectorEntry {
    /// Its name.
    pub name: &'static str,
    /// One line on what it finds.
    pub summary: &'static str,
    /// The tracker to use for what it finds unless the user names one.
    pub default_tracker: &'static str,
    parameter_names: fn() -> Vec<&'static str>,
    template: fn() -> Result<String>,
    detector: fn(toml::Table) -> Result<Box<dyn Detector>>,
}

impl DetectorEntry {
    /// The entry of the detector whose parameters are `P`.
    pub const fn of<P: DetectorRecipe>() -> Self {
        Self {
            name: P::OWNER,
            summary: P::SUMMARY,
            default_tracker: P::DEFAULT_TRACKER,
            parameter_names: names::<P>,
            template: P::template,
            detector: |table| P::from_table(table)?.detector(),
        }
    }

    /// The names of its parameters.
    pub fn parameter_names(&self) -> Vec<&'static str> {
        (self.parameter_names)()
    }

    /// Its parameters with their defaults as commented TOML.
    ///
    /// # Errors
    /// When a default cannot be written as TOML.
    pub fn template(&self) -> Result<String> {
        (self.template)()
    }

    /// The detector: defaults, with the values of `parameters` in their place.
    ///
    /// # Errors
    /// [`TrackingError::Parameter`] for an unknown name or a bad value.
    pub fn detector(&self, parameters: toml::Table) -> Result<Box<dyn Detector>> {
        (self.detector)(parameters)
    }
}

/// The tracker used where none is named.
pub const DEFAULT_TRACKER: &str = "pursuit";

/// Every tracker.
pub const fn trackers() -> &'static [TrackerEntry] {
    const TRACKERS: &[TrackerEntry] = &[
        TrackerEntry::of::<crate::pursuit::PursuitParams>(),
        TrackerEntry::of::<crate::ball::BallParams>(),
        TrackerEntry::of::<crate::regularised::BacfParams>(),
        TrackerEntry::of::<crate::regularised::StrcfParams>(),
        TrackerEntry::of::<crate::kcf::KcfParams>(),
        TrackerEntry::of::<crate::kcf::KcfFixedParams>(),
        TrackerEntry::of::<crate::kcf::CskParams>(),
        TrackerEntry::of::<crate::mosse::MosseParams>(),
        TrackerEntry::of::<crate::staple::StapleParams>(),
        TrackerEntry::of::<crate::dsst::DsstParams>(),
        TrackerEntry::of::<crate::dsst::FdsstParams>(),
    ];
    TRACKERS
}

/// Every detector.
pub const fn detectors() -> &'static [DetectorEntry] {
    const DETECTORS: &[DetectorEntry] = &[DetectorEntry::of::<crate::ball::BallDetectorParams>()];
    DETECTORS
}

/// The tracker called `name`.
///
/// # Errors
/// [`TrackingError::UnknownName`] with the names there are.
pub fn tracker(name: &str) -> Result<&'static TrackerEntry> {
    let available = || trackers().iter().map(|e| e.name).collect::<Vec<_>>().join(", ");
    trackers().iter().find(|e| e.name == name).ok_or_else(|| unknown("tracker", name, available()))
}

/// The detector called `name`.
///
/// # Errors
/// [`TrackingError::UnknownName`] with the names there are.
pub fn detector(name: &str) -> Result<&'static DetectorEntry> {
    let available = || detectors().iter().map(|e| e.name).collect::<Vec<_>>().join(", ");
    detectors().iter().find(|e| e.name == name).ok_or_else(|| unknown("detector", name, available()))
}

fn unknown(kind: &'static str, name: &str, available: String) -> TrackingError {
    TrackingError::UnknownName { kind, name: name.to_owned(), available }
}

fn names<P: Parameters>() -> Vec<&'static str> {
    P::documentation().iter().map(|(name, _)| *name).collect()
}
