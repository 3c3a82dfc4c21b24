//! What a trial is measured with, and where its calibration is kept.

use super::unfit;
use crate::error::Refusal;
use crate::root::Root;
use pursuit::measure::{CALIBRATION, MeasureOptions, read_calibration, write_calibration};
use pursuit::measuring::Calibration;
use pursuit::media::Locator;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// A calibration and what is asked of a run, as the page sets both.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct Setting {
    pub calibration: Calibration,
    pub options: MeasureOptions,
}

impl Setting {
    /// Refuses what would name files, and what cannot be meant.
    pub fn check(&self) -> Result<(), Refusal> {
        let options = &self.options;
        if options.calibration.is_some() || !options.formats.is_empty() || options.plots.is_some() {
            return Err(Refusal::unfit(
                "`calibration`, `formats` and `plots` name files, which the page does elsewhere; leave them out",
            ));
        }
        self.calibration.check().map_err(unfit)
    }
}

/// Where a calibration may be kept: beside a clip, or in the folder of a run.
#[derive(Debug, Clone)]
pub(crate) struct Place {
    folder: PathBuf,
    /// As the page names it.
    pub name: String,
}

impl Place {
    /// Beside the input of a trial, where that is a file or a folder that the page may name, or the input of the command line.
    pub fn beside(root: &Root, locator: &Locator, given: bool) -> Option<Self> {
        let path = locator.path();
        if locator.scheme().is_some() || !path.exists() {
            return None;
        }
        let folder = path.canonicalize().ok()?.parent()?.to_path_buf();
        Self::of(root, folder, given)
    }

    /// The folder of a run.
    pub fn of_run(root: &Root, folder: &Path) -> Option<Self> {
        Self::of(root, folder.to_path_buf(), false)
    }

    fn of(root: &Root, folder: PathBuf, given: bool) -> Option<Self> {
        match root.shown(&folder) {
            Ok(shown) => Some(Self { name: Path::new(&shown).join(CALIBRATION).display().to_string(), folder }),
            Err(_) if given => Some(Self { name: folder.join(CALIBRATION).display().to_string(), folder }),
            Err(_) => None,
        }
    }

    fn path(&self) -> PathBuf {
        self.folder.join(CALIBRATION)
    }

    /// Whether a calibration lies there that is a file and no link: what a link leads to is not told and not replaced.
    fn is_there(&self) -> bool {
        std::fs::symlink_metadata(self.path()).is_ok_and(|m| m.is_file())
    }
}

/// What a trial is measured with.
#[derive(Debug, Clone, Default)]
pub(crate) struct Bench {
    pub setting: Setting,
    /// Where its calibration was read, as the page names it.
    pub from: Option<String>,
    /// Where it would be kept.
    pub place: Option<Place>,
    /// What is wrong with the calibration that lies there.
    pub warning: Option<String>,
}

impl Bench {
    /// With the calibration of the first of these places that has one; it would be kept at the last, beside the input.
    pub fn at(places: Vec<Place>) -> Self {
        let place = places.last().cloned();
        match places.iter().find(|place| place.is_there()).map(|place| (place, read_calibration(&place.path()))) {
            Some((at, Ok(calibration))) => {
                let setting = Setting { calibration, ..Setting::default() };
                Self { setting, from: Some(at.name.clone()), place, warning: None }
            }
            // Paths of this machine are nobody's business.
            Some((at, Err(error))) => {
                let why = error.to_string().replace(&at.path().display().to_string(), &at.name);
                Self { warning: Some(why), place, ..Self::default() }
            }
            None => Self { place, ..Self::default() },
        }
    }

    /// Writes the calibration beside the input; one that is there is replaced only where `overwrite` says so.
    pub fn keep(&mut self, overwrite: bool) -> Result<(), Refusal> {
        self.setting.check()?;
        let Some(place) = &self.place else {
            return Err(Refusal::unfit(
                "this source has no folder that a calibration could be kept in; download the calibration",
            ));
        };
        let path = place.path();
        let there = std::fs::symlink_metadata(&path);
        if there.as_ref().is_ok_and(|m| !m.is_file()) {
            return Err(Refusal::conflict(format!("{} is a link or a folder and is left as it is", place.name)));
        }
        if there.is_ok() && !overwrite {
            return Err(Refusal::conflict(format!(
                "there is a calibration already, {}; say that it is to be replaced",
                place.name
            )));
        }
        write_calibration(&self.setting.calibration, &path, overwrite)
            .map_err(|error| Refusal::conflict(error.to_string().replace(&path.display().to_string(), &place.name)))?;
        (self.from, self.warning) = (Some(place.name.clone()), None);
        Ok(())
    }
}
