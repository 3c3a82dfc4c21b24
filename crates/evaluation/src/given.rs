//! Trajectories that were made before, to be scored beside what is run.

use crate::run::Passes;
use crate::{EvaluationError, Footage, Protocol, Result, RunRecord, Sequence, Trajectory};
use std::path::{Path, PathBuf};

/// Trajectories of one tracker: `trajectory.csv` of `pursuit track`, or `boxes/TRACKER/SEQUENCE.csv` of an evaluation.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Given {
    /// The name they have in the results.
    pub name: String,
    /// The file, where there is one sequence, or a folder with `SEQUENCE.csv` or `SEQUENCE/trajectory.csv`.
    pub path: PathBuf,
}

impl Given {
    /// What it says of a sequence, as one pass from the first annotated frame on.
    pub(crate) fn passes(&self, sequence: &Sequence, alone: bool, protocol: Protocol, build: &str) -> Result<Passes> {
        let path = self.file(sequence, alone)?;
        let fail = |reason: String| EvaluationError::dataset(&path, None, reason);
        let first = match sequence.footage() {
            Footage::Input { first, .. } => *first,
            Footage::Memory(_) => 0,
        };
        let trajectory = Trajectory::read_counted_from(&path, first).map_err(|e| match e {
            EvaluationError::Output { reason, .. } => fail(reason),
            other => other,
        })?;
        let (frames, name) = (sequence.truth().len(), sequence.name());
        if trajectory.frames() != frames {
            let last = trajectory.frames();
            let problem =
                format!("ends after {last} frames of {name}, which has {frames}; give one of the whole sequence");
            return Err(fail(problem));
        }
        let record = RunRecord {
            tracker: self.name.clone(),
            parameters: self.parameters(),
            build: build.to_owned(),
            protocol,
            frames,
            starts: sequence.first_visible().map(|(start, _)| start).into_iter().collect(),
            failures: Vec::new(),
            init_ms: 0.0,
            update: None,
            error: None,
        };
        Ok(vec![(trajectory, record)])
    }

    /// What stands in the results in the place of a tracker's parameters.
    pub(crate) fn parameters(&self) -> serde_json::Value {
        serde_json::json!({ "results": self.path.display().to_string() })
    }

    fn file(&self, sequence: &Sequence, alone: bool) -> Result<PathBuf> {
        if self.path.is_file() && !alone {
            let problem = "is one file for several sequences; give a folder with SEQUENCE.csv, or choose one sequence";
            return Err(EvaluationError::dataset(&self.path, None, problem));
        }
        let name = Path::new(sequence.name());
        let mut places = vec![self.path.join(name).with_extension("csv"), self.path.join(name).join("trajectory.csv")];
        if alone {
            places.extend([self.path.join("trajectory.csv"), self.path.clone()]);
        }
        let found = places.iter().find(|p| p.is_file()).cloned();
        let places = || places.iter().map(|p| p.display().to_string()).collect::<Vec<_>>().join(", ");
        found.ok_or_else(|| {
            EvaluationError::dataset(
                &self.path,
                None,
                format!("has no trajectory of {name:?}; looked for {}", places()),
            )
        })
    }
}
