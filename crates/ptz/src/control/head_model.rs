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
    /// Commands by the time when they take effect.
    commands: VecDeque<(f64, Command)>,
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
        let effect_s = self.commands.back().map_or(effect_s, |&(last, _)| effect_s.max(last));
        self.commands.push_back((effect_s, command));
        while self.commands.len() > Self::MOST_COMMANDS
            || self.commands.front().is_some_and(|&(time, _)| time < now_s - Self::MEMORY_S)
        {
            self.settle_first();
        }
    }

    /// Lets the oldest command act for good.
    fn settle_first(&mut self) {
        if let Some((time, command)) = self.commands.pop_front() {
            self.axes.advance(time - self.since_s, &self.limits);
            self.axes.obey(&command);
            self.since_s = self.since_s.max(time);
        }
    }

    /// The axes at `time_s`; before the memory begins, as they were then.
    fn axes_at(&self, time_s: f64) -> Axes {
        let (mut axes, mut now) = (self.axes, self.since_s);
        for (time, command) in self.commands.iter().take_while(|(time, _)| *time <= time_s) {
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

    /// By how much the head changed its speed shortly before `time_s`: the largest difference to the speed then, per axis,
    /// degrees per second.
    pub fn change_before(&self, time_s: f64) -> Direction {
        const STEPS: u32 = 3;
        const STEP_S: f64 = 0.06;
        let now = self.at(time_s).1;
        let change = |step| {
            let then = self.at(time_s - f64::from(step) * STEP_S).1;
            ((now.pan_deg_s - then.pan_deg_s).abs(), (now.tilt_deg_s - then.tilt_deg_s).abs())
        };
        (1..=STEPS)
            .map(change)
            .fold(Direction::AHEAD, |most, (pan, tilt)| Direction::new(most.pan_deg.max(pan), most.tilt_deg.max(tilt)))
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
    fn a_change_of_speed_is_told_for_a_while() {
        let mut model = model();
        model.sent(100.0, RIGHT); // ramps from 100.2 to 100.3
        assert_eq!(model.change_before(100.2), Direction::AHEAD);
        assert!((model.change_before(100.32).pan_deg - 12.0).abs() < 1e-9);
        assert!((model.change_before(100.45).pan_deg - 3.6).abs() < 1e-9); // 0.18 s before, at 100.27: 8.4°/s
        assert_eq!(model.change_before(100.6), Direction::AHEAD);
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
