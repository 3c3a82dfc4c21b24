//! Whether what is said of position, velocity and acceleration is true: bias, and how often the truth lies within ± 2 standard
//! deviations, over a hundred draws of the pixels' and the clicks' errors.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may panic")]

mod common;

use common::{Normal, WORLDS, World, clicked_ruler, seen};
use pursuit_measuring::{Method, Options, measure};

/// Over all seeds and frames: mean error over mean standard deviation, share within 2 σ, and RMS error; of position, velocity and
/// acceleration.
fn judged(world: &World, gaps: bool, method: Method) -> [[f64; 3]; 3] {
    const SEEDS: u64 = 100;
    let mut sums = [[0.0; 4]; 3];
    for seed in 0..SEEDS {
        let mut draw = Normal::new(seed + 1000);
        let track = seen(world, 0.4, gaps, &mut draw);
        let ruler = clicked_ruler(world.camera, 0.5, &mut draw);
        let measured = measure(&track, &ruler, &Options { method, ..Options::default() }).unwrap();
        for moment in &measured.moments {
            let Some(state) = &moment.state else { continue };
            let truth = (world.state)(moment.time_s);
            for (order, sums) in sums.iter_mut().enumerate() {
                for axis in 0..2 {
                    let error = state.mean()[2 * order + axis] - truth[order][axis];
                    let deviation = state.deviation(2 * order + axis);
                    sums[0] += 1.0;
                    sums[1] += error / deviation;
                    sums[2] += f64::from(u8::from(error.abs() <= 2.0 * deviation));
                    sums[3] += error * error;
                }
            }
        }
    }
    sums.map(|[n, bias, inside, square]| [bias / n, inside / n, (square / n).sqrt()])
}

#[test]
fn truth_lies_within_two_standard_deviations() {
    for world in &WORLDS {
        for gaps in [false, true] {
            let found = judged(world, gaps, Method::Smoother);
            println!("{}, gaps {gaps}: [bias in σ, inside, RMS error] {found:.4?}", world.name);
            for [bias, inside, _] in found {
                assert!(inside >= 0.93, "{}, gaps {gaps}: {found:?}", world.name);
                assert!(bias.abs() < 0.25, "{}, gaps {gaps}: {found:?}", world.name);
            }
        }
    }
}

/// The table of the guide: how many times as large the other ways' errors are.
#[test]
fn the_smoother_errs_less_than_other_ways() {
    for world in &WORLDS {
        let own = judged(world, false, Method::Smoother).map(|f| f[2]);
        for method in [Method::SavitzkyGolay, Method::Differences] {
            let other = judged(world, false, method).map(|f| f[2]);
            let ratio: Vec<f64> = other.iter().zip(own).map(|(other, own)| other / own).collect();
            println!("{}, {method}: {ratio:.2?} times the smoother's error", world.name);
            assert!(ratio[0] > 0.99 && ratio[1] > 1.2 && ratio[2] > 1.5, "{}, {method}: {ratio:?}", world.name);
        }
    }
}
