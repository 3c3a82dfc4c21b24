//! The page: plain files, part of the program.

use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};

const SCRIPT: &str = "text/javascript; charset=utf-8";

macro_rules! assets {
    ($($name:literal $kind:expr),* $(,)?) => {
        &[$(($name, $kind, include_str!(concat!("../assets/", $name)))),*]
    };
}

const ASSETS: &[(&str, &str, &str)] = assets![
    "index.html" "text/html; charset=utf-8",
    "style.css" "text/css; charset=utf-8",
    "icon.svg" "image/svg+xml",
    "app.js" SCRIPT,
    "api.js" SCRIPT,
    "compare.js" SCRIPT,
    "detecting.js" SCRIPT,
    "files.js" SCRIPT,
    "keyboard.js" SCRIPT,
    "live.js" SCRIPT,
    "marks.js" SCRIPT,
    "measuring.js" SCRIPT,
    "model.js" SCRIPT,
    "monitor.js" SCRIPT,
    "names.js" SCRIPT,
    "panels.js" SCRIPT,
    "parameters.js" SCRIPT,
    "plots.js" SCRIPT,
    "results.js" SCRIPT,
    "runs.js" SCRIPT,
    "source.js" SCRIPT,
    "spots.js" SCRIPT,
    "targets.js" SCRIPT,
    "timeline.js" SCRIPT,
    "watching.js" SCRIPT,
    "words.js" SCRIPT,
];

/// The file of that name; the page itself for none.
pub(crate) fn asset(name: &str) -> Response {
    let name = if name.is_empty() { "index.html" } else { name };
    match ASSETS.iter().find(|(own, ..)| *own == name) {
        Some((_, kind, text)) => ([(header::CONTENT_TYPE, *kind)], *text).into_response(),
        None => StatusCode::NOT_FOUND.into_response(),
    }
}
