//! Trajectories put right by hand.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test may panic")]

mod identity;
mod importing;
mod keeping;

use pursuit::media::OpenOptions;
use pursuit::revise::{Backward, EditKind, EditedSession, End, Frames, Input, Row, Trajectory};
use pursuit::{BBox, Recipe};

/// 300 frames, in which the target passes behind something once.
const SCENE: &str = "scene:occluding-bar?seed=3&duration=10&speed=60";

fn input() -> Input {
    Input::new(SCENE, OpenOptions::default())
}

/// MOSSE that says of every frame that it sees the target.
fn always() -> Box<dyn Recipe> {
    let parameters = "policy.model = 'always'".parse().unwrap();
    pursuit::recipe("mosse").unwrap().with(&parameters).unwrap()
}

fn truth(session: &EditedSession, frame: u64) -> BBox {
    session.info().truth_at(frame).bbox().unwrap()
}

/// Follows to the end from the true box in the first frame.
fn followed(recipe: Box<dyn Recipe>) -> (EditedSession, Trajectory) {
    let mut session = EditedSession::new(input(), recipe, None, Vec::new()).unwrap();
    let mut trajectory = Trajectory::default();
    let (_, mut row) = session.step().unwrap().unwrap();
    let bbox = truth(&session, 0);
    session.edit(EditKind::Add { target: 1, bbox }, &mut row).unwrap();
    trajectory.push(row);
    to_the_end(&mut session, &mut trajectory);
    (session, trajectory)
}

fn to_the_end(session: &mut EditedSession, trajectory: &mut Trajectory) {
    while let Some((_, row)) = session.step().unwrap() {
        trajectory.push(row);
    }
}

/// Puts target 1 onto its true box in this frame, and follows it backward from there.
fn correct(session: &mut EditedSession, trajectory: &mut Trajectory, at: u64) -> (u64, End) {
    let bbox = truth(session, at);
    let (frame, row) = session.edit_at(at, EditKind::Correct { target: 1, bbox, backward: true }).unwrap();
    trajectory.branch(at, "corrected", "mosse");
    trajectory.push(row);
    let backward = Backward::new(session.recipe(), 1, &frame, bbox).unwrap();
    backward.run(&mut Frames::new(input(), false), trajectory, session.edits()).unwrap()
}

/// The frames in which the target is to be seen, and whether its box is right there.
fn judged(session: &EditedSession, rows: impl Iterator<Item = Row>) -> Vec<(u64, bool)> {
    let overlap = |row: &Row| {
        let own = row.records[0].estimate.as_ref()?.bbox;
        Some((row.frame, own.iou(&session.info().truth_at(row.frame).bbox()?) > 0.5))
    };
    rows.filter_map(|row| overlap(&row)).collect()
}

fn rows(trajectory: &Trajectory) -> impl Iterator<Item = Row> {
    trajectory.current("mosse").rows.iter().map(|row| (**row).clone()).collect::<Vec<_>>().into_iter()
}

#[test]
fn right_frames_stay_where_tracks_never_meet() {
    let (mut session, mut trajectory) = followed(always());
    let before = judged(&session, rows(&trajectory));
    let wrong: Vec<u64> = before.iter().filter(|(_, right)| !right).map(|(frame, _)| *frame).collect();
    assert!(wrong.len() > 30, "{wrong:?}");
    let (first, _) = correct(&mut session, &mut trajectory, wrong[wrong.len() / 2]);
    let after = judged(&session, rows(&trajectory));
    let spoiled = before.iter().zip(&after).filter(|(a, b)| a.0 < wrong[0] && a.1 && !b.1).count();
    assert!(spoiled <= 3, "{spoiled} spoiled from frame {first} on");
    let still_wrong = after.iter().filter(|(_, right)| !right).count();
    assert!(still_wrong < wrong.iter().filter(|frame| **frame < trajectory.len() as u64).count());
}

#[test]
fn going_back_gives_the_same_rows() {
    let (mut session, trajectory) = followed(pursuit::recipe("mosse").unwrap());
    let boxes = |rows: &mut dyn Iterator<Item = Row>| {
        rows.map(|row| (row.frame, row.records[0].estimate.as_ref().map(|e| e.bbox.ltwh()))).collect::<Vec<_>>()
    };
    // The same box again, in a frame behind two snapshots: what comes before it is followed as it was.
    let mut again = Trajectory::default();
    let bbox = truth(&session, 90);
    let (frame, row) = session.edit_at(90, EditKind::Correct { target: 1, bbox, backward: false }).unwrap();
    assert_eq!((frame.index(), row.records[0].estimate.as_ref().unwrap().bbox), (90, bbox));
    again.push(row);
    to_the_end(&mut session, &mut again);
    let first = boxes(&mut rows(&again));
    // Without the snapshots, from the first frame.
    let edits = session.edits().to_vec();
    session.restart(pursuit::recipe("mosse").unwrap(), edits).unwrap();
    let mut whole = Trajectory::default();
    to_the_end(&mut session, &mut whole);
    assert_eq!(boxes(&mut rows(&whole))[90..], first[..]);
    assert_eq!(boxes(&mut rows(&whole))[..90], boxes(&mut rows(&trajectory))[..90]);
}

#[test]
fn refused_edits_change_nothing() {
    let (mut session, _) = followed(pursuit::recipe("mosse").unwrap());
    let (before, at) = (session.edits().len(), 20);
    let unknown = EditKind::Correct { target: 7, bbox: truth(&session, at), backward: false };
    assert!(session.edit_at(at, unknown).is_err());
    assert_eq!((session.edits().len(), session.targets()), (before, vec![1]));
}
