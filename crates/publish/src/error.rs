use std::path::PathBuf;

/// What can go wrong with publishing. No message ever carries a password.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PublishError {
    /// An address that cannot be understood.
    #[error(
        "{reason}; messages go to mqtt://[USER@]HOST[:PORT][/PREFIX] or nats://…, with TLS to mqtts:// or tls:// (NATS)"
    )]
    Address {
        /// What is wrong with it.
        reason: String,
    },
    /// This build cannot reach such brokers.
    #[error("this build cannot publish to `{scheme}://`; build with `--features {features}`")]
    Missing {
        /// The scheme of the address.
        scheme: &'static str,
        /// The features of the build that it takes.
        features: &'static str,
    },
    /// A file of certificates that is of no use.
    #[error("certificates in {}: {reason}", path.display())]
    Certificates {
        /// The file.
        path: PathBuf,
        /// Why.
        reason: String,
    },
    /// The broker refuses the first contact for a reason that does not go away.
    #[error("{broker}: {reason}")]
    Refused {
        /// The broker.
        broker: String,
        /// Why, and what would mend it.
        reason: String,
    },
    /// No thread can be started.
    #[error("no thread for publishing can be started: {source}")]
    Thread {
        /// What the system says.
        source: std::io::Error,
    },
}
