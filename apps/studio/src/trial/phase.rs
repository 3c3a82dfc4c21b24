use serde::Serialize;

/// Where a run is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Phase {
    /// The first frame is shown; nothing has been followed yet.
    Ready,
    Running,
    Paused,
    /// Stopped by the user.
    Stopped,
    /// The input has ended.
    Ended,
    /// Something broke.
    Failed,
}
