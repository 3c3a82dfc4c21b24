//! Filters of turning targets under a radar, and several models at once.

use super::*;

/// Range and bearing from a point well away, where the curvature is small against the doubt.
struct Radar;

const RADAR_NOISE: [f64; 2] = [1.0, 1e-6];

impl NonlinearSensor<2, 5> for Radar {
    fn expected(&self, state: &SVector<f64, 5>) -> SVector<f64, 2> {
        SVector::from([state[0].hypot(state[1]), state[1].atan2(state[0])])
    }

    fn noise(&self) -> SMatrix<f64, 2, 2> {
        SMatrix::from_diagonal(&SVector::from(RADAR_NOISE))
    }
}

impl LinearizedSensor<2, 5> for Radar {
    fn jacobian(&self, state: &SVector<f64, 5>) -> SMatrix<f64, 2, 5> {
        let (x, y) = (state[0], state[1]);
        let square = x * x + y * y;
        let range = square.sqrt();
        SMatrix::from_fn(|r, c| match (r, c) {
            (0, 0) => x / range,
            (0, 1) => y / range,
            (1, 0) => -y / square,
            (1, 1) => x / square,
            _ => 0.0,
        })
    }
}

/// A coordinated turn whose rate is estimated, seen in range and bearing: 10 px a second at 1000 px, 5 frames a second.
fn turning(name: &str, go: impl Fn(&CoordinatedTurn, &mut Gaussian<5>, f64, &SVector<f64, 2>) -> Innovation<2> + Sync) {
    const DT_S: f64 = 0.2;
    let motion = CoordinatedTurn { acceleration_density: 0.5, turn_density: 1e-4 };
    let mean = SVector::from([1000.0, 200.0, 10.0, 0.0, 0.2]);
    let start = Gaussian::from_variances(mean, SVector::from([1.0, 1.0, 0.25, 0.25, 1e-4])).unwrap();
    consistent(name, [5, 2], |random| {
        let (mut state, mut belief, mut nis) = (random.draw(&start), start, 0.0);
        for _ in 0..STEPS {
            state = motion.advance(&state, DT_S) + random.noise(&motion.noise(&state, DT_S));
            let z = Radar.expected(&state) + random.noise(&Radar.noise());
            nis = go(&motion, &mut belief, DT_S, &z).nis();
        }
        [belief.nees(&state).unwrap(), nis]
    });
}

#[test]
#[ignore = "release: 20 000 runs of each filter"]
fn extended_and_unscented() {
    turning("extended", |motion, belief, dt_s, z| {
        belief.predict_extended(motion, dt_s).unwrap();
        belief.update_extended(&Radar, z).unwrap()
    });
    turning("unscented", |motion, belief, dt_s, z| {
        belief.predict_unscented(motion, dt_s, &Unscented::default()).unwrap();
        belief.update_unscented(&Radar, z, &Unscented::default()).unwrap()
    });
}

/// A target that switches between two accelerations as the model says. The mixture is not Gaussian, and merging its
/// branches is an approximation; with modes this near both are small.
#[test]
#[ignore = "release: 20 000 runs"]
fn interacting_models() {
    let steps = [1.0, 4.0].map(|density| ConstantVelocity::<2>::white(density).over(0.1).unwrap());
    let chances = SMatrix::<f64, 2, 2>::new(0.95, 0.05, 0.1, 0.9);
    let switching = Switching::per_step(chances).unwrap();
    let (sensor, start) = (position(), unit::<4>());
    consistent("IMM", [4, 2], |random| {
        let (mut state, mut nis) = (random.draw(&start), 0.0);
        let mut mode = usize::from(random.uniform() < 1.0 / 3.0);
        let mut imm = Imm::new(start, [2.0 / 3.0, 1.0 / 3.0]).unwrap();
        for _ in 0..STEPS {
            mode = usize::from(random.uniform() < chances[(mode, 1)]);
            state = random.moved(&steps[mode], &state);
            imm.predict(&steps, &switching).unwrap();
            let z = random.measured(&sensor, &state);
            nis = imm.combined().innovation(&sensor, &z).unwrap().nis();
            imm.update(&sensor, &z).unwrap();
        }
        [imm.combined().nees(&state).unwrap(), nis]
    });
}
