//! The simplex method of Nelder and Mead (1965), with the coefficients of Lagarias et al. (1998).

use nalgebra::SVector;

use crate::{EstimationError, Result};

/// Where a function is least.
pub(super) struct Minimum<const P: usize> {
    pub at: SVector<f64, P>,
    pub least: f64,
    pub evaluations: usize,
}

/// Side of the first simplex.
const SIDE: f64 = 0.7;
/// Settled where values and places differ by no more than this.
const VALUES: f64 = 1e-9;
const PLACES: f64 = 1e-5;
/// What has gone so far is going to infinity. Parameters are exponentials of places.
const FAR: f64 = 600.0;
/// Searches, each from what the last one found: a simplex that has collapsed unfolds again.
const SEARCHES: usize = 20;
/// Evaluations in one search for each parameter.
const EVALUATIONS: usize = 400;

/// The least value of `cost` near `start`. Infinite values are walls.
pub(super) fn minimise<const P: usize>(
    cost: impl Fn(&SVector<f64, P>) -> f64,
    start: SVector<f64, P>,
) -> Result<Minimum<P>> {
    let mut best = Minimum { at: start, least: cost(&start), evaluations: 1 };
    if P == 0 {
        return Ok(best);
    }
    let mut side = SIDE;
    for _ in 0..SEARCHES {
        let found = search(&cost, &best, side);
        let gain = best.least - found.least;
        let evaluations = best.evaluations + found.evaluations;
        best = Minimum { evaluations, ..found };
        if best.at.amax() > FAR {
            break;
        }
        if gain <= 1e-6 * (1.0 + best.least.abs() * 1e-6) {
            return Ok(best);
        }
        side = (side * 0.7).max(0.05);
    }
    Err(EstimationError::NoConvergence { what: "the search for the most likely parameters", iterations: SEARCHES })
}

/// One search from a fresh simplex.
fn search<const P: usize>(cost: &impl Fn(&SVector<f64, P>) -> f64, from: &Minimum<P>, side: f64) -> Minimum<P> {
    let mut corners = vec![(from.least, from.at)];
    for axis in 0..P {
        let mut at = from.at;
        at[axis] += side;
        corners.push((cost(&at), at));
    }
    let mut evaluations = P;
    while evaluations < EVALUATIONS * P {
        corners.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (worst, others) = (corners[P], &corners[..P]);
        let wide = others.iter().map(|(_, at)| (at - worst.1).amax()).fold(0.0, f64::max);
        if worst.0 - others[0].0 <= VALUES * (1.0 + others[0].0.abs()) && wide <= PLACES {
            break;
        }
        let centre: SVector<f64, P> = others.iter().map(|(_, at)| at).sum::<SVector<f64, P>>() / P as f64;
        let along = |t: f64| centre + (worst.1 - centre) * t;
        let tried = |t: f64| {
            let at = along(t);
            (cost(&at), at)
        };
        let reflected = tried(-1.0);
        evaluations += 1;
        let (least, second) = (others[0].0, others[P - 1].0);
        if reflected.0 < least {
            let expanded = tried(-2.0);
            evaluations += 1;
            corners[P] = if expanded.0 < reflected.0 { expanded } else { reflected };
            continue;
        }
        if reflected.0 < second {
            corners[P] = reflected;
            continue;
        }
        let (t, bound) = if reflected.0 < worst.0 { (-0.5, reflected.0) } else { (0.5, worst.0) };
        let contracted = tried(t);
        evaluations += 1;
        if contracted.0 < bound {
            corners[P] = contracted;
            continue;
        }
        let best = corners[0].1;
        for (value, at) in &mut corners[1..] {
            *at = best + (*at - best) * 0.5;
            *value = cost(at);
        }
        evaluations += P;
    }
    corners.sort_by(|a, b| a.0.total_cmp(&b.0));
    Minimum { at: corners[0].1, least: corners[0].0, evaluations }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_the_bottom_of_curved_valleys() {
        // Rosenbrock's valley, and Powell's singular function, whose curvature vanishes at the bottom.
        let valley = |x: &SVector<f64, 2>| 100.0 * (x[1] - x[0] * x[0]).powi(2) + (1.0 - x[0]).powi(2);
        let found = minimise(valley, SVector::from([-1.2, 1.0])).unwrap();
        assert!((found.at - SVector::from([1.0, 1.0])).norm() < 1e-3 && found.least < 1e-6, "{}", found.at);
        let singular = |x: &SVector<f64, 4>| {
            (x[0] + 10.0 * x[1]).powi(2)
                + 5.0 * (x[2] - x[3]).powi(2)
                + (x[1] - 2.0 * x[2]).powi(4)
                + 10.0 * (x[0] - x[3]).powi(4)
        };
        let found = minimise(singular, SVector::from([3.0, -1.0, 0.0, 1.0])).unwrap();
        assert!(found.least < 1e-5, "{}", found.least);
        assert!(found.evaluations > 50);
    }

    #[test]
    fn walls_are_kept_out_of() {
        let half = |x: &SVector<f64, 1>| if x[0] < 0.3 { f64::INFINITY } else { x[0] };
        let found = minimise(half, SVector::<f64, 1>::new(5.0)).unwrap();
        assert!((found.at[0] - 0.3).abs() < 1e-3, "{}", found.at[0]);
    }

    #[test]
    fn what_falls_for_ever_is_no_minimum() {
        let slope = |x: &SVector<f64, 1>| -x[0];
        assert!(matches!(minimise(slope, SVector::<f64, 1>::new(0.0)), Err(EstimationError::NoConvergence { .. })));
    }
}
