/// What can go wrong with frames that come in or go out.
///
/// Every message is one line, names the thing and says what would mend it. [`is_output`](Self::is_output) tells the two
/// directions apart, which is all a command line needs to choose its exit code.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum MediaError {
    /// An input that cannot be opened or understood at all; no frame was delivered.
    #[error("cannot read {name}: {reason}")]
    Unreadable {
        /// The input as the user wrote it, or the file inside it.
        name: String,
        /// What is wrong and what would mend it.
        reason: String,
    },
    /// An input that broke after some frames; everything delivered before stays valid.
    #[error("{name} breaks off at frame {frame}: {reason}")]
    Broken {
        /// The input as the user wrote it, or the file inside it.
        name: String,
        /// The frame that could not be had, from 0.
        frame: u64,
        /// What is wrong and what would mend it.
        reason: String,
    },
    /// A frame that cannot be had, of an input that goes on behind it: ask for the next one.
    #[error("{name} is damaged at frame {frame}: {reason}")]
    Damaged {
        /// The input as the user wrote it, or the file inside it.
        name: String,
        /// The frame that could not be had, from 0.
        frame: u64,
        /// What is wrong and what would mend it.
        reason: String,
    },
    /// An input that can only be read from front to back, or has no frame of that number.
    #[error("{name} cannot go to frame {frame}: {reason}")]
    NotSeekable {
        /// The input as the user wrote it.
        name: String,
        /// The frame asked for, from 0.
        frame: u64,
        /// Why not.
        reason: String,
    },
    /// An output that cannot be created, written or finished.
    #[error("cannot write {name}: {reason}")]
    Unwritable {
        /// The file or folder written to.
        name: String,
        /// What is wrong and what would mend it.
        reason: String,
    },
}

impl MediaError {
    /// Whether the trouble is with writing; otherwise it is with reading.
    pub const fn is_output(&self) -> bool {
        matches!(self, Self::Unwritable { .. })
    }

    /// Whether the input goes on behind it.
    pub const fn is_damage(&self) -> bool {
        matches!(self, Self::Damaged { .. })
    }

    /// The number of the frame that could not be had of a readable input.
    pub const fn frame(&self) -> Option<u64> {
        match self {
            Self::Broken { frame, .. } | Self::Damaged { frame, .. } => Some(*frame),
            _ => None,
        }
    }

    pub(crate) fn not_seekable(name: impl Into<String>, frame: u64, reason: impl Into<String>) -> Self {
        Self::NotSeekable { name: name.into(), frame, reason: reason.into() }
    }

    pub(crate) fn unreadable(name: impl Into<String>, reason: impl Into<String>) -> Self {
        Self::Unreadable { name: name.into(), reason: reason.into() }
    }

    pub(crate) fn damaged(name: impl Into<String>, frame: u64, reason: impl Into<String>) -> Self {
        Self::Damaged { name: name.into(), frame, reason: reason.into() }
    }

    pub(crate) fn broken(name: impl Into<String>, frame: u64, reason: impl Into<String>) -> Self {
        Self::Broken { name: name.into(), frame, reason: reason.into() }
    }
}
