//! Evaluation: sequences with truth, protocols that run trackers over them, metrics, and the report.
//!
//! [`evaluate`] is what `pursuit eval` calls. Running and scoring are apart: a run leaves
//! `boxes/TRACKER/SEQUENCE.csv` with a record beside it, and a later call runs only what is missing. A tracker is
//! anything that has a [`Recipe`](pursuit_tracking::Recipe); this crate knows none by name. A [`Survey`] says of an evaluation which
//! kinds of trackers are how good.

pub mod boxes;
mod clock;
mod columns;
mod comparison;
mod crowd;
mod curves;
mod datasets;
mod error;
mod evaluate;
mod frame_cache;
mod given;
pub mod metrics;
mod options;
mod protocol;
mod report;
mod result_files;
pub mod results;
mod run;
mod score;
mod sequence;
mod store;
mod summary;
mod survey;
mod table;
mod trajectory;

pub use comparison::{Comparison, Judgement};
pub use crowd::{
    CrowdComparison, CrowdFigures, CrowdOptions, CrowdResults, CrowdRules, CrowdSequence, CrowdTracker, evaluate_crowds,
};
pub use datasets::Dataset;
pub use error::EvaluationError;
pub use evaluate::{Progress, evaluate};
pub use given::Given;
pub use options::{Entry, EvalOptions};
pub use protocol::{Pass, Protocol, spatial_variants, temporal_starts};
pub use pursuit_geometry::Truth;
pub use results::Results;
pub use run::{RunRecord, UpdateTime};
pub use sequence::{Footage, Sequence};
pub use survey::{Family, FamilyLine, Survey, SurveyLine};
pub use table::{aligned, text_table};
pub use trajectory::{Output, Trajectory};

/// The result of a fallible evaluation step.
pub type Result<T, E = EvaluationError> = std::result::Result<T, E>;
