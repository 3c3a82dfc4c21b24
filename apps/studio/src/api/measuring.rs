//! Measuring: the calibration of a trial, and what was measured with it.

use crate::error::Refusal;
use crate::measuring::{self, Bench, File, Setting};
use crate::studio::Studio;
use crate::trial::Trial;
use axum::Json;
use axum::extract::{Path, Query, State};
use axum::http::header;
use axum::response::{IntoResponse, Response};
use pursuit::geometry::Point;
use pursuit::measure::{CALIBRATION, Measurement};
use pursuit::measuring::{Calibration, Camera};
use pursuit::vision::corner::{Sharp, sharpened};
use serde::Deserialize;
use serde_json::{Value, json};
use std::sync::Arc;

type Answer = Result<Json<Value>, Refusal>;

/// The setting as the page knows it.
fn told(bench: &Bench) -> Value {
    let mut told = measuring::ruler(&bench.setting);
    told["calibration"] = json!(bench.setting.calibration);
    told["options"] = json!(bench.setting.options);
    told["file"] = json!({
        "read": bench.from, "place": bench.place.as_ref().map(|place| &place.name), "warning": bench.warning,
    });
    told["spreadsheets"] = cfg!(feature = "xlsx").into();
    told
}

pub(crate) async fn setting(State(studio): State<Arc<Studio>>, Path(trial): Path<u64>) -> Answer {
    let trial = studio.trial(trial)?;
    let bench = trial.bench()?;
    Ok(Json(told(&bench)))
}

/// Takes a setting even where it cannot be meant yet: its points are clicked one after the other.
pub(crate) async fn set(State(studio): State<Arc<Studio>>, Path(trial): Path<u64>, Json(said): Json<Value>) -> Answer {
    // Of a length or a unit that cannot be read, the message is its own and says what would be right.
    let setting: Setting = serde_json::from_value(said).map_err(|e| Refusal::unfit(e.to_string()))?;
    let trial = studio.trial(trial)?;
    let mut bench = trial.bench()?;
    bench.setting = setting;
    Ok(Json(told(&bench)))
}

/// The calibration as a file.
pub(crate) async fn calibration(
    State(studio): State<Arc<Studio>>,
    Path(trial): Path<u64>,
) -> Result<Response, Refusal> {
    let setting = studio.trial(trial)?.bench()?.setting.clone();
    setting.check()?;
    let text = setting.calibration.to_toml().map_err(|e| Refusal::unfit(e.to_string()))?;
    Ok(file((CALIBRATION, "application/toml"), text.into_bytes()))
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Keeping {
    #[serde(default)]
    overwrite: bool,
}

/// Keeps the calibration beside the input.
pub(crate) async fn keep(
    State(studio): State<Arc<Studio>>,
    Path(trial): Path<u64>,
    Json(Keeping { overwrite }): Json<Keeping>,
) -> Answer {
    let trial = studio.trial(trial)?;
    let mut bench = trial.bench()?;
    bench.keep(overwrite)?;
    Ok(Json(told(&bench)))
}

#[derive(Deserialize)]
pub(crate) struct Pointed {
    x: f64,
    y: f64,
    /// How far from there it may be, pixels.
    radius: f64,
}

/// Where a corner or an edge truly is in the frame shown, near a place that was pointed at.
pub(crate) async fn corner(
    State(studio): State<Arc<Studio>>,
    Path(trial): Path<u64>,
    Query(Pointed { x, y, radius }): Query<Pointed>,
) -> Answer {
    let frame = studio.trial(trial)?.shown().await?;
    let (kind, at) = match sharpened(frame.gray(), Point::new(x, y), radius) {
        Some(Sharp::Corner(at)) => ("corner", at),
        Some(Sharp::Edge(at)) => ("edge", at),
        None => ("none", Point::new(x, y)),
    };
    Ok(Json(json!({ "kind": kind, "x": at.x, "y": at.y })))
}

#[derive(Deserialize)]
pub(crate) struct Of {
    version: Option<u32>,
}

/// What is measured of a version of the trajectory, the newest unless it is said.
pub(crate) async fn measurement(
    State(studio): State<Arc<Studio>>,
    Path(trial): Path<u64>,
    Query(Of { version }): Query<Of>,
) -> Answer {
    let trial = studio.trial(trial)?;
    let setting = trial.bench()?.setting.clone();
    let version = trial.version(version).await?;
    let made = tokio::task::spawn_blocking(move || measuring::results(&version, &setting)).await;
    made.map(Json).map_err(|_| Refusal::unfit("this run cannot be measured; please report it"))
}

#[derive(Deserialize)]
pub(crate) struct Wanted {
    #[serde(default)]
    format: File,
    version: Option<u32>,
}

/// The same as a file.
pub(crate) async fn measured_file(
    State(studio): State<Arc<Studio>>,
    Path(trial): Path<u64>,
    Query(Wanted { format, version }): Query<Wanted>,
) -> Result<Response, Refusal> {
    let trial = studio.trial(trial)?;
    let found = found(&trial, version).await?;
    Ok(file(format.facts(), format.write(&found)?))
}

async fn found(trial: &Trial, version: Option<u32>) -> Result<Measurement, Refusal> {
    let setting = trial.bench()?.setting.clone();
    let version = trial.version(version).await?;
    let found = tokio::task::spawn_blocking(move || measuring::measure(&version, &setting)).await;
    found.unwrap_or_else(|_| Err(Refusal::unfit("this run cannot be measured; please report it")))
}

fn file((name, kind): (&str, &'static str), bytes: Vec<u8>) -> Response {
    let disposition = format!("attachment; filename=\"{name}\"");
    ([(header::CONTENT_TYPE, kind.to_owned()), (header::CONTENT_DISPOSITION, disposition)], bytes).into_response()
}

/// A camera as a calibration holds it, of the text that OpenCV writes, or of a `calibration.toml` that has one.
pub(crate) async fn camera(text: String) -> Answer {
    if let Some(camera) = Calibration::from_toml(&text).ok().and_then(|calibration| calibration.camera) {
        return Ok(Json(json!(camera)));
    }
    let camera = Camera::from_opencv(&text).map_err(|e| Refusal::unfit(e.to_string()))?;
    Ok(Json(json!(camera)))
}
