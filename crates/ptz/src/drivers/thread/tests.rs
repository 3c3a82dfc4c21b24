use super::*;
use crate::Velocity;
use crate::drivers::Capabilities;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};

const MOVE: Command = Command::Move(Velocity { pan_deg_s: 3.0, tilt_deg_s: 0.0, zoom_per_s: 0.0 });
const LONG: Duration = Duration::from_secs(30);

/// Passes on what it is told; waits for a permit before each answer where it has to.
struct Fake {
    sent: Sender<Command>,
    permits: Option<Receiver<()>>,
    fails: bool,
}

impl Head for Fake {
    fn name(&self) -> &str {
        "fake"
    }
    fn capabilities(&self) -> Capabilities {
        Capabilities::default()
    }
    fn send(&mut self, command: &Command) -> Result<()> {
        if matches!(command, Command::Preset { .. }) {
            panic!("the driver breaks");
        }
        self.sent.send(*command).unwrap();
        if let Some(permits) = &self.permits {
            permits.recv().ok();
        }
        if self.fails { Err(PtzError::Ended { head: "fake".into() }) } else { Ok(()) }
    }
    fn status(&mut self) -> Result<Option<Status>> {
        Ok(Some(Status { moving: Some(true), position: None }))
    }
    fn leave(&mut self) {}
}

fn start(watchdog: Duration, poll: Option<Duration>) -> (HeadThread, Receiver<Command>) {
    let (sent, got) = channel();
    let fake = Fake { sent, permits: None, fails: false };
    (HeadThread::start(fake, watchdog, poll, LONG).unwrap(), got)
}

#[test]
fn commands_are_carried_out_and_the_end_stops_the_head() {
    let (head, got) = start(LONG, None);
    head.tell(MOVE).unwrap();
    assert_eq!(got.recv().unwrap(), MOVE);
    drop(head);
    assert_eq!(got.recv().unwrap(), Command::Stop);
    assert!(got.recv().is_err(), "the head is let go of");
}

#[test]
fn the_newest_command_wins_and_telling_never_waits() {
    let ((sent, got), (permit, permits)) = (channel(), channel());
    let fake = Fake { sent, permits: Some(permits), fails: false };
    let head = HeadThread::start(fake, LONG, None, LONG).unwrap();
    head.tell(MOVE).unwrap();
    assert_eq!(got.recv().unwrap(), MOVE);
    for _ in 0..5 {
        head.tell(MOVE).unwrap();
    }
    head.tell(Command::Home).unwrap();
    permit.send(()).unwrap();
    assert_eq!(got.recv().unwrap(), Command::Home);
    let report = head.report();
    assert_eq!((report.overtaken, report.ended), (5, false));
    drop(permit);
}

#[test]
fn a_head_that_is_told_nothing_is_stopped() {
    let (head, got) = start(Duration::from_millis(20), None);
    head.tell(MOVE).unwrap();
    assert_eq!(got.recv().unwrap(), MOVE);
    assert_eq!(got.recv().unwrap(), Command::Stop, "nothing was told for 20 ms");
    std::thread::sleep(Duration::from_millis(80));
    assert!(got.try_recv().is_err(), "once it stands it is left alone");
    drop(head);
}

#[test]
fn a_head_on_its_way_to_a_place_is_not_stopped() {
    let (head, got) = start(Duration::from_millis(5), None);
    head.tell(MOVE).unwrap();
    head.tell(Command::Home).unwrap();
    while got.recv().unwrap() != Command::Home {}
    assert_eq!(
        got.recv_timeout(Duration::from_millis(80)),
        Err(RecvTimeoutError::Timeout),
        "it stands there by itself"
    );
    drop(head);
}

#[test]
fn errors_are_reported_and_a_stop_that_fails_is_tried_again() {
    let (sent, got) = channel();
    let head = HeadThread::start(Fake { sent, permits: None, fails: true }, Duration::from_millis(5), None, LONG);
    let head = head.unwrap();
    head.tell(MOVE).unwrap();
    let commands: Vec<Command> = (0..40).map(|_| got.recv().unwrap()).collect();
    assert_eq!(commands[0], MOVE);
    assert!(commands[1..].iter().all(|command| *command == Command::Stop));
    let report = head.report();
    assert!(!report.errors.is_empty() && report.errors.len() <= Shared::MOST_ERRORS);
}

#[test]
fn the_status_is_polled() {
    let (head, _got) = start(LONG, Some(Duration::from_millis(1)));
    let deadline = Instant::now() + LONG;
    while head.report().status.is_none() {
        assert!(Instant::now() < deadline);
        std::thread::sleep(Duration::from_millis(1));
    }
    let (words, status) = head.heard_since(0).unwrap();
    assert_eq!((status.moving, head.heard_since(u64::MAX)), (Some(true), None));
    assert!(words > 0);
}

#[test]
fn a_slow_head_is_polled_between_commands() {
    let ((sent, got), (permit, permits)) = (channel(), channel());
    let fake = Fake { sent, permits: Some(permits), fails: false };
    let every = Duration::from_millis(50);
    let head = HeadThread::start(fake, LONG, Some(every), LONG).unwrap();
    head.tell(MOVE).unwrap();
    got.recv().unwrap();
    // The poll becomes due while the head is busy, and another command waits.
    std::thread::sleep(2 * every);
    let before = head.heard_since(0).map_or(0, |(words, _)| words);
    head.tell(MOVE).unwrap();
    permit.send(()).unwrap();
    assert_eq!(got.recv().unwrap(), MOVE);
    assert_eq!(head.heard_since(0).map(|(words, _)| words), Some(before + 1));
    drop(permit);
}

#[test]
fn a_driver_that_hangs_or_breaks_holds_up_nobody() {
    let ((sent, got), (permit, permits)) = (channel(), channel::<()>());
    let fake = Fake { sent, permits: Some(permits), fails: false };
    let head = HeadThread::start(fake, LONG, None, Duration::from_millis(10)).unwrap();
    head.tell(MOVE).unwrap();
    got.recv().unwrap();
    assert!(!head.end());
    drop(permit);
    let (head, _got) = start(LONG, None);
    head.tell(Command::Preset { number: 1 }).unwrap();
    let deadline = Instant::now() + LONG;
    while !head.report().ended {
        assert!(Instant::now() < deadline);
    }
    assert!(matches!(head.tell(MOVE), Err(PtzError::Ended { .. })));
}
