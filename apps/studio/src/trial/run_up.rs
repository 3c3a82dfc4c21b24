/// Frames that what models a scene is shown before the one that it is asked about.
const LEARNT_FROM: u64 = 64;

/// Where what models a scene begins, to say something of frame `at`; `seen` is the one that it was shown last.
pub(crate) enum RunUp {
    /// It goes on from the frame after that.
    GoOn(u64),
    /// It begins anew.
    Anew(u64),
}

impl RunUp {
    pub fn to(at: u64, seen: Option<u64>) -> Self {
        match seen.map(|seen| seen + 1) {
            Some(next) if (next..=next + LEARNT_FROM).contains(&at) => Self::GoOn(next),
            _ => Self::Anew(at.saturating_sub(LEARNT_FROM)),
        }
    }
}
