use std::path::PathBuf;

/// What can go wrong with networks.
#[derive(Debug, thiserror::Error)]
pub enum InferenceError {
    /// A file cannot be read.
    #[error("the network file {} cannot be read: {source}; check the path and its permissions", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A file is no network, or one that cannot be used.
    #[error("{what} is no usable network: {why}; {mend}")]
    Model {
        /// The file, or the name of the built-in network.
        what: String,
        /// What is wrong with it.
        why: String,
        /// What would mend it.
        mend: String,
    },
    /// A description beside a network cannot be understood.
    #[error("the description {} is wrong: {why}", path.display())]
    Description {
        /// The file.
        path: PathBuf,
        /// What is wrong with it, and what would be right.
        why: String,
    },
    /// No library that runs networks is there.
    #[error("no library can run {what}: {why}; {mend}")]
    NoBackend {
        /// The file.
        what: String,
        /// What was tried.
        why: String,
        /// What would mend it.
        mend: String,
    },
    /// The library refused to run the network.
    #[error("running the network {what} failed: {why}")]
    Run {
        /// The network.
        what: String,
        /// What the library said.
        why: String,
    },
    /// A tensor of another size than the network takes or gives.
    #[error(
        "the network {what} has {port} of {expected} numbers, not of {actual}; give tensors of the shapes it lists"
    )]
    Tensor {
        /// The network.
        what: String,
        /// The input or output.
        port: String,
        /// Numbers it has.
        expected: usize,
        /// Numbers that were given.
        actual: usize,
    },
    /// A value of a configuration cannot be used.
    #[error(transparent)]
    Config(#[from] pursuit_parameters::ParameterError),
    /// A box that cannot be followed.
    #[error("a target must be a finite box with an area, not {bbox}")]
    Box {
        /// The box.
        bbox: String,
    },
}

/// What is wrong with a description, and in which line.
pub(crate) fn in_line(text: &str, error: &toml::de::Error) -> String {
    let before = error.span().and_then(|span| text.get(..span.start));
    let message = error.message().replace('\n', " ");
    before.map_or_else(|| message.clone(), |b| format!("line {}: {message}", b.matches('\n').count() + 1))
}
