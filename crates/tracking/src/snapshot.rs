//! Saved trackers: a short header, then the state.

use crate::{Result, TrackingError};
use serde::{Serialize, de::DeserializeOwned};

const MAGIC: &[u8; 8] = b"pursuit\x01";

/// Writes `state` of the tracker called `tracker`.
pub(crate) fn write<T: Serialize>(tracker: &str, state: &T) -> Result<Vec<u8>> {
    let mut bytes = MAGIC.to_vec();
    let problem = |e: postcard::Error| TrackingError::Snapshot { tracker: tracker.to_owned(), problem: e.to_string() };
    bytes.extend(postcard::to_stdvec(&(tracker, env!("CARGO_PKG_VERSION"))).map_err(problem)?);
    bytes.extend(postcard::to_stdvec(state).map_err(problem)?);
    Ok(bytes)
}

/// Name of the tracker whose state `bytes` are, alone or with its segmenter.
pub(crate) fn owner(bytes: &[u8]) -> Result<&str> {
    let header = header(bytes).map(|name| name.strip_suffix(SEGMENTING).unwrap_or(name));
    header.ok_or_else(|| TrackingError::Snapshot {
        tracker: String::new(),
        problem: "these bytes are not a saved tracker".into(),
    })
}

/// What follows the name of a tracker that is saved with its segmenter.
const SEGMENTING: &str = "+mask";

/// The name under which `tracker` is saved with its segmenter.
pub(crate) fn segmenting(tracker: &str) -> String {
    format!("{tracker}{SEGMENTING}")
}

/// Whether a tracker was saved with its segmenter.
pub(crate) fn is_segmenting(bytes: &[u8]) -> bool {
    header(bytes).is_some_and(|name| name.ends_with(SEGMENTING))
}

fn header(bytes: &[u8]) -> Option<&str> {
    let ((name, _), _) = postcard::take_from_bytes::<(&str, &str)>(bytes.strip_prefix(MAGIC)?).ok()?;
    Some(name)
}

/// Reads what [`write`] wrote.
pub(crate) fn read<T: DeserializeOwned>(tracker: &str, bytes: &[u8]) -> Result<T> {
    let problem = |problem: String| TrackingError::Snapshot { tracker: tracker.to_owned(), problem };
    let Some(rest) = bytes.strip_prefix(MAGIC) else {
        return Err(problem("these bytes are not a saved tracker".into()));
    };
    let ((name, version), state) =
        postcard::take_from_bytes::<(&str, &str)>(rest).map_err(|e| problem(e.to_string()))?;
    if name != tracker {
        return Err(problem(format!("they were saved by tracker `{name}`")));
    }
    if version != env!("CARGO_PKG_VERSION") {
        return Err(problem(format!("they were saved by version {version}, this is {}", env!("CARGO_PKG_VERSION"))));
    }
    match postcard::take_from_bytes(state) {
        Ok((value, [])) => Ok(value),
        Ok((_, rest)) => Err(problem(format!("{} bytes too many", rest.len()))),
        Err(e) => Err(problem(e.to_string())),
    }
}
