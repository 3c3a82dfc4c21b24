//! Measuring in the page: a calibration that is clicked together, and what it makes of the trajectory that is there.

mod bench;
mod report;

pub(crate) use bench::{Bench, Place, Setting};

use crate::error::Refusal;
use crate::trial::Told;
use pursuit::measure::{Measurement, RecordedRun, measure_recorded};
use pursuit::measuring::Ruler;
use serde::Deserialize;
use serde_json::{Value, json};

/// What is known of a ruler that was set, before anything is measured with it.
pub(crate) fn ruler(setting: &Setting) -> Value {
    // The size of the target shows in a run only.
    if setting.calibration.target.is_some() {
        return json!({ "problem": setting.check().err().map(|e| e.message), "ruler": null });
    }
    match setting.check().and_then(|()| Ruler::new(&setting.calibration, &[]).map_err(unfit)) {
        Ok(ruler) => json!({ "problem": null, "ruler": ruler.facts() }),
        Err(refusal) => json!({ "problem": refusal.message, "ruler": null }),
    }
}

/// Measures a version of a trajectory.
pub(crate) fn measure(told: &Told, setting: &Setting) -> Result<Measurement, Refusal> {
    setting.check()?;
    let size = told.info.input_size();
    let records = told.version.rows.iter().flat_map(|row| &row.records);
    let run = RecordedRun::of(records, [size.width, size.height], &setting.options);
    Ok(measure_recorded(&run, setting.calibration.clone(), &setting.options)?)
}

/// What was measured as the page draws it; where nothing can be, why.
pub(crate) fn results(told: &Told, setting: &Setting) -> Value {
    let found = if told.version.rows.iter().all(|row| row.records.is_empty()) {
        Err(Refusal::unfit("nothing was followed yet; drag a box around the target and press Start"))
    } else {
        measure(told, setting)
    };
    match found {
        Ok(found) => report::results(told.version.number, &found),
        Err(refusal) => json!({ "version": told.version.number, "problem": refusal.message }),
    }
}

/// A file that is made of what was measured.
#[derive(Debug, Clone, Copy, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum File {
    #[default]
    Csv,
    Events,
    Json,
    Xlsx,
}

impl File {
    /// Its name and media type.
    pub const fn facts(self) -> (&'static str, &'static str) {
        match self {
            Self::Csv => ("measure.csv", "text/csv; charset=utf-8"),
            Self::Events => ("measure-events.csv", "text/csv; charset=utf-8"),
            Self::Json => ("measure.json", "application/json"),
            Self::Xlsx => ("measure.xlsx", "application/vnd.openxmlformats-officedocument.spreadsheetml.sheet"),
        }
    }

    /// What it holds.
    pub fn write(self, found: &Measurement) -> Result<Vec<u8>, Refusal> {
        match self {
            Self::Csv => Ok(found.csv()),
            Self::Events => Ok(found.events_csv()),
            Self::Json => serde_json::to_vec_pretty(&found.facts).map_err(|e| Refusal::unfit(e.to_string())),
            #[cfg(feature = "xlsx")]
            Self::Xlsx => Ok(found.xlsx()?),
            #[cfg(not(feature = "xlsx"))]
            Self::Xlsx => Err(Refusal::unfit(
                "this build cannot write spreadsheets; build with `--features xlsx`, or take the CSV",
            )),
        }
    }
}

fn unfit(error: impl std::fmt::Display) -> Refusal {
    Refusal::unfit(error.to_string())
}
