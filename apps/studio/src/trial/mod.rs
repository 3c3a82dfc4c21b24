//! A trial: one input, one method, what the user did, and the trajectories that came of it.

mod backward;
mod edit;
mod engine;
mod follower;
mod handle;
mod input;
mod job;
mod looks;
mod pictures;
mod proposer;
mod report;
mod row;
mod screen;
mod snapshots;
mod trajectory;

pub(crate) use handle::{Order, Setup, Told, Trial};
pub(crate) use job::{Job, read_only};
pub(crate) use looks::Look;
pub(crate) use proposer::Seeking;
pub(crate) use report::brief;
pub(crate) use row::Row;
pub(crate) use screen::{Packet, Wish};

/// Targets that one trial follows at most.
const MOST_TARGETS: usize = 16;
/// What the user does in one trial at most.
const MOST_EDITS: usize = 10_000;
