use crate::args::{Global, PtzFollow};
use crate::commands::{Remarks, track};
use pursuit::sinks::Sink;
use pursuit::{Frame, Record, Run, RunError};
use pursuit_ptz::control::{Diagnosis, Follower, FollowerParams, Mode};
use pursuit_ptz::drivers::Pilot;
use pursuit_ptz::geometry::FieldsOfView;
use pursuit_ptz::{Aim, Position, PtzError, Still};
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Instant;

/// `pursuit ptz follow`: a run as `pursuit track` makes it, whose first target a head follows.
pub fn run(args: &PtzFollow, global: &Global) -> anyhow::Result<ExitCode> {
    let params = match &args.follower {
        None => FollowerParams::default(),
        Some(path) => super::read(path, "does not say how to follow")?,
    };
    let views = FieldsOfView::fixed(0.5 * args.field_of_view)?;
    if args.track.inputs.len() > 1 {
        return Err(RunError::usage("a head follows one input; give no more than one").into());
    }
    let mut config = track::config(&args.track)?;
    if config.region.is_some() {
        return Err(
            RunError::usage("a head aims with the whole picture; leave `--region` out (`--resize` may stay)").into()
        );
    }
    // A picture of everything that was seen is made when asked for.
    config.video = config.video.or(Some(false));
    let Some(config) = track::with_box(config, &args.track)? else { return Ok(ExitCode::SUCCESS) };
    let run = Run::prepare(config, &track::open_options(&args.track))?;
    let (size, live) = (run.input().size, run.input().live);
    let follower = Follower::new(params, views, size, 0.0)?;
    let head = super::on_a_thread(super::reach(&args.head.head, &args.head.secret)?, Pilot::WATCHDOG)?;
    let carry_out = |run: Run, remarks: Remarks| {
        let pilot = Pilot::new(follower, head);
        let run = run.with_sink(Box::new(HeadSink { pilot, live, clock: None, complaint: None, remarks }));
        let say = |finished: &_| if args.track.json { track::json(finished) } else { track::summary(finished, false) };
        track::carry_out(run, global, say)
    };
    #[cfg(feature = "studio")]
    if args.track.watch {
        return crate::commands::studio::watched(run, carry_out);
    }
    carry_out(run, Box::new(|_| {}))
}

/// Where the results of a run become commands to a head.
struct HeadSink {
    pilot: Pilot,
    /// Whether frames arrive as they are taken. A recording is followed by its own clock, as fast as it can be read.
    live: bool,
    /// When the first frame came, and its time stamp.
    clock: Option<(Instant, f64)>,
    /// What the head complained of last: said once.
    complaint: Option<String>,
    /// Where it is said what the head does.
    remarks: Remarks,
}

impl HeadSink {
    /// The time now on the clock of the frames, seconds since the first.
    fn now_s(&mut self, frame: &Frame) -> (f64, f64) {
        let (began, first_s) = *self.clock.get_or_insert_with(|| (Instant::now(), frame.time_s()));
        let stamp_s = frame.time_s() - first_s;
        (if self.live { began.elapsed().as_secs_f64().max(stamp_s) } else { stamp_s }, stamp_s)
    }

    /// Says what the head complained of.
    fn listen(&mut self) {
        for error in self.pilot.report().errors {
            let text = error.to_string();
            if self.complaint.as_ref() != Some(&text) {
                tracing::warn!("{text}");
                self.complaint = Some(text);
            }
        }
    }
}

/// What the head is believed to do.
fn outlook(diagnosis: &Diagnosis) -> String {
    let mode = match diagnosis.mode {
        Mode::Waiting => "waits for a target",
        Mode::Following => "follows",
        Mode::Coasting => "follows the prediction",
        Mode::Lost => "has lost the target",
        Mode::Manual => "is driven by hand",
    };
    let Position { direction, zoom } = diagnosis.head;
    format!("head {mode}: pan {:.1}°, tilt {:.1}°, zoom {zoom:.2}", direction.pan_deg, direction.tilt_deg)
}

fn failed(error: PtzError) -> RunError {
    RunError::output("the head")(std::io::Error::other(error))
}

impl Sink for HeadSink {
    fn write(&mut self, frame: &Arc<Frame>, records: &[Record]) -> Result<(), RunError> {
        let (now_s, stamp_s) = self.now_s(frame);
        let estimate = records.first().and_then(|r| r.estimate.as_ref());
        let aim = estimate.map(|e| Aim { bbox: e.bbox, covariance: e.covariance, state: e.state });
        self.pilot.see(now_s, stamp_s, &Still(aim)).map_err(failed)?;
        (self.remarks)(outlook(&self.pilot.diagnosis(now_s)));
        self.listen();
        Ok(())
    }

    fn finish(&mut self) -> Result<(), RunError> {
        let ended = self.pilot.end();
        self.listen();
        if ended {
            return Ok(());
        }
        let head = "the head".to_owned();
        Err(failed(PtzError::TimedOut { head, doing: "the last stop", after_s: 0.0 }))
    }
}
