/// A parameter that does not exist or has a senseless value.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("parameter `{name}` of `{owner}`: {problem}")]
pub struct ParameterError {
    /// Whose parameter it is: a tracker, a detector, a scene.
    pub owner: String,
    /// Its name, with the names of its groups before it.
    pub name: String,
    /// What is wrong, and what would be right.
    pub problem: String,
}

impl ParameterError {
    /// The error about the parameter `name` of `owner`.
    pub fn new(owner: impl Into<String>, name: impl Into<String>, problem: impl Into<String>) -> Self {
        Self { owner: owner.into(), name: name.into(), problem: problem.into() }
    }
}
