//! The supervised (reset) measures of VOT: accuracy, robustness and expected average overlap (Kristan et al. 2015,
//! 2016), frame by frame as the official toolkit computes them.

/// What happened in one frame of a supervised run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Supervised {
    /// The tracker was started on the true box.
    Init,
    /// It reported a box with this overlap (> 0).
    Overlap(f64),
    /// Its box did not overlap the target: a failure.
    Failure,
    /// Skipped after a failure, or before the first start.
    Skipped,
}

/// Frames skipped after a failure before the tracker is started again, counted from the failure.
pub const SKIP_AFTER_FAILURE: usize = 5;
/// Frames from each start that do not count towards accuracy.
pub const BURN_IN: usize = 10;
/// Sensitivity of the reliability `exp(−S · failures / frames)`.
pub const SENSITIVITY: f64 = 30.0;
/// The span of run lengths that the EAO averages over, as published for VOT2018 (VOT2015/16: 108…371, VOT2019: 46…291).
pub const EAO_SPAN: (usize, usize) = (100, 356);

/// Mean overlap outside burn-in and failures, and the number of frames it is taken over; 0 of nothing.
pub fn accuracy(frames: &[Supervised], burn_in: usize) -> (f64, usize) {
    let mut quiet = 0usize;
    let (mut sum, mut count) = (0.0, 0usize);
    for frame in frames {
        if *frame == Supervised::Init {
            quiet = burn_in;
        }
        match frame {
            Supervised::Overlap(overlap) if quiet == 0 => {
                sum += overlap;
                count += 1;
            }
            // Only reached without burn-in: the toolkit gives the frame of a start no overlap.
            Supervised::Init if quiet == 0 => count += 1,
            _ => {}
        }
        quiet = quiet.saturating_sub(1);
    }
    (if count > 0 { sum / count as f64 } else { 0.0 }, count)
}

/// How often the tracker failed.
pub fn failures(frames: &[Supervised]) -> usize {
    frames.iter().filter(|f| **f == Supervised::Failure).count()
}

/// `exp(−sensitivity · failures / frames)`, in `[0, 1]`.
pub fn reliability(failures: f64, frames: f64, sensitivity: f64) -> f64 {
    if frames > 0.0 { (-sensitivity * failures / frames).exp() } else { 0.0 }
}

/// A stretch from a start to a failure or to the end.
#[derive(Debug, Clone, PartialEq)]
pub struct Fragment {
    /// Overlap of every frame; 0 in the frame of the start.
    pub overlaps: Vec<f64>,
    /// Whether it ended in a failure.
    pub failed: bool,
}

/// The fragments of a supervised trajectory.
pub fn fragments(frames: &[Supervised]) -> Vec<Fragment> {
    let mut fragments = Vec::new();
    let mut current: Option<Vec<f64>> = None;
    for frame in frames {
        match frame {
            Supervised::Init => {
                let unfinished = current.replace(vec![0.0]);
                fragments.extend(unfinished.map(|overlaps| Fragment { overlaps, failed: false }));
            }
            Supervised::Overlap(overlap) => {
                if let Some(fragment) = &mut current {
                    fragment.push(*overlap);
                }
            }
            Supervised::Failure => fragments.extend(current.take().map(|overlaps| Fragment { overlaps, failed: true })),
            Supervised::Skipped => {}
        }
    }
    fragments.extend(current.map(|overlaps| Fragment { overlaps, failed: false }));
    fragments
}

/// Expected average overlap for every run length (index = frames after the start).
///
/// A run that failed counts with zeros from its failure on; one that reached the end counts up to its length only.
pub fn eao_curve(fragments: &[Fragment]) -> Vec<f64> {
    let longest = fragments.iter().map(|r| r.overlaps.len()).max().unwrap_or(0);
    let (mut sums, mut counts) = (vec![0.0; longest], vec![0usize; longest]);
    for fragment in fragments {
        let reach = if fragment.failed { longest } else { fragment.overlaps.len() };
        let mut total = 0.0;
        for length in 0..reach {
            let overlap = fragment.overlaps.get(length).copied().unwrap_or(0.0);
            // The frame of the start is not averaged over, except that it is all there is of length 0.
            total += if length == 0 { 0.0 } else { overlap };
            sums[length] += if length == 0 { overlap } else { total / length as f64 };
            counts[length] += 1;
        }
    }
    sums.into_iter().zip(counts).map(|(s, n)| if n > 0 { s / n as f64 } else { 0.0 }).collect()
}

/// The mean of the curve over a span of lengths (both included), cut to the curve's own; `None` when it does not reach it.
pub fn expected_average_overlap(curve: &[f64], (low, high): (usize, usize)) -> Option<f64> {
    let part = curve.get(low..=high.min(curve.len().checked_sub(1)?))?;
    (!part.is_empty()).then(|| super::mean(part))
}

#[cfg(test)]
mod tests {
    use super::Supervised::{Failure, Init, Overlap, Skipped};
    use super::*;

    #[test]
    fn accuracy_leaves_out_burn_in_and_failures() {
        let frames =
            [Init, Overlap(0.1), Overlap(0.6), Overlap(0.8), Failure, Skipped, Init, Overlap(0.2), Overlap(1.0)];
        let (accuracy, count) = accuracy(&frames, 2);
        assert!((accuracy - (0.6 + 0.8 + 1.0) / 3.0).abs() < 1e-12);
        assert_eq!((count, failures(&frames)), (3, 1));
    }

    #[test]
    fn overlap_curve_pads_only_failed_runs() {
        let frames = [Init, Overlap(0.6), Failure, Skipped, Init, Overlap(1.0), Overlap(0.5), Overlap(0.9)];
        let fragments = fragments(&frames);
        assert_eq!(fragments.iter().map(|r| (r.overlaps.len(), r.failed)).collect::<Vec<_>>(), [(2, true), (4, false)]);
        let curve = eao_curve(&fragments);
        let expected = [0.0, 0.8, (0.3 + 0.75) / 2.0, (0.2 + 0.8) / 2.0];
        assert!(curve.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{curve:?}");
        assert_eq!(expected_average_overlap(&curve, (1, 2)), Some((0.8 + 0.525) / 2.0));
        assert_eq!(expected_average_overlap(&curve, (10, 20)), None);
    }

    #[test]
    fn starts_without_burn_in_count_as_zero() {
        let (mean, count) = accuracy(&[Init, Overlap(0.6), Failure, Skipped, Init, Overlap(0.9)], 0);
        assert!((mean - 1.5 / 4.0).abs() < 1e-12);
        assert_eq!(count, 4);
        assert_eq!(accuracy(&[Init, Overlap(0.6)], 5), (0.0, 0));
        // Burn-in counts the start: with 1, the first overlap counts.
        assert_eq!(accuracy(&[Init, Overlap(0.5), Overlap(0.75)], 1), (0.625, 2));
        assert_eq!(accuracy(&[], 0), (0.0, 0));
        assert_eq!(failures(&[Init, Failure, Skipped, Init, Failure]), 2);
    }

    #[test]
    fn reliability_falls_exponentially_with_failures() {
        assert_eq!((reliability(0.0, 100.0, 30.0), reliability(3.0, 0.0, 30.0)), (1.0, 0.0));
        assert_eq!(reliability(0.0, 0.0, 30.0), 0.0, "nothing seen proves nothing");
        assert!((reliability(2.0, 120.0, 30.0) - (-0.5f64).exp()).abs() < 1e-12);
    }

    #[test]
    fn a_start_ends_the_run_before_it() {
        let found =
            fragments(&[Skipped, Overlap(0.4), Init, Overlap(0.5), Init, Overlap(0.7), Failure, Overlap(0.1), Failure]);
        let fragment = |overlaps: &[f64], failed| Fragment { overlaps: overlaps.to_vec(), failed };
        assert_eq!(
            found,
            [fragment(&[0.0, 0.5], false), fragment(&[0.0, 0.7], true)],
            "what lies outside of fragments is left out"
        );
        assert_eq!(fragments(&[]), []);
    }

    #[test]
    fn curves_average_over_the_runs_that_reach() {
        let fragment = |overlaps: &[f64], failed| Fragment { overlaps: overlaps.to_vec(), failed };
        let curve = eao_curve(&[fragment(&[0.0, 0.4], false), fragment(&[0.0, 0.8, 0.6, 1.0], false)]);
        let expected = [0.0, 0.6, 0.7, 0.8];
        assert!(curve.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12) && curve.len() == 4, "{curve:?}");
        assert!(eao_curve(&[]).is_empty());
    }

    #[test]
    fn the_span_is_cut_to_the_curve() {
        let curve = [0.0, 0.2, 0.4, 0.9];
        assert_eq!(expected_average_overlap(&curve, (3, 100)), Some(0.9));
        assert!((expected_average_overlap(&curve, (1, 2)).unwrap() - 0.3).abs() < 1e-12);
        assert_eq!(expected_average_overlap(&curve, (4, 100)), None);
        assert_eq!(expected_average_overlap(&[], (0, 5)), None);
    }
}
