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
    /// The scene has no such key.
    #[error("scene `{scene}` has no key `{key}`; it has: {known}")]
    UnknownKey {
        /// The scene.
        scene: String,
        /// The key asked for.
        key: String,
        /// All keys with their ranges, separated by commas.
        known: String,
    },
    /// A value that the key does not allow.
    #[error("scene `{scene}`: {key}={value} cannot be used; {key} is {help}, {allowed}")]
    BadValue {
        /// The scene.
        scene: String,
        /// The key.
        key: String,
        /// The value as written.
        value: String,
        /// What the key means.
        help: &'static str,
        /// What it takes: a range, or a list of words.
        allowed: String,
    },
    /// A query that does not follow `scene:NAME[?seed=1&key=value]`.
    #[error("`{query}` is no scene query: {reason}; write scene:NAME or scene:NAME?seed=1&key=value")]
    Malformed {
        /// The query as written.
        query: String,
        /// What is wrong with it.
        reason: String,
    },
}
