//! Long-term tracking: precision, recall and F (Lukežič et al. 2018, the VOT-LT measures), what is said while the target
//! is away, and how long a return goes unnoticed.

use super::mean;

/// One frame, judged. Frames of unknown truth are left out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScoredFrame {
    /// Whether the target is visible.
    pub visible: bool,
    /// Whether the tracker says that it sees the target.
    pub alive: bool,
    /// Overlap of the box with the target; 0 where either is missing.
    pub overlap: f64,
    /// The tracker's score, to be thresholded.
    pub score: f64,
}

/// Precision and recall at one operating point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PrecisionRecall {
    /// Mean overlap over the frames in which a box is claimed; 1 when none is (as the toolkit has it).
    pub precision: f64,
    /// Sum of these overlaps over the number of visible frames.
    pub recall: f64,
}

impl PrecisionRecall {
    /// The harmonic mean of both; 0 when both are 0.
    pub fn f(&self) -> f64 {
        let sum = self.precision + self.recall;
        if sum > 0.0 { 2.0 * self.precision * self.recall / sum } else { 0.0 }
    }

    /// The mean over sequences, taken before F as VOT-LT does; `None` of nothing.
    pub fn mean(of: &[Self]) -> Option<Self> {
        let all = |pick: fn(&Self) -> f64| mean(&of.iter().map(pick).collect::<Vec<_>>());
        (!of.is_empty()).then(|| Self { precision: all(|p| p.precision), recall: all(|p| p.recall) })
    }
}

/// Precision and recall of the frames that `claims` picks.
pub fn precision_recall(frames: &[ScoredFrame], claims: impl Fn(&ScoredFrame) -> bool) -> PrecisionRecall {
    let visible = frames.iter().filter(|j| j.visible).count();
    let (mut claimed, mut overlap) = (0usize, 0.0);
    for j in frames.iter().filter(|j| claims(j)) {
        claimed += 1;
        overlap += if j.visible { j.overlap } else { 0.0 };
    }
    if claimed == 0 {
        return PrecisionRecall { precision: 1.0, recall: 0.0 };
    }
    PrecisionRecall {
        precision: overlap / claimed as f64,
        recall: if visible > 0 { overlap / visible as f64 } else { 0.0 },
    }
}

/// Precision and recall of the TLD evaluation (Kalal, Mikolajczyk and Matas 2012, section 6): the box of a frame in which
/// the target is claimed to be seen is right if it overlaps by more than `overlap`, and wrong otherwise.
pub fn detection(frames: &[ScoredFrame], overlap: f64) -> PrecisionRecall {
    let visible = frames.iter().filter(|j| j.visible).count();
    let claimed = frames.iter().filter(|j| j.alive).count();
    let right = frames.iter().filter(|j| j.alive && j.visible && j.overlap > overlap).count() as f64;
    PrecisionRecall {
        precision: if claimed > 0 { right / claimed as f64 } else { 1.0 },
        recall: if visible > 0 { right / visible as f64 } else { 0.0 },
    }
}

/// Precision and recall at every threshold given: a box is claimed where `score ≥ threshold`.
pub fn precision_recall_curve(frames: &[ScoredFrame], thresholds: &[f64]) -> Vec<PrecisionRecall> {
    thresholds.iter().map(|t| precision_recall(frames, |j| j.score >= *t)).collect()
}

/// The thresholds of the VOT-LT toolkit: ∞, then `resolution − 2` scores in descending order at equal steps through the
/// sorted scores (all scores when there are fewer), then −∞.
pub fn thresholds(scores: &[f64], resolution: usize) -> Vec<f64> {
    let mut sorted: Vec<f64> = scores.iter().copied().filter(|s| !s.is_nan()).collect();
    sorted.sort_by(|a, b| b.total_cmp(a));
    let inner = resolution.saturating_sub(2);
    if sorted.len() > inner && inner > 1 {
        let delta = sorted.len() / inner;
        let span = (sorted.len() - 2 * delta) as f64;
        let at = |i: usize| {
            let position = delta as f64 + span * i as f64 / (inner - 1) as f64;
            sorted.get(position.round_ties_even() as usize).copied()
        };
        sorted = (0..inner).filter_map(at).collect();
    }
    std::iter::once(f64::INFINITY).chain(sorted).chain(std::iter::once(f64::NEG_INFINITY)).collect()
}

/// The best F over thresholds, with its threshold and operating point, for curves averaged over sequences: every curve
/// was taken at the same `thresholds`.
pub fn best_f(curves: &[Vec<PrecisionRecall>], thresholds: &[f64]) -> Option<(f64, PrecisionRecall)> {
    let at = |i: usize| PrecisionRecall::mean(&curves.iter().filter_map(|c| c.get(i).copied()).collect::<Vec<_>>());
    let averaged = thresholds.iter().enumerate().filter_map(|(i, t)| Some((*t, at(i)?)));
    // The first of equals, as the toolkit's `index(max(…))` picks.
    averaged.reduce(|best, next| if next.1.f() > best.1.f() { next } else { best })
}

/// Fraction of the frames without the target in which the tracker says that it sees it; `None` without such frames.
pub fn false_alive(frames: &[ScoredFrame]) -> Option<f64> {
    share(frames.iter().filter(|j| !j.visible), |j| j.alive)
}

/// Overlap from which on a box is right.
const RIGHT_FROM: f64 = 0.5;

/// Fraction of the frames with a right box in which the tracker does not say that it sees the target; `None` without such frames.
pub fn right_untold(frames: &[ScoredFrame]) -> Option<f64> {
    share(frames.iter().filter(|j| j.visible && j.overlap >= RIGHT_FROM), |j| !j.alive)
}

/// Fraction of the frames with a wrong box of a visible target in which the tracker says that it sees it; `None` without such frames.
pub fn wrong_told(frames: &[ScoredFrame]) -> Option<f64> {
    share(frames.iter().filter(|j| j.visible && j.overlap < RIGHT_FROM), |j| j.alive)
}

fn share<'a>(of: impl Iterator<Item = &'a ScoredFrame>, counts: impl Fn(&ScoredFrame) -> bool) -> Option<f64> {
    let (all, counted) = of.fold((0_usize, 0_usize), |(all, n), j| (all + 1, n + usize::from(counts(j))));
    (all > 0).then(|| counted as f64 / all as f64)
}

/// For every return of the target after an absence, how many frames pass from the first visible one until the overlap
/// exceeds one half (0: at once), or `None` if that does not happen before it leaves again.
pub fn reacquisition(frames: &[ScoredFrame]) -> Vec<Option<usize>> {
    let mut returns = Vec::new();
    let mut seen_before = false;
    let mut since_return: Option<usize> = None;
    let mut away = false;
    for j in frames {
        if !j.visible {
            if since_return.take().is_some() {
                returns.push(None);
            }
            away = seen_before;
            continue;
        }
        if std::mem::take(&mut away) {
            since_return = Some(0);
        }
        seen_before = true;
        if let Some(passed) = since_return {
            if j.overlap > 0.5 {
                returns.push(Some(passed));
                since_return = None;
            } else {
                since_return = Some(passed + 1);
            }
        }
    }
    if since_return.is_some() {
        returns.push(None);
    }
    returns
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frames(spec: &str) -> Vec<ScoredFrame> {
        // v: visible and hit, m: visible and missed, a: absent and said so, A: absent, yet "alive".
        let judged = |c| match c {
            'v' => ScoredFrame { visible: true, alive: true, overlap: 0.8, score: 0.9 },
            'm' => ScoredFrame { visible: true, alive: true, overlap: 0.2, score: 0.3 },
            'a' => ScoredFrame { visible: false, alive: false, overlap: 0.0, score: 0.1 },
            _ => ScoredFrame { visible: false, alive: true, overlap: 0.0, score: 0.6 },
        };
        spec.chars().map(judged).collect()
    }

    #[test]
    fn doubts_and_claims_are_counted_where_they_matter() {
        // Told and untold, with right boxes and wrong ones.
        let frame = |alive, overlap| ScoredFrame { visible: true, alive, overlap, score: 0.5 };
        let mut all = frames("aA");
        all.extend([frame(true, 0.5), frame(true, 0.9), frame(false, 0.8), frame(false, 0.7)]);
        all.extend([frame(true, 0.49), frame(false, 0.2), frame(false, 0.0)]);
        assert_eq!((right_untold(&all), wrong_told(&all)), (Some(0.5), Some(1.0 / 3.0)));
        assert_eq!((right_untold(&frames("mA")), wrong_told(&frames("va"))), (None, None));
    }

    #[test]
    fn returns_are_counted_from_the_first_visible_frame() {
        assert_eq!(reacquisition(&frames("vvaavv")), [Some(0)]);
        assert_eq!(reacquisition(&frames("vvaammv")), [Some(2)]);
        assert_eq!(reacquisition(&frames("vvaammaav")), [None, Some(0)]);
        assert_eq!(reacquisition(&frames("vaam")), [None]);
        assert_eq!(reacquisition(&frames("vvmm")), []);
        assert_eq!(reacquisition(&frames("aavv")), [], "an absence before the target was first seen is no absence");
    }

    #[test]
    fn precision_counts_claims_and_recall_counts_visible_frames() {
        let judged = frames("vvmAa");
        let pr = precision_recall(&judged, |j| j.alive);
        assert!((pr.precision - 1.8 / 4.0).abs() < 1e-12 && (pr.recall - 1.8 / 3.0).abs() < 1e-12);
        assert!((pr.f() - 2.0 * 0.45 * 0.6 / 1.05).abs() < 1e-12);
        assert_eq!(false_alive(&judged), Some(0.5));
        assert_eq!(false_alive(&frames("vm")), None);
        let none = precision_recall(&judged, |_| false);
        assert_eq!((none.precision, none.recall, none.f()), (1.0, 0.0, 0.0));
    }

    #[test]
    fn detections_are_right_or_wrong() {
        // Two right and one wrong box of four claimed, one of them where nothing is.
        let judged = frames("vvmAa");
        let strict = detection(&judged, 0.5);
        assert_eq!((strict.precision, strict.recall), (0.5, 2.0 / 3.0));
        let lenient = detection(&judged, 0.1);
        assert_eq!((lenient.precision, lenient.recall), (0.75, 1.0));
        let exact = detection(&judged, 0.8);
        assert_eq!((exact.precision, exact.recall, exact.f()), (0.0, 0.0, 0.0), "above, not at");
        let silent = detection(&frames("aa"), 0.5);
        assert_eq!((silent.precision, silent.recall), (1.0, 0.0));
        let unclaimed = ScoredFrame { visible: true, alive: false, overlap: 0.9, score: 0.2 };
        assert_eq!(detection(&[unclaimed], 0.5).recall, 0.0, "a box that is not claimed is no answer");
    }

    #[test]
    fn the_best_threshold_drops_what_is_wrong() {
        let judged = frames("vvvAAmm");
        let scores: Vec<f64> = judged.iter().map(|j| j.score).collect();
        let thresholds = thresholds(&scores, 100);
        let curve = precision_recall_curve(&judged, &thresholds);
        let (threshold, best) = best_f(&[curve], &thresholds).unwrap();
        assert_eq!(threshold, 0.9);
        assert!((best.precision - 0.8).abs() < 1e-12);
    }

    #[test]
    fn recall_counts_visible_frames_only() {
        let odd = ScoredFrame { visible: false, alive: true, overlap: 0.7, score: 0.5 };
        let pr = precision_recall(&[odd], |_| true);
        assert_eq!((pr.precision, pr.recall, pr.f()), (0.0, 0.0, 0.0), "a box where nothing is is worth nothing");
        let all = precision_recall(&frames("vaA"), |_| true);
        assert!((all.precision - 0.8 / 3.0).abs() < 1e-12 && (all.recall - 0.8).abs() < 1e-12);
    }

    #[test]
    fn curves_claim_at_and_above_each_threshold() {
        let curve = precision_recall_curve(&frames("vmA"), &[f64::INFINITY, 0.9, 0.6, 0.3, f64::NEG_INFINITY]);
        let precision: Vec<f64> = curve.iter().map(|p| p.precision).collect();
        let expected = [1.0, 0.8, 0.4, 1.0 / 3.0, 1.0 / 3.0];
        assert!(precision.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{precision:?}");
        let recall: Vec<f64> = curve.iter().map(|p| p.recall).collect();
        assert!(recall.iter().zip([0.0, 0.4, 0.4, 0.5, 0.5]).all(|(a, b)| (a - b).abs() < 1e-12), "{recall:?}");
    }

    #[test]
    fn thresholds_step_evenly_through_the_sorted_scores() {
        let (top, bottom) = (f64::INFINITY, f64::NEG_INFINITY);
        assert_eq!(thresholds(&[0.2, f64::NAN, 0.7], 100), [top, 0.7, 0.2, bottom], "all when there are few");
        let scores: Vec<f64> = (1..=20).map(f64::from).collect();
        // VOT-LT: delta = 20 / 4 = 5, positions 5, 8.33, 11.67, 15 of the descending scores.
        assert_eq!(thresholds(&scores, 6), [top, 15.0, 12.0, 8.0, 5.0, bottom]);
        assert_eq!(thresholds(&scores[..4], 6), [top, 4.0, 3.0, 2.0, 1.0, bottom]);
        assert_eq!(thresholds(&scores[..3], 3), [top, 3.0, 2.0, 1.0, bottom], "too coarse to step");
        // Of eight scores positions 2, 3, 4 (delta = 2, span = 4 - 0 … rounded to even), of nine 3, 4.5 → 4 and 6.
        assert_eq!(thresholds(&scores[..8], 5), [top, 6.0, 4.0, 2.0, bottom]);
        assert_eq!(thresholds(&[], 10), [top, bottom]);
    }

    #[test]
    fn averages_are_taken_over_sequences_before_f() {
        let pr = |precision, recall| PrecisionRecall { precision, recall };
        let mean = PrecisionRecall::mean(&[pr(1.0, 0.0), pr(0.5, 0.5)]).unwrap();
        assert_eq!(mean, pr(0.75, 0.25));
        assert_eq!(PrecisionRecall::mean(&[]), None);
        assert!((mean.f() - 0.375).abs() < 1e-12);
        let curves = [vec![pr(1.0, 0.0), pr(0.6, 0.2), pr(0.2, 0.2)], vec![pr(1.0, 0.0), pr(0.4, 0.8), pr(0.8, 0.8)]];
        let (threshold, best) = best_f(&curves, &[0.9, 0.5, 0.1]).unwrap();
        assert_eq!(threshold, 0.5, "the first of equals");
        assert!((best.precision - 0.5).abs() < 1e-12 && (best.recall - 0.5).abs() < 1e-12);
        assert_eq!(best_f(&[], &[0.5]), None);
        assert_eq!(best_f(&curves, &[]), None);
    }

    #[test]
    fn only_absent_targets_make_tracking_false() {
        assert_eq!(false_alive(&frames("vvvA")), Some(1.0));
        assert_eq!(false_alive(&frames("vvaaaA")), Some(0.25));
        assert_eq!(false_alive(&frames("vma")), Some(0.0));
    }

    #[test]
    fn exactly_half_overlap_has_not_reacquired() {
        let half = ScoredFrame { visible: true, alive: true, overlap: 0.5, score: 0.5 };
        let mut judged = frames("va");
        judged.extend([half, half]);
        assert_eq!(reacquisition(&judged), [None]);
        judged.extend(frames("v"));
        assert_eq!(reacquisition(&judged), [Some(2)]);
    }
}
