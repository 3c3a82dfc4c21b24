use crate::mechanics::{Axes, HeadLimits};
use crate::{Command, Direction, Position, Velocity};
use std::collections::VecDeque;

/// Where the head stands at any moment, told from the commands it was given: each takes effect a fixed delay after it was
/// sent, and the axes then move within their limits.
///
/// This is the model of a Smith predictor (Smith 1957): it answers for the past (where did the camera look when this
/// picture was taken?) and for the future (where will it look when this command arrives?). Its error only matters as far
/// as it grows between a picture and the next, because target and head are measured against the same model.
#[derive(Debug, Clone)]
pub struct HeadModel {
    limits: HeadLimits,
    delay_s: f64,
    /// The state at `since_s`, before any of `commands`.
    axes: Axes,
    since_s: f64,
    /// Commands by the time when they take effect, with by how much each changes the speed of pan and of tilt, degrees per second.
    commands: VecDeque<(f64, Command, Direction)>,
    /// How fast the last command lets the head turn, degrees per second of pan and of tilt.
    told: Direction,
}

impl HeadModel {
    /// How far back it can be asked, seconds.
    pub const MEMORY_S: f64 = 3.0;
    /// The most commands kept; older ones are taken to have acted.
    const MOST_COMMANDS: usize = 512;

    /// A head at rest at `home`, whose commands take effect `delay_s` after they are sent.
    pub fn new(limits: HeadLimits, delay_s: f64, home: Position, now_s: f64) -> Self {
        Self {
            limits,
            delay_s,
            axes: Axes::at(home),
            since_s: now_s - Self::MEMORY_S,
            commands: VecDeque::with_capacity(Self::MOST_COMMANDS + 1),
            told: Direction::AHEAD,
        }
    }

    /// What the axes can do.
    pub const fn limits(&self) -> &HeadLimits {
        &self.limits
    }

    /// How long after its sending a command takes effect, seconds.
    pub const fn delay_s(&self) -> f64 {
        self.delay_s
    }

    /// Takes note that `command` was sent at `now_s`.
    pub fn sent(&mut self, now_s: f64, command: Command) {
        let effect_s = now_s + self.delay_s;
        // A clock that jumps back must not mix up the order.
        let effect_s = self.commands.back().map_or(effect_s, |&(last, ..)| effect_s.max(last));
        let told = self.speed_told(effect_s, &command);
        let change = Direction::new(told.pan_deg - self.told.pan_deg, told.tilt_deg - self.told.tilt_deg);
        self.commands.push_back((effect_s, command, change));
        self.told = told;
        while self.commands.len() > Self::MOST_COMMANDS
            || self.commands.front().is_some_and(|&(time, ..)| time < now_s - Self::MEMORY_S)
        {
            self.settle_first();
        }
    }

    /// It stands elsewhere than was thought, and stood so all the time.
    pub fn shift(&mut self, by: Direction) {
        self.axes.shift(by);
    }

    /// Lets the oldest command act for good.
    fn settle_first(&mut self) {
        if let Some((time, command, _)) = self.commands.pop_front() {
            self.axes.advance(time - self.since_s, &self.limits);
            self.axes.obey(&command);
            self.since_s = self.since_s.max(time);
        }
    }

    /// The axes at `time_s`; before the memory begins, as they were then.
    fn axes_at(&self, time_s: f64) -> Axes {
        let (mut axes, mut now) = (self.axes, self.since_s);
        for (time, command, _) in self.commands.iter().take_while(|(time, ..)| *time <= time_s) {
            axes.advance(time - now, &self.limits);
            axes.obey(command);
            now = now.max(*time);
        }
        axes.advance(time_s - now, &self.limits);
        axes
    }

    /// Where the camera looks and how fast the motors turn at `time_s`.
    pub fn at(&self, time_s: f64) -> (Position, Velocity) {
        let axes = self.axes_at(time_s);
        (axes.position(), axes.velocity())
    }

    /// How fast a command lets the head turn: the speed told, or the greatest on the way to where it is sent.
    fn speed_told(&self, effect_s: f64, command: &Command) -> Direction {
        match command {
            Command::Move(v) => {
                let clamped = |speed: f64, top: f64| speed.clamp(-top, top);
                let Velocity { pan_deg_s, tilt_deg_s, .. } = *v;
                let HeadLimits { pan, tilt, .. } = &self.limits;
                Direction::new(clamped(pan_deg_s, pan.max_speed_deg_s), clamped(tilt_deg_s, tilt.max_speed_deg_s))
            }
            Command::Stop => Direction::AHEAD,
            Command::GoTo { .. } | Command::TurnBy { .. } | Command::Preset { .. } | Command::Home => {
                let mut axes = self.axes_at(effect_s);
                axes.obey(command);
                let mut most = Direction::AHEAD;
                for _ in 0..Self::LOOKS {
                    axes.advance(Self::LOOK_S, &self.limits);
                    let Velocity { pan_deg_s, tilt_deg_s, .. } = axes.velocity();
                    let larger = |a: f64, b: f64| if b.abs() > a.abs() { b } else { a };
                    most = Direction::new(larger(most.pan_deg, pan_deg_s), larger(most.tilt_deg, tilt_deg_s));
                }
                most
            }
        }
    }

    /// How often, and how far apart in seconds, a head that is sent somewhere is looked at for its greatest speed.
    const LOOKS: u32 = 8;
    const LOOK_S: f64 = 0.06;

    /// By how much the head may have come apart from this model from `from_s` to `to_s`, as a variance per unit of the variance
    /// of a command's delay, (degrees per second)² of pan and of tilt.
    ///
    /// A command that changes the speed by `Δv` and takes effect `δ` later than assumed leaves the head `Δv δ` away from its
    /// model for good. That adds up command by command, as a random walk of variance `Σ Δv² σ²`. When a command of delay
    /// `± σ` takes effect is uncertain by `±√3 σ`, and its part is spread over that time.
    pub fn drift(&self, from_s: f64, to_s: f64, sigma_s: f64) -> Direction {
        let half = (3.0_f64.sqrt() * sigma_s).max(1e-3);
        let mut sum = Direction::AHEAD;
        for (time, _, change) in &self.commands {
            let part = (to_s.min(time + half) - from_s.max(time - half)).max(0.0) / (2.0 * half);
            sum.pan_deg += part * change.pan_deg.powi(2);
            sum.tilt_deg += part * change.tilt_deg.powi(2);
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn model() -> HeadModel {
        HeadModel::new(HeadLimits::default(), 0.2, Position::default(), 100.0)
    }

    fn pan(model: &HeadModel, time_s: f64) -> f64 {
        model.at(time_s).0.direction.pan_deg
    }

    const RIGHT: Command = Command::Move(Velocity { pan_deg_s: 12.0, tilt_deg_s: 0.0, zoom_per_s: 0.0 });

    #[test]
    fn commands_take_effect_after_the_delay() {
        let mut model = model();
        model.sent(100.0, RIGHT);
        assert_eq!(pan(&model, 100.2), 0.0);
        // ramp of 0.1 s (0.6°), then 12°/s
        assert!((pan(&model, 100.3) - 0.6).abs() < 1e-9);
        assert!((pan(&model, 101.3) - 12.6).abs() < 1e-9);
        assert!((model.at(101.0).1.pan_deg_s - 12.0).abs() < 1e-9);
        model.sent(101.1, Command::Stop);
        assert!((pan(&model, 109.0) - 13.2).abs() < 1e-9);
        assert!((pan(&model, 100.3) - 0.6).abs() < 1e-9, "the past stays as it was");
    }

    #[test]
    fn drift_grows_with_every_change_of_speed() {
        let mut model = model();
        model.sent(100.0, RIGHT);
        model.sent(101.0, Command::Stop);
        assert_eq!(model.drift(99.0, 100.1, 0.01), Direction::AHEAD);
        assert!((model.drift(99.0, 100.5, 0.01).pan_deg - 144.0).abs() < 1e-9);
        assert!((model.drift(99.0, 100.2, 0.01).pan_deg - 72.0).abs() < 1e-9, "half of its time");
        assert!((model.drift(99.0, 102.0, 0.01).pan_deg - 288.0).abs() < 1e-9);
        model.sent(102.0, RIGHT);
        model.sent(102.5, RIGHT);
        assert_eq!(model.drift(102.6, 103.0, 0.01), Direction::AHEAD, "the same speed again");
        model.sent(103.0, Command::TurnBy { by: Direction::new(-5.0, 0.0) });
        assert!(model.drift(103.1, 103.4, 0.01).pan_deg > 144.0);
    }

    #[test]
    fn the_past_is_forgotten_without_a_jump() {
        let mut model = model();
        for step in 0..2000 {
            let now = 100.0 + f64::from(step) * 0.05;
            let speed = if step % 40 < 20 { 10.0 } else { -10.0 };
            let command = Command::Move(Velocity { pan_deg_s: speed, ..Velocity::ZERO });
            let before = (pan(&model, now - 2.5), pan(&model, now + 0.2));
            model.sent(now, command);
            let after = (pan(&model, now - 2.5), pan(&model, now + 0.2));
            if step > 60 {
                assert!((before.0 - after.0).abs() < 0.02 && (before.1 - after.1).abs() < 0.02, "{step}");
            }
        }
        assert!(model.commands.len() <= 70);
    }

    #[test]
    fn many_commands_at_once_are_bounded_and_a_clock_that_jumps_back_is_borne() {
        let mut model = model();
        for _ in 0..5000 {
            model.sent(100.0, RIGHT);
        }
        assert!(model.commands.len() <= HeadModel::MOST_COMMANDS);
        model.sent(50.0, Command::Stop);
        let (position, velocity) = model.at(101.0);
        assert_eq!((position.direction, velocity), (Direction::AHEAD, Velocity::ZERO), "the stop comes last");
    }
}
