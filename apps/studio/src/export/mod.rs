//! Trajectories as files.

mod coco;
mod cvat;
mod table;

use crate::trial::Told;
use pursuit::Record;
use pursuit::sinks::{mot_lines, trajectory_csv};
use serde::Deserialize;

/// How a trajectory is written down.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Format {
    /// As `pursuit track` writes it.
    #[default]
    Csv,
    /// The paper's text table: actual and predicted positions.
    Table,
    /// MOTChallenge.
    Mot,
    /// COCO's object detection, with the target's number as `track_id`.
    Coco,
    /// CVAT for video 1.1.
    Cvat,
}

impl Format {
    pub fn write(self, told: &Told) -> Vec<u8> {
        let records = || told.version.rows.iter().flat_map(|row| row.records.iter());
        match self {
            Self::Csv => trajectory_csv(records()),
            Self::Table => table::write(told).into_bytes(),
            Self::Mot => mot_lines(records()),
            Self::Coco => coco::write(told).into_bytes(),
            Self::Cvat => cvat::write(told).into_bytes(),
        }
    }

    pub const fn file_name(self) -> &'static str {
        match self {
            Self::Csv => "trajectory.csv",
            Self::Table => "targets.txt",
            Self::Mot => "trajectory.txt",
            Self::Coco => "annotations.json",
            Self::Cvat => "annotations.xml",
        }
    }

    pub const fn media_type(self) -> &'static str {
        match self {
            Self::Csv => "text/csv; charset=utf-8",
            Self::Table | Self::Mot => "text/plain; charset=utf-8",
            Self::Coco => "application/json",
            Self::Cvat => "application/xml",
        }
    }
}

/// A target is annotated where it is believed to be in the picture: not while it is lost.
fn annotated(record: &Record) -> Option<&pursuit::Estimate> {
    record.estimate.as_ref().filter(|e| e.state != pursuit::TrackState::Lost)
}
