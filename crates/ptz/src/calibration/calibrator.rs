use super::pulse::{Answer, Record, Shift};
use crate::control::FollowerParams;
use crate::error::require;
use crate::{Command, PtzError, Result, Velocity};
use pursuit_parameters::Parameters;
use serde::{Deserialize, Serialize};

pursuit_parameters::parameters! {
    /// How a head is measured.
    #[derive(Copy)]
    pub struct CalibrationParams {
        /// The speeds of the three moves each way, growing.
        pub speeds_deg_s: [f64; 3] = [4.0, 8.0, 16.0], in above(0.0).at_most(100.0), unit "deg/s";
        /// How long each move lasts.
        pub move_s: f64 = 1.0, in 0.2..=5.0, unit "s";
        /// By less than this a picture that stands still may seem to shift.
        pub still_px: f64 = 0.3, in above(0.0).at_most(100.0), unit "px a frame";
        /// For how long the picture must stand still after a move.
        pub rest_s: f64 = 0.4, in 0.1..=5.0, unit "s";
        /// How long to wait for that; then the head is given up.
        pub patience_s: f64 = 3.0, in 0.5..=10.0, unit "s";
    }
}

/// What was measured of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct AxisFacts {
    /// By how many pixels the picture shifts for each degree commanded; negative where the head turns the other way.
    pub px_per_deg: f64,
    /// From a command to when its effect is seen in a frame, seconds.
    pub delay_s: f64,
    /// How much that varies from move to move, one standard deviation, seconds, from two pairs of equal moves.
    pub jitter_s: f64,
    /// How much the age of pictures varies from one to the next, one standard deviation, seconds, from how unevenly steady motion
    /// seems to go.
    pub picture_jitter_s: f64,
    /// How fast the axis gains speed, degrees per second²; `None` where that took no time that could be measured.
    pub acceleration_deg_s2: Option<f64>,
    /// How far the motor turns at a reversal before the camera follows, degrees.
    pub backlash_deg: f64,
}

/// What was measured of a head.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Calibration {
    /// Pan.
    pub pan: AxisFacts,
    /// Tilt.
    pub tilt: AxisFacts,
    /// Which part of the commands got lost: did nothing, and had to be given again.
    pub loss: f64,
    /// How long the measurement took, seconds.
    pub took_s: f64,
}

impl Calibration {
    /// From a command to when its effect is seen, seconds.
    pub const fn delay_s(&self) -> f64 {
        0.5 * (self.pan.delay_s + self.tilt.delay_s)
    }

    /// How much that varies from command to command, one standard deviation, seconds.
    pub fn jitter_s(&self) -> f64 {
        (0.5 * (self.pan.jitter_s.powi(2) + self.tilt.jitter_s.powi(2))).sqrt()
    }

    /// How much the age of pictures varies from one to the next, one standard deviation, seconds.
    pub fn picture_jitter_s(&self) -> f64 {
        (0.5 * (self.pan.picture_jitter_s.powi(2) + self.tilt.picture_jitter_s.powi(2))).sqrt()
    }

    /// Less jitter than that is not told from none by so few moves, seconds.
    const LEAST_JITTER_S: f64 = 0.01;

    /// Puts what was measured into a follower's parameters. Of the whole delay, `frame_age_s` stays with the pictures and
    /// the rest is taken for the commands'; only the sum matters much.
    pub fn apply(&self, params: &mut FollowerParams) {
        params.command_delay_s = (self.delay_s() - params.frame_age_s).clamp(0.0, 5.0);
        params.motion.jitter_s = self.jitter_s().clamp(Self::LEAST_JITTER_S, 1.0);
        params.motion.picture_jitter_s = self.picture_jitter_s().clamp(Self::LEAST_JITTER_S, 1.0);
        for (facts, limits) in [(&self.pan, &mut params.limits.pan), (&self.tilt, &mut params.limits.tilt)] {
            limits.max_acceleration_deg_s2 = facts.acceleration_deg_s2.unwrap_or(1e4);
            limits.backlash_deg = facts.backlash_deg.clamp(0.0, 10.0);
        }
    }
}

/// What to do next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Step {
    /// Nothing yet.
    Wait,
    /// Send this command.
    Send(Command),
    /// All is measured; the head stands.
    Done(Calibration),
}

/// The moves of an axis: the first takes up the play, the fourth is a reversal.
const MOVES: [(usize, f64); 6] = [(0, 1.0), (1, 1.0), (2, 1.0), (0, -1.0), (1, -1.0), (2, -1.0)];

#[derive(Debug, Clone, Copy, PartialEq)]
enum State {
    /// Waits for the picture to stand still before the next move.
    Resting,
    /// Told to move then.
    Moving(f64),
    /// Told to move then, and to stop.
    Stopping(f64),
    Done,
}

/// Measures a head by moves of pan and then of tilt: twelve moves of a second, at most 16° each, and under 60 s in all.
#[derive(Debug, Clone)]
pub struct Calibrator {
    params: CalibrationParams,
    state: State,
    since_s: f64,
    began_s: f64,
    next_move: usize,
    record: Record,
    rest: Record,
    answers: Vec<Answer>,
    pan: Option<AxisFacts>,
    /// How many commands were sent, and how many of them did nothing.
    sent: u32,
    lost: u32,
    /// Whether the move under way went on too long, for its stop got lost.
    spoiled: bool,
}

impl Calibrator {
    /// Begins at `now_s`, with a head that stands still.
    ///
    /// # Errors
    /// Where a parameter is out of its range.
    pub fn new(params: CalibrationParams, now_s: f64) -> Result<Self> {
        params.validate("calibration")?;
        let [slow, middle, fast] = params.speeds_deg_s;
        require("speeds_deg_s", middle, slow < middle && middle < fast, "above the first and below the third")?;
        Ok(Self {
            params,
            state: State::Resting,
            since_s: now_s,
            began_s: now_s,
            next_move: 0,
            record: Record::default(),
            rest: Record::default(),
            answers: Vec::new(),
            pan: None,
            sent: 0,
            lost: 0,
            spoiled: false,
        })
    }

    /// The most commands that may get lost.
    const MOST_LOST: u32 = 6;
    /// After this time a head that does not stop is told so again, seconds.
    const STOPS_WITHIN_S: f64 = 2.0;

    /// Takes note of a shift of the picture. Stamps are on the same clock as the times given to [`step`](Self::step).
    pub fn see(&mut self, shift: &Shift) {
        // In the direction in which the head turns.
        let step = if self.pan.is_none() { -shift.right_px } else { shift.down_px };
        match self.state {
            State::Resting => self.rest.push(shift.stamp_s, step),
            State::Moving(told) | State::Stopping(told) => {
                if shift.stamp_s >= told {
                    self.record.push(shift.stamp_s - told, step);
                }
            }
            State::Done => {}
        }
    }

    /// What to do at `now_s`; to be asked at least once a frame.
    ///
    /// # Errors
    /// Where the picture does not come to rest, or does not shift when the head is told to move. The head is then to be
    /// stopped.
    pub fn step(&mut self, now_s: f64) -> Result<Step> {
        let waited = now_s - self.since_s;
        match self.state {
            State::Done => Ok(Step::Wait),
            State::Resting => {
                if self.rest.rests(self.params.rest_s, self.params.still_px) {
                    Ok(self.begin(now_s))
                } else if waited > self.params.patience_s {
                    Err(failed("the picture does not stand still; is something large moving in it, or the head?"))
                } else {
                    Ok(Step::Wait)
                }
            }
            State::Moving(told) if waited >= self.params.move_s => {
                (self.state, self.since_s) = (State::Stopping(told), now_s);
                self.sent += 1;
                Ok(Step::Send(Command::Stop))
            }
            State::Moving(_) => Ok(Step::Wait),
            State::Stopping(_) => {
                let still = self.record.rests(self.params.rest_s, self.params.still_px);
                let begun = self.record.answer().is_some();
                let goes_on = waited > Self::STOPS_WITHIN_S.min(self.params.patience_s) && !still;
                match (still && begun, waited > self.params.patience_s) {
                    (true, _) if self.spoiled => Ok(self.again(now_s)),
                    (true, _) => self.finish_move(now_s),
                    _ if begun && goes_on && self.lost < Self::MOST_LOST => {
                        (self.lost, self.sent, self.spoiled, self.since_s) =
                            (self.lost + 1, self.sent + 1, true, now_s);
                        Ok(Step::Send(Command::Stop))
                    }
                    (_, true) if begun => Err(failed("the head does not stop")),
                    (_, true) if self.lost < Self::MOST_LOST && self.moved() => {
                        self.lost += 1;
                        Ok(self.again(now_s))
                    }
                    (_, true) => Err(failed("the picture does not shift when the head is told to move")),
                    _ => Ok(Step::Wait),
                }
            }
        }
    }

    /// Whether the head has moved at all so far: one that never does is not one that loses commands.
    fn moved(&self) -> bool {
        self.pan.is_some() || !self.answers.is_empty()
    }

    /// The same move once more, after a rest.
    fn again(&mut self, now_s: f64) -> Step {
        (self.state, self.since_s, self.rest, self.spoiled) = (State::Resting, now_s, Record::default(), false);
        Step::Wait
    }

    fn begin(&mut self, now_s: f64) -> Step {
        let (speed, sign) = MOVES.get(self.next_move).copied().unwrap_or((0, 1.0));
        let speed = sign * self.params.speeds_deg_s.get(speed).copied().unwrap_or_default();
        let velocity = if self.pan.is_none() {
            Velocity { pan_deg_s: speed, ..Velocity::ZERO }
        } else {
            Velocity { tilt_deg_s: speed, ..Velocity::ZERO }
        };
        (self.state, self.since_s, self.record) = (State::Moving(now_s), now_s, Record::default());
        self.sent += 1;
        Step::Send(Command::Move(velocity))
    }

    fn finish_move(&mut self, now_s: f64) -> Result<Step> {
        self.answers.extend(self.record.answer());
        self.next_move += 1;
        (self.state, self.since_s, self.rest) = (State::Resting, now_s, Record::default());
        if self.next_move < MOVES.len() {
            return Ok(Step::Wait);
        }
        let facts = facts(&self.answers, &self.params)?;
        (self.answers, self.next_move) = (Vec::new(), 0);
        let Some(pan) = self.pan else {
            self.pan = Some(facts);
            return Ok(Step::Wait);
        };
        self.state = State::Done;
        let loss = f64::from(self.lost) / f64::from(self.sent.max(1));
        Ok(Step::Done(Calibration { pan, tilt: facts, loss, took_s: now_s - self.began_s }))
    }
}

fn failed(reason: &str) -> PtzError {
    PtzError::Calibration { reason: reason.to_owned() }
}

/// What the six moves of an axis say of it.
///
/// A move that follows one in the same direction goes `k v T` pixels, `k` being the pixels per degree; the reversal goes
/// `k b` less. The line of steady motion leaves the start at `τ + v / 2a`: two speeds tell the delay from the acceleration.
fn facts(answers: &[Answer], params: &CalibrationParams) -> Result<AxisFacts> {
    let [_, middle, fast, back, middle_back, fast_back] = answers else {
        return Err(failed("too few of the moves could be measured"));
    };
    let [slow_deg_s, middle_deg_s, fast_deg_s] = params.speeds_deg_s;
    let degrees = params.move_s * 2.0 * (middle_deg_s + fast_deg_s);
    let px_per_deg = (middle.way_px + fast.way_px - middle_back.way_px - fast_back.way_px) / degrees;
    let alike = [middle, fast].iter().all(|a| a.way_px * px_per_deg > 0.0)
        && [back, middle_back, fast_back].iter().all(|a| a.way_px * px_per_deg < 0.0);
    if !alike {
        return Err(failed("the picture does not shift to and fro as the head is told to move"));
    }
    let onset_middle = 0.5 * (middle.onset_s + middle_back.onset_s);
    let onset_fast = 0.5 * (fast.onset_s + fast_back.onset_s);
    // A picture's place errs by some pixels, which are more time where the motion is slow: `scatter = jitter² + (error / speed)²`, at two speeds.
    let scatter = |a: &Answer, b: &Answer| {
        let (of_a, of_b) = (a.frames as f64 - 2.0, b.frames as f64 - 2.0);
        (of_a * a.scatter_s2 + of_b * b.scatter_s2) / (of_a + of_b)
    };
    let (of_middle, of_fast) = (scatter(middle, middle_back), scatter(fast, fast_back));
    let squared = |speed: f64| speed * speed;
    let pictures_s2 = (squared(fast_deg_s) * of_fast - squared(middle_deg_s) * of_middle)
        / (squared(fast_deg_s) - squared(middle_deg_s));
    let pictures_s2 = pictures_s2.max(0.0).min(of_fast);
    // The same move to and fro takes effect after the same time but for the jitter: two pairs of two, at one speed each, since an error of the
    // speed moves both alike. The pictures take their part of it.
    let square = |a: &Answer, b: &Answer, speed_deg_s: f64| {
        let onset = |answer: &Answer| answer.middle.0 - answer.middle.1.abs() / (px_per_deg.abs() * speed_deg_s);
        let of_pictures = pictures_s2 * (0.5 / a.frames as f64 + 0.5 / b.frames as f64);
        0.5 * (onset(a) - onset(b)).powi(2) - of_pictures
    };
    let squares = square(middle, middle_back, middle_deg_s) + square(fast, fast_back, fast_deg_s);
    let jitter_s = (0.5 * squares).max(0.0).sqrt();
    let slope = (onset_fast - onset_middle) / (fast_deg_s - middle_deg_s);
    // A ramp shorter than that is not told from none.
    let slope = if slope > 1e-4 { slope } else { 0.0 };
    let delay_s = if slope > 0.0 { onset_middle - slope * middle_deg_s } else { 0.5 * (onset_middle + onset_fast) };
    Ok(AxisFacts {
        px_per_deg,
        delay_s,
        jitter_s,
        picture_jitter_s: pictures_s2.sqrt(),
        acceleration_deg_s2: (slope > 0.0).then(|| 0.5 / slope),
        backlash_deg: (slow_deg_s * params.move_s - (back.way_px / px_per_deg).abs()).max(0.0),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn answer(way_px: f64, onset_s: f64) -> Answer {
        let middle = (onset_s + 0.5, 0.5 * way_px);
        Answer { way_px, speed_px_s: way_px, onset_s, middle, scatter_s2: 0.0, frames: 8 }
    }

    #[test]
    fn six_moves_tell_scale_delay_acceleration_and_play() {
        // 10 px a degree, 0.3 s late, 100°/s², 0.5° of play; speeds 4, 8 and 16°/s for 1 s.
        let onset = |v: f64| 0.3 + v / 200.0;
        let moves = [
            answer(37.0, onset(4.0)),
            answer(80.0, onset(8.0)),
            answer(160.0, onset(16.0)),
            answer(-35.0, onset(4.0) + 0.1),
            answer(-80.0, onset(8.0)),
            answer(-160.0, onset(16.0)),
        ];
        let facts = facts(&moves, &CalibrationParams::default()).unwrap();
        assert!((facts.px_per_deg - 10.0).abs() < 1e-9 && (facts.delay_s - 0.3).abs() < 1e-9);
        assert!((facts.acceleration_deg_s2.unwrap() - 100.0).abs() < 1e-6 && (facts.backlash_deg - 0.5).abs() < 1e-9);
    }

    #[test]
    fn moves_that_contradict_each_other_are_refused() {
        let params = CalibrationParams::default();
        let wrong = [
            answer(40.0, 0.3),
            answer(80.0, 0.3),
            answer(-9.0, 0.3),
            answer(-40.0, 0.3),
            answer(-80.0, 0.3),
            answer(-160.0, 0.3),
        ];
        assert!(facts(&wrong, &params).unwrap_err().to_string().contains("to and fro"));
        assert!(facts(&wrong[..4], &params).unwrap_err().to_string().contains("too few"));
        for bad in [
            CalibrationParams { speeds_deg_s: [4.0, 4.0, 8.0], ..params },
            CalibrationParams { speeds_deg_s: [0.0, 4.0, 8.0], ..params },
            CalibrationParams { move_s: 0.1, ..params },
            CalibrationParams { still_px: 0.0, ..params },
            CalibrationParams { rest_s: 0.0, ..params },
            CalibrationParams { patience_s: 99.0, ..params },
        ] {
            assert!(Calibrator::new(bad, 0.0).is_err());
        }
    }

    #[test]
    fn what_was_measured_goes_into_the_followers_parameters() {
        let axis = AxisFacts {
            px_per_deg: 10.0,
            delay_s: 0.4,
            jitter_s: 0.06,
            picture_jitter_s: 0.04,
            acceleration_deg_s2: Some(90.0),
            backlash_deg: 0.2,
        };
        let tilt = AxisFacts { delay_s: 0.3, acceleration_deg_s2: None, ..axis };
        let mut params = FollowerParams { frame_age_s: 0.1, ..FollowerParams::default() };
        Calibration { pan: axis, tilt, loss: 0.0, took_s: 30.0 }.apply(&mut params);
        assert!((params.command_delay_s - 0.25).abs() < 1e-12 && (params.motion.jitter_s - 0.06).abs() < 1e-12);
        assert!((params.motion.picture_jitter_s - 0.04).abs() < 1e-12);
        assert_eq!((params.limits.pan.max_acceleration_deg_s2, params.limits.tilt.backlash_deg), (90.0, 0.2));
        params.validate("follower").unwrap();
    }
}
