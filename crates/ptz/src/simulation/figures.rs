use super::Sample;
use serde::{Deserialize, Serialize};

/// How well a loop kept its target.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Figures {
    /// Which fraction of the pictures showed the middle of the target within the central 20 % of the picture: not more
    /// than a tenth of its width and of its height from the middle.
    pub central: f64,
    /// Root mean square of the angle between the target and the optical axis, degrees.
    pub rms_deg: f64,
    /// Which fraction of the pictures showed the middle of the target at all.
    pub shown: f64,
    /// The longest time for which it was out of the picture, seconds.
    pub longest_absence_s: f64,
    /// How far the head went past where the target was at first, of the way there: what is past a target that stands. 0 where the
    /// head looks at the target at first.
    pub overshoot: f64,
    /// How far the head still wanders in the last half of the run, degrees: 0 before a target that stands, its amplitude in a
    /// limit cycle.
    pub wandering_deg: f64,
}

impl Figures {
    /// Half the side of the central 20 %, in halves of the picture.
    const CENTRAL: f64 = 0.2;

    /// The figures of a run from `from_s` on.
    pub fn of(samples: &[Sample], from_s: f64) -> Self {
        let judged: Vec<&Sample> = samples.iter().filter(|s| s.time_s >= from_s).collect();
        let count = judged.len().max(1) as f64;
        let central =
            |s: &&&Sample| s.offset.is_some_and(|(x, y)| x.abs() <= Self::CENTRAL && y.abs() <= Self::CENTRAL);
        let square = |s: &&Sample| s.target.angle_to(s.position.direction).powi(2);
        let (mut since, mut longest): (Option<f64>, f64) = (None, 0.0);
        for sample in &judged {
            since = if sample.shown { None } else { since.or(Some(sample.time_s)) };
            longest = longest.max(since.map_or(0.0, |since| sample.time_s - since));
        }
        Self {
            central: judged.iter().filter(central).count() as f64 / count,
            rms_deg: (judged.iter().map(square).sum::<f64>() / count).sqrt(),
            shown: judged.iter().filter(|s| s.shown).count() as f64 / count,
            longest_absence_s: longest,
            overshoot: overshoot(samples),
            wandering_deg: wandering_deg(samples, 0.5 * samples.last().map_or(0.0, |s| s.time_s)),
        }
    }

    /// The mean of each figure over several runs, but the longest of all absences, and the most of overshoot and wandering.
    pub fn mean(runs: &[Self]) -> Self {
        let mean = |figure: fn(&Self) -> f64| runs.iter().map(figure).sum::<f64>() / runs.len().max(1) as f64;
        let most = |figure: fn(&Self) -> f64| runs.iter().map(figure).fold(0.0, f64::max);
        Self {
            central: mean(|f| f.central),
            rms_deg: mean(|f| f.rms_deg.powi(2)).sqrt(),
            shown: mean(|f| f.shown),
            longest_absence_s: most(|f| f.longest_absence_s),
            overshoot: most(|f| f.overshoot),
            wandering_deg: most(|f| f.wandering_deg),
        }
    }
}

/// How far the head went past a target that stands, as a fraction of the way it had to go.
pub fn overshoot(samples: &[Sample]) -> f64 {
    let Some(first) = samples.first() else { return 0.0 };
    let way = first.target.from(first.position.direction).pan_deg;
    let past = |s: &Sample| -s.target.from(s.position.direction).pan_deg * way.signum();
    if way.abs() < 1e-6 { 0.0 } else { samples.iter().map(past).fold(0.0, f64::max) / way.abs() }
}

/// How far the head still wanders from `from_s` on: from its leftmost to its rightmost and its lowest to its highest,
/// whichever is more, degrees. A head that stands wanders by 0; one in a limit cycle by its amplitude.
pub fn wandering_deg(samples: &[Sample], from_s: f64) -> f64 {
    let spread = |axis: fn(&Sample) -> f64| {
        let values = samples.iter().filter(|s| s.time_s >= from_s).map(axis);
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        (high - low).max(0.0)
    };
    spread(|s| s.position.direction.pan_deg).max(spread(|s| s.position.direction.tilt_deg))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Direction, Position};

    fn sample(time_s: f64, target: f64, head: f64) -> Sample {
        let offset = (target - head) / 30.0;
        Sample {
            time_s,
            target: Direction::new(target, 0.0),
            position: Position { direction: Direction::new(head, 0.0), zoom: 0.0 },
            offset: Some((offset, 0.0)),
            shown: offset.abs() <= 1.0,
        }
    }

    #[test]
    fn figures_are_counted() {
        let run = [
            sample(0.0, 90.0, 0.0),
            sample(1.0, 6.0, 0.0),
            sample(2.0, 8.0, 0.0),
            sample(3.0, 40.0, 0.0),
            sample(4.0, 50.0, 0.0),
            sample(5.5, 31.0, 0.0),
            sample(6.0, 0.0, 0.0),
            sample(7.0, 0.0, 6.1),
        ];
        let figures = Figures::of(&run, 1.0);
        assert_eq!(figures.central, 2.0 / 7.0);
        assert_eq!(figures.shown, 4.0 / 7.0);
        assert_eq!(figures.longest_absence_s, 2.5);
        let squares: f64 = [6.0, 8.0, 40.0, 50.0, 31.0, 0.0, 6.1].iter().map(|v: &f64| v * v).sum();
        assert!((figures.rms_deg - (squares / 7.0).sqrt()).abs() < 1e-9);
        let mut high = sample(9.0, 0.0, 0.0);
        high.offset = Some((0.0, -0.21));
        assert_eq!(Figures::of(&[high], 0.0).central, 0.0);
    }

    #[test]
    fn means_are_means_and_the_longest_absence_the_longest() {
        let a = Figures {
            central: 1.0,
            rms_deg: 3.0,
            shown: 1.0,
            longest_absence_s: 0.5,
            overshoot: 0.0,
            wandering_deg: 0.7,
        };
        let b = Figures {
            central: 0.5,
            rms_deg: 1.0,
            shown: 0.9,
            longest_absence_s: 0.2,
            overshoot: 0.1,
            wandering_deg: 0.3,
        };
        let mean = Figures::mean(&[a, b]);
        assert_eq!((mean.central, mean.longest_absence_s), (0.75, 0.5));
        assert_eq!((mean.overshoot, mean.wandering_deg), (0.1, 0.7));
        assert!((mean.rms_deg - 5f64.sqrt()).abs() < 1e-12 && (mean.shown - 0.95).abs() < 1e-12);
    }

    #[test]
    fn overshoot_and_wandering_are_measured_from_the_head() {
        let run = [sample(0.0, 20.0, 0.0), sample(1.0, 20.0, 21.0), sample(2.0, 20.0, 19.5), sample(3.0, 20.0, 20.0)];
        assert!((overshoot(&run) - 0.05).abs() < 1e-12);
        assert!((wandering_deg(&run, 1.0) - 1.5).abs() < 1e-12);
        let left = [sample(0.0, -20.0, 0.0), sample(1.0, -20.0, -22.0)];
        assert!((overshoot(&left) - 0.1).abs() < 1e-12);
        assert_eq!(overshoot(&run[..1]), 0.0);
    }
}
