use crate::mechanics::{HeadLimits, travel_time_s};
use crate::{Command, Direction, Position};
use pursuit_parameters::{choices, parameters};

choices! {
    /// What a follower does about a target that is lost.
    pub enum LostPolicy {
        /// Stand still.
        Hold = "hold",
        /// Stand still and zoom out to the widest view.
        ZoomOut = "zoom_out",
        /// Go to the head's home position.
        Home = "home",
        /// Stand still, and after a while go back to where it looked when it began to follow.
        Return = "return",
        /// Zoom out and look to both sides of where the target was expected, wider and wider.
        Search = "search",
        /// Stand still, and after a while go to a stored position of the head.
        Preset = "preset",
        /// Stand still, and after a while go from one stored position of the head to the next, again and again.
        Patrol = "patrol",
    }
}

parameters! {
    /// What to do about a target that is lost.
    #[derive(Copy)]
    pub struct LostParams {
        /// Stand still, zoom out, go home, go back to where it waited, search (zoom out and look to both sides, wider and wider), or go to
        /// stored positions.
        pub policy: LostPolicy = LostPolicy::Hold;
        /// Of `search`: how far the first look to the side goes.
        pub amplitude_deg: f64 = 20.0, in above(0.0).at_most(180.0), unit "deg";
        /// Of `search` and `patrol`: how long to look at each place; a patrol's way there counts.
        pub dwell_s: f64 = 1.0, in 0.0..=3600.0, unit "s";
        /// Of `return`, `preset` and `patrol`: for how long to stand still first.
        pub after_s: f64 = 10.0, in 0.0..=86400.0, unit "s";
        /// Of `preset` and `patrol`: the number of the stored position, the first of several.
        pub preset: u32 = 1, in 0..=255;
        /// Of `patrol`: how many stored positions there are, numbered on from the first.
        pub presets: u32 = 2, in 1..=255;
        /// Of `search`: after how many looks to stand still.
        pub looks: u32 = 12;
    }
}

/// A loss under way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Loss {
    /// Where the target was last expected.
    around: Direction,
    looked: u32,
    next_s: f64,
    began_s: f64,
}

impl Loss {
    /// How often a head that shall stand is told so, seconds.
    const STOP_AGAIN_S: f64 = 1.0;

    pub const fn new(now_s: f64, around: Direction) -> Self {
        Self { around, looked: 0, next_s: now_s, began_s: now_s }
    }

    /// Whether it has stood long enough and is to go back to where it waited.
    pub fn returns(&self, params: &LostParams, now_s: f64) -> bool {
        params.policy == LostPolicy::Return && now_s >= self.began_s + params.after_s
    }

    /// The next command of the policy, if one is due; the head stands at `from` by then.
    pub fn act(&mut self, params: &LostParams, now_s: f64, from: Position, limits: &HeadLimits) -> Option<Command> {
        if now_s < self.next_s {
            return None;
        }
        let look = self.looked;
        self.looked = look.saturating_add(1);
        self.next_s = f64::INFINITY;
        match params.policy {
            LostPolicy::Hold | LostPolicy::Return => Some(self.stop(now_s)),
            LostPolicy::ZoomOut => {
                (look == 0).then_some(Command::GoTo { direction: limits.reachable(from.direction), zoom: Some(0.0) })
            }
            LostPolicy::Home => (look == 0).then_some(Command::Home),
            LostPolicy::Preset | LostPolicy::Patrol if now_s < self.began_s + params.after_s => {
                self.looked = 0;
                let stop = self.stop(now_s);
                self.next_s = self.next_s.min(self.began_s + params.after_s);
                Some(stop)
            }
            LostPolicy::Preset => (look == 0).then(|| preset(params, 0)),
            LostPolicy::Patrol => {
                self.next_s = now_s + params.dwell_s.max(Self::STOP_AGAIN_S);
                Some(preset(params, look % params.presets.max(1)))
            }
            LostPolicy::Search => {
                if look >= params.looks {
                    return Some(self.stop(now_s));
                }
                let direction = limits.reachable(self.around.turned(Self::side(look, params.amplitude_deg)));
                let turn = direction.from(from.direction);
                let travel = travel_time_s(turn.pan_deg, 0.0, &limits.pan);
                self.next_s = now_s + travel.max(travel_time_s(turn.tilt_deg, 0.0, &limits.tilt)) + params.dwell_s;
                Some(Command::GoTo { direction, zoom: Some(0.0) })
            }
        }
    }

    /// Stops, and will say so again: a command may get lost.
    const fn stop(&mut self, now_s: f64) -> Command {
        self.next_s = now_s + Self::STOP_AGAIN_S;
        Command::Stop
    }

    /// Where the look number `look` goes: the middle, right, left, further right, further left, …
    fn side(look: u32, amplitude_deg: f64) -> Direction {
        let ring = f64::from(look.div_ceil(2));
        let sign = if look % 2 == 1 { 1.0 } else { -1.0 };
        Direction::new(sign * ring * amplitude_deg, 0.0)
    }
}

/// The stored position so many numbers after the first.
fn preset(params: &LostParams, later: u32) -> Command {
    Command::Preset { number: u8::try_from(params.preset.saturating_add(later)).unwrap_or(u8::MAX) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn commands(params: LostParams) -> Vec<(f64, Command)> {
        let limits = HeadLimits::default();
        let mut loss = Loss::new(10.0, Direction::new(100.0, 3.0));
        let mut from = Position { direction: Direction::new(90.0, 1.0), zoom: 0.7 };
        let mut out = Vec::new();
        for tick in 0..1000 {
            let now = 10.0 + f64::from(tick) * 0.1;
            if let Some(command) = loss.act(&params, now, from, &limits) {
                if let Command::GoTo { direction, .. } = command {
                    from.direction = direction;
                }
                out.push((now, command));
            }
        }
        out
    }

    fn single(policy: LostPolicy) -> Vec<(f64, Command)> {
        commands(LostParams { policy, ..LostParams::default() })
    }

    #[test]
    fn stopping_is_repeated_and_other_single_acts_are_done_once() {
        let holds = single(LostPolicy::Hold);
        assert!(holds.iter().all(|(_, command)| *command == Command::Stop));
        assert!((90..=100).contains(&holds.len()), "once a second for 100 s, not {} times", holds.len());
        assert_eq!(single(LostPolicy::Home), [(10.0, Command::Home)]);
        let out = Command::GoTo { direction: Direction::new(90.0, 1.0), zoom: Some(0.0) };
        assert_eq!(single(LostPolicy::ZoomOut), [(10.0, out)]);
    }

    #[test]
    fn presets_are_gone_to_after_a_while() {
        let params = LostParams { policy: LostPolicy::Preset, after_s: 3.0, preset: 7, ..LostParams::default() };
        let told = commands(params);
        let moves: Vec<_> = told.iter().filter(|(_, command)| *command != Command::Stop).collect();
        assert_eq!(moves.len(), 1, "{told:?}");
        assert!((moves[0].0 - 13.0).abs() < 0.11 && moves[0].1 == Command::Preset { number: 7 });
        assert!(told.len() >= 4, "it is told to stand before");
        let params = LostParams { policy: LostPolicy::Patrol, dwell_s: 20.0, after_s: 0.0, presets: 3, ..params };
        let numbers: Vec<u8> = commands(params)
            .iter()
            .filter_map(|(_, command)| if let Command::Preset { number } = command { Some(*number) } else { None })
            .collect();
        assert_eq!(numbers, [7, 8, 9, 7, 8]);
    }

    #[test]
    fn a_search_widens_within_the_travel_and_ends() {
        let search = LostParams {
            policy: LostPolicy::Search,
            amplitude_deg: 30.0,
            dwell_s: 2.0,
            looks: 6,
            ..LostParams::default()
        };
        let found = commands(search);
        let pans: Vec<f64> = found
            .iter()
            .filter_map(|(_, command)| match command {
                Command::GoTo { direction, zoom: Some(0.0) } if direction.tilt_deg == 3.0 => Some(direction.pan_deg),
                _ => None,
            })
            .collect();
        assert_eq!(pans, [100.0, 130.0, 70.0, 160.0, 40.0, 170.0]);
        assert!(found[6..].iter().all(|(_, command)| *command == Command::Stop) && found.len() > 20);
        // Each look is given its travel and its dwelling: 60° take 1.5 s, then 2 s.
        assert!((found[3].0 - found[2].0 - 3.5).abs() < 0.11, "{found:?}");
    }
}
