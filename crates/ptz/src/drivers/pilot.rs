use super::{HeadThread, Report};
use crate::control::{Controller, Departure, Diagnosis, Follower, Subject};
use crate::{Command, Forecast, Result};
use pursuit_imaging::CameraPose;
use std::time::Duration;

/// A follower that drives a head: is told of each frame, and sends what is to be done.
///
/// The head stands still when the target is lost (by the follower's policy), when frames cease (the thread's watchdog), and
/// when this value is dropped.
pub struct Pilot {
    follower: Follower,
    head: HeadThread,
    /// How often the head had said how it stands when it was listened to last.
    words: u64,
}

impl Pilot {
    /// How long a head may move without being told so again, to go with [`HeadThread::start`]: longer than the pause
    /// between two frames of a slow camera, shorter than a head takes to turn far.
    pub const WATCHDOG: Duration = Duration::from_millis(1000);

    /// How often a head is asked how it stands, to go with [`HeadThread::start`].
    pub const POLL: Duration = Duration::from_millis(200);

    /// Follows by `follower`, with `head`.
    pub const fn new(follower: Follower, head: HeadThread) -> Self {
        Self { follower, head, words: 0 }
    }

    /// A frame has been looked at: `stamp_s` is its time stamp, `now_s` the time now, on one clock. Gives back what the head was
    /// told, if anything.
    ///
    /// # Errors
    /// Where a number is not finite, or the head's thread has ended.
    pub fn see(&mut self, now_s: f64, stamp_s: f64, forecast: &dyn Forecast) -> Result<Option<Command>> {
        self.follower.see(now_s, stamp_s, forecast)?;
        self.act(now_s)
    }

    /// Time has passed without a frame.
    ///
    /// # Errors
    /// As [`see`](Self::see).
    pub fn act(&mut self, now_s: f64) -> Result<Option<Command>> {
        let heard = self.head.heard_since(self.words);
        let status = heard.map(|(words, status)| {
            self.words = words;
            status
        });
        let command = self.follower.act(now_s, status.as_ref())?;
        command.map(|command| self.head.tell(command).map(|()| command)).transpose()
    }

    /// A person drives the head: the command is carried out, and the follower keeps still for a while.
    ///
    /// # Errors
    /// Where the head's thread has ended.
    pub fn manual(&mut self, now_s: f64, command: Command) -> Result<()> {
        self.head.tell(self.follower.manual(now_s, command))
    }

    /// What the follower thinks.
    pub fn diagnosis(&self, now_s: f64) -> Diagnosis {
        self.follower.diagnosis(now_s)
    }

    /// How the camera is believed to have stood when it took the frame of this time stamp.
    pub fn camera(&self, stamp_s: f64) -> Option<CameraPose> {
        self.follower.camera(stamp_s)
    }

    /// What the head was noticed to do that it was not told, if anything since the last call.
    pub fn departure(&mut self) -> Option<Departure> {
        self.follower.departure()
    }

    /// What has become of the head since the last report.
    pub fn report(&self) -> Report {
        self.head.report()
    }

    /// What it follows of all that is tracked.
    pub const fn subject(&self) -> Subject {
        self.follower.params().subject
    }

    /// Stops the head, sends it where it shall be at the end, and ends its thread; whether it ended in time.
    pub fn end(&self) -> bool {
        self.head.end_with(self.follower.params().at_end.command())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::{AtEnd, EndParams, FollowerParams};
    use crate::drivers::{Capabilities, Head};
    use crate::geometry::FieldsOfView;
    use crate::{Aim, Direction, PtzError, Status, Velocity};
    use pursuit_geometry::{BBox, Point, Size};
    use pursuit_tracking::TrackState;
    use std::sync::mpsc::{Receiver, Sender, channel};

    struct Noted(Sender<Command>);

    impl Head for Noted {
        fn name(&self) -> &str {
            "noted"
        }
        fn capabilities(&self) -> Capabilities {
            Capabilities::default()
        }
        fn send(&mut self, command: &Command) -> Result<()> {
            self.0.send(*command).map_err(|_| PtzError::Ended { head: "noted".into() })
        }
        fn status(&mut self) -> Result<Option<Status>> {
            Ok(None)
        }
        fn leave(&mut self) {}
    }

    fn pilot(watchdog: Duration) -> (Pilot, Receiver<Command>) {
        let (sent, got) = channel();
        let head = HeadThread::start(Noted(sent), watchdog, None, Duration::from_secs(20)).unwrap();
        let views = FieldsOfView::fixed(30.0).unwrap();
        let follower = Follower::new(FollowerParams::default(), views, Size::new(640, 360), 0.0).unwrap();
        (Pilot::new(follower, head), got)
    }

    fn seen(x: f64, state: TrackState) -> impl Fn(f64) -> Option<Aim> {
        move |_| Some(Aim { bbox: BBox::from_center_size(Point::new(x, 180.0), 30.0, 80.0), covariance: None, state })
    }

    #[test]
    fn the_head_turns_to_the_target_and_stands_when_it_is_lost_and_at_the_end() {
        let (mut pilot, got) = pilot(Duration::from_secs(20));
        for k in 0..10 {
            let now = 0.2 * f64::from(k);
            pilot.see(now, now, &seen(560.0, TrackState::Tracking)).unwrap();
            let Command::Move(Velocity { pan_deg_s, tilt_deg_s, .. }) = got.recv().unwrap() else {
                panic!("it moves");
            };
            if k < 3 {
                assert!(pan_deg_s > 1.0 && tilt_deg_s.abs() < 1.0, "{k}: {pan_deg_s} {tilt_deg_s}");
            }
        }
        let told = pilot.see(2.2, 2.2, &seen(560.0, TrackState::Lost)).unwrap();
        assert_eq!(told, Some(Command::Stop));
        assert_eq!(got.recv().unwrap(), Command::Stop);
        pilot.manual(2.4, Command::TurnBy { by: Direction::new(1.0, 0.0) }).unwrap();
        assert_eq!(got.recv().unwrap(), Command::TurnBy { by: Direction::new(1.0, 0.0) });
        assert_eq!(pilot.see(2.6, 2.6, &seen(560.0, TrackState::Tracking)).unwrap(), None, "a person has it");
        drop(pilot);
        assert_eq!(got.recv().unwrap(), Command::Stop);
    }

    #[test]
    fn the_head_goes_home_at_the_end_where_it_shall() {
        let (sent, got) = channel();
        let head = HeadThread::start(Noted(sent), Duration::from_secs(20), None, Duration::from_secs(20)).unwrap();
        let at_end = EndParams { policy: AtEnd::Preset, preset: 4 };
        let params = FollowerParams { at_end, ..FollowerParams::default() };
        let views = FieldsOfView::fixed(30.0).unwrap();
        let pilot = Pilot::new(Follower::new(params, views, Size::new(640, 360), 0.0).unwrap(), head);
        assert!(pilot.end());
        drop(pilot);
        assert_eq!(got.iter().collect::<Vec<_>>(), [Command::Stop, Command::Preset { number: 4 }]);
    }

    #[test]
    fn a_camera_that_falls_silent_stops_the_head() {
        let (mut pilot, got) = pilot(Duration::from_millis(30));
        pilot.see(0.0, 0.0, &seen(600.0, TrackState::Tracking)).unwrap();
        assert!(matches!(got.recv().unwrap(), Command::Move(_)));
        assert_eq!(got.recv().unwrap(), Command::Stop);
        assert!(pilot.end() && pilot.report().ended);
        assert!(pilot.see(0.5, 0.5, &seen(600.0, TrackState::Tracking)).is_err());
    }
}
