//! Trajectories put right by hand: what a user did in which frame, following again with it, following backward from a
//! corrected box, and the versions before each correction.
//!
//! A trajectory is a function of the recipe and of the edits. An [`EditedSession`] follows with them, and goes back to an
//! earlier frame by a snapshot; a [`Trajectory`] holds what came of it, with its earlier versions; [`Backward`] shows the
//! frames before a corrected one to a tracker, the latest first. A [`RunWriter`] keeps all of it in the folder of a run;
//! an [`Imported`] comes from files of other programs.
//!
//! ```
//! use pursuit::revise::{Backward, EditKind, EditedSession, Frames, Input, Trajectory};
//!
//! let input = Input::new("scene:occluding-bar?seed=3&duration=2", Default::default());
//! let mut session = EditedSession::new(input.clone(), pursuit::recipe("mosse")?, None, Vec::new())?;
//! let mut trajectory = Trajectory::default();
//! let truth = |session: &EditedSession, frame| session.info().truth_at(frame).bbox().expect("the target is in the picture");
//!
//! // The first frame, and in it a target of number 1.
//! let (_, mut row) = session.step()?.expect("the scene has frames");
//! let bbox = truth(&session, 0);
//! session.edit(EditKind::Add { target: 1, bbox }, &mut row)?;
//! trajectory.push(row);
//! while let Some((_, row)) = session.step()? {
//!     trajectory.push(row);
//! }
//!
//! // A better box in frame 40; from there the target is followed backward to where both tracks meet.
//! let bbox = truth(&session, 40);
//! let (frame, row) = session.edit_at(40, EditKind::Correct { target: 1, bbox, backward: true })?;
//! trajectory.branch(40, "corrected", "mosse");
//! trajectory.push(row);
//! let mut frames = Frames::new(input, false);
//! let backward = Backward::new(session.recipe(), 1, &frame, bbox)?;
//! let (first_changed, _why) = backward.run(&mut frames, &mut trajectory, session.edits())?;
//! assert!(first_changed <= 40 && trajectory.last().is_some_and(|row| row.frame == 40));
//! // What was there before is kept.
//! assert_eq!(trajectory.versions()[0].rows.len(), 60);
//! # Ok::<(), pursuit::RunError>(())
//! ```

mod backward;
mod edit;
mod edits_file;
mod film;
mod frames;
mod identity;
mod import;
mod input;
mod label;
mod row;
mod run_writer;
mod session;
mod snapshots;
mod trajectory;

pub use backward::{Backward, End};
pub use edit::{Edit, EditKind};
pub use edits_file::{EDITS, Revised};
pub use film::film;
pub use frames::Frames;
pub use identity::Identity;
pub use import::{Imported, complete};
pub use input::Input;
pub use label::Label;
pub use row::{Row, Version};
pub use run_writer::RunWriter;
pub use session::{ChosenDetector, EditedSession};
pub use trajectory::Trajectory;
