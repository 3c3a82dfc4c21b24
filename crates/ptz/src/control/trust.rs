use crate::Direction;
use pursuit_parameters::parameters;
use std::collections::VecDeque;

parameters! {
    /// How far a prediction is trusted: by how well those before it came true.
    #[derive(Copy)]
    pub struct TrustParams {
        /// Whether the prediction judges itself; it is trusted wholly otherwise.
        pub judges: bool = true;
        /// How far beyond the latency a prediction is judged: about the time in which the head answers.
        pub response_s: f64 = 0.4, in 0.0..=2.0, unit "s";
        /// For how long a prediction that was judged counts.
        pub memory_s: f64 = 6.0, in above(0.0).at_most(3600.0), unit "s";
        /// Which factor is taken beforehand.
        pub beforehand: f64 = 1.0, in 0.0..=1.0;
        /// That counts as much as a second of predictions over this way.
        pub known_deg: f64 = 8.0, in above(0.0).at_most(360.0), unit "deg";
        /// From this factor on a prediction is trusted wholly, and below it in proportion, down to none at `nothing`.
        pub whole: f64 = 0.8, in above(0.0).at_most(1.0);
        /// At this factor and below it the prediction is not trusted at all.
        pub nothing: f64 = 0.4, in Bounds::from(0.0..).below(1.0);
        /// Below this factor nothing is predicted, until it has risen above [`back`](Self::back).
        pub floor: f64 = 0.2, in 0.0..=1.0;
        /// Above this factor predicting begins again.
        pub back: f64 = 0.3, in 0.0..=1.0;
    }
    ordered { floor <= back, nothing <= whole }
}

/// Which part of a predicted displacement is to be believed.
///
/// What the target did over the last latency is regressed on what had been predicted for it: the factor `f` that minimises
/// `Σ λ |a − f p|²` over the predicted displacements `p` and those that came about, `a`, with forgetting `λ`. A target that
/// turns about faster than the loop can answer, or a head whose own swing is taken for the target's motion, makes `f` small.
#[derive(Debug, Clone)]
pub(super) struct Trust {
    params: TrustParams,
    /// Predictions that wait for their time: when that is, from where, and how far.
    waiting: VecDeque<(f64, Direction, Direction)>,
    product: f64,
    square: f64,
    now_s: f64,
    fallen_back: bool,
}

impl Trust {
    /// The most predictions that wait.
    const MOST: usize = 256;

    pub fn new(params: TrustParams) -> Self {
        let known = params.known_deg * params.known_deg;
        let waiting = VecDeque::with_capacity(Self::MOST + 1);
        Self {
            params,
            waiting,
            product: params.beforehand * known,
            square: known,
            now_s: f64::NEG_INFINITY,
            fallen_back: false,
        }
    }

    /// How far ahead to predict what is to be judged, seconds, where the loop is `latency_s` late.
    pub fn horizon_s(&self, latency_s: f64) -> f64 {
        latency_s + self.params.response_s
    }

    /// The target is another one, or was out of sight: what waits says nothing.
    pub fn begin(&mut self) {
        self.waiting.clear();
    }

    /// The target is believed at `here` at `now_s`, and will be `displacement` further `horizon_s` later.
    pub fn note(&mut self, now_s: f64, here: Direction, displacement: Direction, horizon_s: f64) {
        let known = self.params.known_deg * self.params.known_deg;
        let passed = (now_s - self.now_s).clamp(0.0, 10.0);
        let keeps = if self.now_s.is_finite() { (-passed / self.params.memory_s).exp() } else { 1.0 };
        let before = self.params.beforehand * known;
        self.product = before + keeps * (self.product - before);
        self.square = known + keeps * (self.square - known);
        while let Some(&(time, from, said)) = self.waiting.front().filter(|(time, ..)| *time <= now_s) {
            self.waiting.pop_front();
            if now_s - time < 0.25 {
                let came = here.from(from);
                self.product += passed * (came.pan_deg * said.pan_deg + came.tilt_deg * said.tilt_deg);
                self.square += passed * (said.pan_deg.powi(2) + said.tilt_deg.powi(2));
            }
        }
        self.waiting.push_back((now_s + horizon_s, here, displacement));
        if self.waiting.len() > Self::MOST {
            self.waiting.pop_front();
        }
        self.now_s = now_s;
        let factor = self.raw();
        self.fallen_back = factor < if self.fallen_back { self.params.back } else { self.params.floor };
    }

    fn raw(&self) -> f64 {
        (self.product / self.square).clamp(0.0, 1.0)
    }

    /// Which part of a predicted displacement, and of the speed, to believe: 0 to 1.
    pub fn factor(&self) -> f64 {
        match (self.params.judges, self.fallen_back) {
            (false, _) => 1.0,
            (true, true) => 0.0,
            (true, false) => {
                let TrustParams { whole, nothing, .. } = self.params;
                ((self.raw() - nothing) / (whole - nothing)).clamp(0.0, 1.0)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The factor after ten seconds of a target that moves by `path`, predicted by its speed over .3 s.
    fn after(path: impl Fn(f64) -> f64) -> f64 {
        let mut trust = Trust::new(TrustParams { response_s: 0.0, ..TrustParams::default() });
        for k in 0..250 {
            let now = f64::from(k) * 0.04;
            let speed = (path(now) - path(now - 0.04)) / 0.04;
            let horizon = trust.horizon_s(0.3);
            trust.note(now, Direction::new(path(now), 0.0), Direction::new(speed * horizon, 0.0), horizon);
        }
        trust.factor()
    }

    #[test]
    fn what_comes_true_is_trusted_and_what_does_not_is_not() {
        assert!(after(|t| 10.0 * t) > 0.99);
        assert!((after(|_| 3.0) - 1.0).abs() < 1e-12, "a target that stands says nothing");
        let swings = |t: f64| 10.0 * (std::f64::consts::TAU * 1.5 * t).sin();
        assert_eq!(after(swings), 0.0, "half a period ahead it goes the other way");
        let never = TrustParams { judges: false, ..TrustParams::default() };
        assert_eq!(Trust::new(never).factor(), 1.0);
    }

    #[test]
    fn trust_comes_back() {
        let swings_first = |t: f64| if t < 4.0 { (std::f64::consts::TAU * 1.5 * t).sin() } else { 12.0 * (t - 4.0) };
        assert!(after(swings_first) > 0.5, "{}", after(swings_first));
    }
}
