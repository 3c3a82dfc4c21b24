use super::HeadModel;
use super::departure::Departure;
use crate::Direction;
use std::collections::VecDeque;

/// How far what a head says of itself is believed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Honesty {
    /// It has not moved far enough for what it says to be compared with what it was told.
    Unproven,
    /// It says what its commands have not done, or nothing that changes.
    Lies,
    /// True, but of a while ago: good enough to correct slow errors.
    Late,
    /// True and prompt: where it says that it stood is where it stood.
    Prompt,
}

/// What a head said, and where it stood by its model then, for each lag.
#[derive(Debug, Clone, Copy)]
struct Compared {
    time_s: f64,
    said: Direction,
    by_model: [Direction; OwnWord::LAGS],
}

/// What a head says of itself, compared with what it was told.
///
/// Heads lie: some always say that they move, some say where they stood at first, some say an old position. So the way that a
/// head says it went within half a second is compared with the way by its model, for several lags between both, and the lag
/// that fits best is kept. Where what is left is small beside the way gone, the head is honest. Where the zero of its angles is
/// does not matter to that.
#[derive(Debug, Clone)]
pub struct OwnWord {
    said: VecDeque<(f64, Direction)>,
    compared: VecDeque<Compared>,
    /// For each lag the sum of squares of what the model does not explain, degrees² s, older ones forgotten.
    unexplained: [f64; Self::LAGS],
    /// The sums of squares of the ways said and by the model, degrees² s.
    way_said: f64,
    way_told: f64,
    /// The sum of squares of the changes of speed that were told, degrees² / s.
    changes: f64,
    lag_s: f64,
    honesty: Honesty,
    /// By how much the model was shifted in all since this value was made: what is compared is before all shifts.
    shifted: Direction,
    /// Since when the head departs from what it was told, and how.
    departs: Option<(f64, Departure)>,
    /// A departure that nobody was told of yet.
    news: Option<Departure>,
}

impl Default for OwnWord {
    /// A head that has said nothing.
    fn default() -> Self {
        Self {
            said: VecDeque::new(),
            compared: VecDeque::new(),
            unexplained: [0.0; Self::LAGS],
            way_said: 0.0,
            way_told: 0.0,
            changes: 0.0,
            lag_s: 0.0,
            honesty: Honesty::Unproven,
            shifted: Direction::AHEAD,
            departs: None,
            news: None,
        }
    }
}

impl OwnWord {
    /// The lags between model and word that are tried: this many, so far apart, from the first on, seconds.
    const LAGS: usize = 15;
    const APART_S: f64 = 0.1;
    const FIRST_S: f64 = -0.1;
    /// Over which time ways are compared, and how often, seconds.
    const WAY_S: f64 = 0.5;
    const EVERY_S: f64 = 0.095;
    /// For how long a comparison counts, seconds.
    const MEMORY_S: f64 = 10.0;
    /// How far a head must have gone to be judged, degrees² s.
    const PROVES: f64 = 4.0;
    /// Which part of the way may stay unexplained for a head to be honest, and to stay so.
    const HONEST: f64 = 0.25;
    const STAYS_HONEST: f64 = 0.4;
    /// Up to this lag a word is prompt, seconds.
    const PROMPT_S: f64 = 0.45;
    /// Over at least this time a head is looked at for what it was not told, and for so long it is believed all the same, seconds.
    const LOOKED_AT_S: f64 = 0.8;
    const EXCUSED_S: f64 = 3.0;

    /// How far it is believed.
    pub const fn honesty(&self) -> Honesty {
        self.honesty
    }

    /// By how much what the head says is behind its model, seconds: commands are later than assumed by that, or the word is old.
    pub const fn lag_s(&self) -> f64 {
        self.lag_s
    }

    /// How much the delay of commands varies, one standard deviation, seconds, by what the head says: what the model leaves
    /// unexplained of the ways gone comes from changes of speed that acted earlier or later. `None` before that is known.
    pub fn jitter_s(&self) -> Option<f64> {
        let least = self.unexplained.iter().copied().fold(f64::INFINITY, f64::min);
        let known = self.honesty == Honesty::Prompt && self.changes > 1.0;
        known.then(|| (least / self.changes).sqrt())
    }

    /// What it said last: when, and where it stood.
    pub fn last(&self) -> Option<(f64, Direction)> {
        self.said.back().copied()
    }

    /// What the head was noticed to do that it was not told, once for each time.
    pub fn departure(&mut self) -> Option<Departure> {
        self.news.take()
    }

    /// The model was shifted.
    pub fn shifted(&mut self, by: Direction) {
        self.shifted = self.shifted.turned(by);
    }

    /// The head says at `now_s` that it stands at `position`. A word that is not newer than the last changes nothing.
    pub fn hear(&mut self, now_s: f64, position: Direction, model: &HeadModel) {
        if !position.is_finite() || self.said.back().is_some_and(|(time, _)| now_s <= *time) {
            return;
        }
        // Pans of heads that turn without end are counted on.
        let position = self.said.back().map_or(position, |(_, last)| last.turned(position.from(*last)));
        self.said.push_back((now_s, position));
        while self.said.front().is_some_and(|(time, _)| *time < now_s - HeadModel::MEMORY_S) {
            self.said.pop_front();
        }
        if self.compared.back().is_none_or(|last| now_s >= last.time_s + Self::EVERY_S) {
            self.compare(now_s, position, model);
        }
    }

    fn compare(&mut self, now_s: f64, said: Direction, model: &HeadModel) {
        let unshifted =
            |at: Direction| Direction::new(at.pan_deg - self.shifted.pan_deg, at.tilt_deg - self.shifted.tilt_deg);
        let lag = |k: usize| Self::FIRST_S + k as f64 * Self::APART_S;
        let by_model = std::array::from_fn(|k| unshifted(model.at(now_s - lag(k)).0.direction));
        let now = Compared { time_s: now_s, said, by_model };
        let before = self.compared.iter().rev().find(|c| c.time_s <= now_s - Self::WAY_S).copied();
        self.look_for_departure(&now, model);
        // For a while a departure is the head's; what goes on for longer speaks against its word.
        let excused = self.departs.is_some_and(|(since_s, _)| now_s < since_s + Self::EXCUSED_S);
        if let (Some(before), Some(last), false) = (before, self.compared.back(), excused) {
            let passed_s = (now_s - last.time_s).min(1.0);
            let keeps = (-passed_s / Self::MEMORY_S).exp();
            let square = |by: Direction| by.pan_deg.powi(2) + by.tilt_deg.powi(2);
            let less = |a: Direction, b: Direction| Direction::new(a.pan_deg - b.pan_deg, a.tilt_deg - b.tilt_deg);
            let way = less(now.said, before.said);
            for (k, sum) in self.unexplained.iter_mut().enumerate() {
                let told = less(now.by_model[k], before.by_model[k]);
                *sum = keeps * *sum + passed_s * square(less(way, told));
            }
            let told = less(now.by_model[1], before.by_model[1]);
            let drift = model.drift(before.time_s - self.lag_s, now_s - self.lag_s, 0.0);
            self.way_said = keeps * self.way_said + passed_s * square(way);
            self.way_told = keeps * self.way_told + passed_s * square(told);
            self.changes = keeps * self.changes + passed_s * (drift.pan_deg + drift.tilt_deg);
            self.judge();
        }
        self.compared.push_back(now);
        while self.compared.front().is_some_and(|c| c.time_s < now_s - 2.0 * Self::WAY_S) {
            self.compared.pop_front();
        }
    }

    /// Compares what an honest head did within the last second with what it was told.
    fn look_for_departure(&mut self, now: &Compared, model: &HeadModel) {
        let Some(before) = self
            .compared
            .front()
            .filter(|c| now.time_s - c.time_s >= Self::LOOKED_AT_S && self.honesty == Honesty::Prompt)
        else {
            return;
        };
        let index = ((self.lag_s - Self::FIRST_S) / Self::APART_S).round().max(0.0) as usize;
        let Some((told_now, told_before)) = now.by_model.get(index).zip(before.by_model.get(index)) else { return };
        let length = |to: Direction, from: Direction| (to.pan_deg - from.pan_deg).hypot(to.tilt_deg - from.tilt_deg);
        let (said, told) = (length(now.said, before.said), length(*told_now, *told_before));
        let seconds = now.time_s - before.time_s;
        let top = model.limits().pan.max_speed_deg_s.hypot(model.limits().tilt.max_speed_deg_s);
        let found = Departure::of(said, told, top * seconds);
        let known = self.departs.map(|(_, departure)| departure);
        if found != known {
            self.news = found.or(self.news);
            self.departs = found.map(|departure| (now.time_s, departure));
        }
    }

    fn judge(&mut self) {
        let best = (0..Self::LAGS).min_by(|a, b| self.unexplained[*a].total_cmp(&self.unexplained[*b])).unwrap_or(0);
        let way = self.way_said.max(self.way_told);
        if way < Self::PROVES {
            return;
        }
        let honest = matches!(self.honesty, Honesty::Late | Honesty::Prompt);
        let most = if honest { Self::STAYS_HONEST } else { Self::HONEST };
        if self.unexplained[best] > most * way {
            self.honesty = Honesty::Lies;
            return;
        }
        // Between the lags that were tried: the vertex of the parabola through the best and its neighbours.
        let at = |k: usize| self.unexplained.get(k).copied();
        let vertex = best.checked_sub(1).and_then(at).zip(at(best + 1)).map_or(0.0, |(before, after)| {
            let bend = before - 2.0 * self.unexplained[best] + after;
            if bend > 0.0 { (0.5 * (before - after) / bend).clamp(-0.5, 0.5) } else { 0.0 }
        });
        self.lag_s = Self::FIRST_S + (best as f64 + vertex) * Self::APART_S;
        self.honesty = if self.lag_s <= Self::PROMPT_S { Honesty::Prompt } else { Honesty::Late };
    }

    /// Where the head said it stood at `time_s`, and how fast it turned then, degrees per second; `None` before the first and
    /// after the last word.
    pub fn at(&self, time_s: f64) -> Option<(Direction, Direction)> {
        let next = self.said.partition_point(|(time, _)| *time <= time_s);
        let (from_s, from) = *self.said.get(next.checked_sub(1)?)?;
        let (to_s, to) = match self.said.get(next) {
            Some(to) => *to,
            None if time_s <= from_s => return Some((from, Direction::AHEAD)),
            None => return None,
        };
        let way = Direction::new(to.pan_deg - from.pan_deg, to.tilt_deg - from.tilt_deg);
        let part = (time_s - from_s) / (to_s - from_s);
        let there = from.turned(Direction::new(part * way.pan_deg, part * way.tilt_deg));
        let seconds = to_s - from_s;
        Some((there, Direction::new(way.pan_deg / seconds, way.tilt_deg / seconds)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mechanics::HeadLimits;
    use crate::{Command, Position, Velocity};

    /// A head that swings to and fro and says `says(time, truth)`, `truth` being where it stood `age_s` ago.
    fn heard(age_s: f64, says: impl Fn(f64) -> Option<f64>) -> OwnWord {
        let mut model = HeadModel::new(HeadLimits::default(), 0.15, Position::default(), 0.0);
        let mut truth = HeadModel::new(HeadLimits::default(), 0.15 + age_s, Position::default(), 0.0);
        let mut word = OwnWord::default();
        for k in 0..400_u32 {
            let now = f64::from(k) * 0.05;
            if k % 16 == 0 {
                let pan_deg_s = if k % 32 == 0 { 20.0 } else { -20.0 };
                let command = Command::Move(Velocity { pan_deg_s, ..Velocity::ZERO });
                model.sent(now, command);
                truth.sent(now, command);
            }
            let stands = truth.at(now).0.direction;
            let said = says(stands.pan_deg).map_or(stands, |pan| Direction::new(pan, 0.0));
            word.hear(now, said, &model);
        }
        word
    }

    #[test]
    fn a_prompt_and_an_old_word_are_told_apart() {
        let prompt = heard(0.2, |_| None);
        assert_eq!(prompt.honesty(), Honesty::Prompt);
        assert!((prompt.lag_s() - 0.2).abs() < 0.03, "{}", prompt.lag_s());
        assert!(prompt.jitter_s().unwrap() < 0.03);
        let late = heard(1.0, |_| None);
        assert_eq!(late.honesty(), Honesty::Late);
        assert!((late.lag_s() - 1.0).abs() < 0.05 && late.jitter_s().is_none());
    }

    #[test]
    fn departures_are_noticed_within_two_seconds() {
        let limits = HeadLimits::default();
        let cases = [
            // A person turns it at 10°/s while it is told to stand.
            (Departure::Driven, Command::Stop, Command::Move(Velocity { pan_deg_s: 10.0, ..Velocity::ZERO }), 0.0),
            // It is told to turn and stands at a stop.
            (Departure::Held, Command::Move(Velocity { pan_deg_s: 10.0, ..Velocity::ZERO }), Command::Stop, 0.0),
            // It restarts and stands elsewhere.
            (Departure::Jumped, Command::Stop, Command::Stop, 150.0),
        ];
        for (expected, told, does, jump_deg) in cases {
            let mut model = HeadModel::new(limits, 0.15, Position::default(), 0.0);
            let mut truth = model.clone();
            let mut word = OwnWord::default();
            let mut noticed = None;
            for k in 0..300_u32 {
                let now = f64::from(k) * 0.05;
                let departs = now >= 10.0;
                if departs && (now - 10.0).abs() < 0.01 {
                    model.sent(now, told);
                    truth.sent(now, does);
                } else if !departs && k % 16 == 0 {
                    let pan_deg_s = if k % 32 == 0 { 20.0 } else { -20.0 };
                    let command = Command::Move(Velocity { pan_deg_s, ..Velocity::ZERO });
                    model.sent(now, command);
                    truth.sent(now, command);
                }
                let jump = if departs { jump_deg } else { 0.0 };
                word.hear(now, truth.at(now).0.direction.turned(Direction::new(jump, 0.0)), &model);
                if let Some(departure) = word.departure() {
                    assert!(departs, "{departure:?} at {now}");
                    noticed = noticed.or(Some((now, departure)));
                }
            }
            let (when, departure) = noticed.unwrap();
            assert!(departure == expected && when <= 12.0, "{departure:?} at {when}, not {expected:?}");
        }
    }

    #[test]
    fn the_zero_of_its_angles_does_not_matter() {
        let elsewhere = heard(0.1, |truth| Some(truth + 75.0));
        assert_eq!(elsewhere.honesty(), Honesty::Prompt);
        let (at, turning) = elsewhere.at(19.02).unwrap();
        assert!((60.0..100.0).contains(&at.pan_deg) && turning.pan_deg.abs() <= 21.0);
        assert_eq!((elsewhere.at(0.0), elsewhere.at(99.0)), (None, None));
    }

    #[test]
    fn a_word_at_odds_with_the_commands_is_a_lie() {
        assert_eq!(heard(0.0, |_| Some(3.0)).honesty(), Honesty::Lies);
        assert_eq!(heard(0.0, |truth| Some(3.0 * truth)).honesty(), Honesty::Lies);
        assert_eq!(heard(0.0, |_| Some(f64::NAN)).honesty(), Honesty::Unproven);
    }
}
