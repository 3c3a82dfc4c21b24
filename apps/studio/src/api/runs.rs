//! Results of evaluations and reproductions below the root, to look at.

use crate::error::Refusal;
use crate::root::Root;
use crate::runs;
use crate::studio::Studio;
use axum::Json;
use axum::extract::{Query, State};
use axum::http::header;
use axum::response::{IntoResponse, Response};
use serde::Deserialize;
use serde_json::Value;
use std::sync::Arc;

/// Reads files on a thread that may wait for them.
async fn reading<T: Send + 'static>(
    studio: Arc<Studio>,
    read: impl FnOnce(&Studio, &Root) -> Result<T, Refusal> + Send + 'static,
) -> Result<T, Refusal> {
    let done = tokio::task::spawn_blocking(move || read(&studio, studio.root()?)).await;
    done.unwrap_or_else(|_| Err(Refusal::unfit("these results cannot be read")))
}

pub(crate) async fn list(State(studio): State<Arc<Studio>>) -> Result<Json<Vec<runs::Run>>, Refusal> {
    reading(studio, |_, root| runs::list(root)).await.map(Json)
}

#[derive(Deserialize)]
pub(crate) struct Folder {
    folder: String,
}

pub(crate) async fn open(
    State(studio): State<Arc<Studio>>,
    Query(Folder { folder }): Query<Folder>,
) -> Result<Json<Value>, Refusal> {
    reading(studio, move |_, root| runs::open(root, &folder)).await.map(Json)
}

#[derive(Deserialize)]
pub(crate) struct Picture {
    folder: String,
    name: String,
}

pub(crate) async fn picture(
    State(studio): State<Arc<Studio>>,
    Query(Picture { folder, name }): Query<Picture>,
) -> Result<Response, Refusal> {
    let (kind, bytes) = reading(studio, move |_, root| runs::picture(root, &folder, &name)).await?;
    Ok(([(header::CONTENT_TYPE, kind)], bytes).into_response())
}

#[derive(Deserialize)]
pub(crate) struct Worst {
    folder: String,
    tracker: String,
    sequence: String,
}

pub(crate) async fn worst(
    State(studio): State<Arc<Studio>>,
    Query(Worst { folder, tracker, sequence }): Query<Worst>,
) -> Result<Json<Value>, Refusal> {
    let read = move |studio: &Studio, root: &Root| runs::worst(root, &folder, (&tracker, &sequence), &studio.options);
    reading(studio, read).await.map(Json)
}
