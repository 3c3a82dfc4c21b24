//! The figures of many targets, under the names that the field has for them.

use crate::Result;
use crate::comparison::{Comparison, Judgement};
use crate::metrics::many::{Clear, Crowd, Hota, Identity, Labelled, Match, clear_told, hota, identity};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The overlap from which on a box may be a match, of CLEAR MOT and IDF1.
const THRESHOLD: f64 = 0.5;

/// Figures of one sequence, or of several together.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[allow(non_snake_case, reason = "the field's names, which `results.json` has too")]
pub struct CrowdFigures {
    /// Higher order tracking accuracy, in `[0, 1]` as the next three.
    pub HOTA: f64,
    /// Detection accuracy.
    pub DetA: f64,
    /// Association accuracy.
    pub AssA: f64,
    /// Localisation accuracy.
    pub LocA: f64,
    /// Multiple object tracking accuracy, at most 1.
    pub MOTA: f64,
    /// Mean overlap of matches.
    pub MOTP: f64,
    /// Harmonic mean of the next two.
    pub IDF1: f64,
    /// Part of the true boxes that the target told to be theirs finds.
    pub IDR: f64,
    /// Part of the boxes said that find theirs.
    pub IDP: f64,
    /// Switches of the id of a true target.
    pub IDSW: usize,
    /// How often a true target was found again.
    pub Frag: usize,
    /// True targets found in more than 80 % of their boxes.
    pub MT: usize,
    /// True targets in between.
    pub PT: usize,
    /// True targets found in less than 20 % of their boxes.
    pub ML: usize,
    /// True boxes found.
    pub TP: usize,
    /// True boxes not found.
    pub FN: usize,
    /// Boxes said that are no true one's.
    pub FP: usize,
    /// As the last three, by IDF1's pairing.
    pub IDTP: usize,
    /// True boxes not found by IDF1's pairing.
    pub IDFN: usize,
    /// Boxes said that IDF1's pairing has no true one for.
    pub IDFP: usize,
}

/// What figures are made of; adds up.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Parts {
    hota: Hota,
    clear: Clear,
    identity: Identity,
}

impl Parts {
    pub fn of(truth: &[Labelled], said: &[Labelled], tell: impl FnMut(Match)) -> Result<Self> {
        let crowd = Crowd::new(truth, said)?;
        Ok(Self {
            clear: clear_told(&crowd, THRESHOLD, tell)?,
            identity: identity(&crowd, THRESHOLD)?,
            hota: hota(&crowd)?,
        })
    }

    pub fn combined<'a>(parts: impl Iterator<Item = &'a Self> + Clone) -> Self {
        Self {
            hota: Hota::combined(parts.clone().map(|p| &p.hota)),
            clear: Clear::combined(parts.clone().map(|p| &p.clear)),
            identity: Identity::combined(parts.map(|p| &p.identity)),
        }
    }

    pub fn figures(&self) -> CrowdFigures {
        let Self { hota, clear, identity } = self;
        CrowdFigures {
            HOTA: hota.hota,
            DetA: hota.detection,
            AssA: hota.association,
            LocA: hota.localization,
            MOTA: clear.mota(),
            MOTP: clear.motp(),
            IDF1: identity.idf1(),
            IDR: identity.recall(),
            IDP: identity.precision(),
            IDSW: clear.switches,
            Frag: clear.fragments,
            MT: clear.mostly_tracked,
            PT: clear.partly_tracked,
            ML: clear.mostly_lost,
            TP: clear.matches,
            FN: clear.misses,
            FP: clear.false_alarms,
            IDTP: identity.matches,
            IDFN: identity.misses,
            IDFP: identity.false_alarms,
        }
    }
}

/// Figures of one tracker.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct CrowdTracker {
    /// Shares are means over the sets, counts are sums.
    pub mean: CrowdFigures,
    /// By set: its sequences combined as TrackEval combines them.
    pub sets: BTreeMap<String, CrowdFigures>,
    /// By SET/SEQUENCE.
    pub sequences: BTreeMap<String, CrowdFigures>,
    /// By class and set, where the truth has classes.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub classes: BTreeMap<String, BTreeMap<String, CrowdFigures>>,
}

impl CrowdTracker {
    /// The mean over the sets.
    pub(super) fn averaged(mut self) -> Self {
        let sets: Vec<&CrowdFigures> = self.sets.values().collect();
        let share =
            |of: fn(&CrowdFigures) -> f64| crate::metrics::mean(&sets.iter().map(|f| of(f)).collect::<Vec<_>>());
        let sum = |of: fn(&CrowdFigures) -> usize| sets.iter().map(|f| of(f)).sum();
        self.mean = CrowdFigures {
            HOTA: share(|f| f.HOTA),
            DetA: share(|f| f.DetA),
            AssA: share(|f| f.AssA),
            LocA: share(|f| f.LocA),
            MOTA: share(|f| f.MOTA),
            MOTP: share(|f| f.MOTP),
            IDF1: share(|f| f.IDF1),
            IDR: share(|f| f.IDR),
            IDP: share(|f| f.IDP),
            IDSW: sum(|f| f.IDSW),
            Frag: sum(|f| f.Frag),
            MT: sum(|f| f.MT),
            PT: sum(|f| f.PT),
            ML: sum(|f| f.ML),
            TP: sum(|f| f.TP),
            FN: sum(|f| f.FN),
            FP: sum(|f| f.FP),
            IDTP: sum(|f| f.IDTP),
            IDFN: sum(|f| f.IDFN),
            IDFP: sum(|f| f.IDFP),
        };
        self
    }
}

/// One tracker against another, by one figure, on all sequences.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CrowdComparison {
    /// The tracker.
    pub tracker: String,
    /// What it is compared with.
    pub against: String,
    /// The figure.
    pub figure: String,
    /// Sequences.
    pub sequences: usize,
    /// Mean of the differences over sequences, tracker less the other.
    pub difference: f64,
    /// 95 % interval of that mean, by resampling sequences.
    pub interval: [f64; 2],
    /// What follows.
    pub judgement: Judgement,
}

/// A figure by its name, and how it is read.
type Compared = (&'static str, fn(&CrowdFigures) -> f64);

/// The figures that trackers are compared by.
const COMPARED: [Compared; 3] = [("HOTA", |f| f.HOTA), ("MOTA", |f| f.MOTA), ("IDF1", |f| f.IDF1)];

/// Every tracker against those ranked below it, by each figure.
pub(super) fn comparisons(ranked: &[(&String, &CrowdTracker)]) -> Vec<CrowdComparison> {
    let mut all = Vec::new();
    for (rank, (name, tracker)) in ranked.iter().enumerate() {
        for (other_name, other) in ranked.iter().skip(rank + 1) {
            for (figure, of) in COMPARED {
                let by = |t: &CrowdTracker| t.sequences.iter().map(|(s, f)| (s.clone(), of(f))).collect();
                let compared = Comparison::new((name, &by(tracker)), (other_name, &by(other)));
                all.extend(compared.map(|c| CrowdComparison {
                    tracker: c.tracker,
                    against: c.against,
                    figure: figure.to_owned(),
                    sequences: c.sequences,
                    difference: c.difference,
                    interval: c.interval,
                    judgement: c.judgement,
                }));
            }
        }
    }
    all
}
