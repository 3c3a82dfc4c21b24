use super::{Axis, Goal, HeadLimits};
use crate::{Command, Direction, Position, Velocity};

/// The three axes of a head, and what a command does to them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axes {
    pan: Axis,
    tilt: Axis,
    zoom: Axis,
    home: Position,
}

impl Axes {
    /// At rest at `home`, which is also where [`Command::Home`] leads.
    pub const fn at(home: Position) -> Self {
        Self {
            pan: Axis::at(home.direction.pan_deg),
            tilt: Axis::at(home.direction.tilt_deg),
            zoom: Axis::at(home.zoom),
            home,
        }
    }

    /// Obeys a command from now on. Presets are unknown here and change nothing.
    pub const fn obey(&mut self, command: &Command) {
        match *command {
            Command::Move(Velocity { pan_deg_s, tilt_deg_s, zoom_per_s }) => {
                self.pan.aim(Goal::Speed(pan_deg_s));
                self.tilt.aim(Goal::Speed(tilt_deg_s));
                self.zoom.aim(Goal::Speed(zoom_per_s));
            }
            Command::GoTo { direction, zoom } => {
                self.pan.aim(Goal::Angle(direction.pan_deg));
                self.tilt.aim(Goal::Angle(direction.tilt_deg));
                if let Some(zoom) = zoom {
                    self.zoom.aim(Goal::Angle(zoom));
                }
            }
            Command::TurnBy { by } => {
                self.pan.aim_by(by.pan_deg);
                self.tilt.aim_by(by.tilt_deg);
            }
            Command::Home => {
                self.pan.aim(Goal::Angle(self.home.direction.pan_deg));
                self.tilt.aim(Goal::Angle(self.home.direction.tilt_deg));
                self.zoom.aim(Goal::Angle(self.home.zoom));
            }
            Command::Preset { .. } => {}
            Command::Stop => {
                self.pan.aim(Goal::Speed(0.0));
                self.tilt.aim(Goal::Speed(0.0));
                self.zoom.aim(Goal::Speed(0.0));
            }
        }
    }

    /// It stands elsewhere than was thought; where it is sent stays.
    pub fn shift(&mut self, by: Direction) {
        self.pan.shift(by.pan_deg);
        self.tilt.shift(by.tilt_deg);
    }

    /// Lets `seconds` pass.
    pub fn advance(&mut self, seconds: f64, limits: &HeadLimits) {
        self.pan.advance(seconds, &limits.pan);
        self.tilt.advance(seconds, &limits.tilt);
        self.zoom.advance(seconds, &limits.zoom_axis());
    }

    /// Where the camera looks.
    pub const fn position(&self) -> Position {
        let direction = Direction::new(self.pan.angle_deg(), self.tilt.angle_deg());
        Position { direction, zoom: self.zoom.angle_deg() }
    }

    /// How fast the motors turn.
    pub const fn velocity(&self) -> Velocity {
        Velocity {
            pan_deg_s: self.pan.speed_deg_s(),
            tilt_deg_s: self.tilt.speed_deg_s(),
            zoom_per_s: self.zoom.speed_deg_s(),
        }
    }

    /// Whether anything turns, or will.
    pub fn moves(&self) -> bool {
        self.pan.moves() || self.tilt.moves() || self.zoom.moves()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn after(commands: &[Command]) -> Axes {
        let mut axes = Axes::at(Position { direction: Direction::new(5.0, 2.0), zoom: 0.5 });
        for command in commands {
            axes.obey(command);
            axes.advance(20.0, &HeadLimits::default());
        }
        axes
    }

    #[test]
    fn each_command_does_what_it_says() {
        let there = Command::GoTo { direction: Direction::new(30.0, -10.0), zoom: Some(0.25) };
        let position = after(&[there]).position();
        assert!((position.direction.pan_deg - 30.0).abs() < 1e-9 && (position.direction.tilt_deg + 10.0).abs() < 1e-9);
        assert!((position.zoom - 0.25).abs() < 1e-9);

        let stays = after(&[Command::GoTo { direction: Direction::AHEAD, zoom: None }]).position();
        assert!((stays.zoom - 0.5).abs() < 1e-12);

        let turned = after(&[Command::TurnBy { by: Direction::new(-10.0, 3.0) }]).position().direction;
        assert!((turned.pan_deg + 5.0).abs() < 1e-9 && (turned.tilt_deg - 5.0).abs() < 1e-9);

        let home = after(&[there, Command::Preset { number: 1 }, Command::Home]);
        assert!(home.position().direction.angle_to(Direction::new(5.0, 2.0)) < 1e-9 && !home.moves());
        assert!((home.position().zoom - 0.5).abs() < 1e-9);
    }

    #[test]
    fn moving_goes_on_until_stopped() {
        let mut axes = after(&[]);
        let velocity = Velocity { pan_deg_s: 10.0, tilt_deg_s: -4.0, zoom_per_s: 0.1 };
        axes.obey(&Command::Move(velocity));
        axes.advance(1.0, &HeadLimits::default());
        assert!(axes.moves());
        let now = axes.velocity();
        assert!((now.pan_deg_s - 10.0).abs() < 1e-9 && (now.tilt_deg_s + 4.0).abs() < 1e-9);
        assert!((now.zoom_per_s - 0.1).abs() < 1e-9);
        let ramp = 10.0 / 120.0; // seconds, on average at half the speed
        assert!((axes.position().direction.pan_deg - (15.0 - 10.0 * ramp / 2.0)).abs() < 1e-9);
        axes.obey(&Command::Stop);
        axes.advance(1.0, &HeadLimits::default());
        assert!(!axes.moves() && axes.velocity().is_zero());
    }
}
