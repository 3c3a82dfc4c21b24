use super::HeadModel;
use super::departure::Departure;
use super::own_word::{Honesty, OwnWord};
use crate::mechanics::HeadLimits;
use crate::{Command, Direction, Position, Status, Velocity};

/// Where the head is believed to stand at any moment: by its commands ([`HeadModel`]), and by its own word where that proves
/// honest ([`OwnWord`]).
#[derive(Debug, Clone)]
pub struct BelievedHead {
    model: HeadModel,
    word: OwnWord,
}

impl BelievedHead {
    /// How fast a word that is true but old corrects the model, per second.
    const SLOWLY_PER_S: f64 = 0.5;

    /// A head at rest at `home`, whose commands take effect `delay_s` after they are sent.
    pub fn new(limits: HeadLimits, delay_s: f64, home: Position, now_s: f64) -> Self {
        Self { model: HeadModel::new(limits, delay_s, home, now_s), word: OwnWord::default() }
    }

    /// Takes note that `command` was sent at `now_s`.
    pub fn sent(&mut self, now_s: f64, command: Command) {
        self.model.sent(now_s, command);
    }

    /// What the head says of itself.
    pub const fn word(&self) -> &OwnWord {
        &self.word
    }

    /// What the head was noticed to do that it was not told, once for each time.
    pub fn departure(&mut self) -> Option<Departure> {
        self.word.departure()
    }

    /// Whether what the head says of itself is true and prompt, and so is what is believed.
    pub fn prompt(&self) -> bool {
        self.word.honesty() == Honesty::Prompt
    }

    /// By how much longer than assumed commands take by the head's own word, seconds; 0 where that is not believed.
    pub fn late_s(&self) -> f64 {
        if self.prompt() { self.word.lag_s() } else { 0.0 }
    }

    /// The head says at `now_s` how it stands. Gives back by how much its believed direction changed at once, for whoever
    /// measured by the former.
    pub fn hear(&mut self, now_s: f64, status: &Status) -> Direction {
        let Some(position) = status.position.filter(|p| p.direction.is_finite()) else { return Direction::AHEAD };
        let before_s = self.word.last().map(|(time, _)| time);
        let (believed, was_prompt) = (self.at(now_s).0.direction, self.prompt());
        self.word.hear(now_s, position.direction, &self.model);
        let Some((_, said)) = self.word.last().filter(|(time, _)| *time == now_s) else { return Direction::AHEAD };
        let off = said.from(self.model.at(now_s - self.word.lag_s()).0.direction);
        match self.word.honesty() {
            Honesty::Prompt => {
                self.shift(off);
                // From word to word the head is followed; when it begins to be believed it is somewhere else at once.
                if was_prompt { Direction::AHEAD } else { self.at(now_s).0.direction.from(believed) }
            }
            Honesty::Late => {
                let passed_s = before_s.map_or(0.0, |before| (now_s - before).clamp(0.0, 1.0));
                let part = 1.0 - (-Self::SLOWLY_PER_S * passed_s).exp();
                let by = Direction::new(part * off.pan_deg, part * off.tilt_deg);
                self.shift(by);
                by
            }
            Honesty::Unproven | Honesty::Lies => Direction::AHEAD,
        }
    }

    fn shift(&mut self, by: Direction) {
        self.model.shift(by);
        self.word.shifted(by);
    }

    /// Where the camera looks and how fast it turns at `time_s`.
    pub fn at(&self, time_s: f64) -> (Position, Velocity) {
        if !self.prompt() {
            return self.model.at(time_s);
        }
        let lag_s = self.word.lag_s();
        let (position, turning) = self.model.at(time_s - lag_s);
        if let Some((direction, speed)) = self.word.at(time_s) {
            let velocity = Velocity { pan_deg_s: speed.pan_deg, tilt_deg_s: speed.tilt_deg, ..turning };
            return (Position { direction, ..position }, velocity);
        }
        // The model is in line with the last word, and goes on from there.
        (position, turning)
    }

    /// [`HeadModel::drift`], and none while the head itself says how it stood.
    pub fn drift(&self, from_s: f64, to_s: f64, sigma_s: f64) -> Direction {
        match self.word.last().filter(|_| self.prompt()) {
            None => self.model.drift(from_s, to_s, sigma_s),
            Some((said_s, _)) if said_s >= to_s => Direction::AHEAD,
            Some((said_s, _)) => {
                let lag_s = self.word.lag_s();
                self.model.drift(from_s.max(said_s) - lag_s, to_s - lag_s, sigma_s)
            }
        }
    }
}
