//! `zhai2024`: the maximum-likelihood recursion of the motion noise, equations (24) and (25), what it does for a particle
//! filter with few particles, and the whole tracker beside plain KCF and ACPF on clips with depth.

mod again;
mod clip;
mod clips;
#[cfg(test)]
mod dataset_tests;
mod params;
mod pictures;
mod toy;
mod tracking;

pub use clips::{ClipFigures, DepthClips, depth_clips};

use super::Paper;
use super::monte_carlo::{mean, over_seeds};
use super::result::{Bar, Finding, Reproduction, Row};
use super::table::number;
use crate::ExperimentError;
use nalgebra::Vector2;
use params::{LOOKED_AT, RESIDUAL_VARIANCE};
use pursuit_estimation::zhai2024::{VarianceEstimate, VarianceParams, VarianceRule};
use std::path::Path;

const STREAM: u64 = 2024;
/// Seeds of the particle filter, and clips: one for each ten of the recursion's.
const SEEDS_PER_TOY: u32 = 10;

/// What the recursion made of the residuals of one seed: the estimates as printed and corrected at each step, and the
/// batch estimate (24).
struct Estimates {
    printed: Vec<f64>,
    corrected: Vec<f64>,
    /// Largest relative deviation of the corrected recursion from the batch.
    deviation: f64,
}

fn estimates(residuals: &[Vector2<f64>]) -> Result<Estimates, ExperimentError> {
    let rule = |rule| VarianceEstimate::<2>::new(VarianceParams::unbounded(rule));
    let (mut printed, mut corrected) = (rule(VarianceRule::Printed)?, rule(VarianceRule::Corrected)?);
    let mut found = Estimates { printed: Vec::new(), corrected: Vec::new(), deviation: 0.0 };
    let mut sum = Vector2::zeros();
    for (k, residual) in (1_u32..).zip(residuals) {
        sum += residual.component_mul(residual);
        let batch = sum / f64::from(k);
        let now = corrected.observe(residual)?;
        found.deviation = found.deviation.max((now - batch).component_div(&batch).abs().max());
        found.corrected.push(now.mean());
        found.printed.push(printed.observe(residual)?.mean());
    }
    Ok(found)
}

fn recursion(seeds: u32) -> Result<(Vec<Row>, Vec<Estimates>), ExperimentError> {
    let steps = LOOKED_AT.iter().map(|(k, _)| *k).max().unwrap_or(1);
    let sigma = RESIDUAL_VARIANCE.sqrt();
    let all = over_seeds(seeds, STREAM, |random| {
        let residuals: Vec<Vector2<f64>> =
            (0..steps).map(|_| Vector2::new(sigma * random.normal(), sigma * random.normal())).collect();
        estimates(&residuals)
    })?;
    let setting = "variance recursion, true variance 4";
    let deviation = all.iter().map(|e| e.deviation).fold(0.0, f64::max);
    let mut rows = vec![
        Row::new(setting, "corrected (25) against batch (24), relative", deviation)
            .reference(3e-14)
            .bar(Bar::AtMost(1e-12)),
    ];
    for (k, reference) in LOOKED_AT {
        let at = |values: &[f64]| values.get(k - 1).copied().unwrap_or(f64::NAN);
        let theory = RESIDUAL_VARIANCE * (k as f64 - 1.0) / 2.0;
        // The mean of the printed form strays by √(8/3n) of itself at k = 2 and less later: bars from ten steps on.
        let bar = (k >= 10).then_some(Bar::Within { of: theory, relative: 0.03 });
        rows.push(
            Row::new(setting, format!("as printed, k = {k}"), mean(all.iter().map(|e| at(&e.printed))))
                .reference(reference)
                .bar_if(bar),
        );
    }
    let last = |e: &Estimates| e.corrected.last().copied().unwrap_or(f64::NAN);
    rows.push(Row::new(setting, format!("corrected, k = {steps}"), mean(all.iter().map(last))).reference(4.0));
    Ok((rows, all))
}

/// Runs the experiment.
pub(super) fn run(seeds: u32, dataset: Option<&Path>) -> Result<Reproduction, ExperimentError> {
    let (mut rows, all) = recursion(seeds)?;
    let grown = rows.iter().find(|r| r.figure == "as printed, k = 1000").map_or(f64::NAN, |r| r.ours.value);
    let mut findings = vec![Finding::new(
        "equation (25) is the recursive form of equation (24)",
        grown < 2.0 * RESIDUAL_VARIANCE,
        format!(
            "as printed its mean is σ² (k − 1)/2 and grows without bound: {} after 1000 steps for σ² = 4; with 1/k for the \
             second factor it is the batch estimate to rounding",
            number(grown)
        ),
    )];
    let (more_rows, more_findings) = toy::rows(seeds.div_ceil(SEEDS_PER_TOY))?;
    rows.extend(more_rows);
    findings.extend(more_findings);
    let (more_rows, more_findings, more_charts) = tracking::on_scenes(seeds.div_ceil(SEEDS_PER_TOY))?;
    rows.extend(more_rows);
    findings.extend(more_findings);
    let mut charts = pictures::charts(&all)?;
    charts.extend(more_charts);
    if let Some(folder) = dataset {
        let (more_rows, more_charts) = tracking::on_dataset(folder)?;
        rows.extend(more_rows);
        charts.extend(more_charts);
    }
    Ok(Reproduction {
        paper: Paper::Zhai2024,
        title: "motion noise by maximum likelihood, and tracking through occlusion by depth; the paper's own images have to be \
                had from the Princeton Tracking Benchmark and given by --dataset"
            .into(),
        seeds,
        rows,
        findings,
        charts,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    #[test]
    fn the_printed_form_weighs_residuals_by_their_age() {
        // Unrolled: s_k = Σ_j r_j² (j − 1)/k · …: the first residual has no weight at all, and the sum of weights is
        // (k − 1)/2.
        let unit = vec![Vector2::new(1.0, 1.0); 9];
        let found = estimates(&unit).unwrap();
        for (k, printed) in (1_i32..).zip(&found.printed) {
            assert!((printed - f64::from(k - 1) / 2.0).abs() < 1e-12, "{k}: {printed}");
        }
        assert!(found.corrected.iter().all(|s| (s - 1.0).abs() < 1e-15));
    }

    #[test]
    fn the_corrected_form_is_the_batch() {
        let mut random = Random::new(0, 0);
        let residuals: Vec<_> = (0..500).map(|_| Vector2::new(random.normal(), 1e3 * random.normal())).collect();
        assert!(estimates(&residuals).unwrap().deviation < 1e-12);
    }
}
