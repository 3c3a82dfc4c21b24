//! Trajectories that were made before, to be scored beside what is run.

use crate::run::Passes;
use crate::{EvaluationError, Footage, Protocol, Result, RunRecord, Sequence, Trajectory, UpdateTime, result_files};
use std::path::{Path, PathBuf};

/// Trajectories of one tracker: `trajectory.csv` of `pursuit track`, `boxes/TRACKER/SEQUENCE.csv` of an evaluation, or the
/// result files of OTB's, GOT-10k's and VOT's toolkits.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Given {
    /// The name they have in the results.
    pub name: String,
    /// The file, where there is one sequence, or a folder with `SEQUENCE.csv`, `SEQUENCE/trajectory.csv`, `SEQUENCE.txt` or
    /// `SEQUENCE/SEQUENCE_001.txt`.
    pub path: PathBuf,
}

impl Given {
    /// What it says of a sequence: one pass, or as many as there are repetitions.
    pub(crate) fn passes(&self, sequence: &Sequence, alone: bool, protocol: Protocol, build: &str) -> Result<Passes> {
        if self.path.is_file() && !alone {
            let problem =
                "is one file for several sequences; give a folder with a file for each, or choose one sequence";
            return Err(EvaluationError::dataset(&self.path, None, problem));
        }
        let (name, frames) = (sequence.name(), sequence.truth().len());
        let record = |starts: Vec<usize>, failures: Vec<usize>, update: Option<UpdateTime>| RunRecord {
            tracker: self.name.clone(),
            parameters: self.parameters(),
            build: build.to_owned(),
            protocol,
            footage_bytes: None,
            start_box: None,
            frames,
            starts,
            failures,
            init_ms: 0.0,
            update,
            masks: Vec::new(),
            error: None,
        };
        let first = || sequence.first_visible().map(|(start, _)| start).into_iter().collect();
        let places = self.tables(name, alone);
        if let Some(table) = places.iter().find(|p| p.is_file()) {
            if protocol == Protocol::Reset {
                let problem = "is of one pass; the protocol `reset` scores the files of VOT's supervised experiment";
                return Err(EvaluationError::dataset(table, None, problem));
            }
            return Ok(vec![(read_table(table, sequence)?, record(first(), Vec::new(), None))]);
        }
        let files = result_files::find(&self.path, name, alone);
        if files.is_empty() {
            let looked: Vec<String> = places.iter().map(|p| p.display().to_string()).collect();
            let below = self.path.join(name);
            let problem = format!(
                "has no trajectory of {name:?}; looked for {}, {below}.txt and {below}/{}_001.txt",
                looked.join(", "),
                name.rsplit('/').next().unwrap_or(name),
                below = below.display()
            );
            return Err(EvaluationError::dataset(&self.path, None, problem));
        }
        let pass = |file: &PathBuf| {
            let said = result_files::read(file, sequence, protocol)?;
            let starts = if protocol == Protocol::Reset { said.starts } else { first() };
            Ok((said.trajectory, record(starts, said.failures, said.update)))
        };
        files.iter().map(pass).collect()
    }

    /// What stands in the results in the place of a tracker's parameters.
    pub(crate) fn parameters(&self) -> serde_json::Value {
        serde_json::json!({ "results": self.path.display().to_string() })
    }

    /// Where a table of the sequence may lie.
    fn tables(&self, sequence: &str, alone: bool) -> Vec<PathBuf> {
        let mut places =
            vec![self.path.join(format!("{sequence}.csv")), self.path.join(sequence).join("trajectory.csv")];
        if alone {
            places.push(self.path.join("trajectory.csv"));
            places.extend(self.path.extension().is_none_or(|e| e != "txt").then(|| self.path.clone()));
        }
        places
    }
}

/// A table of the whole sequence.
fn read_table(path: &Path, sequence: &Sequence) -> Result<Trajectory> {
    let fail = |reason: String| EvaluationError::dataset(path, None, reason);
    let first = match sequence.footage() {
        Footage::Input { first, .. } => *first,
        Footage::Memory(_) => 0,
    };
    let trajectory = Trajectory::read_counted_from(path, first).map_err(|e| match e {
        EvaluationError::Output { reason, .. } => fail(reason),
        other => other,
    })?;
    let (last, frames, name) = (trajectory.frames(), sequence.truth().len(), sequence.name());
    if last != frames {
        return Err(fail(format!(
            "ends after {last} frames of {name}, which has {frames}; give one of the whole sequence"
        )));
    }
    Ok(trajectory)
}
