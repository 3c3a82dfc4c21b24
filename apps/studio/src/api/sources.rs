//! What can be opened, and with what it can be followed.

use crate::error::Refusal;
use crate::root::Entry;
use crate::studio::Studio;
use crate::uploads;
use axum::Json;
use axum::body::Body;
use axum::extract::{Query, State};
use hyper::body::Body as _;
use pursuit::scenes::SCENES;
use serde::Deserialize;
use serde_json::{Value, json};
use std::io::Write;
use std::pin::Pin;
use std::sync::Arc;
use std::time::Duration;

/// An upload that stands still for this long has been given up.
const STALLED: Duration = Duration::from_secs(30);

pub(crate) async fn info(State(studio): State<Arc<Studio>>) -> Json<Value> {
    Json(json!({
        "version": env!("CARGO_PKG_VERSION"),
        "input": studio.given.as_ref().map(ToString::to_string),
        "default_tracker": pursuit::trackers::registry::DEFAULT_TRACKER,
        "picking": studio.picking,
        "read_only": studio.root.is_none(),
        "scenes": SCENES.iter().map(|scene| format!("scene:{}", scene.name)).collect::<Vec<_>>(),
        "largest_upload": uploads::LARGEST,
        "trials": studio.numbers(),
    }))
}

pub(crate) async fn trackers() -> Result<Json<Value>, Refusal> {
    Ok(Json(pursuit::config::catalogue(None)?))
}

#[derive(Deserialize)]
pub(crate) struct Folder {
    #[serde(default)]
    folder: String,
}

pub(crate) async fn files(
    State(studio): State<Arc<Studio>>,
    Query(Folder { folder }): Query<Folder>,
) -> Result<Json<Vec<Entry>>, Refusal> {
    let listed = tokio::task::spawn_blocking(move || studio.root()?.list(&folder)).await;
    listed.unwrap_or_else(|_| Err(Refusal::unfit("this folder cannot be listed"))).map(Json)
}

#[derive(Deserialize)]
pub(crate) struct Named {
    #[serde(default)]
    name: String,
}

/// Takes a file as the body of the request; says how a source names it.
pub(crate) async fn upload(
    State(studio): State<Arc<Studio>>,
    Query(Named { name }): Query<Named>,
    body: Body,
) -> Result<Json<Value>, Refusal> {
    let broken = |e: std::io::Error| Refusal::conflict(format!("the upload cannot be kept: {e}"));
    let upload = studio.uploads.begin(&name)?;
    let mut file = upload.file().map_err(broken)?;
    let (mut body, mut bytes) = (body, 0_u64);
    loop {
        let next = std::future::poll_fn(|context| Pin::new(&mut body).poll_frame(context));
        let frame = tokio::time::timeout(STALLED, next).await;
        let frame = match frame.map_err(|_| Refusal::unfit("the upload stood still and was given up"))? {
            None => break,
            Some(frame) => frame.map_err(|_| Refusal::unfit("the upload broke off"))?,
        };
        let Ok(chunk) = frame.into_data() else { continue };
        bytes += chunk.len() as u64;
        if bytes > uploads::LARGEST {
            let most = uploads::LARGEST >> 20;
            let message = format!("a file may have {most} MiB; start the studio with the file's folder as --root");
            return Err(Refusal::new(axum::http::StatusCode::PAYLOAD_TOO_LARGE, message));
        }
        file.write_all(&chunk).map_err(broken)?;
    }
    if bytes == 0 {
        return Err(Refusal::unfit("the upload is empty; send the file as the body of the request"));
    }
    Ok(Json(json!({ "source": upload.finish()?, "bytes": bytes })))
}
