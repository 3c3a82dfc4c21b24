//! How a run is measured, as a file, a command line or Python says it.

use crate::RunError;
use crate::config::options::options;
use pursuit_geometry::BBox;
use pursuit_measuring::{Method, Unit};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use std::str::FromStr;

/// Which point of a target's box is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Point {
    /// Its middle.
    #[default]
    Center,
    /// The middle of its lower edge: where somebody stands, on a plane.
    Bottom,
    /// The middle of its upper edge.
    Top,
}

impl Point {
    /// The point of a box, in pixels.
    pub fn of(self, bbox: &BBox) -> [f64; 2] {
        let center = bbox.center();
        match self {
            Self::Center => [center.x, center.y],
            Self::Bottom => [center.x, bbox.top() + bbox.height()],
            Self::Top => [center.x, bbox.top()],
        }
    }
}

impl FromStr for Point {
    type Err = RunError;

    fn from_str(text: &str) -> Result<Self, RunError> {
        match text {
            "center" => Ok(Self::Center),
            "bottom" => Ok(Self::Bottom),
            "top" => Ok(Self::Top),
            _ => Err(RunError::usage(format!("`{text}` is no point of a box; use center, bottom or top"))),
        }
    }
}

options! {
    /// How a run is measured.
    pub struct MeasureOptions {
        /// The calibration; without one `calibration.toml` in the run's folder or beside its input.
        pub calibration: Option<PathBuf>,
        /// How velocity and acceleration are made of places: `smoother`, `savitzky-golay` or `differences`.
        pub method: Option<Method>,
        /// How many frames a cubic of `savitzky-golay` is fitted to, odd.
        pub window: Option<usize>,
        /// Whether jumps of the velocity are looked for, at which the smoother begins anew.
        pub bounces: Option<bool>,
        /// Which point of the box is measured: `center`, `bottom` (of who walks on a plane) or `top`.
        pub point: Option<Point>,
        /// Whether frames count in which the target was in sight, but not for certain.
        pub unsure: Option<bool>,
        /// The unit of the results: km, m, cm, mm, um, in, ft or px.
        pub unit: Option<Unit>,
        /// What is fitted: `line`, `parabola`, `sine`, with an axis (`sine:x`) and a span in seconds (`parabola@0.2-0.9`).
        pub fits: Vec<String>,
        /// Lines whose crossings are events, `[NAME=]X1,Y1,X2,Y2` in the unit of the results.
        pub lines: Vec<String>,
        /// Zones whose entries are events, `[NAME=]X1,Y1,X2,Y2,X3,Y3,…` in the unit of the results.
        pub zones: Vec<String>,
        /// Pairs of targets between which distance and direction are measured, `A,B`.
        pub between: Vec<String>,
        /// Further files, by their names: `jsonl`, `parquet`, `xlsx`.
        pub formats: Vec<String>,
        /// Whether plots are drawn; they are unless this says otherwise.
        pub plots: Option<bool>,
    }
}

impl MeasureOptions {
    /// Refuses what could not be used after a run on `input`: before it is begun.
    ///
    /// # Errors
    /// Lines, zones, fits or pairs that cannot be read, and a calibration that cannot.
    pub(crate) fn check(&self, input: Option<&std::path::Path>) -> Result<(), RunError> {
        super::Questions::read(self)?;
        let beside =
            input.and_then(|input| Some(input.parent()?.join(super::CALIBRATION))).filter(|path| path.is_file());
        match self.calibration.clone().or(beside) {
            Some(path) => super::calibration::read_calibration(&path).map(drop),
            None => Ok(()),
        }
    }
}
