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
    /// What a head that went `said_deg` by its own word and `told_deg` by its commands did, where it could have gone `most_deg`.
    pub(super) fn of(said_deg: f64, told_deg: f64, most_deg: f64) -> Option<Self> {
        if said_deg > 1.2 * most_deg + 2.0 {
            Some(Self::Jumped)
        } else if told_deg < 0.5 && said_deg > 3.0 {
            Some(Self::Driven)
        } else if told_deg > 5.0 && said_deg < 0.1 * told_deg {
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
