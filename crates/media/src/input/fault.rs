use crate::MediaError;
use pursuit_containers::ContainerError;

/// What stopped a reader, before a file name and a frame number are put to it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Fault {
    /// Sound as far as we can tell, but not decoded here; `ffmpeg` may know it. Names the codec or feature.
    Unsupported(String),
    /// Broken, hostile, or not what it claims to be.
    Malformed(String),
}

impl Fault {
    pub fn unsupported(what: impl Into<String>) -> Self {
        Self::Unsupported(what.into())
    }

    pub fn malformed(reason: impl Into<String>) -> Self {
        Self::Malformed(reason.into())
    }

    /// It takes an ffmpeg, and there is none; `what` says in words what it is.
    pub fn no_ffmpeg(what: &str) -> Self {
        Self::Malformed(format!(
            "{what} is not decoded here and no ffmpeg was found; install ffmpeg (apt install ffmpeg, brew install ffmpeg) \
             or convert it to H.264 (8-bit 4:2:0) in MP4"
        ))
    }

    pub fn reason(self) -> String {
        match self {
            Self::Unsupported(what) => format!("{what} is not decoded here; convert it to H.264 8-bit 4:2:0 in MP4"),
            Self::Malformed(reason) => reason,
        }
    }

    pub fn unreadable(self, name: &str) -> MediaError {
        MediaError::unreadable(name, self.reason())
    }

    pub fn damaged(self, name: &str, frame: u64) -> MediaError {
        MediaError::damaged(name, frame, self.reason())
    }

    pub fn broken(self, name: &str, frame: u64) -> MediaError {
        MediaError::broken(name, frame, self.reason())
    }
}

/// Why there is no frame, and which.
#[derive(Debug, PartialEq)]
pub(crate) struct Trouble {
    pub frame: u64,
    pub fault: Fault,
    /// Whether frames may come after it.
    goes_on: bool,
}

impl Trouble {
    /// One frame that cannot be had; others may come.
    pub fn damage(frame: u64, fault: Fault) -> Self {
        Self { frame, fault, goes_on: true }
    }

    /// Nothing comes any more.
    pub fn end(frame: u64, fault: Fault) -> Self {
        Self { frame, fault, goes_on: false }
    }

    pub fn error(self, name: &str) -> MediaError {
        let Self { frame, fault, goes_on } = self;
        if goes_on { MediaError::damaged(name, frame, fault.reason()) } else { fault.broken(name, frame) }
    }

    pub fn goes_on(&self) -> bool {
        self.goes_on
    }
}

impl From<std::io::Error> for Fault {
    fn from(error: std::io::Error) -> Self {
        Self::Malformed(match error.kind() {
            std::io::ErrorKind::UnexpectedEof => "the file ends early".to_owned(),
            _ => error.to_string(),
        })
    }
}

impl From<pursuit_imaging::ImagingError> for Fault {
    fn from(error: pursuit_imaging::ImagingError) -> Self {
        Self::Malformed(error.to_string())
    }
}

impl From<ContainerError> for Fault {
    fn from(error: ContainerError) -> Self {
        match error {
            ContainerError::Unsupported { what } => Self::Unsupported(what),
            other => Self::Malformed(other.to_string()),
        }
    }
}
