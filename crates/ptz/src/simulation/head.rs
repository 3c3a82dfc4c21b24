use super::params::{HeadParams, StatusHonesty, StatusParams};
use super::random::Random;
use crate::mechanics::Axes;
use crate::{Command, Direction, Position, Result, Status, Velocity};
use pursuit_parameters::Parameters;
use std::collections::VecDeque;

/// A head that exists in numbers only: it obeys late, loses commands, moves within its limits and with play, and may lie.
#[derive(Debug, Clone)]
pub struct SimulatedHead {
    params: HeadParams,
    axes: Axes,
    now_s: f64,
    pending: VecDeque<(f64, Command)>,
    /// The truth of the past, for a status that is old news.
    past: VecDeque<(f64, Status)>,
    random: Random,
}

impl SimulatedHead {
    /// A head at rest.
    ///
    /// # Errors
    /// Where a parameter is out of its range.
    pub fn new(params: HeadParams, seed: u64) -> Result<Self> {
        params.validate("head")?;
        let axes = Axes::at(params.home);
        let (pending, past) = (VecDeque::new(), VecDeque::new());
        Ok(Self { params, axes, now_s: 0.0, pending, past, random: Random::new(seed, 1) })
    }

    /// Is told something at `now_s`: it obeys after its delay, or never.
    pub fn command(&mut self, now_s: f64, command: Command) {
        let (lost, late) = (self.random.happens(self.params.dropped), self.random.unit());
        if lost || !command.is_sound() || !now_s.is_finite() {
            return;
        }
        let time = now_s + self.params.delay_s + self.params.jitter_s * late;
        let time = self.pending.back().map_or(time, |&(before, _)| time.max(before));
        self.pending.push_back((time, command));
    }

    /// Lets time pass until `now_s`.
    pub fn advance_to(&mut self, now_s: f64) {
        while let Some(&(time, command)) = self.pending.front().filter(|(time, _)| *time <= now_s) {
            self.pending.pop_front();
            self.pass(time);
            self.axes.obey(&self.as_carried_out(command));
        }
        self.pass(now_s);
        if let StatusParams { says: StatusHonesty::OldNews, age_s } = self.params.status {
            self.past.push_back((now_s, self.truth()));
            while self.past.get(1).is_some_and(|(time, _)| *time <= now_s - age_s) {
                self.past.pop_front();
            }
        }
    }

    fn pass(&mut self, now_s: f64) {
        if now_s > self.now_s {
            self.axes.advance(now_s - self.now_s, &self.params.limits);
            self.now_s = now_s;
        }
    }

    /// A command as this head carries it out: at the speeds it has.
    fn as_carried_out(&self, command: Command) -> Command {
        let Command::Move(velocity) = command else { return command };
        let at = |speed: f64, top: f64| {
            let level = f64::from(self.params.speed_levels);
            let speed = if level > 0.0 { (speed / top * level).round() / level * top } else { speed };
            speed * self.params.speed_scale
        };
        let limits = &self.params.limits;
        Command::Move(Velocity {
            pan_deg_s: at(velocity.pan_deg_s, limits.pan.max_speed_deg_s),
            tilt_deg_s: at(velocity.tilt_deg_s, limits.tilt.max_speed_deg_s),
            zoom_per_s: velocity.zoom_per_s,
        })
    }

    /// Where the camera truly looks.
    pub fn position(&self) -> Position {
        let Position { direction, zoom } = self.axes.position();
        let quantum = self.params.quantum_deg;
        let step = |angle: f64| if quantum > 0.0 { (angle / quantum).round() * quantum } else { angle };
        Position { direction: Direction::new(step(direction.pan_deg), step(direction.tilt_deg)), zoom }
    }

    /// How fast its motors truly turn.
    pub const fn velocity(&self) -> Velocity {
        self.axes.velocity()
    }

    fn truth(&self) -> Status {
        Status { position: Some(self.position()), moving: Some(self.axes.moves()) }
    }

    /// What it says of itself.
    pub fn status(&self) -> Option<Status> {
        let at_first = |moving| Some(Status { position: Some(self.params.home), moving: Some(moving) });
        match self.params.status.says {
            StatusHonesty::TheTruth => Some(self.truth()),
            StatusHonesty::OldNews => self.past.front().map(|(_, status)| *status),
            StatusHonesty::AlwaysMoving => at_first(true),
            StatusHonesty::AlwaysIdle => at_first(false),
            StatusHonesty::Nothing => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RIGHT: Command = Command::Move(Velocity { pan_deg_s: 10.0, tilt_deg_s: 0.0, zoom_per_s: 0.0 });

    fn pan_after(params: HeadParams, seconds: f64) -> f64 {
        let mut head = SimulatedHead::new(params, 3).unwrap();
        head.command(0.0, RIGHT);
        head.advance_to(seconds);
        head.position().direction.pan_deg
    }

    #[test]
    fn it_obeys_late_and_at_the_speeds_it_has() {
        let ramp = 10.0 / 120.0 / 2.0;
        let plain = HeadParams { delay_s: 0.2, ..HeadParams::default() };
        assert_eq!(pan_after(plain.clone(), 0.2), 0.0);
        assert!((pan_after(plain.clone(), 1.2) - 10.0 * (1.0 - ramp)).abs() < 1e-9);
        let coarse = HeadParams { quantum_deg: 0.5, ..plain.clone() };
        assert_eq!(pan_after(coarse, 1.2), 9.5);
        // Of the speeds 15, 30, 45 and 60, 15 is nearest to 10.
        let few = HeadParams { speed_levels: 4, ..plain.clone() };
        assert!((pan_after(few, 1.2) - 15.0 * (1.0 - 1.5 * ramp)).abs() < 1e-9);
        let fast = HeadParams { speed_scale: 1.5, ..plain };
        assert!((pan_after(fast, 1.2) - 15.0 * (1.0 - 1.5 * ramp)).abs() < 1e-9);
    }

    #[test]
    fn commands_are_lost_and_late_as_often_as_said_but_stay_in_order() {
        let params = HeadParams { dropped: 0.25, jitter_s: 0.5, delay_s: 0.0, ..HeadParams::default() };
        let mut head = SimulatedHead::new(params, 5).unwrap();
        for k in 0..4000 {
            head.command(f64::from(k) * 0.01, RIGHT);
        }
        assert!((2850..3150).contains(&head.pending.len()), "{}", head.pending.len());
        let times: Vec<f64> = head.pending.iter().map(|(time, _)| *time).collect();
        assert!(times.windows(2).all(|w| w[0] <= w[1]));
        let none = SimulatedHead::new(HeadParams { dropped: 1.0, ..HeadParams::default() }, 5);
        let mut none = none.unwrap();
        none.command(0.0, RIGHT);
        none.advance_to(9.0);
        assert_eq!(none.position(), Position::default());
    }

    #[test]
    fn the_same_seed_gives_the_same_head() {
        let run = |seed| {
            let params = HeadParams { dropped: 0.3, jitter_s: 0.1, ..HeadParams::default() };
            let mut head = SimulatedHead::new(params, seed).unwrap();
            for k in 0..50 {
                let speed = f64::from(k % 7) * 3.0;
                head.command(f64::from(k) * 0.1, Command::Move(Velocity { pan_deg_s: speed, ..Velocity::ZERO }));
                head.advance_to(f64::from(k) * 0.1);
            }
            head.position()
        };
        assert_eq!(run(7), run(7));
        assert_ne!(run(7), run(8));
    }

    #[test]
    fn what_it_says_is_as_true_as_asked_for() {
        let said = |says, seconds: f64| {
            let status = StatusParams { says, age_s: 1.0 };
            let mut head = SimulatedHead::new(HeadParams { status, delay_s: 0.0, ..HeadParams::default() }, 1).unwrap();
            head.command(0.0, RIGHT);
            for tick in 0..=(seconds * 10.0) as u32 {
                head.advance_to(f64::from(tick) * 0.1);
            }
            head.status().map(|s| (s.position.unwrap().direction.pan_deg, s.moving.unwrap()))
        };
        let (pan, moving) = said(StatusHonesty::TheTruth, 2.0).unwrap();
        assert!((pan - 19.583_333).abs() < 1e-5 && moving);
        let (pan, _) = said(StatusHonesty::OldNews, 2.0).unwrap();
        assert!((pan - 9.583_333).abs() < 1e-5);
        assert_eq!(said(StatusHonesty::AlwaysMoving, 2.0), Some((0.0, true)));
        assert_eq!(said(StatusHonesty::AlwaysIdle, 2.0), Some((0.0, false)));
        assert_eq!(said(StatusHonesty::Nothing, 2.0), None);
    }

    #[test]
    fn unsound_commands_are_ignored() {
        let mut head = SimulatedHead::new(HeadParams::default(), 1).unwrap();
        head.command(0.0, Command::Move(Velocity { pan_deg_s: f64::NAN, ..Velocity::ZERO }));
        head.command(f64::NAN, RIGHT);
        head.advance_to(3.0);
        assert_eq!(head.position(), Position::default());
    }
}
