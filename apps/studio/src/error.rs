use axum::Json;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use pursuit::RunError;
use pursuit::tracking::TrackingError;
use serde_json::json;

/// What keeps the studio from being opened.
#[derive(Debug, thiserror::Error)]
pub enum StudioError {
    /// The folder that files may come from is none.
    #[error("--root {path}: {reason}")]
    Root {
        /// As given.
        path: String,
        /// What is wrong, and what would be right.
        reason: String,
    },
    /// Nobody can listen at that address.
    #[error("cannot listen at {address}: {source}; choose another with --port or --host")]
    Listen {
        /// The address.
        address: String,
        /// Why.
        source: std::io::Error,
    },
    /// The system gives no thread, no random numbers or no folder for uploads.
    #[error("the studio cannot be opened: {0}")]
    System(String),
}

/// A request that is refused: a status below 500 and one line for the user.
#[derive(Debug, Clone)]
pub(crate) struct Refusal {
    pub status: StatusCode,
    pub message: String,
}

impl Refusal {
    pub fn new(status: StatusCode, message: impl Into<String>) -> Self {
        Self { status, message: message.into() }
    }

    /// What was asked for makes no sense.
    pub fn unfit(message: impl Into<String>) -> Self {
        Self::new(StatusCode::UNPROCESSABLE_ENTITY, message)
    }

    /// There is no such thing.
    pub fn missing(message: impl Into<String>) -> Self {
        Self::new(StatusCode::NOT_FOUND, message)
    }

    /// It cannot be done now.
    pub fn conflict(message: impl Into<String>) -> Self {
        Self::new(StatusCode::CONFLICT, message)
    }

    /// There is too much of it already.
    pub fn too_many(message: impl Into<String>) -> Self {
        Self::new(StatusCode::TOO_MANY_REQUESTS, message)
    }
}

impl From<RunError> for Refusal {
    fn from(error: RunError) -> Self {
        match &error {
            RunError::Tracking(TrackingError::UnknownTarget { .. }) => Self::missing(error.to_string()),
            _ => Self::unfit(error.to_string()),
        }
    }
}

impl IntoResponse for Refusal {
    fn into_response(self) -> Response {
        (self.status, Json(json!({ "error": self.message }))).into_response()
    }
}
