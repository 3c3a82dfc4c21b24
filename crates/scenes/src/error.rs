/// What can be wrong with a request for a scene.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// No scene has this name.
    #[error("there is no scene `{name}`; there are: {known}")]
    UnknownScene {
        /// The name asked for.
        name: String,
        /// All names, separated by commas.
        known: String,
    },
    /// A parameter that the scene does not have, or does not allow.
    #[error(transparent)]
    Parameter(#[from] pursuit_parameters::ParameterError),
    /// A query that does not follow `scene:NAME[?seed=1&key=value]`.
    #[error("`{query}` is no scene query: {reason}; write scene:NAME or scene:NAME?seed=1&key=value")]
    Malformed {
        /// The query as written.
        query: String,
        /// What is wrong with it.
        reason: String,
    },
}
