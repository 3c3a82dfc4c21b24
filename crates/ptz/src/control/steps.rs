use crate::mechanics::{HeadLimits, travel_time_s};
use crate::{Direction, Position, Velocity};

/// Where to send a head so that it meets the target: the head stands at `from` and turns at `turning` when the command
/// takes effect, and `target` says where the target is a number of seconds after that.
///
/// The time of the meeting is a fixed point: a head that is sent further arrives later. Few rounds suffice, since heads are
/// faster than what they follow; a target that outruns the head is met where it is after the last round.
pub(super) fn meeting(
    from: Position,
    turning: Velocity,
    limits: &HeadLimits,
    target: impl Fn(f64) -> Option<Direction>,
) -> Option<Direction> {
    const ROUNDS: usize = 16;
    const LONGEST_S: f64 = 3.0;
    let mut after_s = 0.0;
    let mut goal = limits.reachable(target(after_s)?);
    for _ in 0..ROUNDS {
        let turn = goal.from(from.direction);
        let pan = travel_time_s(turn.pan_deg, turning.pan_deg_s, &limits.pan);
        let tilt = travel_time_s(turn.tilt_deg, turning.tilt_deg_s, &limits.tilt);
        after_s = pan.max(tilt).min(LONGEST_S);
        goal = limits.reachable(target(after_s)?);
    }
    Some(goal)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_head_and_the_target_arrive_together() {
        let limits = HeadLimits::default();
        for speed in [-15.0, 0.0, 5.0, 15.0] {
            let target = |t: f64| Some(Direction::new(20.0 + speed * t, 1.0));
            let goal = meeting(Position::default(), Velocity::ZERO, &limits, target).unwrap();
            let arrival = travel_time_s(goal.pan_deg, 0.0, &limits.pan);
            assert!((goal.pan_deg - (20.0 + speed * arrival)).abs() < 0.01, "{speed}: {goal:?} {arrival}");
        }
    }

    #[test]
    fn goals_stay_within_the_travel() {
        let target = |t: f64| Some(Direction::new(160.0 + 50.0 * t, 89.0 + 9.0 * t));
        let goal = meeting(Position::default(), Velocity::ZERO, &HeadLimits::default(), target).unwrap();
        assert_eq!(goal, Direction::new(170.0, 90.0));
        assert_eq!(meeting(Position::default(), Velocity::ZERO, &HeadLimits::default(), |_| None), None);
    }
}
