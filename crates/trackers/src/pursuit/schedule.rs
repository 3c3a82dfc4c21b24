//! When the network is not asked, and what stands for its answer then.

use super::FusionParams;
use super::fusion::{Candidate, Fusion};
use pursuit_estimation::logit;
use pursuit_geometry::{BBox, Point};
use serde::{Deserialize, Serialize};
use std::time::Instant;

/// Frames whose share of the budget can be saved up.
const SAVED_FRAMES: f64 = 25.0;

/// How long the network has not been asked, and what it said when both witnesses agreed.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct NetworkSchedule {
    /// For how many frames its last answer has stood.
    frames: usize,
    /// `None` where the last frame left a doubt.
    remembered: Option<Agreement>,
    /// What a clock says is no state of a target.
    #[serde(skip)]
    budget: Budget,
}

/// The time that the network may take, in milliseconds; counted only where there is a limit.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Budget {
    /// What may be spent; below 0 where more was.
    balance_ms: f64,
    /// What this frame has cost.
    spent_ms: f64,
}

/// The network's box beside the filter's, on which both agreed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Agreement {
    /// Log odds of its score.
    network: f64,
    overlap: f64,
    /// From the middle of the filter's box to that of the network's, in sizes of the former.
    offset: (f64, f64),
    /// Sides of the network's box in those of the filter's: as reported, and in its own terms.
    sides: (f64, f64),
    own_sides: (f64, f64),
}

impl NetworkSchedule {
    /// For how many frames its last answer has stood.
    pub const fn frames(&self) -> usize {
        self.frames
    }

    /// What the network said in an earlier frame, where that is enough in this one.
    pub fn remembered(&self, params: &FusionParams) -> Option<Remembered> {
        let waits = self.frames + 1 < params.ask_every;
        let spent = params.budget_ms > 0.0 && self.budget.balance_ms < 0.0;
        self.remembered.filter(|_| waits || spent).map(Remembered)
    }

    /// When the network began to be asked; `None` where its time is not limited, and no clock is read.
    pub fn timer(params: &FusionParams) -> Option<Instant> {
        (params.budget_ms > 0.0).then(Instant::now)
    }

    /// The network has been asked since `began`.
    pub fn spend(&mut self, began: Option<Instant>) {
        self.budget.spent_ms = began.map_or(0.0, |began| 1e3 * began.elapsed().as_secs_f64());
    }

    /// A frame is over: what was concluded in it, and whether the network was asked about the place expected.
    pub fn note(&mut self, params: &FusionParams, concluded: Option<&Fusion>, asked: bool) {
        // A frame in which nothing was looked for is none that its answer stood for.
        self.frames = if asked || concluded.is_none() { 0 } else { self.frames + 1 };
        let Budget { balance_ms, spent_ms } = self.budget;
        let most = SAVED_FRAMES * params.budget_ms;
        self.budget = Budget { balance_ms: (balance_ms + params.budget_ms - spent_ms).min(most), spent_ms: 0.0 };
        let agreed = concluded.filter(|fused| fused.agreed).and_then(|fused| fused.filter.zip(fused.network));
        self.remembered = match agreed {
            Some((filter, network)) if is_sure(params, &filter) => Some(Agreement::of(&filter, &network)),
            _ => None,
        };
    }
}

/// Whether what is believed is beyond doubt.
fn is_sure(params: &FusionParams, candidate: &Candidate) -> bool {
    candidate.log_odds >= logit(params.sure_from)
}

impl Agreement {
    fn of(filter: &Candidate, network: &Candidate) -> Self {
        let (seen, by_network) = (filter.bbox.center(), network.bbox.center());
        let (width, height) = (filter.bbox.width(), filter.bbox.height());
        let sides = |b: &BBox| (b.width() / width, b.height() / height);
        Self {
            network: filter.evidence.network,
            overlap: filter.evidence.overlap,
            offset: ((by_network.x - seen.x) / width, (by_network.y - seen.y) / height),
            sides: sides(&network.bbox),
            own_sides: sides(&network.own),
        }
    }
}

/// An answer of an earlier frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct Remembered(Agreement);

impl Remembered {
    /// Log odds of the score that the network gave, and the overlap of both boxes.
    pub const fn evidence(&self) -> (f64, f64) {
        (self.0.network, self.0.overlap)
    }

    /// Both, as if the network had said again what it said beside a filter that now says this; `None` where that leaves a doubt.
    pub fn agree(&self, params: &FusionParams, filter: Candidate, place: (Point, f64)) -> Option<Fusion> {
        if !is_sure(params, &filter) {
            return None;
        }
        let Agreement { offset, sides, own_sides, .. } = self.0;
        let (seen, width, height) = (filter.bbox.center(), filter.bbox.width(), filter.bbox.height());
        let center = Point::new(seen.x + offset.0 * width, seen.y + offset.1 * height);
        let beside = |sides: (f64, f64)| BBox::from_center_size(center, sides.0 * width, sides.1 * height);
        let network = Candidate { bbox: beside(sides), own: beside(own_sides), ..filter };
        let (filter, network) = (Some(filter), Some(network));
        Some(Fusion {
            filter,
            network,
            agreed: true,
            filter_leads: true,
            odds: 0.0,
            place: Some(place),
            ..Fusion::NOTHING
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::judge::JointEvidence;
    use super::*;

    fn candidate(left: f64, log_odds: f64) -> Candidate {
        let bbox = BBox::from_ltwh(left, 20.0, 30.0, 40.0);
        Candidate {
            bbox,
            own: bbox,
            evidence: JointEvidence { network: 5.0, overlap: 0.8, ..JointEvidence::default() },
            log_odds,
        }
    }

    fn agreed(log_odds: f64) -> Fusion {
        let network = Candidate { bbox: BBox::from_ltwh(13.0, 20.0, 24.0, 40.0), ..candidate(10.0, log_odds) };
        let (filter, network) = (Some(candidate(10.0, log_odds)), Some(network));
        Fusion { filter, network, agreed: true, filter_leads: true, ..Fusion::NOTHING }
    }

    #[test]
    fn between_questions_the_last_answer_stands() {
        let params = FusionParams { ask_every: 3, ..FusionParams::default() };
        let mut schedule = NetworkSchedule::default();
        assert!(schedule.remembered(&params).is_none(), "nothing was ever said");
        let mut asked = Vec::new();
        for frame in 0..7 {
            let remembered = schedule.remembered(&params);
            if remembered.is_none() {
                asked.push(frame);
            }
            schedule.note(&params, Some(&agreed(4.0)), remembered.is_none());
        }
        assert_eq!(asked, [0, 3, 6]);
        let again = schedule.remembered(&params).unwrap();
        let fused = again.agree(&params, candidate(40.0, 4.0), (Point::new(55.0, 40.0), 1.0)).unwrap();
        assert_eq!(
            fused.network.unwrap().bbox,
            BBox::from_ltwh(43.0, 20.0, 24.0, 40.0),
            "as far from the filter's as before"
        );
        assert!(fused.agreed && again.evidence() == (5.0, 0.8));
        assert!(again.agree(&params, candidate(40.0, 1.0), (Point::new(55.0, 40.0), 1.0)).is_none(), "a doubt");
    }

    #[test]
    fn a_doubt_has_it_asked_at_once() {
        let params = FusionParams { ask_every: 100, ..FusionParams::default() };
        let doubtful = Fusion { agreed: false, ..agreed(4.0) };
        for concluded in [None, Some(doubtful), Some(agreed(1.0))] {
            let mut schedule = NetworkSchedule::default();
            schedule.note(&params, concluded.as_ref(), true);
            assert!(schedule.remembered(&params).is_none(), "{concluded:?}");
        }
    }

    #[test]
    fn frames_are_counted_in_which_the_answer_stood() {
        let (params, mut schedule) =
            (FusionParams { ask_every: 100, ..FusionParams::default() }, NetworkSchedule::default());
        let counted = [true, false, false, true, false].map(|asked| {
            schedule.note(&params, Some(&agreed(4.0)), asked);
            schedule.frames()
        });
        assert_eq!(counted, [0, 1, 2, 0, 1]);
        // Out of the picture nothing is looked for, and nothing has grown on the way back.
        schedule.note(&params, None, false);
        assert_eq!(schedule.frames(), 0);
    }

    #[test]
    fn a_budget_is_kept_on_average() {
        let params = FusionParams { budget_ms: 1.0, ..FusionParams::default() };
        let (mut schedule, mut asked) = (NetworkSchedule::default(), 0);
        for _ in 0..400 {
            let remembered = schedule.remembered(&params);
            asked += u32::from(remembered.is_none());
            schedule.budget.spent_ms = if remembered.is_none() { 4.0 } else { 0.0 };
            schedule.note(&params, Some(&agreed(4.0)), remembered.is_none());
        }
        assert!((99..=103).contains(&asked), "{asked} of 400 frames, 4 ms each");
        for _ in 0..1000 {
            schedule.note(&params, Some(&agreed(4.0)), false);
        }
        assert_eq!(schedule.budget.balance_ms, 25.0);
        let unlimited = FusionParams::default();
        assert!(schedule.remembered(&unlimited).is_none(), "without a budget it is asked in every frame");
    }

    #[test]
    fn time_is_taken_only_where_it_is_limited() {
        let spent = |budget_ms| {
            let mut schedule = NetworkSchedule::default();
            let timer = NetworkSchedule::timer(&FusionParams { budget_ms, ..FusionParams::default() });
            std::thread::sleep(std::time::Duration::from_millis(2));
            schedule.spend(timer);
            schedule.budget.spent_ms
        };
        assert_eq!(spent(0.0), 0.0);
        assert!(spent(1.0) >= 2.0);
    }
}
