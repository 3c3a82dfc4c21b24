use pursuit_tracking::{Recipe, TargetId};
use std::collections::BTreeMap;

/// Frames from one snapshot to the next: the way back is never longer than that while there is room.
const EVERY: u64 = 32;
/// What they may take, bytes.
const ROOM: usize = 48 << 20;

/// What was known after a frame.
pub(super) struct Snapshot {
    pub frame: u64,
    pub state: Vec<u8>,
    pub numbers: BTreeMap<TargetId, u64>,
    pub recipe: Box<dyn Recipe>,
    pub obeyed: usize,
}

impl Clone for Snapshot {
    fn clone(&self) -> Self {
        Self {
            frame: self.frame,
            state: self.state.clone(),
            numbers: self.numbers.clone(),
            recipe: self.recipe.boxed_clone(),
            obeyed: self.obeyed,
        }
    }
}

/// What was known after some frames, in their order; of long runs, after fewer.
#[derive(Default)]
pub(super) struct Snapshots {
    kept: Vec<Snapshot>,
    /// Doubles whenever there is no room.
    every: u64,
}

impl Snapshots {
    pub fn is_due(&self, frame: u64) -> bool {
        let every = self.every.max(EVERY);
        self.kept.last().map_or(frame >= every, |last| frame >= last.frame + every)
    }

    pub fn keep(&mut self, snapshot: Snapshot) {
        self.kept.push(snapshot);
        let bytes = |kept: &[Snapshot]| kept.iter().map(|s| s.state.len()).sum::<usize>();
        while bytes(&self.kept) > ROOM {
            self.every = 2 * self.every.max(EVERY);
            let mut place = 0;
            self.kept.retain(|_| {
                place += 1;
                place % 2 == 0
            });
        }
    }

    /// Drops those of this frame and later ones.
    pub fn forget_from(&mut self, frame: u64) {
        self.kept.retain(|s| s.frame < frame);
    }

    pub fn last(&self) -> Option<Snapshot> {
        self.kept.last().cloned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn room_is_bounded_and_what_is_late_is_forgotten() {
        let mut snapshots = Snapshots::default();
        for frame in 0..20_000 {
            if snapshots.is_due(frame) {
                let recipe = crate::recipe("mosse").unwrap();
                let state = vec![0; 1 << 20];
                snapshots.keep(Snapshot { frame, state, numbers: BTreeMap::new(), recipe, obeyed: 0 });
            }
        }
        assert!((20..=48).contains(&snapshots.kept.len()), "{}", snapshots.kept.len());
        assert!(snapshots.last().unwrap().frame > 19_000);
        snapshots.forget_from(10_000);
        let last = snapshots.last().unwrap().frame;
        assert!((8_000..10_000).contains(&last), "{last}");
    }
}
