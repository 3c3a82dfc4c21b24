use super::{Capabilities, Head};
use crate::{Command, Direction, Result, Status, Velocity};
use std::time::{Duration, Instant};

/// A head that cannot move at a velocity and turns by angles instead: it is told again and again to turn by what the velocity
/// makes of the time between.
#[derive(Debug)]
pub struct ByTurns<H> {
    head: H,
    /// The velocity told last, and when.
    moving: Option<(Velocity, Instant)>,
    /// What is still to be turned.
    left: Direction,
    turned: Instant,
}

impl<H: Head> ByTurns<H> {
    /// How often it is told to turn: each turn costs a head its start and its stop.
    const EVERY: Duration = Duration::from_millis(200);
    /// A velocity lasts no longer than that without being told again.
    const LASTS: Duration = Duration::from_millis(500);

    /// `head`, which turns by angles.
    pub fn new(head: H) -> Self {
        Self { head, moving: None, left: Direction::AHEAD, turned: Instant::now() }
    }

    fn velocity(&mut self, velocity: Velocity, now: Instant) -> Result<()> {
        if let Some((before, since)) = self.moving.replace((velocity, now)) {
            let seconds = now.saturating_duration_since(since).min(Self::LASTS).as_secs_f64();
            self.left = self.left.turned(Direction::new(before.pan_deg_s * seconds, before.tilt_deg_s * seconds));
        }
        if now.saturating_duration_since(self.turned) < Self::EVERY || self.left == Direction::AHEAD {
            return Ok(());
        }
        self.turned = now;
        let by = std::mem::replace(&mut self.left, Direction::AHEAD);
        self.head.send(&Command::TurnBy { by })
    }
}

impl<H: Head> Head for ByTurns<H> {
    fn name(&self) -> &str {
        self.head.name()
    }

    fn capabilities(&self) -> Capabilities {
        Capabilities { velocity: true, ..self.head.capabilities() }
    }

    fn send(&mut self, command: &Command) -> Result<()> {
        if let Command::Move(velocity) = command {
            return self.velocity(*velocity, Instant::now());
        }
        (self.moving, self.left) = (None, Direction::AHEAD);
        self.head.send(command)
    }

    fn status(&mut self) -> Result<Option<Status>> {
        self.head.status()
    }

    fn leave(&mut self) {
        self.head.leave();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Default)]
    struct Noted(Vec<Command>);

    impl Head for Noted {
        fn name(&self) -> &str {
            "noted"
        }
        fn capabilities(&self) -> Capabilities {
            Capabilities { relative: true, ..Capabilities::default() }
        }
        fn send(&mut self, command: &Command) -> Result<()> {
            self.0.push(*command);
            Ok(())
        }
        fn status(&mut self) -> Result<Option<Status>> {
            Ok(None)
        }
        fn leave(&mut self) {}
    }

    #[test]
    fn a_velocity_becomes_turns_of_the_same_way() {
        let mut head = ByTurns::new(Noted::default());
        assert!(head.capabilities().velocity);
        let began = Instant::now();
        let velocity = Velocity { pan_deg_s: 10.0, tilt_deg_s: -4.0, zoom_per_s: 0.0 };
        for k in 0..=50 {
            head.velocity(velocity, began + Duration::from_millis(40 * k)).unwrap();
        }
        let turns: Vec<Direction> =
            head.head.0.iter().filter_map(|c| if let Command::TurnBy { by } = c { Some(*by) } else { None }).collect();
        assert_eq!(turns.len(), head.head.0.len());
        assert!((8..=11).contains(&turns.len()), "{turns:?}");
        let way = turns.iter().fold(head.left, |sum, by| sum.turned(*by));
        assert!((way.pan_deg - 20.0).abs() < 1e-6 && (way.tilt_deg + 8.0).abs() < 1e-6, "{way:?}");
        head.send(&Command::Stop).unwrap();
        assert_eq!((head.head.0.last(), head.left), (Some(&Command::Stop), Direction::AHEAD));
    }
}
