//! The one run loop: steps, commands, ends.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may panic")]

mod common;

use common::{Asked, Memory, Still, Taken, at, blank, book, camera};
use pursuit::imaging::{CameraPose, Lens};
use pursuit::sinks::{Moment, Sink};
use pursuit::tracking::many::AcquisitionParams;
use pursuit::tracking::{Detection, Detector, Followed, TargetId, TrackState, TrackingError};
use pursuit::{BBox, Command, Frame, Outcome, RunError, Session, open, recipe};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// A session over ten blank frames with targets that stay where they are put.
fn session() -> (Session, Asked, Taken) {
    let (targets, sink) = (Still::default(), Memory::default());
    let (asked, taken) = (targets.asked.clone(), sink.taken.clone());
    let session = Session::new(Box::new(book(10)), recipe("mosse").unwrap());
    (session.following(Box::new(targets)).with_sinks(vec![Box::new(sink)]), asked, taken)
}

fn step(session: &mut Session) -> Option<(u64, Vec<(u64, f64)>)> {
    let progress = session.step().unwrap()?;
    let left = |r: &pursuit::Record| (r.target.0, r.estimate.as_ref().map_or(-1.0, |e| e.bbox.left()));
    Some((progress.frame.index(), progress.records.iter().map(left).collect()))
}

fn add(bbox: BBox) -> Command {
    Command::Add { bbox, recipe: None }
}

/// Asks of every frame how its camera stood, and where targets 1 and 9 will be half a second later.
#[derive(Clone, Default)]
struct Asking(Arc<Mutex<Vec<[Option<f64>; 3]>>>);

impl Sink for Asking {
    fn write(&mut self, moment: &Moment<'_>) -> Result<(), RunError> {
        let ahead = |target| moment.forecast(TargetId(target), 0.5).map(|f| f.bbox.left());
        self.0.lock().unwrap().push([moment.frame.camera().map(|c| c.pan_rad()), ahead(1), ahead(9)]);
        Ok(())
    }

    fn finish(&mut self) -> Result<(), RunError> {
        Ok(())
    }
}

#[test]
fn sinks_see_the_pose_and_ask_for_forecasts() {
    let asking = Asking::default();
    let pose = |time_s| CameraPose::new(time_s, 0.1 + time_s, 0.0, Lens::field_of_view(1.0).unwrap()).ok();
    let session = Session::new(Box::new(book(2)), recipe("mosse").unwrap()).following(Box::new(Still::default()));
    let session = session.starting_on(vec![at(1.0)]).posed_by(Box::new(pose));
    let outcome = session.with_sinks(vec![Box::new(asking.clone())]).run(|_| {});
    assert!(outcome.failure.is_none());
    assert_eq!(asking.0.lock().unwrap()[..], [[Some(0.1), Some(6.0), None], [Some(0.14), Some(6.0), None]]);
}

#[test]
fn a_session_can_start_before_anything_is_written() {
    let (targets, sink) = (Still::default(), Memory::default());
    let (asked, taken) = (targets.asked.clone(), sink.taken.clone());
    let session = Session::new(Box::new(book(3)), recipe("mosse").unwrap());
    let mut session = session.following(Box::new(targets)).starting_on(vec![at(1.0)]);
    session.start().unwrap();
    session.start().unwrap();
    assert_eq!((session.frame().unwrap().index(), session.targets().ids()), (0, vec![TargetId(1)]));
    assert_eq!(asked.lock().unwrap()[..], ["step 0", "add 1 by mosse on 0"], "once is enough");
    let mut session = session.with_sinks(vec![Box::new(sink)]);
    let frames: Vec<u64> = std::iter::from_fn(|| step(&mut session)).map(|s| s.0).collect();
    assert_eq!(frames, [0, 1, 2]);
    assert_eq!(session.finish().frames, 3);
    let taken: Vec<Option<u64>> = taken.lock().unwrap().iter().map(|t| t.as_ref().map(|t| t.0)).collect();
    assert_eq!(taken, [Some(0), Some(1), Some(2), None]);

    // A box that cannot be used is known at once, and the session is over; an empty input is no error.
    let outside = BBox::from_ltwh(9000.0, 0.0, 5.0, 5.0);
    let mut session = Session::new(Box::new(book(3)), recipe("mosse").unwrap()).starting_on(vec![outside]);
    assert_eq!(session.start().unwrap_err().exit_code(), 2);
    assert!(session.step().unwrap().is_none());
    let mut session = Session::new(Box::new(book(0)), recipe("mosse").unwrap());
    session.start().unwrap();
    assert!(session.step().unwrap().is_none());

    // Going elsewhere forgets what was looked at and not yet handed on.
    let mut session = Session::new(Box::new(book(3)), recipe("mosse").unwrap());
    session.start().unwrap();
    session.apply(Command::Seek(2)).unwrap();
    assert_eq!(std::iter::from_fn(|| step(&mut session)).map(|s| s.0).collect::<Vec<_>>(), [2]);
}

#[test]
fn a_target_may_start_later() {
    let (session, asked, _) = session();
    let mut session = session.starting_at(2, vec![at(1.0)]).starting_on(vec![at(5.0)]);
    let seen: Vec<_> = std::iter::from_fn(|| step(&mut session)).map(|(_, targets)| targets.len()).collect();
    assert_eq!(seen, [1, 1, 2, 2, 2, 2, 2, 2, 2, 2]);
    let added = |text: &str| asked.lock().unwrap().iter().any(|a| a == text);
    assert!(added("add 1 by mosse on 0") && added("add 2 by mosse on 2"));
}

#[test]
fn a_step_is_a_frame_and_every_sink_gets_it() {
    let (session, asked, taken) = session();
    let mut session = session.starting_on(vec![at(1.0), at(2.0), at(3.0)]);
    assert!(session.frame().is_none() && session.targets().ids().is_empty());
    let progress = session.step().unwrap().unwrap();
    assert_eq!((progress.frames, progress.frame.index(), progress.records.len()), (1, 0, 3));
    let first = &progress.records[0];
    assert_eq!((first.frame, first.time_s, first.target), (0, 0.0, TargetId(1)));
    let started = first.estimate.as_ref().unwrap();
    assert_eq!((started.bbox, started.score, started.state), (at(1.0), 1.0, TrackState::Tracking));
    assert!(first.update_ms.is_some());
    let progress = session.step().unwrap().unwrap();
    assert_eq!((progress.frames, progress.frame.index()), (2, 1));
    let updated = &progress.records[1];
    assert_eq!((updated.frame, updated.time_s, updated.update_ms), (1, 0.04, Some(2.0)));
    assert_eq!(updated.estimate.as_ref().unwrap().state, TrackState::Lost);
    assert_eq!(progress.records[2].estimate, None);
    assert_eq!(session.frame().unwrap().index(), 1);
    assert_eq!(session.targets().ids().len(), 3);
    while step(&mut session).is_some() {}
    assert!(step(&mut session).is_none(), "after the end comes the end");
    let outcome = session.finish();
    assert_eq!((outcome.frames, outcome.interrupted, outcome.failure.is_none()), (10, false, true));
    // Three are started in the first frame; in nine more one is measured, one lost, one sought.
    assert_eq!((outcome.states.tracking, outcome.states.lost, outcome.states.occluded), (12, 18, 0));
    assert_eq!(
        (outcome.timing.update_ms.count, outcome.timing.update_ms.max),
        (18, 2.0),
        "two have updates in nine frames"
    );
    assert_eq!(outcome.timing.decode_ms.count, 10);
    assert!(outcome.timing.total_s > 0.0);
    let taken = taken.lock().unwrap();
    assert_eq!(taken.len(), 11);
    assert!(taken[..10].iter().enumerate().all(|(k, t)| t.as_ref().unwrap().0 == k as u64));
    assert_eq!((taken[3].as_ref().unwrap().1.len(), &taken[10]), (3, &None), "closed once, at the end");
    let asked = asked.lock().unwrap();
    assert_eq!(asked[..4], ["step 0", "add 1 by mosse on 0", "add 2 by mosse on 0", "add 3 by mosse on 0"]);
}

#[test]
fn commands_are_obeyed_between_steps() {
    let (mut session, asked, _) = session();
    // Before the first frame a box belongs to the frame that comes.
    assert_eq!(session.apply(add(at(5.0))).unwrap(), None);
    assert_eq!(step(&mut session), Some((0, vec![(1, 5.0)])));
    // Then to the frame looked at last.
    assert_eq!(session.apply(add(at(6.0))).unwrap(), Some(TargetId(2)));
    let other = Command::Add { bbox: at(7.0), recipe: Some(recipe("kcf").unwrap()) };
    assert_eq!(session.apply(other).unwrap(), Some(TargetId(3)));
    session.apply(Command::Reinit { target: TargetId(1), bbox: at(9.0) }).unwrap();
    assert_eq!(step(&mut session), Some((1, vec![(1, 9.0), (2, 6.0), (3, -1.0)])));
    session.apply(Command::Remove(TargetId(2))).unwrap();
    assert_eq!(step(&mut session), Some((2, vec![(1, 9.0), (3, -1.0)])));
    let table: toml::Table = "policy.lost_after_s = 2.0".parse().unwrap();
    session.apply(Command::Change { target: Some(TargetId(1)), parameters: table.clone() }).unwrap();
    session.apply(Command::Change { target: None, parameters: table }).unwrap();
    let asked = asked.lock().unwrap();
    let said: Vec<&str> = asked.iter().map(String::as_str).filter(|a| !a.starts_with("step")).collect();
    let change = "[policy]\nlost_after_s = 2.0";
    assert_eq!(
        said,
        [
            "add 1 by mosse on 0",
            "add 2 by mosse on 0",
            "add 3 by kcf on 0",
            "reinit 1 on 0",
            &format!("change 1 to {change}"),
            &format!("change all to {change}")
        ]
    );
}

#[test]
fn what_cannot_be_obeyed_is_refused_and_changes_nothing() {
    let (mut session, _, _) = session();
    session.apply(add(at(5.0))).unwrap();
    step(&mut session);
    let unknown = |r: Result<Option<TargetId>, RunError>| {
        assert!(matches!(r, Err(RunError::Tracking(TrackingError::UnknownTarget { id: 7 }))), "{r:?}");
    };
    unknown(session.apply(Command::Remove(TargetId(7))));
    unknown(session.apply(Command::Reinit { target: TargetId(7), bbox: at(1.0) }));
    let beyond = BBox::from_ltwh(1e4, 0.0, 5.0, 5.0);
    let refused = session.apply(Command::Reinit { target: TargetId(1), bbox: beyond });
    assert!(matches!(refused, Err(RunError::Tracking(TrackingError::StartBox { .. }))));
    let refused = session.apply(Command::Seek(99));
    assert!(refused.unwrap_err().to_string().contains("99"));
    assert_eq!(step(&mut session), Some((1, vec![(1, 5.0)])));
}

#[test]
fn sessions_go_to_any_frame_of_sources_that_can() {
    let (mut session, asked, taken) = session();
    session.apply(add(at(5.0))).unwrap();
    (0..3).for_each(|_| drop(step(&mut session)));
    session.apply(Command::Seek(7)).unwrap();
    assert!(session.frame().is_none());
    // What is put now is put onto the frame that comes.
    assert_eq!(session.apply(add(at(8.0))).unwrap(), None);
    assert_eq!(session.apply(Command::Reinit { target: TargetId(1), bbox: at(9.0) }).unwrap(), None);
    let progress = session.step().unwrap().unwrap();
    assert_eq!(progress.frame.index(), 7);
    let said: Vec<_> = progress.records.iter().map(|r| (r.target.0, r.estimate.clone().unwrap())).collect();
    assert_eq!(
        said.iter().map(|(id, e)| (*id, e.bbox, e.score)).collect::<Vec<_>>(),
        [(1, at(9.0), 1.0), (2, at(8.0), 1.0)]
    );
    assert_eq!(step(&mut session).unwrap().0, 8);
    session.apply(Command::Seek(1)).unwrap();
    assert_eq!(step(&mut session).unwrap().0, 1);
    // Even after the end.
    while step(&mut session).is_some() {}
    session.apply(Command::Seek(9)).unwrap();
    assert_eq!(step(&mut session).unwrap().0, 9);
    assert!(step(&mut session).is_none());
    drop(session.finish());
    let frames: Vec<u64> = taken.lock().unwrap().iter().flatten().map(|t| t.0).collect();
    assert_eq!(frames, [0, 1, 2, 7, 8, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9]);
    assert!(asked.lock().unwrap().contains(&"reinit 1 on 7".to_owned()));

    let (camera, frames) = camera();
    let mut live = Session::new(Box::new(camera), recipe("mosse").unwrap()).following(Box::new(Still::default()));
    frames.send(blank(0)).unwrap();
    step(&mut live);
    assert!(live.apply(Command::Seek(0)).unwrap_err().to_string().contains("front to back"));
    assert!(live.frame().is_some());
}

#[test]
fn a_run_waits_while_it_is_paused_and_goes_on_when_told() {
    let (mut session, _, taken) = session();
    session.apply(Command::Pause).unwrap();
    assert!(session.is_paused());
    assert_eq!(step(&mut session).unwrap().0, 0, "a single step is a step");
    let remote = session.remote();
    let run = std::thread::spawn(move || session.run(|_| {}));
    assert_eq!(remote.send(add(at(3.0))).wait().unwrap(), Some(TargetId(1)), "paused sessions obey");
    assert!(remote.send(Command::Remove(TargetId(9))).wait().is_err());
    assert_eq!(taken.lock().unwrap().len(), 1);
    remote.send(Command::Resume).wait().unwrap();
    let outcome = run.join().unwrap();
    assert_eq!((outcome.frames, outcome.interrupted), (10, false));
    assert_eq!(taken.lock().unwrap().len(), 11);
    assert!(remote.send(Command::Pause).wait().unwrap_err().to_string().contains("ended"));
    let (mut session, _, _) = crate::session();
    session.apply(Command::Pause).unwrap();
    session.apply(Command::Resume).unwrap();
    assert!(!session.is_paused());
}

#[test]
fn one_handle_stops_a_session_wherever_it_is() {
    // Before a frame.
    let (mut session, _, taken) = session();
    step(&mut session);
    let remote = session.remote();
    assert!(!remote.is_stopped());
    remote.stop();
    assert!(remote.is_stopped() && step(&mut session).is_none());
    assert!(session.apply(Command::Seek(0)).is_ok() && step(&mut session).is_none(), "stopped is stopped");
    let outcome = session.finish();
    assert_eq!((outcome.frames, outcome.interrupted, outcome.failure.is_none()), (1, true, true));
    assert_eq!(taken.lock().unwrap().last(), Some(&None));

    // While paused.
    let (mut session, _, _) = crate::session();
    session.apply(Command::Pause).unwrap();
    let remote = session.remote();
    let run = std::thread::spawn(move || session.run(|_| {}));
    std::thread::sleep(Duration::from_millis(20));
    remote.stop();
    let outcome = run.join().unwrap();
    assert_eq!((outcome.frames, outcome.interrupted), (0, true));

    // While it waits for a frame that never comes.
    let (camera, frames) = camera();
    let session = Session::new(Box::new(camera), recipe("mosse").unwrap()).following(Box::new(Still::default()));
    frames.send(blank(0)).unwrap();
    let remote = session.remote();
    let run = std::thread::spawn(move || session.run(|_| {}));
    std::thread::sleep(Duration::from_millis(30));
    remote.stop();
    let outcome = run.join().unwrap();
    assert_eq!((outcome.frames, outcome.interrupted), (1, true));
    drop(frames);
}

/// Runs ten frames with one target, and what is wrong.
fn run_with(sinks: Vec<Memory>, broken_at: Option<u64>) -> (Outcome, Vec<Taken>, u64) {
    let taken = sinks.iter().map(|s| s.taken.clone()).collect();
    let source = common::Book { broken_at, ..book(10) };
    let sinks: Vec<_> = sinks.into_iter().map(|s| Box::new(s) as Box<dyn pursuit::sinks::Sink>).collect();
    let session = Session::new(Box::new(source), recipe("mosse").unwrap());
    let mut seen = 0;
    let session = session.following(Box::new(Still::default())).starting_on(vec![at(1.0)]).with_sinks(sinks);
    let outcome = session.run(|progress| {
        seen += 1;
        assert_eq!((progress.frames, progress.records.len()), (seen, 1));
    });
    (outcome, taken, seen)
}

#[test]
fn whatever_breaks_ends_the_run_and_closes_every_sink() {
    let (outcome, taken, seen) = run_with(vec![Memory::default(), Memory::default()], None);
    assert_eq!((outcome.frames, seen, outcome.interrupted, outcome.failure.is_none()), (10, 10, false, true));
    assert!(taken.iter().all(|t| t.lock().unwrap().len() == 11));

    let (outcome, taken, seen) = run_with(vec![Memory::default()], Some(4));
    assert_eq!((outcome.frames, seen, outcome.interrupted), (4, 4, false));
    assert!(outcome.failure.unwrap().to_string().contains("breaks off at frame 4: torn"));
    assert_eq!(taken[0].lock().unwrap().last(), Some(&None));

    let failing = Memory { fails_at: Some(2), fails_to_finish: true, ..Memory::default() };
    let (outcome, taken, seen) = run_with(vec![Memory::default(), failing], None);
    assert_eq!((outcome.frames, seen), (3, 2), "the frame was looked at, but not told");
    assert!(outcome.failure.unwrap().to_string().contains("disk"), "the first thing that went wrong");
    assert_eq!((taken[0].lock().unwrap().len(), taken[1].lock().unwrap().len()), (4, 3));

    let late = Memory { fails_to_finish: true, ..Memory::default() };
    let (outcome, _, _) = run_with(vec![late, Memory::default()], None);
    assert!(outcome.failure.unwrap().to_string().contains("end"));
}

#[test]
fn a_step_that_failed_is_the_last() {
    let mut session = Session::new(Box::new(common::Book { broken_at: Some(1), ..book(10) }), recipe("mosse").unwrap());
    assert!(session.step().unwrap().is_some_and(|p| p.records.is_empty()), "nobody has to be followed");
    assert!(session.step().is_err());
    assert!(session.step().unwrap().is_none());
    assert!(!session.finish().interrupted);
    // A box that cannot be used.
    let beyond = BBox::from_ltwh(1e4, 0.0, 5.0, 5.0);
    let mut session = Session::new(Box::new(book(3)), recipe("mosse").unwrap()).starting_on(vec![beyond]);
    assert!(matches!(session.step(), Err(RunError::Tracking(TrackingError::StartBox { .. }))));
}

/// Finds what the scene's truth says, from frame 3 on.
struct Knowing(Vec<Option<BBox>>);

impl Detector for Knowing {
    fn detect(&mut self, frame: &Frame, _: &[Followed]) -> pursuit::tracking::Result<Vec<Detection>> {
        let known = self.0.get(frame.index() as usize).copied().flatten().filter(|_| frame.index() >= 3);
        Ok(known.map(|bbox| Detection::new(bbox, 0.9)).into_iter().collect())
    }
}

const SCENE: &str = "scene:drift?seed=7&duration=1";

fn truth() -> Vec<Option<BBox>> {
    open(SCENE).unwrap().info().truth.clone().unwrap().iter().map(|t| t.bbox()).collect()
}

#[test]
fn a_detector_starts_a_target_of_the_sessions_own_recipe() {
    let session = Session::new(open(SCENE).unwrap(), recipe("mosse").unwrap());
    let mut session = session.finding(Box::new(Knowing(truth())), AcquisitionParams::default()).unwrap();
    let mut boxes = Vec::new();
    while let Some(progress) = session.step().unwrap() {
        assert_eq!((progress.records.len(), progress.records[0].target), (1, TargetId(1)));
        boxes.push(progress.records[0].estimate.as_ref().map(|e| e.bbox));
    }
    assert_eq!(boxes[..3], [None, None, None]);
    assert_eq!(boxes[3], truth()[3]);
    assert!(boxes[4..].iter().zip(&truth()[4..]).all(|(b, t)| b.unwrap().iou(&t.unwrap()) > 0.6));
    let outcome = session.finish();
    assert_eq!((outcome.states.lost, outcome.timing.update_ms.count), (3, boxes.len() as u64 - 4));
    let bad = AcquisitionParams { detected: 2.0, ..AcquisitionParams::default() };
    let session = Session::new(open(SCENE).unwrap(), recipe("mosse").unwrap());
    assert!(session.finding(Box::new(Knowing(vec![])), bad).is_err());
}

#[test]
fn the_same_boxes_come_from_a_session_a_tracker_and_track() {
    let first = truth()[0].unwrap();
    let recipe = recipe("kcf").unwrap();
    let mut session = Session::new(open(SCENE).unwrap(), recipe.boxed_clone()).starting_on(vec![first]);
    let mut of_session = Vec::new();
    while let Some(progress) = session.step().unwrap() {
        of_session.push(progress.records[0].estimate.clone().unwrap());
    }
    let of_track: Vec<_> = pursuit::track(open(SCENE).unwrap(), &*recipe, first).map(Result::unwrap).collect();
    assert_eq!(of_session.len(), 30);
    assert_eq!(of_session, of_track);
    assert!(of_track[29].bbox.iou(&truth()[29].unwrap()) > 0.6);
}

#[test]
fn changes_count_for_targets_added_later_and_bad_ones_for_none() {
    let first = truth()[0].unwrap();
    let mut session = Session::new(open(SCENE).unwrap(), recipe("kcf").unwrap()).starting_on(vec![first]);
    session.step().unwrap();
    let change = |text: &str, target| Command::Change { target, parameters: text.parse().unwrap() };
    assert!(session.apply(change("motion.nonsense = 1", None)).is_err());
    assert!(session.apply(change("motion.model = 'none'", Some(TargetId(9)))).is_err());
    session.apply(change("motion.model = 'none'", None)).unwrap();
    assert_eq!(session.apply(add(first)).unwrap(), Some(TargetId(2)));
    session.step().unwrap();
    for id in [1, 2] {
        assert!(session.targets().forecast(TargetId(id), 1.0).unwrap().velocity.is_none(), "target {id}");
    }
    // Of one target alone.
    session.apply(change("motion.model = 'constant-velocity'", Some(TargetId(2)))).unwrap();
    assert!(session.targets().forecast(TargetId(2), 1.0).unwrap().velocity.is_some());
    assert!(session.targets().forecast(TargetId(1), 1.0).unwrap().velocity.is_none());
}

/// The source of a session in whose 64x48 pixels the part from (16, 8) on is shown twice as large.
fn part() -> Box<dyn pursuit::media::Source> {
    let resize = Some("64x48".parse().unwrap());
    pursuit::part_of(Box::new(book(5)), Some([16.0, 8.0, 32.0, 24.0]), resize).unwrap()
}

#[test]
fn boxes_of_a_part_are_of_the_input() {
    let targets = Still::default();
    let (asked, sink) = (targets.asked.clone(), Memory::default());
    let taken = sink.taken.clone();
    let session = Session::new(part(), recipe("mosse").unwrap()).following(Box::new(targets));
    let mut session = session.starting_on(vec![at(20.0)]).with_sinks(vec![Box::new(sink)]);
    // What is given and what is handed on are boxes of the input; what trackers see is the part.
    assert_eq!(step(&mut session), Some((0, vec![(1, 20.0)])));
    session.apply(add(at(30.0))).unwrap();
    session.apply(Command::Reinit { target: TargetId(1), bbox: at(24.0) }).unwrap();
    assert_eq!(step(&mut session), Some((1, vec![(1, 24.0), (2, 30.0)])));
    assert_eq!(session.frame().unwrap().size(), pursuit::geometry::Size::new(64, 48));
    let outside = Command::Reinit { target: TargetId(1), bbox: at(1.0) };
    assert!(session.apply(outside).is_err(), "the part has no such place");
    let last = taken.lock().unwrap()[1].clone().unwrap().1;
    assert_eq!(last[0].estimate.as_ref().unwrap().bbox, at(24.0));
    assert_eq!(asked.lock().unwrap().len(), 5);
    let twice = pursuit::part_of(part(), Some([0.0, 0.0, 20.0, 20.0]), None);
    assert!(twice.err().unwrap().to_string().contains("in part already"));
}

#[test]
fn track_ends_with_what_went_wrong() {
    let recipe = recipe("mosse").unwrap();
    let torn = common::Book { broken_at: Some(2), ..book(9) };
    let said: Vec<_> = pursuit::track(Box::new(torn), &*recipe, at(20.0)).collect();
    assert_eq!(said.iter().map(Result::is_ok).collect::<Vec<_>>(), [true, true, false]);
    let none = pursuit::recipe("nobody").err().unwrap();
    assert!(none.to_string().contains("nobody") && open("nowhere.mp4").is_err());
}
