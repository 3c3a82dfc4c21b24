//! The calls that the page makes, and that others can.

mod live;
mod measuring;
mod results;
mod runs;
mod sources;
mod trials;

use crate::studio::Studio;
use crate::{assets, guard};
use axum::Router;
use axum::extract::{DefaultBodyLimit, Path, Request, State};
use axum::http::{StatusCode, header};
use axum::middleware::{self, Next};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post, put};
use std::sync::Arc;

/// The description of all calls.
const DESCRIPTION: &str = include_str!("openapi.json");
/// The longest body of a request that is no upload, bytes.
const LONGEST_BODY: usize = 64 << 10;

/// The largest file of a trajectory that is read back, bytes.
const LARGEST_IMPORT: usize = 128 << 20;

/// Every call, watched by the guard.
pub(crate) fn router(studio: Arc<Studio>) -> Router {
    let trial = Router::new()
        .route("/", get(trials::tell).delete(trials::close))
        .route("/orders", post(trials::order))
        .route("/targets", post(trials::add))
        .route("/targets/{target}", put(trials::correct).delete(trials::remove))
        .route("/targets/{target}/label", put(trials::label))
        .route("/targets/{target}/identity", put(trials::identify))
        .route("/import", post(trials::import).layer(DefaultBodyLimit::max(LARGEST_IMPORT)))
        .route("/parameters", put(trials::change))
        .route("/method", put(trials::method))
        .route("/detector", put(trials::detect))
        .route("/rows", get(results::rows))
        .route("/trajectory", get(results::trajectory))
        .route("/picture", get(results::picture))
        .route("/video", get(results::film))
        .route("/measuring", get(measuring::setting).put(measuring::set))
        .route("/measuring/calibration", get(measuring::calibration).post(measuring::keep))
        .route("/measurement", get(measuring::measurement))
        .route("/measurement/file", get(measuring::measured_file))
        .route("/corner", get(measuring::corner))
        .route("/live", get(live::live));
    let api = Router::new()
        .route("/info", get(sources::info))
        .route("/trackers", get(sources::trackers))
        .route("/files", get(sources::files))
        .route("/runs", get(runs::list))
        .route("/runs/results", get(runs::open))
        .route("/runs/picture", get(runs::picture))
        .route("/runs/worst", get(runs::worst))
        .route("/uploads", post(sources::upload).layer(DefaultBodyLimit::disable()))
        .route("/cameras", post(measuring::camera))
        .route("/trials", get(trials::list).post(trials::open))
        .nest("/trials/{trial}", trial)
        .route("/openapi.json", get(async || ([(header::CONTENT_TYPE, "application/json")], DESCRIPTION)));
    Router::new()
        .route("/", get(async || assets::asset("")))
        .route("/assets/{name}", get(async |Path(name): Path<String>| assets::asset(&name)))
        .route("/metrics", get(metrics))
        .nest("/api", api)
        .fallback(async || StatusCode::NOT_FOUND)
        .layer(DefaultBodyLimit::max(LONGEST_BODY))
        .layer(middleware::from_fn_with_state(studio.clone(), guard::watch))
        .layer(middleware::from_fn_with_state(studio.clone(), count))
        .with_state(studio)
}

async fn count(State(studio): State<Arc<Studio>>, request: Request, next: Next) -> Response {
    studio.metrics.requested();
    next.run(request).await
}

async fn metrics(State(studio): State<Arc<Studio>>) -> Response {
    let text = studio.metrics.text(studio.count());
    ([(header::CONTENT_TYPE, "text/plain; version=0.0.4; charset=utf-8")], text).into_response()
}
