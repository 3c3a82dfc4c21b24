use std::io;

/// What can go wrong with a head. No message ever carries a password.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PtzError {
    /// Parameters cannot be used.
    #[error(transparent)]
    Parameters(#[from] pursuit_parameters::ParameterError),
    /// A number is out of its range.
    #[error("`{name}` is {value}; it must be {wanted}")]
    Parameter {
        /// What it is.
        name: &'static str,
        /// What was given.
        value: f64,
        /// What would do.
        wanted: &'static str,
    },
    /// A head's address cannot be understood.
    #[error(
        "{reason}; a head is given as onvif[s]://USER@HOST, visca://HOST, visca+tcp://HOST, visca:DEVICE, pelco:DEVICE, mavlink:LINK or hook:COMMAND"
    )]
    Address {
        /// What is wrong with it.
        reason: String,
    },
    /// The operating system reports an error while talking to a head.
    #[error("{head}: {doing} failed: {source}")]
    Io {
        /// Which head.
        head: String,
        /// What was being done.
        doing: &'static str,
        /// What the system says.
        source: io::Error,
    },
    /// A head did not answer in time.
    #[error("{head}: no answer to {doing} within {after_s} s; is it switched on and is the address right?")]
    TimedOut {
        /// Which head.
        head: String,
        /// What was being done.
        doing: &'static str,
        /// How long was waited, seconds.
        after_s: f64,
    },
    /// A head's answer cannot be understood.
    #[error("{head}: the answer to {doing} makes no sense: {reason}")]
    Reply {
        /// Which head.
        head: String,
        /// What was being done.
        doing: &'static str,
        /// What is wrong with it.
        reason: String,
    },
    /// A head refuses a command.
    #[error("{head}: refuses {doing}: {reason}")]
    Refused {
        /// Which head.
        head: String,
        /// What was being done.
        doing: &'static str,
        /// What it says.
        reason: String,
    },
    /// A head does not accept the user or the password.
    #[error("{head}: does not accept the user or the password ({reason})")]
    Unauthorised {
        /// Which head.
        head: String,
        /// What it says, and what might mend it.
        reason: String,
    },
    /// A camera's certificate is signed by no authority that is trusted, or is for another name.
    #[error(
        "{head}: its certificate is not trusted ({reason}); its SHA-256 is {fingerprint}: where that is your camera's, keep the \
         certificate in a file (`pursuit ptz probe --save-certificate FILE`) and trust that (`--head-ca FILE`)"
    )]
    Certificate {
        /// Which head.
        head: String,
        /// Why it is not trusted.
        reason: String,
        /// The SHA-256 of the certificate, `AB:CD:…`.
        fingerprint: String,
    },
    /// What was said about a gimbal.
    #[error("{reason}")]
    Mavlink {
        /// What went wrong.
        reason: String,
    },
    /// A head cannot do what is asked.
    #[error("{head}: cannot {what}")]
    Unsupported {
        /// Which head.
        head: String,
        /// What it cannot do.
        what: &'static str,
    },
    /// The thread of a head has ended.
    #[error("{head}: is no longer served: its thread has ended")]
    Ended {
        /// Which head.
        head: String,
    },
    /// An estimate became unsound.
    #[error(transparent)]
    Estimation(#[from] pursuit_estimation::EstimationError),
    /// A picture cannot be used.
    #[error(transparent)]
    Imaging(#[from] pursuit_imaging::ImagingError),
    /// A picture for a simulated camera cannot be had.
    #[error("a simulated camera has no picture: {reason}")]
    Picture {
        /// Why.
        reason: String,
    },
    /// A tracker cannot look at what a simulated camera sees.
    #[error(transparent)]
    Tracking(#[from] pursuit_tracking::TrackingError),
    /// A calibration cannot be finished.
    #[error("the calibration failed: {reason}")]
    Calibration {
        /// Why, and what would mend it.
        reason: String,
    },
}

/// Refuses a number that is out of its range.
pub(crate) const fn require(name: &'static str, value: f64, holds: bool, wanted: &'static str) -> crate::Result<()> {
    if holds && value.is_finite() { Ok(()) } else { Err(PtzError::Parameter { name, value, wanted }) }
}
