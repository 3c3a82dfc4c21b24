use super::HeadModel;
use super::servo::AxisAim;
use crate::mechanics::HeadLimits;
use crate::{Command, Direction, Position, Velocity};
use pursuit_parameters::parameters;

parameters! {
    /// How far a prediction is trusted: by how well the head would have kept the target with more or less of it.
    #[derive(Copy)]
    pub struct TrustParams {
        /// Whether the prediction judges itself; it is trusted wholly otherwise.
        pub judges: bool = true;
        /// For how long an error counts.
        pub memory_s: f64 = 8.0, in above(0.0).at_most(3600.0), unit "s";
        /// An error of this size, kept up for a second, speaks clearly against the factor that made it.
        pub clear_deg: f64 = 8.0, in above(0.0).at_most(360.0), unit "deg";
        /// At this latency predicting nothing is taken to be as good as predicting wholly, before anything was seen.
        pub even_s: f64 = 0.65, in above(0.0).at_most(60.0), unit "s";
        /// How much is held beforehand of predicting wholly at no latency: the logarithm of the odds to predicting nothing.
        pub beforehand: f64 = 3.0, in 0.0..=100.0;
    }
}

/// Which part of a prediction to believe, found by rehearsing.
///
/// For each of several factors a head that exists in numbers only follows the target by that part of the prediction, with the
/// delays and the limits of the true one. A head that came closer to where the target turned out to be had the better factor:
/// each is weighed by `exp(−Σ λ e² dt / 2 s²)`, `e` being the angle between its head and the target, with older errors forgotten.
/// The target goes where it goes whatever the head does, so heads that were never built can be judged by it (the estimator
/// based supervisor of Morse, "Supervisory control of families of linear set-point controllers", IEEE Transactions on Automatic
/// Control 41, 1996, chooses among controllers in the same way).
#[derive(Debug, Clone)]
pub(super) struct Rehearsal {
    params: TrustParams,
    heads: Vec<Rehearsed>,
    now_s: f64,
    /// How many commands were rehearsed.
    count: u32,
    /// From a picture to when the command made by it acts, seconds.
    latency_s: f64,
}

#[derive(Debug, Clone)]
struct Rehearsed {
    factor: f64,
    head: HeadModel,
    /// The sum of squares of its errors, degrees² s.
    errors: f64,
    weight: f64,
}

/// A target as a rehearsed head knows it when a command is made.
pub(super) struct Cue {
    /// Where it was seen.
    pub seen: Direction,
    /// By how much further it is expected to be when the command takes effect, and how fast it is expected to move then.
    pub ahead: Direction,
    pub speed: Direction,
}

impl Cue {
    /// Where it is expected, and how fast, by this part of the prediction.
    pub fn by(&self, factor: f64) -> (Direction, Direction) {
        let part = |of: Direction| Direction::new(factor * of.pan_deg, factor * of.tilt_deg);
        (self.seen.turned(part(self.ahead)), part(self.speed))
    }
}

impl Rehearsal {
    /// The factors that are rehearsed.
    const FACTORS: [f64; 4] = [0.0, 0.33, 0.67, 1.0];
    /// Errors beyond this many times `clear_deg` count as that.
    const MOST: f64 = 4.0;

    pub fn new(params: TrustParams, limits: HeadLimits, delay_s: f64, home: Position, now_s: f64) -> Self {
        let head = HeadModel::new(limits, delay_s, home, now_s);
        let rehearsed = |factor| Rehearsed { factor, head: head.clone(), errors: 0.0, weight: 0.0 };
        let mut rehearsal = Self {
            params,
            heads: Self::FACTORS.map(rehearsed).into(),
            now_s: f64::NEG_INFINITY,
            count: 0,
            latency_s: delay_s,
        };
        rehearsal.weigh();
        rehearsal
    }

    /// All directions are counted from elsewhere: what was at 0 is at `by`.
    pub fn shift(&mut self, by: Direction) {
        self.heads.iter_mut().for_each(|rehearsed| rehearsed.head.shift(by));
    }

    /// The target is another one, or was out of sight: every head stands where the true one does.
    pub fn begin(&mut self, now_s: f64, from: Position) {
        for rehearsed in &mut self.heads {
            rehearsed.head = HeadModel::new(*rehearsed.head.limits(), rehearsed.head.delay_s(), from, now_s);
        }
        self.now_s = f64::NEG_INFINITY;
    }

    /// A command is made at `now_s` that takes effect `late_s` later than assumed, give or take `jitter_s`.
    pub fn act(&mut self, now_s: f64, (late_s, jitter_s): (f64, f64), cue: &Cue, gain_per_s: f64) {
        // Delays as uneven as the true ones, the same in every run: the golden ratio's multiples fill an interval evenly.
        self.count = self.count.wrapping_add(1);
        let uneven = 2.0 * (f64::from(self.count) * 0.618_033_988_749_894_9).fract() - 1.0;
        let acts_s = now_s + late_s + 3.0_f64.sqrt() * jitter_s * uneven;
        for Rehearsed { factor, head, .. } in &mut self.heads {
            let (position, turning) = head.at(now_s + late_s + head.delay_s());
            let (direction, speed) = cue.by(*factor);
            let away = direction.from(position.direction);
            let limits = *head.limits();
            let drive = |head_deg, head_deg_s, away_deg, target_deg_s, limits| {
                AxisAim { head_deg, head_deg_s, away_deg, target_deg_s }.speed_deg_s(gain_per_s, limits)
            };
            let at = position.direction;
            let pan_deg_s = drive(at.pan_deg, turning.pan_deg_s, away.pan_deg, speed.pan_deg, &limits.pan);
            let tilt_deg_s = drive(at.tilt_deg, turning.tilt_deg_s, away.tilt_deg, speed.tilt_deg, &limits.tilt);
            head.sent(acts_s, Command::Move(Velocity { pan_deg_s, tilt_deg_s, zoom_per_s: 0.0 }));
        }
    }

    /// The target turns out to have been at `target` at `time_s`; the whole loop is `latency_s` late.
    pub fn judge(&mut self, time_s: f64, target: Direction, latency_s: f64) {
        self.latency_s = latency_s;
        let passed_s = if self.now_s.is_finite() { (time_s - self.now_s).clamp(0.0, 0.5) } else { 0.0 };
        self.now_s = time_s;
        let keeps = (-passed_s / self.params.memory_s).exp();
        let most = (Self::MOST * self.params.clear_deg).powi(2);
        for Rehearsed { head, errors, .. } in &mut self.heads {
            let off = target.from(head.at(time_s).0.direction);
            let square = off.pan_deg.powi(2) + off.tilt_deg.powi(2);
            *errors = keeps * *errors + passed_s * square.min(most);
        }
        self.weigh();
    }

    fn weigh(&mut self) {
        let TrustParams { clear_deg, even_s, beforehand, .. } = self.params;
        let odds = beforehand * (1.0 - self.latency_s / even_s);
        let log = |of: &Rehearsed| odds * of.factor - 0.5 * of.errors / (clear_deg * clear_deg);
        let most = self.heads.iter().map(log).fold(f64::NEG_INFINITY, f64::max);
        let sum: f64 = self.heads.iter().map(|of| (log(of) - most).exp()).sum();
        self.heads.iter_mut().for_each(|of| of.weight = (log(of) - most).exp() / sum);
    }

    /// How far off the target the rehearsed heads were of late, by their weight, degrees (root mean square): how far it may be off
    /// what is expected of it.
    pub fn error_deg(&self) -> f64 {
        let span_s = self.params.memory_s;
        self.heads.iter().map(|of| of.weight * of.errors / span_s).sum::<f64>().sqrt()
    }

    /// Which part of a predicted displacement, and of the speed, to believe: 0 to 1.
    pub fn factor(&self) -> f64 {
        if !self.params.judges {
            return 1.0;
        }
        self.heads.iter().map(|of| of.weight * of.factor).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The factor after twenty seconds of a target that moves by `path`, predicted by its speed over a loop .3 s late.
    fn after(params: TrustParams, path: impl Fn(f64) -> f64) -> f64 {
        let mut rehearsal = Rehearsal::new(params, HeadLimits::default(), 0.3, Position::default(), 0.0);
        for k in 0..500 {
            let now = f64::from(k) * 0.04;
            let speed = (path(now) - path(now - 0.04)) / 0.04;
            let part = |deg| Direction::new(deg, 0.0);
            let cue = Cue { seen: part(path(now)), ahead: part(0.3 * speed), speed: part(speed) };
            rehearsal.judge(now, cue.seen, 0.3);
            rehearsal.act(now, (0.0, 0.0), &cue, 4.5);
        }
        rehearsal.factor()
    }

    #[test]
    fn steady_motion_is_trusted_and_quick_swings_are_not() {
        let params = TrustParams::default();
        assert!(after(params, |t| 8.0 * t) > 0.75, "{}", after(params, |t| 8.0 * t));
        let swings = |t: f64| 15.0 * (std::f64::consts::TAU * t).sin();
        assert!(after(params, swings) < 0.5, "{}", after(params, swings));
        assert_eq!(after(TrustParams { judges: false, ..params }, swings), 1.0);
    }

    #[test]
    fn trust_comes_back() {
        let path = |t: f64| if t < 8.0 { 15.0 * (std::f64::consts::TAU * t).sin() } else { 12.0 * (t - 8.0) };
        let factor = after(TrustParams::default(), path);
        assert!(factor > 0.6, "{factor}");
    }

    #[test]
    fn long_latencies_are_trusted_less_beforehand() {
        let params = TrustParams::default();
        let mut rehearsal = Rehearsal::new(params, HeadLimits::default(), 0.15, Position::default(), 0.0);
        rehearsal.judge(0.0, Direction::AHEAD, 0.15);
        let soon = rehearsal.factor();
        rehearsal.judge(0.1, Direction::AHEAD, 1.2);
        assert!(soon > 0.7 && rehearsal.factor() < 0.3, "{soon} {}", rehearsal.factor());
        // A world counted from elsewhere changes nothing, nor does a new target.
        rehearsal.shift(Direction::new(30.0, 2.0));
        rehearsal.begin(5.0, Position { direction: Direction::new(30.0, 2.0), zoom: 0.0 });
        rehearsal.judge(5.0, Direction::new(30.0, 2.0), 0.15);
        assert!((rehearsal.factor() - soon).abs() < 0.05);
    }
}
