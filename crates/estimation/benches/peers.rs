//! One predict and update of the linear filter beside the kfilter crate's, in rounds that take turns, so that a busy
//! machine disturbs both alike: `cargo bench -p pursuit-estimation --bench peers` prints the least time of each and the
//! ratio. `benches/compare_peers.py` adds FilterPy to the same rounds: with the argument `--serve` this program runs one
//! round for each line it reads.

#![allow(missing_docs, clippy::unwrap_used)]

use nalgebra::{SMatrix, SVector};
use pursuit_estimation::motion::{ConstantAcceleration, ConstantVelocity, PhysicalBox};
use pursuit_estimation::{Gaussian, LinearMeasurement, MotionModel, Transition};
use std::hint::black_box;
use std::io::{BufRead, Write};
use std::time::Instant;

/// Steps that are timed together, and rounds when nobody asks for them.
const STEPS: u32 = 5_000;
const ROUNDS: u32 = 400;

/// Both filters on one problem.
trait Contest {
    /// Nanoseconds a step, ours and the peer's.
    fn round(&mut self) -> [f64; 2];
}

struct Problem<const M: usize, const N: usize> {
    step: Transition<N>,
    sensor: LinearMeasurement<M, N>,
    ours: Gaussian<N>,
    value: SVector<f64, M>,
    peer: kfilter::Kalman1MLinearNoInput<f64, N, M>,
    peer_value: kfilter_nalgebra::SVector<f64, M>,
}

impl<const M: usize, const N: usize> Problem<M, N> {
    fn new(step: Transition<N>, sensor: LinearMeasurement<M, N>) -> Self {
        let value = SVector::repeat(0.1);
        Self {
            step,
            sensor,
            ours: Gaussian::new(SVector::zeros(), SMatrix::identity()).unwrap(),
            value,
            peer: kfilter::Kalman1M::new(
                for_kfilter(step.matrix()),
                for_kfilter(step.noise()),
                for_kfilter(sensor.matrix()),
                for_kfilter(sensor.noise()),
                kfilter_nalgebra::SVector::zeros(),
            ),
            peer_value: for_kfilter(&value),
        }
    }
}

impl<const M: usize, const N: usize> Contest for Problem<M, N> {
    fn round(&mut self) -> [f64; 2] {
        let ours = timed(|| {
            self.ours.predict(black_box(&self.step)).unwrap();
            self.ours.update(black_box(&self.sensor), black_box(&self.value)).unwrap();
        });
        let peer = timed(|| {
            kfilter::KalmanPredict::predict(&mut self.peer).unwrap();
            self.peer.update(black_box(self.peer_value)).unwrap();
        });
        [ours, peer]
    }
}

/// Nanoseconds of one of `STEPS` calls.
fn timed(mut step: impl FnMut()) -> f64 {
    let start = Instant::now();
    for _ in 0..STEPS {
        step();
    }
    start.elapsed().as_secs_f64() * 1e9 / f64::from(STEPS)
}

/// The same matrix in the version of nalgebra that kfilter uses.
fn for_kfilter<const R: usize, const C: usize>(matrix: &SMatrix<f64, R, C>) -> kfilter_nalgebra::SMatrix<f64, R, C> {
    kfilter_nalgebra::SMatrix::from_column_slice(matrix.as_slice())
}

/// Nanoseconds a step with the transition given, and with it computed from the time step.
fn computed_each_time<const M: usize, const N: usize>(
    model: &impl MotionModel<N>,
    sensor: &LinearMeasurement<M, N>,
) -> [f64; 2] {
    let step = model.over(1.0 / 30.0).unwrap();
    let (mut belief, value) =
        (Gaussian::<N>::new(SVector::zeros(), SMatrix::identity()).unwrap(), SVector::repeat(0.1));
    let fixed = timed(|| {
        belief.predict(black_box(&step)).unwrap();
        belief.update(black_box(sensor), black_box(&value)).unwrap();
    });
    let each = timed(|| {
        belief.predict(&black_box(model).over(black_box(1.0 / 30.0)).unwrap()).unwrap();
        belief.update(black_box(sensor), black_box(&value)).unwrap();
    });
    [fixed, each]
}

/// Prints what computing the transition at each step costs.
fn report_computed<const M: usize, const N: usize>(
    name: &str,
    rounds: u32,
    model: &impl MotionModel<N>,
    sensor: &LinearMeasurement<M, N>,
) {
    let mut least = [f64::INFINITY; 2];
    for _ in 0..rounds {
        let round = computed_each_time(model, sensor);
        least = [least[0].min(round[0]), least[1].min(round[1])];
    }
    let [fixed, each] = least;
    println!("linear {name}: dt fixed {fixed:.1} ns, computed at each step {each:.1} ns, ratio {:.2}", each / fixed);
}

fn main() {
    let dt_s = 1.0 / 30.0;
    let four = ConstantVelocity::<2>::white(50.0).over(dt_s).unwrap();
    let six = PhysicalBox { acceleration_density: 50.0, size_density: 1.0, position_density: 0.0 }.over(dt_s).unwrap();
    let mut problems: [(&str, Box<dyn Contest>); 2] = [
        ("4/2", Box::new(Problem::new(four, LinearMeasurement::<2, 4>::select([0, 1], [1.0, 1.0]).unwrap()))),
        ("6/4", Box::new(Problem::new(six, PhysicalBox::measurement(1.0, 1.0).unwrap()))),
    ];
    if std::env::args().any(|argument| argument == "--serve") {
        let mut out = std::io::stdout();
        for _ in std::io::stdin().lock().lines() {
            for (name, problem) in &mut problems {
                let [ours, peer] = problem.round();
                write!(out, "{name} {ours} {peer} ").unwrap();
            }
            writeln!(out).unwrap();
            out.flush().unwrap();
        }
        return;
    }
    // Cargo names what it does: without `--bench` this is a test run, which only asks whether it works.
    let rounds = if std::env::args().any(|argument| argument == "--bench") { ROUNDS } else { 1 };
    let four = LinearMeasurement::<2, 4>::select([0, 1], [1.0, 1.0]).unwrap();
    let six = LinearMeasurement::<2, 6>::select([0, 1], [1.0, 1.0]).unwrap();
    let boxed = PhysicalBox::measurement(1.0, 1.0).unwrap();
    report_computed("4/2", rounds, &ConstantVelocity::<2>::white(50.0), &four);
    report_computed("6/2", rounds, &ConstantAcceleration::<2>::white(50.0), &six);
    report_computed(
        "6/4",
        rounds,
        &PhysicalBox { acceleration_density: 50.0, size_density: 1.0, position_density: 0.0 },
        &boxed,
    );
    for (name, problem) in &mut problems {
        let mut least = [f64::INFINITY; 2];
        for _ in 0..rounds {
            let round = problem.round();
            least = [least[0].min(round[0]), least[1].min(round[1])];
        }
        let [ours, peer] = least;
        println!("linear {name}: pursuit {ours:.1} ns, kfilter {peer:.1} ns, kfilter / pursuit {:.2}", peer / ours);
    }
}
