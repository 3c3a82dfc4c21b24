//! What a follower makes of pictures, and what it commands.

use super::super::Controller;
use super::super::diagnosis::Mode;
use super::super::lateness::Lateness;
use super::super::params::PredictBy;
use super::super::sighting::{Sighting, View};
use super::super::target_motion::{SeenAt, TargetMotion};
use super::Follower;
use crate::{Command, Forecast, Position, Result, Status};
use pursuit_imaging::CameraPose;
use pursuit_tracking::TrackState;

impl Controller for Follower {
    fn see(&mut self, now_s: f64, stamp_s: f64, forecast: &dyn Forecast) -> Result<()> {
        let Some(aim) = forecast.at(stamp_s) else { return Ok(()) };
        match aim.state {
            TrackState::Unsure | TrackState::Occluded => return Ok(()),
            TrackState::Lost => {
                self.given_up = true;
                return Ok(());
            }
            TrackState::Tracking => {}
        }
        self.post.get_or_insert(self.head.at(now_s).0);
        let taken_s = stamp_s - self.params.frame_age_s;
        let (views, size, formula) = (&self.views, self.size, self.params.formula);
        let view = View { views, size, formula, motion: &self.params.motion };
        let head = &self.head;
        let late_s = self.late_s();
        let asked = (self.params.predict_by == PredictBy::Tracker).then_some(forecast);
        let sighting = Sighting::new(&view, (stamp_s, taken_s), head.at(taken_s - late_s), &aim, asked)?;
        let seen = |late_s: f64| sighting.by(&view, head.at(taken_s - late_s), late_s, &aim);
        let known = self.loss.is_none() && !self.given_up;
        let motion = self.params.motion;
        match &mut self.target {
            Some(target) if known => {
                let before_s = target.time_s();
                target.update(&motion, taken_s, &|of: &TargetMotion| {
                    let late_s = of.late_s().0;
                    let drift = head.drift(before_s - late_s, taken_s - late_s, of.jitter().commands_s());
                    SeenAt { drift, ..seen(late_s) }
                })?;
            }
            Some(target) => {
                target.renew(motion, taken_s, &seen)?;
                self.trust.begin(taken_s, head.at(taken_s).0);
            }
            slot => *slot = Some(Lateness::new(motion, taken_s, &seen)?),
        }
        self.sighting = Some(sighting);
        let latency_s = self.params.command_delay_s + self.head.late_s() + self.params.frame_age_s + self.late_s();
        self.trust.judge(taken_s, sighting.seen.direction, latency_s);
        self.measured_s = taken_s;
        (self.loss, self.given_up) = (None, false);
        Ok(())
    }

    fn camera(&self, stamp_s: f64) -> Option<CameraPose> {
        let (Position { direction, zoom }, _) = self.head.at(stamp_s - self.params.frame_age_s - self.late_s());
        let (half_x, _) = self.half_view_deg(zoom);
        let lens = pursuit_imaging::Lens::field_of_view(2.0 * half_x.to_radians()).ok()?;
        CameraPose::new(stamp_s, direction.pan_deg.to_radians(), direction.tilt_deg.to_radians(), lens).ok()
    }

    fn act(&mut self, now_s: f64, status: Option<&Status>) -> Result<Option<Command>> {
        if let Some(status) = status {
            self.hear(now_s, status)?;
        }
        if now_s < self.manual_until_s || now_s < self.next_s {
            return Ok(None);
        }
        self.next_s = now_s + self.params.period_s;
        if self.target.is_none() {
            self.mode = Mode::Waiting;
            return Ok(None);
        }
        let unseen_s = now_s - self.params.frame_age_s - self.measured_s;
        // Between two frames a target is not yet unseen.
        self.mode = match unseen_s {
            _ if self.given_up => Mode::Lost,
            unseen if unseen > self.params.coast_s.max(0.5) => Mode::Lost,
            unseen if unseen > 0.5 => Mode::Coasting,
            _ => Mode::Following,
        };
        if self.mode == Mode::Lost { self.lost(now_s) } else { self.follow(now_s) }
    }
}
