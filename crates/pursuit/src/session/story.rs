use crate::Record;
use pursuit_tracking::{TargetId, TrackState};
use std::collections::BTreeMap;

/// What happens to targets, in words, for whoever wants to be told (`-v`).
#[derive(Debug, Default)]
pub(super) struct Story {
    /// The last state of every target that there is; none while a detector looks for it.
    states: BTreeMap<TargetId, Option<TrackState>>,
}

impl Story {
    /// What is new in this frame.
    pub fn tell(&mut self, records: &[Record], mut say: impl FnMut(String)) {
        for record in records {
            let state = record.estimate.as_ref().map(|e| e.state);
            let before = self.states.insert(record.target, state);
            if before == Some(state) {
                continue;
            }
            let what = match (before.flatten(), state) {
                (None, Some(_)) => "found",
                (Some(TrackState::Tracking | TrackState::Occluded), Some(TrackState::Unsure)) => "unsure",
                (Some(TrackState::Tracking | TrackState::Unsure), Some(TrackState::Occluded)) => "hidden",
                (Some(_), Some(TrackState::Lost)) => "lost",
                (Some(TrackState::Lost), Some(_)) => "found again",
                (Some(_), Some(TrackState::Tracking)) => "seen again",
                (Some(_), None) => "given up",
                (None, None)
                | (Some(TrackState::Unsure), Some(TrackState::Unsure))
                | (Some(TrackState::Occluded), Some(TrackState::Occluded)) => continue,
            };
            let place = record.estimate.as_ref().map(|e| format!(" at {}", e.bbox)).unwrap_or_default();
            say(format!("frame {}, {:.2} s: target {} {what}{place}", record.frame, record.time_s, record.target));
        }
        if self.states.len() > records.len() {
            self.states.retain(|id, _| records.iter().any(|r| r.target == *id));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_geometry::BBox;
    use pursuit_tracking::Estimate;

    fn record(frame: u64, target: u64, state: Option<TrackState>) -> Record {
        let bbox = BBox::from_ltwh(1.0, 2.0, 3.0, 4.0);
        let estimate = state.map(|state| Estimate { state, ..Estimate::started(0.0, bbox, 1.0) });
        Record { frame, time_s: 0.5, target: TargetId(target), class: None, estimate, update_ms: None }
    }

    #[test]
    fn every_change_is_told_once() {
        use TrackState::{Lost, Occluded, Tracking, Unsure};
        let mut story = Story::default();
        let mut told = Vec::new();
        let states = [
            None,
            None,
            Some(Tracking),
            Some(Tracking),
            Some(Occluded),
            Some(Lost),
            Some(Lost),
            Some(Tracking),
            Some(Occluded),
            Some(Unsure),
            Some(Unsure),
            Some(Occluded),
            Some(Tracking),
            Some(Unsure),
            Some(Tracking),
            None,
        ];
        for (frame, state) in (0..).zip(states) {
            story.tell(&[record(frame, 1, state)], |text| told.push(text));
        }
        let at = format!(" at {}", BBox::from_ltwh(1.0, 2.0, 3.0, 4.0));
        let line = |frame: u64, what: &str| format!("frame {frame}, 0.50 s: target 1 {what}{at}");
        let mut wanted = vec![line(2, "found"), line(4, "hidden"), line(5, "lost"), line(7, "found again")];
        wanted.extend([line(8, "hidden"), line(9, "unsure"), line(11, "hidden"), line(12, "seen again")]);
        wanted.extend([line(13, "unsure"), line(14, "seen again"), "frame 15, 0.50 s: target 1 given up".to_owned()]);
        assert_eq!(told, wanted);
    }

    #[test]
    fn targets_that_are_gone_are_forgotten() {
        let mut story = Story::default();
        for target in 0..100 {
            story.tell(&[record(0, target, Some(TrackState::Tracking))], |_| {});
        }
        assert_eq!(story.states.len(), 1);
    }
}
