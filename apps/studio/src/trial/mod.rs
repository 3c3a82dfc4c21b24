//! A trial: one input, one method, what the user did, and the trajectories that came of it.

mod engine;
mod handle;
mod job;
mod looks;
mod phase;
mod proposer;
mod report;
mod run_up;
mod screen;

pub(crate) use engine::Place;
pub(crate) use handle::{Order, Setup, Told, Trial};
pub(crate) use job::{Job, read_only};
pub(crate) use looks::Look;
pub(crate) use proposer::seeking;
pub(crate) use report::brief;
pub(crate) use screen::{Packet, Wish};

/// Targets that one trial follows at most.
const MOST_TARGETS: usize = 16;
/// What the user does in one trial at most.
const MOST_EDITS: usize = 10_000;
