//! Many filters on the same four targets: what the paper's ratio leaves out.

use super::params::{Bench, STAY, STAY_ACCELERATION};
use super::{Finding, Row, STREAM, errors, median, number, spread, tuned_plain};
use crate::ExperimentError;
use crate::axis_filters::AxisFilter;
use pursuit_estimation::gao2007::{LiteralParams, RatioGuard, VelocityReading};
use pursuit_estimation::regression::Kernel;

/// A filter, and the independent reference's figure on the turn, the circle without and with noise, and straight on.
type Entry = (&'static str, AxisFilter, [Option<f64>; 4]);

const R: f64 = 0.25;

fn literal(velocity: VelocityReading, samples: usize, gamma: f64, guard: RatioGuard) -> AxisFilter {
    AxisFilter::Literal(LiteralParams {
        acceleration_variance: 0.01 * R,
        measurement_variance: R,
        samples,
        gamma,
        kernel: Kernel::Linear,
        velocity,
        guard,
    })
}

fn entries() -> Vec<Entry> {
    let plain = |q_over_r: f64| AxisFilter::Plain { q: q_over_r * R };
    let clamp = RatioGuard::Clamp { low: 0.8, high: 1.25 };
    let all = |values: [f64; 4]| values.map(Some);
    vec![
        ("plain, q/R 1e-4", plain(1e-4), all([6.13, 8.81, 8.83, 0.205])),
        ("plain, q/R 1e-2", plain(1e-2), all([0.989, 1.012, 1.116, 0.281])),
        ("plain, q/R 1e-1", plain(1e-1), all([0.489, 0.281, 0.622, 0.342])),
        (
            "literal, posterior velocity, N 5",
            literal(VelocityReading::Posterior, 5, 10.0, RatioGuard::None),
            all([4.26, 4.23, 6.51, 5.39]),
        ),
        (
            "the same, ratios in [.8, 1.25]",
            literal(VelocityReading::Posterior, 5, 10.0, clamp),
            all([1.51, 1.65, 1.68, 1.27]),
        ),
        (
            "literal, measured velocity, N 2",
            literal(VelocityReading::MeasuredDifference, 2, 1.0, RatioGuard::None),
            all([0.642, 0.192, 0.815, 0.502]),
        ),
        ("gated, q/R 1e-2", AxisFilter::Gated { q: 0.01 * R }, [Some(0.377), Some(0.419), None, Some(0.288)]),
        (
            "Singer, α .2, a_max .5",
            AxisFilter::Singer { rate: 0.2, variance: 0.25 / 3.0 },
            all([0.430, 0.042, 0.650, 0.403]),
        ),
        (
            "current statistical, α .05, a_max 1",
            AxisFilter::Current { rate: 0.05, most: 1.0 },
            all([0.469, 0.018, 0.654, 0.410]),
        ),
        (
            "input estimation, 10 steps, q/R 1e-3",
            AxisFilter::InputEstimation { q: 1e-3 * R, threshold: 9.0 },
            all([0.327, 0.363, 0.723, 0.245]),
        ),
        (
            "IMM CV(1e-4) + CV(1)",
            AxisFilter::ImmVelocity { quiet: 1e-4, agile: 1.0, stay: STAY },
            all([0.346, 0.275, 0.668, 0.324]),
        ),
        (
            "IMM CV(1e-4) + CA(.01)",
            AxisFilter::ImmAcceleration { quiet: 1e-4, agile: 0.01, stay: STAY_ACCELERATION },
            all([0.370, 0.152, 0.635, 0.297]),
        ),
    ]
}

fn targets() -> [Bench; 4] {
    [
        Bench::turn("RMSE on a turn, 2 to −1.5 px a frame, σ .5", 2.0, -1.5),
        Bench::circle("RMSE on a circle without noise", 0.0, R),
        Bench::circle("RMSE on a circle, σ .8", 0.8, R),
        Bench::straight("RMSE straight on, σ .5"),
    ]
}

/// The rows of all filters on all targets, and what follows for the literal form.
pub(super) fn rows(seeds: u32) -> Result<(Vec<Row>, Finding), ExperimentError> {
    let tuned_reference = [0.423, 0.0, 0.614, 0.187];
    let (mut rows, mut literal_wins, mut compared) = (Vec::new(), 0, 0);
    let mut worst = 0.0_f64;
    for (column, bench) in targets().iter().enumerate() {
        let q = tuned_plain(bench)?;
        let best = median(errors(bench, AxisFilter::Plain { q: q * R }, seeds, STREAM)?).value;
        for (name, filter, references) in entries() {
            let found = spread(errors(bench, filter, seeds, STREAM)?);
            if matches!(filter, AxisFilter::Literal(_)) {
                compared += 1;
                literal_wins += usize::from(found.value < best);
                worst = worst.max(found.value / best);
            }
            rows.push(Row::new(bench.name, name, found).reference_if(references[column]));
        }
        let name = format!("plain, tuned: q/R {}", number(q));
        rows.push(Row::new(bench.name, name, best).reference(tuned_reference[column]));
    }
    let finding = Finding::new(
        "the printed ratio a(k) = v(k) / v(k−1) is a good transition",
        literal_wins > 0,
        format!(
            "of {compared} comparisons with a tuned plain filter the literal forms win {literal_wins}; a ratio of \
             velocities explodes where the velocity passes through zero (worst: {} times the tuned filter's error)",
            if worst > 1e3 { "more than 1000".to_owned() } else { number(worst) }
        ),
    );
    Ok((rows, finding))
}
