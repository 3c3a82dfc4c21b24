use nalgebra::SVector;
use rand_core::Rng;

/// Centre x, centre y, logarithm of the size relative to that at the start; and their velocities a second.
pub type State = SVector<f64, 6>;

pursuit_parameters::parameters! {
    /// The second-order dynamics: a velocity that dies away and is disturbed, and a place that is disturbed besides.
    pub struct DynamicsParams {
        /// How fast the velocity dies away.
        pub damping: f64 = 4.0, in 0.0..=1000.0, unit "1/s", source "ours; isard1998 learns it";
        /// How suddenly the velocity changes.
        pub acceleration: f64 = 3.0, in 0.0..=1000.0, unit "sizes/s^1.5", source "ours; isard1998 learns it";
        /// How fast the place changes without it.
        pub wander: f64 = 0.5, in 0.0..=100.0, unit "sizes/√s", source "ours; isard1998 learns it";
        /// How suddenly the velocity of the size's logarithm changes.
        pub growth: f64 = 0.2, in 0.0..=100.0, unit "1/s^1.5", source "ours; isard1998 learns it";
        /// How fast the size's logarithm changes without it.
        pub size_wander: f64 = 0.08, in 0.0..=10.0, unit "1/√s", source "ours; isard1998 learns it";
    }
}

/// The dynamics of one step: x(t) = x(t−1) + a (x(t−1) − x(t−2)) + B w(t), that is A₁ = 1 + a and A₂ = −a in
/// x(t) = A₂ x(t−2) + A₁ x(t−1) + B w(t) (isard1998, section 3), with a = exp(−damping · dt). A velocity in place of the place
/// before makes it independent of the frame rate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dynamics {
    keep: f64,
    dt_s: f64,
    /// Standard deviations of the velocity's and the place's own steps, in target sizes; and of the size.
    push: f64,
    stray: f64,
    grow: f64,
    resize: f64,
}

impl Dynamics {
    /// Over `dt_s` seconds.
    pub fn over(p: &DynamicsParams, dt_s: f64) -> Self {
        let root = dt_s.max(0.0).sqrt();
        // What stays of a velocity, and the standard deviation of what a disturbance of one brings about meanwhile.
        let keep = (-p.damping * dt_s).exp();
        let gained = if p.damping > 0.0 { ((1.0 - keep * keep) / (2.0 * p.damping)).sqrt() } else { root };
        Self {
            keep,
            dt_s,
            push: p.acceleration * gained,
            stray: p.wander * root,
            grow: p.growth * gained,
            resize: p.size_wander * root,
        }
    }

    /// Where a sample goes that is `size_px` large, with random numbers of `generator`.
    pub fn step(&self, state: &State, size_px: f64, generator: &mut impl Rng) -> State {
        let mut next = *state;
        for (axis, (push, stray)) in [
            (self.push * size_px, self.stray * size_px),
            (self.push * size_px, self.stray * size_px),
            (self.grow, self.resize),
        ]
        .into_iter()
        .enumerate()
        {
            let [a, b] = normals(generator);
            let velocity = self.keep * state[axis + 3] + push * a;
            next[axis + 3] = velocity;
            next[axis] = state[axis] + velocity * self.dt_s + stray * b;
        }
        next
    }
}

/// Two independent standard normal numbers (Box and Muller 1958).
fn normals(generator: &mut impl Rng) -> [f64; 2] {
    let mut uniform = || (generator.next_u64() >> 11) as f64 / (1_u64 << 53) as f64;
    let (u, v) = (1.0 - uniform(), uniform());
    let (sin, cos) = (std::f64::consts::TAU * v).sin_cos();
    let radius = (-2.0 * u.ln()).sqrt();
    [radius * cos, radius * sin]
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_estimation::particle::{ParticleFilter, ParticleOptions};

    /// Moves `count` samples that start alike.
    fn moved(p: &DynamicsParams, start: State, count: usize, steps: usize, dt_s: f64) -> Vec<State> {
        let mut filter = ParticleFilter::from_states(vec![start; count], ParticleOptions::default(), 7).unwrap();
        let dynamics = Dynamics::over(p, dt_s);
        for _ in 0..steps {
            filter.predict_with(|state, generator| dynamics.step(state, 20.0, generator)).unwrap();
        }
        filter.states().to_vec()
    }

    #[test]
    fn undisturbed_samples_obey_the_second_order_equation() {
        let p = DynamicsParams {
            acceleration: 0.0,
            wander: 0.0,
            growth: 0.0,
            size_wander: 0.0,
            ..DynamicsParams::default()
        };
        let (dt, a) = (0.04, (-4.0_f64 * 0.04).exp());
        let start = State::from([10.0, 20.0, 0.1, 50.0, -30.0, 0.2]);
        let places: Vec<State> = (0..6).map(|k| moved(&p, start, 1, k, dt)[0]).collect();
        for t in 2..6 {
            for axis in 0..3 {
                let want = -a * places[t - 2][axis] + (1.0 + a) * places[t - 1][axis];
                assert!((places[t][axis] - want).abs() < 1e-9, "step {t}, axis {axis}");
            }
        }
        assert!(places[5][0] > 15.0);
    }

    #[test]
    fn speeds_spread_alike_at_any_frame_rate() {
        let p = DynamicsParams::default();
        let variance = |steps: usize, dt: f64, axis: usize| {
            let states = moved(&p, State::zeros(), 4000, steps, dt);
            states.iter().map(|s| s[axis] * s[axis]).sum::<f64>() / states.len() as f64
        };
        for axis in [3, 5] {
            let (slow, fast) = (variance(5, 0.1, axis), variance(50, 0.01, axis));
            assert!((slow / fast - 1.0).abs() < 0.15, "axis {axis}: {slow} {fast}");
        }
        // 9 · 20² (1 − e^(−2·4·0.5)) / (2·4), the variance of a velocity half a second after it was nought.
        let want = 9.0 * 400.0 * (1.0 - (-4.0_f64).exp()) / 8.0;
        assert!((variance(5, 0.1, 3) / want - 1.0).abs() < 0.1);
    }
}
