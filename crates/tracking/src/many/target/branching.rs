//! How the branches of a target go on.

use super::{Known, Target};
use crate::many::association::GoesOn;
use crate::many::branches::{Branch, MOST_SCANS, Past};
use crate::{Detection, TrackState};

impl Target {
    /// Takes its branches on; where another one is the best now, that is believed, as if it had been reported all along.
    pub(super) fn branch(&mut self, goes_on: GoesOn<'_>, detections: &[Detection], lost_s: f64) {
        self.refuted = goes_on.refuted;
        let Some(((chosen, past), rest)) = goes_on.branches.split_first() else { return };
        let Known { branches, belief, unseen, undetected_s, .. } = &mut self.known;
        // The new ones stand behind those before, until these are done with.
        let (others, spare) = (&mut branches.others, &mut self.spare.branches);
        let before = others.len();
        for (next, past) in rest {
            let parent = match next.parent.checked_sub(1) {
                None => Some((&belief.motion, *unseen, self.dt_s)),
                Some(other) => others[..before].get(other).map(|b| (&b.motion, b.unseen, self.dt_s)),
            };
            let detection = next.detection.and_then(|d| detections.get(d));
            let branch = parent.and_then(|parent| Branch::next(parent, *past, detection, lost_s, spare.pop()).ok());
            others.extend(branch);
        }
        let other = chosen.parent.checked_sub(1).filter(|other| *other < before);
        let instead = other.and_then(|other| Some((other, others[other].expected.take()?)));
        if let Some((other, (expected, expectation))) = instead {
            let Branch { motion, unseen: instead, past, .. } = &mut others[other];
            let (instead, past) = (*instead, *past);
            std::mem::swap(&mut belief.motion, motion);
            self.revised = Some((branches.own, past));
            belief.last_believed = expected.bbox;
            if belief.state == TrackState::Lost && instead.seconds <= lost_s {
                belief.state = TrackState::Occluded;
            }
            (self.prior, self.expectation) = (Some(expected), Some(expectation));
            (*unseen, *undetected_s) = (instead, instead.seconds);
        }
        branches.own = *past;
        spare.extend(others.drain(..before));
    }

    /// What it took in the last frames and not what was said before, where that is so: how many frames before this one, and which of the
    /// detections that were sure enough.
    pub fn revised(&self) -> impl Iterator<Item = (u64, Option<usize>)> + '_ {
        let changed = |(before, now): &(Past, Past), ago| before.taken(ago) != now.taken(ago);
        let all = self.revised.iter().flat_map(|both| (0..MOST_SCANS).map(move |ago| (both, ago)));
        all.filter(move |(both, ago)| changed(both, *ago)).map(|((_, now), ago)| (ago as u64 + 1, now.taken(ago)))
    }
}
