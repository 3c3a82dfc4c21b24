use std::fmt;

/// What a head did that it was not told.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Departure {
    /// It turned while it was told to stand.
    Driven,
    /// It stood while it was told to turn.
    Held,
    /// It was somewhere else at once.
    Jumped,
}

impl Departure {
    /// Faster than its limits by this factor, and this much farther, is no turning, degrees.
    const FASTER: f64 = 1.2;
    const FARTHER_DEG: f64 = 2.0;
    /// A head that is told to go no farther than the first of these stands by its commands; one that goes farther than the second
    /// turns, degrees.
    const STANDS_DEG: f64 = 0.5;
    const TURNS_DEG: f64 = 3.0;
    /// A head that is told to go at least so far and goes less than this part of it is held, degrees.
    const TOLD_DEG: f64 = 5.0;
    const HELD_PART: f64 = 0.1;

    /// What a head that went `said_deg` by its own word and `told_deg` by its commands did, where it could have gone `most_deg`.
    pub(super) fn of(said_deg: f64, told_deg: f64, most_deg: f64) -> Option<Self> {
        if said_deg > Self::FASTER * most_deg + Self::FARTHER_DEG {
            Some(Self::Jumped)
        } else if told_deg < Self::STANDS_DEG && said_deg > Self::TURNS_DEG {
            Some(Self::Driven)
        } else if told_deg > Self::TOLD_DEG && said_deg < Self::HELD_PART * told_deg {
            Some(Self::Held)
        } else {
            None
        }
    }
}

impl fmt::Display for Departure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Driven => {
                "the head turns without being told: somebody else drives it; it is followed by its own word"
            }
            Self::Held => "the head does not turn as it is told: it stands at a stop, is held, or is switched off",
            Self::Jumped => {
                "the head stands somewhere else at once: it may have restarted; it is followed by its own word"
            }
        })
    }
}
