use std::io;

/// What can go wrong with MAVLink.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MavlinkError {
    /// A link's address cannot be understood.
    #[error(
        "the link `{address}` {problem}; a link is udpin:HOST:PORT, udpout:HOST:PORT, tcp:HOST:PORT or serial:DEVICE[:BAUD]"
    )]
    Address {
        /// As given.
        address: String,
        /// What is wrong with it.
        problem: &'static str,
    },
    /// No link is given.
    #[error("no link is given; name one, for example udpin:0.0.0.0:14550")]
    NoLink,
    /// A system or component has a number that it cannot have.
    #[error("{what} is {value}; it is between 1 and 255")]
    Identity {
        /// What it is.
        what: &'static str,
        /// Its number.
        value: u8,
    },
    /// The operating system reports an error that trying again does not mend.
    #[error("{link}: {doing} failed: {source}")]
    Io {
        /// Which link.
        link: String,
        /// What was being done.
        doing: &'static str,
        /// What the system says.
        source: io::Error,
    },
    /// A key for signing cannot be used.
    #[error(
        "the signing key cannot be used: {problem}; it is 64 hexadecimal digits, or a passphrase of at least 8 characters"
    )]
    Key {
        /// What is wrong with it.
        problem: String,
    },
    /// No gimbal answered.
    #[error(
        "no gimbal manager answered within {after_s} s; is the link right, and does the autopilot or the gimbal speak the gimbal protocol v2?"
    )]
    NoGimbal {
        /// How long was waited, seconds.
        after_s: f64,
    },
    /// A gimbal manager refuses.
    #[error("the gimbal manager refuses {doing}: {reason}")]
    Refused {
        /// What was being done.
        doing: &'static str,
        /// What it says.
        reason: String,
    },
    /// A gimbal manager does not answer.
    #[error("the gimbal manager did not answer {doing} within {after_s} s")]
    TimedOut {
        /// What was being done.
        doing: &'static str,
        /// How long was waited, seconds.
        after_s: f64,
    },
}
