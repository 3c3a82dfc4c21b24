mod controller;

use super::believed_head::BelievedHead;
use super::dead_zone::DeadZone;
use super::departure::Departure;
use super::diagnosis::{Diagnosis, Mode};
use super::jitter::Jitter;
use super::lateness::Lateness;
use super::lost::Loss;
use super::params::{FollowerParams, PredictBy, Scheme};
use super::prediction::{Prediction, slowed};
use super::rehearsal::{Cue, Rehearsal};
use super::servo::AxisAim;
use super::sighting::Sighting;
use super::steps::meeting;
use super::zones::Permit;
use crate::geometry::FieldsOfView;
use crate::mechanics::HeadLimits;
use crate::{Command, Direction, Position, PtzError, Result, Status, Velocity};
use pursuit_geometry::Size;
use pursuit_parameters::Parameters;

/// Keeps a target in the middle of the picture.
///
/// Each picture is dated back to when it was taken, and the target in it is turned into a direction in the world by where
/// the head looked **then**. Each command is made for when it takes effect: for where the target will be **then**, and
/// from where the head will look **then**. What the head says of itself is used as far as it proves true
/// ([`OwnWord`](super::OwnWord)).
#[derive(Debug, Clone)]
pub struct Follower {
    params: FollowerParams,
    views: FieldsOfView,
    size: Size,
    head: BelievedHead,
    target: Option<Lateness>,
    trust: Rehearsal,
    sighting: Option<Sighting>,
    measured_s: f64,
    given_up: bool,
    loss: Option<Loss>,
    /// Where it looked when it began to follow.
    post: Option<Position>,
    rests: [DeadZone; 2],
    manual_until_s: f64,
    next_s: f64,
    goal: Option<Position>,
    sent: Option<(f64, Command)>,
    /// Since when the head is told to stand.
    standing_since_s: Option<f64>,
    mode: Mode,
}

impl Follower {
    /// How often a head that shall stand is told so, seconds: a command may get lost.
    const STOP_AGAIN_S: f64 = 0.5;
    /// A delay known to this deviation counts as known, seconds.
    const KNOWN_S: f64 = 0.03;
    /// How close to a place on its way the head need not come closer, degrees.
    const NEAR_DEG: f64 = 0.1;

    /// A follower for a camera of these fields of view and this size of picture, whose head rests at `params.home`.
    ///
    /// # Errors
    /// Where a parameter is out of its range.
    pub fn new(params: FollowerParams, views: FieldsOfView, size: Size, now_s: f64) -> Result<Self> {
        params.validate("follower")?;
        views.lens(0.0, size)?;
        if !now_s.is_finite() {
            return Err(PtzError::Parameter { name: "now_s", value: now_s, wanted: "a finite time" });
        }
        Ok(Self {
            head: BelievedHead::new(params.limits, params.command_delay_s, params.home, now_s),
            trust: Rehearsal::new(params.trust, params.limits, params.command_delay_s, params.home, now_s),
            params,
            views,
            size,
            target: None,
            sighting: None,
            measured_s: f64::NEG_INFINITY,
            given_up: false,
            loss: None,
            post: None,
            rests: [DeadZone::default(); 2],
            manual_until_s: f64::NEG_INFINITY,
            next_s: f64::NEG_INFINITY,
            goal: None,
            sent: None,
            standing_since_s: None,
            mode: Mode::Waiting,
        })
    }

    /// Its parameters.
    pub const fn params(&self) -> &FollowerParams {
        &self.params
    }

    /// A person drives the head: gives back the command to carry out, and keeps still until
    /// [`FollowerParams::manual_s`] after the last such command.
    pub fn manual(&mut self, now_s: f64, command: Command) -> Command {
        self.manual_until_s = now_s + self.params.manual_s;
        self.mode = Mode::Manual;
        // Where it waits from now on is where the person leaves it.
        self.post = None;
        self.note(now_s, command)
    }

    /// What the head was noticed to do that it was not told, once for each time.
    pub fn departure(&mut self) -> Option<Departure> {
        self.head.departure()
    }

    /// What it thinks at `now_s`.
    pub fn diagnosis(&self, now_s: f64) -> Diagnosis {
        let effect_s = self.effect_s(now_s);
        let (head, turning) = self.head.at(effect_s);
        let target = self.predict(effect_s).ok().flatten().map(|p| p.direction);
        Diagnosis { mode: self.mode, target, head, turning }
    }

    /// When a command that is sent now takes effect, seconds.
    fn effect_s(&self, now_s: f64) -> f64 {
        now_s + self.params.command_delay_s + self.head.late_s()
    }

    /// The head says how it stands.
    fn hear(&mut self, now_s: f64, status: &Status) -> Result<()> {
        let (was_prompt, before_s) = (self.head.prompt(), self.head.late_s());
        let by = self.head.hear(now_s, status);
        if self.head.prompt() != was_prompt
            && let Some(target) = &mut self.target
        {
            // How late commands are is known by the head's word from now on, no longer by sightings, or the other way round.
            target.later(before_s - self.head.late_s())?;
        }
        if by == Direction::AHEAD {
            return Ok(());
        }
        if let Some(target) = &mut self.target {
            target.shift(by)?;
        }
        if let Some(sighting) = &mut self.sighting {
            sighting.shift(by);
        }
        self.trust.shift(by);
        Ok(())
    }

    fn note(&mut self, now_s: f64, command: Command) -> Command {
        self.head.sent(now_s, command);
        self.sent = Some((now_s, command));
        command
    }

    /// By how much longer than assumed commands and pictures together take, seconds.
    fn late_s(&self) -> f64 {
        self.target.as_ref().map_or(0.0, |target| target.late_s().0)
    }

    /// Where the target will be when the head stands where its model says that it stands at `time_s`.
    fn predict(&self, time_s: f64) -> Result<Option<Prediction>> {
        let (Some(target), Some(sighting)) = (&self.target, &self.sighting) else { return Ok(None) };
        let beside = self.params.aim.beside(self.half_view_deg(self.head.at(time_s).0.zoom));
        let here = |direction: Direction, speed, sigma: Direction| Prediction {
            direction: direction.turned(beside),
            speed,
            sigma_deg: sigma.pan_deg.max(sigma.tilt_deg),
            is_waypoint: false,
        };
        // A head that obeys late stands by its model where it stood that much earlier; the target goes on meanwhile.
        let (horizon_s, part) = slowed(time_s + self.late_s() - target.time_s());
        let slower = |speed: Direction| Direction::new(part * speed.pan_deg, part * speed.tilt_deg);
        Ok(Some(match self.params.predict_by {
            PredictBy::World => {
                let (cue, sigma_deg) = self.cue(target, sighting, time_s)?;
                let (direction, speed) = cue.by(self.trust.factor());
                here(direction, speed, sigma_deg)
            }
            PredictBy::Tracker => match sighting.forecast_at(target.time_s() + horizon_s) {
                Some((direction, speed)) => here(direction, slower(speed), sighting.seen.sigma_deg),
                None => here(sighting.seen.direction, Direction::AHEAD, sighting.seen.sigma_deg),
            },
            PredictBy::Nothing => here(sighting.seen.direction, Direction::AHEAD, sighting.seen.sigma_deg),
        }))
    }

    /// What is known of the target for a command that takes effect at `time_s`, and how uncertain its direction is then.
    fn cue(&self, target: &Lateness, sighting: &Sighting, time_s: f64) -> Result<(Cue, Direction)> {
        let belief = target.at(&|late_s| target.time_s() + slowed(time_s + late_s - target.time_s()).0)?;
        let (_, part) = slowed(time_s + self.late_s() - target.time_s());
        let speed = Direction::new(part * belief.speed_deg_s.pan_deg, part * belief.speed_deg_s.tilt_deg);
        // None of the prediction is where the target was seen, as without prediction.
        let seen = sighting.seen.direction;
        Ok((Cue { seen, ahead: belief.direction.from(seen), speed }, belief.sigma_deg))
    }

    /// Follows: the command for a target that is believed in.
    fn follow(&mut self, now_s: f64) -> Result<Option<Command>> {
        let effect_s = self.effect_s(now_s);
        let Some(there) = self.predict(effect_s)? else { return Ok(None) };
        let (head, turning) = self.head.at(effect_s);
        let zoom = self.zoom_goal(head.zoom, there.sigma_deg);
        let (there, zoom) = self.permit().first(head, there, zoom);
        if let (PredictBy::World, Some(target), Some(sighting)) = (self.params.predict_by, &self.target, &self.sighting)
        {
            let (cue, _) = self.cue(target, sighting, effect_s)?;
            let late_s = self.late_s() + self.head.late_s();
            let late = (late_s, self.command_jitter_s());
            self.trust.act(now_s, late, &cue, self.params.gain_per_s);
        }
        match self.params.scheme {
            Scheme::Velocity => Ok(self.velocity(now_s, head, turning, &there, zoom)),
            Scheme::Steps => self.step(now_s, effect_s, (head, turning), zoom),
        }
    }

    /// How much the delay of commands varies, one standard deviation, seconds: by the head's own word, else as measured by sightings.
    fn command_jitter_s(&self) -> f64 {
        let measured = || self.target.as_ref().and_then(Lateness::jitter).map_or(0.0, Jitter::commands_s);
        self.head.word().jitter_s().unwrap_or_else(measured)
    }

    fn zoom_goal(&self, zoom: f64, sigma_deg: f64) -> Option<f64> {
        let (params, sighting) = (self.params.zoom.as_ref()?, self.sighting.as_ref()?);
        params.goal(&self.views, zoom, &sighting.bbox, &sighting.lens, sigma_deg.max(self.trust.error_deg()))
    }

    fn velocity(
        &mut self,
        now_s: f64,
        head: Position,
        turning: Velocity,
        there: &Prediction,
        zoom: Option<f64>,
    ) -> Option<Command> {
        let away = there.direction.from(head.direction);
        let (half_x, half_y) = self.half_view_deg(head.zoom);
        let (params, limits, gain_per_s) = (&self.params, self.limits(), self.gain_per_s());
        let pan = AxisAim {
            head_deg: head.direction.pan_deg,
            head_deg_s: turning.pan_deg_s,
            away_deg: away.pan_deg,
            target_deg_s: there.speed.pan_deg,
        };
        let tilt = AxisAim {
            head_deg: head.direction.tilt_deg,
            head_deg_s: turning.tilt_deg_s,
            away_deg: away.tilt_deg,
            target_deg_s: there.speed.tilt_deg,
        };
        // A target that moves along one axis is followed along both.
        let speed = there.speed.pan_deg.hypot(there.speed.tilt_deg);
        let [pan_rest, tilt_rest] = &mut self.rests;
        let drive = |rest: &mut DeadZone, aim: AxisAim, half_deg: f64, limits| {
            let zone = if there.is_waypoint { Self::NEAR_DEG } else { params.dead_zone * half_deg };
            let rests = rest.rests(aim.away_deg, speed, zone, params.still_deg_s);
            if rests { 0.0 } else { aim.speed_deg_s(gain_per_s, limits) }
        };
        let velocity = Velocity {
            pan_deg_s: drive(pan_rest, pan, half_x, &limits.pan),
            tilt_deg_s: drive(tilt_rest, tilt, half_y, &limits.tilt),
            zoom_per_s: zoom.map_or(0.0, |goal| {
                let top = params.limits.zoom_per_s;
                (params.gain_per_s * (goal - head.zoom)).clamp(-top, top)
            }),
        };
        let zones = self.permit().zones(head.direction, head.zoom);
        let velocity = zones.braked(head.direction, velocity, &limits, self.params.period_s);
        let command = if velocity.is_zero() { Command::Stop } else { Command::Move(velocity) };
        self.unless_said(now_s, command)
    }

    /// The command, unless it is a stop of a head that was told so often enough. A stop may get lost, and a head that then
    /// turns on goes far, so it is said again at once for a while, and now and then later.
    fn unless_said(&mut self, now_s: f64, command: Command) -> Option<Command> {
        if command != Command::Stop {
            self.standing_since_s = None;
            return Some(self.note(now_s, command));
        }
        let standing_s = now_s - *self.standing_since_s.get_or_insert(now_s);
        let just_said = self.sent.is_some_and(|(time, sent)| sent == command && now_s < time + Self::STOP_AGAIN_S);
        if standing_s > Self::STOP_AGAIN_S && just_said { None } else { Some(self.note(now_s, command)) }
    }

    const fn permit(&self) -> Permit<'_> {
        Permit { zones: &self.params.zones, views: &self.views, size: self.size, limits: &self.params.limits }
    }

    /// How fast the distance is closed: more slowly while the delays are not known. A head that obeys later than assumed makes the target seem
    /// to run ahead of it, and is sent after that, past a target that stands.
    fn gain_per_s(&self) -> f64 {
        let FollowerParams { gain_per_s, caution, .. } = self.params;
        let unsure_s = self.target.as_ref().map_or(0.0, |target| (target.late_s().1 - Self::KNOWN_S).max(0.0));
        gain_per_s / (1.0 + caution * gain_per_s * unsure_s)
    }

    /// What the head can do, slower where the target is near.
    fn limits(&self) -> HeadLimits {
        match (&self.params.near, &self.sighting) {
            (Some(near), Some(sighting)) => near.limits(self.params.limits, &sighting.bbox, self.size),
            _ => self.params.limits,
        }
    }

    fn step(
        &mut self,
        now_s: f64,
        effect_s: f64,
        (head, turning): (Position, Velocity),
        zoom: Option<f64>,
    ) -> Result<Option<Command>> {
        let target = |after_s: f64| self.predict(effect_s + after_s).ok().flatten().map(|p| p.direction);
        let Some(direction) = meeting(head, turning, &self.params.limits, target) else { return Ok(None) };
        let Some(direction) = self.permit().goal(head, direction, zoom) else { return Ok(None) };
        let (half_x, half_y) = self.half_view_deg(head.zoom);
        let near = |from: Direction| {
            let off = direction.from(from);
            let zone = 0.5 * self.params.dead_zone;
            off.pan_deg.abs() <= zone * half_x && off.tilt_deg.abs() <= zone * half_y
        };
        // Before the first step the head counts as sent to where it stands.
        let there = self.goal.unwrap_or(head);
        if near(there.direction) && zoom.is_none() {
            return Ok(None);
        }
        self.goal = Some(Position { direction, zoom: zoom.unwrap_or(there.zoom) });
        Ok(Some(self.note(now_s, Command::GoTo { direction, zoom })))
    }

    fn half_view_deg(&self, zoom: f64) -> (f64, f64) {
        self.views.lens(zoom, self.size).map_or((f64::NAN, f64::NAN), |lens| lens.half_fov_deg())
    }

    fn lost(&mut self, now_s: f64) -> Result<Option<Command>> {
        let effect_s = self.effect_s(now_s);
        let (head, _) = self.head.at(effect_s);
        let mut loss = match self.loss {
            Some(loss) => loss,
            None => {
                // Beyond the coasting time the prediction is worth no more than its last believed place.
                let until = self.measured_s + self.params.coast_s;
                let around = self.predict(until.min(effect_s))?.map_or(head.direction, |p| p.direction);
                Loss::new(now_s, around)
            }
        };
        if let Some(post) = self.post.filter(|_| loss.returns(&self.params.when_lost, now_s)) {
            self.loss = Some(loss);
            return Ok(self.go_back(now_s, effect_s, post));
        }
        let command = loss.act(&self.params.when_lost, now_s, head, &self.params.limits);
        self.loss = Some(loss);
        self.goal = None;
        let command = match command {
            Some(Command::GoTo { direction, zoom }) => {
                let there = self.permit().goal(head, direction, zoom);
                Some(there.map_or(Command::Stop, |direction| Command::GoTo { direction, zoom }))
            }
            other => other,
        };
        Ok(command.map(|command| self.note(now_s, command)))
    }

    /// Drives to where it waited as to a target that stands there: any head can do that, and zones are kept.
    fn go_back(&mut self, now_s: f64, effect_s: f64, post: Position) -> Option<Command> {
        let (head, turning) = self.head.at(effect_s);
        let zoom = self.params.zoom.map(|_| post.zoom);
        if self.params.scheme == Scheme::Steps {
            let direction = self.permit().goal(head, post.direction, zoom)?;
            let goal = Position { direction, zoom: zoom.unwrap_or(post.zoom) };
            let is_new = self.goal.replace(goal) != Some(goal);
            return is_new.then(|| self.note(now_s, Command::GoTo { direction, zoom }));
        }
        let there =
            Prediction { direction: post.direction, speed: Direction::AHEAD, sigma_deg: 0.0, is_waypoint: true };
        let (there, zoom) = self.permit().first(head, there, zoom);
        self.velocity(now_s, head, turning, &there, zoom)
    }
}
