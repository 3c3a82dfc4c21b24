//! What came of a trial.

use crate::error::Refusal;
use crate::export::Export;
use crate::studio::Studio;
use crate::trial::brief;
use axum::Json;
use axum::extract::{Path, Query, State};
use axum::http::header;
use axum::response::{IntoResponse, Response};
use pursuit::sinks::Format;
use serde::Deserialize;
use serde_json::{Value, json};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Rows that one answer holds at most.
const MOST_ROWS: usize = 2000;

/// The largest video that is sent, bytes.
const LARGEST_FILM: u64 = 1 << 30;

/// Says that nobody waits any more when it is dropped.
struct Waiting(Arc<AtomicBool>);

impl Drop for Waiting {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// The input with all that is known drawn in, as MP4. It is made when it is asked for, one at a time, and given up when whoever asked
/// has gone.
pub(crate) async fn film(State(studio): State<Arc<Studio>>, Path(trial): Path<u64>) -> Result<Response, Refusal> {
    let busy = |_| Refusal::conflict("another video is being made; ask again when it is done");
    let _turn = studio.filming.try_lock().map_err(busy)?;
    let trial = studio.trial(trial)?;
    let (rows, input) = (trial.version(None).await?.version.rows, trial.input()?.clone());
    let gone = Arc::new(AtomicBool::new(false));
    let _waiting = Waiting(gone.clone());
    let made = tokio::task::spawn_blocking(move || {
        let failed = |e: std::io::Error| Refusal::conflict(format!("the video cannot be made: {e}"));
        let file = tempfile::Builder::new().suffix(".mp4").tempfile().map_err(failed)?;
        pursuit::revise::film(&input, &rows, file.path(), || gone.load(Ordering::Relaxed))?;
        if file.path().metadata().map_err(failed)?.len() > LARGEST_FILM {
            return Err(Refusal::conflict(
                "the video is larger than 1 GiB; `pursuit track` writes such ones to the disk",
            ));
        }
        std::fs::read(file.path()).map_err(failed)
    });
    let bytes = made.await.unwrap_or_else(|_| Err(Refusal::unfit("the video cannot be made; please report it")))?;
    let headers =
        [(header::CONTENT_TYPE, "video/mp4"), (header::CONTENT_DISPOSITION, "attachment; filename=\"overlay.mp4\"")];
    Ok((headers, bytes).into_response())
}

#[derive(Deserialize)]
pub(crate) struct Part {
    /// The first frame wanted.
    #[serde(default)]
    from: u64,
    version: Option<u32>,
}

/// The rows of a time line from a frame on, at most [`MOST_ROWS`]; `next` is where to go on.
pub(crate) async fn rows(
    State(studio): State<Arc<Studio>>,
    Path(trial): Path<u64>,
    Query(Part { from, version }): Query<Part>,
) -> Result<Json<Value>, Refusal> {
    let version = studio.trial(trial)?.version(version).await?.version;
    let begin = version.rows.partition_point(|r| r.frame < from);
    let rows: Vec<Value> = version.rows.iter().skip(begin).take(MOST_ROWS).map(|r| brief(r)).collect();
    let next = version.rows.get(begin + rows.len()).map(|r| r.frame);
    let backward = version.backward();
    Ok(Json(
        json!({ "version": version.number, "tracker": version.tracker, "rows": rows, "next": next, "backward": backward }),
    ))
}

#[derive(Deserialize)]
pub(crate) struct Wanted {
    format: Option<Export>,
    version: Option<u32>,
}

/// The trajectory as a file.
pub(crate) async fn trajectory(
    State(studio): State<Arc<Studio>>,
    Path(trial): Path<u64>,
    Query(Wanted { format, version }): Query<Wanted>,
) -> Result<Response, Refusal> {
    let told = studio.trial(trial)?.version(version).await?;
    let format = format.unwrap_or(Export::Format(Format::CSV));
    let bytes = tokio::task::spawn_blocking(move || format.write(&told)).await;
    let bytes = bytes.map_err(|_| Refusal::unfit("this trajectory cannot be written"))??;
    let disposition = format!("attachment; filename=\"{}\"", format.file_name());
    Ok(([(header::CONTENT_TYPE, format.media_type().to_owned()), (header::CONTENT_DISPOSITION, disposition)], bytes)
        .into_response())
}

#[derive(Deserialize)]
pub(crate) struct At {
    frame: u64,
}

/// A frame as JPEG.
pub(crate) async fn picture(
    State(studio): State<Arc<Studio>>,
    Path(trial): Path<u64>,
    Query(At { frame }): Query<At>,
) -> Result<Response, Refusal> {
    let bytes = studio.trial(trial)?.picture(frame).await?;
    Ok(([(header::CONTENT_TYPE, "image/jpeg")], bytes).into_response())
}
