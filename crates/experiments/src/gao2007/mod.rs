//! `gao2007` §5: the filter whose transition is learnt against the plain one, on a sudden turn, a circle, and a circle in
//! noise. All figures are root mean square errors of the filtered position over all frames.

mod benches;
mod params;
mod pictures;

use super::Paper;
use super::axis_filters::AxisFilter;
use super::filters::{Trace, rmse, tuned};
use super::monte_carlo::{decades, median, over_seeds, quantile_of, share};
use super::result::{Bar, Finding, Reproduction, Row, Spread};
use super::table::number;
use crate::ExperimentError;
use params::{Bench, PHASE_B, PHASES, Printed, Q_OVER_R_1, Q_OVER_R_B, SIGMA_B, STAY, TUNING, TUNING_SEEDS};
use pursuit_estimation::gao2007::LiteralParams;

const STREAM: u64 = 2007;
const TUNING_STREAM: u64 = 20_070;

/// What `filter` makes of one measured sequence of `bench`.
fn trace(
    bench: &Bench,
    filter: AxisFilter,
    measured: &[nalgebra::SVector<f64, 1>],
) -> Result<Trace<1>, ExperimentError> {
    let first = measured.first().copied().unwrap_or_default();
    let mut filter = filter.start(bench.variance, &first, bench.path.velocity)?;
    Trace::of(&mut *filter, measured)
}

/// The error of `filter` on each seed.
fn errors(bench: &Bench, filter: AxisFilter, seeds: u32, stream: u64) -> Result<Vec<f64>, ExperimentError> {
    // Without noise all seeds are the same.
    let seeds = if bench.sigma > 0.0 { seeds } else { 1 };
    over_seeds(seeds, stream, |random| {
        let measured = bench.path.measured(bench.sigma, random);
        Ok(rmse(&trace(bench, filter, &measured)?.filtered, &bench.path.positions))
    })
}

/// `q / R` of the plain filter with the least median error on seeds of its own.
fn tuned_plain(bench: &Bench) -> Result<f64, ExperimentError> {
    let (low, high, per_decade) = TUNING;
    tuned(&decades(low, high, per_decade), |q| {
        let filter = AxisFilter::Plain { q: q * bench.variance };
        Ok(median(errors(bench, filter, TUNING_SEEDS, TUNING_STREAM)?).value)
    })
}

/// Two interacting constant-velocity models, the same ones everywhere.
const IMM: AxisFilter = AxisFilter::ImmVelocity { quiet: 1e-4, agile: 1.0, stay: STAY };

/// Errors of the plain filter, the adaptive one, the tuned plain one and interacting models, seed by seed.
struct Outcome {
    plain: Vec<f64>,
    adaptive: Vec<f64>,
    tuned: Vec<f64>,
    imm: Vec<f64>,
    tuned_q: f64,
}

fn ratios(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a / b).collect()
}

impl Outcome {
    fn new(bench: &Bench, q_over_r: f64, adaptive: AxisFilter, seeds: u32) -> Result<Self, ExperimentError> {
        let tuned_q = tuned_plain(bench)?;
        let run = |filter| errors(bench, filter, seeds, STREAM);
        Ok(Self {
            plain: run(AxisFilter::Plain { q: q_over_r * bench.variance })?,
            adaptive: run(adaptive)?,
            tuned: run(AxisFilter::Plain { q: tuned_q * bench.variance })?,
            imm: run(IMM)?,
            tuned_q,
        })
    }

    /// Adaptive over plain.
    fn ratio(&self) -> Vec<f64> {
        ratios(&self.adaptive, &self.plain)
    }

    /// A row of that ratio, the tuned plain filter's and the interacting models' beside it.
    fn ratio_row(&self, setting: &str, figure: &str) -> Row {
        Row::new(setting, figure, spread(self.ratio()))
            .beside(median(ratios(&self.tuned, &self.plain)).value, median(ratios(&self.imm, &self.plain)).value)
    }

    /// The errors themselves.
    fn error_rows(&self, setting: &str, paper: usize, reference: [f64; 2]) -> [Row; 2] {
        let of = |figure: &str, errors: &[f64]| Row::new(setting, figure, spread(errors.to_vec()));
        [
            of("plain RMSE", &self.plain).paper(Printed::PLAIN[paper - 1]).reference(reference[0]),
            of("adaptive RMSE", &self.adaptive)
                .paper(Printed::IMPROVED[paper - 1])
                .reference(reference[1])
                .beside(median(self.tuned.iter().copied()).value, median(self.imm.iter().copied()).value),
        ]
    }

    fn better(&self) -> f64 {
        share(&self.ratio(), |r| *r < 1.0)
    }
}

/// Median and quantiles; of a single run, only the number.
fn spread(values: Vec<f64>) -> Spread {
    match values.as_slice() {
        [single] => (*single).into(),
        _ => median(values),
    }
}

/// Experiment 1, gated, and three further turns.
fn experiment_1(seeds: u32) -> Result<(Vec<Row>, Vec<Finding>), ExperimentError> {
    let bench = Bench::experiment_1();
    let gated = AxisFilter::Gated { q: Q_OVER_R_1 * bench.variance };
    let outcome = Outcome::new(&bench, Q_OVER_R_1, gated, seeds)?;
    let over_imm = ratios(&outcome.adaptive, &outcome.imm);
    let [plain, adaptive] = outcome.error_rows(bench.name, 1, [6.8315, 0.4214]);
    let mut rows = vec![
        plain,
        adaptive.bar(Bar::AtMost(0.46)),
        outcome
            .ratio_row(bench.name, "gated / plain")
            .paper(Printed::ratio(1))
            .reference(0.0617)
            .bar(Bar::AtMost(0.070)),
        Row::new(bench.name, "95 % quantile of gated / plain", quantile_of(outcome.ratio(), 0.95))
            .reference(0.071)
            .bar(Bar::AtMost(0.080)),
        Row::new(bench.name, "share of seeds, gated better", outcome.better()).reference(1.0).bar(Bar::AtLeast(1.0)),
        Row::new(bench.name, "gated / IMM", median(over_imm)).reference(0.0617 / 0.0501).bar(Bar::AtLeast(1.1)),
    ];
    for (name, before, after, reference) in
        [("2 to .5", 2.0, 0.5, 0.129), ("2 to 0", 2.0, 0.0, 0.093), ("4 to −4", 4.0, -4.0, 0.052)]
    {
        let bench = Bench::turn(name, before, after);
        let outcome = Outcome::new(&bench, Q_OVER_R_1, gated, seeds)?;
        rows.push(outcome.ratio_row("other turns, gated, q/R 1e-4", &format!("{name}: / plain")).reference(reference));
    }
    let tuned_ratio = median(ratios(&outcome.tuned, &outcome.plain)).value;
    let gated_ratio = median(outcome.ratio()).value;
    let finding = Finding::new(
        "the ratios measure the improved filter: on a sudden turn it has a seventeenth of the error",
        tuned_ratio > 2.0 * gated_ratio,
        format!(
            "they measure how badly the plain filter is tuned: with q/R = {} it alone has {} of the error (the gated \
             form {}, interacting models {})",
            number(outcome.tuned_q),
            number(tuned_ratio),
            number(gated_ratio),
            number(median(ratios(&outcome.imm, &outcome.plain)).value),
        ),
    );
    Ok((rows, vec![finding]))
}

/// Experiments 2 and 3 in setup B: filtered differences, two samples, clamped ratios.
fn setup_b(seeds: u32) -> Result<(Vec<Row>, Vec<Finding>), ExperimentError> {
    let quiet = Bench::setup_b("experiment 2: circle without noise, setup B", 0.0, PHASE_B);
    let q = Q_OVER_R_B * quiet.variance;
    let literal = AxisFilter::Literal(LiteralParams::experiment_2(q, quiet.variance));
    let outcome = Outcome::new(&quiet, Q_OVER_R_B, literal, 1)?;
    let over_phases = phases(literal)?;
    let mut rows = outcome.error_rows(quiet.name, 2, [1.011, 0.284]).to_vec();
    rows.push(
        outcome
            .ratio_row(quiet.name, "adaptive / plain")
            .paper(Printed::ratio(2))
            .reference(0.281)
            .bar(Bar::AtMost(0.30)),
    );
    let spread_of_phases = median(over_phases);
    rows.push(Row::new(quiet.name, "adaptive / plain, 100 phases", spread_of_phases));

    let noisy = Bench::setup_b("experiment 3: circle in noise, setup B, σ .82", SIGMA_B, PHASE_B);
    let outcome = Outcome::new(&noisy, Q_OVER_R_B, literal, seeds)?;
    rows.extend(outcome.error_rows(noisy.name, 3, [1.114, 0.859]));
    rows.push(
        outcome
            .ratio_row(noisy.name, "adaptive / plain")
            .paper(Printed::ratio(3))
            .reference(0.772)
            .bar(Bar::AtMost(0.80)),
    );
    let better = Row::new(noisy.name, "share of seeds, adaptive better", outcome.better());
    rows.push(better.reference(0.977).bar(Bar::AtLeast(0.95)));
    let tuned_ratio = median(ratios(&outcome.tuned, &outcome.plain)).value;
    let adaptive_ratio = median(outcome.ratio()).value;
    let finding = Finding::new(
        "the improved filter is better than the ordinary one on a circle in noise",
        adaptive_ratio < tuned_ratio,
        format!(
            "it has {} of the error of one with q/R = {Q_OVER_R_B}, but one with q/R = {} has {} of it",
            number(adaptive_ratio),
            number(outcome.tuned_q),
            number(tuned_ratio)
        ),
    );
    let spread_finding = Finding::new(
        "the noise-free figure is a property of the filter",
        spread_of_phases.high.zip(spread_of_phases.low).is_some_and(|(high, low)| high - low < 0.02),
        format!(
            "it depends on where on the circle the target starts: {} to {} over 90 % of the phases",
            number(spread_of_phases.low.unwrap_or(f64::NAN)),
            number(spread_of_phases.high.unwrap_or(f64::NAN)),
        ),
    );
    Ok((rows, vec![finding, spread_finding]))
}

/// Adaptive over plain without noise, for phases around the circle.
fn phases(literal: AxisFilter) -> Result<Vec<f64>, ExperimentError> {
    let mut found = Vec::new();
    for k in 0..PHASES {
        let phase = std::f64::consts::TAU * f64::from(k) / f64::from(PHASES);
        let bench = Bench::setup_b("", 0.0, phase);
        let run = |filter| errors(&bench, filter, 1, STREAM);
        let plain = run(AxisFilter::Plain { q: Q_OVER_R_B * bench.variance })?;
        found.extend(ratios(&run(literal)?, &plain));
    }
    Ok(found)
}

/// The gated form on the circle, and what it costs on a straight line.
fn gated_elsewhere(seeds: u32) -> Result<Vec<Row>, ExperimentError> {
    let setting = "gated on a circle, r 50, period 100, q/R .01";
    let quiet = Bench::circle(setting, 0.0, 0.25);
    let noisy = Bench::circle(setting, 0.8, 0.64);
    let gated = |bench: &Bench, q: f64| AxisFilter::Gated { q: q * bench.variance };
    let without = Outcome::new(&quiet, 0.01, gated(&quiet, 0.01), 1)?;
    let with = Outcome::new(&noisy, 0.01, gated(&noisy, 0.01), seeds)?;
    let mut rows = vec![
        without.ratio_row(setting, "no noise: gated / plain").reference(0.414),
        with.ratio_row(setting, "σ .8: gated / plain").reference(0.674).bar(Bar::AtMost(0.70)),
        Row::new(setting, "σ .8: IMM / tuned plain", median(ratios(&with.imm, &with.tuned)))
            .reference(1.07)
            .bar(Bar::AtMost(1.10)),
    ];
    let setting = "gated on a straight line, 2 px a frame, σ .5";
    let straight = Bench::straight(setting);
    for (q, reference, bar) in
        [(1e-4, 1.12, Some(Bar::AtMost(1.15))), (1e-2, 1.009, Some(Bar::AtMost(1.02))), (1e-1, 1.0, None)]
    {
        let outcome = Outcome::new(&straight, q, gated(&straight, q), seeds)?;
        let row = outcome.ratio_row(setting, &format!("q/R {q}: gated / plain"));
        rows.push(row.reference(reference).bar_if(bar));
    }
    Ok(rows)
}

/// Runs the experiments.
pub(super) fn run(seeds: u32) -> Result<Reproduction, ExperimentError> {
    let (mut rows, mut findings) = experiment_1(seeds)?;
    let (more_rows, more_findings) = setup_b(seeds)?;
    rows.extend(more_rows);
    findings.extend(more_findings);
    rows.extend(gated_elsewhere(seeds)?);
    let (bench_rows, finding) = benches::rows(seeds)?;
    rows.extend(bench_rows);
    findings.push(finding);
    Ok(Reproduction {
        paper: Paper::Gao2007,
        title: "a filter whose transition is learnt, on a turn, a circle, and a circle in noise".into(),
        seeds,
        rows,
        findings,
        charts: pictures::charts()?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn experiment_1_agrees_with_the_paper() {
        let bench = Bench::experiment_1();
        let gated = AxisFilter::Gated { q: Q_OVER_R_1 * bench.variance };
        let outcome = Outcome {
            plain: errors(&bench, AxisFilter::Plain { q: Q_OVER_R_1 * bench.variance }, 10, STREAM).unwrap(),
            adaptive: errors(&bench, gated, 10, STREAM).unwrap(),
            tuned: Vec::new(),
            imm: errors(&bench, IMM, 10, STREAM).unwrap(),
            tuned_q: 1.0,
        };
        assert!((median(outcome.plain.clone()).value - 6.83).abs() < 0.15);
        assert_eq!(outcome.better(), 1.0);
        assert!(median(outcome.ratio()).value < 0.08);
        assert!(median(ratios(&outcome.imm, &outcome.plain)).value < 0.07);
    }

    #[test]
    fn without_noise_one_run_is_enough() {
        let bench = Bench::circle("", 0.0, 0.25);
        let found = errors(&bench, AxisFilter::Plain { q: 0.01 * 0.25 }, 50, STREAM).unwrap();
        assert_eq!(found.len(), 1);
        assert!((found[0] - 1.0117).abs() < 1e-3, "{found:?}");
    }
}
