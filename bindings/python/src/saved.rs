//! Saved trackers as bytes: what they are, a header as JSON, and the state as the crates below write it.

use crate::errors::StateError;
use pyo3::prelude::*;
use serde::{Serialize, de::DeserializeOwned};

/// The bytes of `state` under `header`; `magic` says what they are.
pub fn write(magic: &[u8], header: &impl Serialize, state: &[u8]) -> PyResult<Vec<u8>> {
    let header = serde_json::to_vec(header).map_err(|e| StateError::new_err(e.to_string()))?;
    let length = (header.len() as u64).to_le_bytes();
    Ok([magic, &length, &header, state].concat())
}

/// Header and state of what `write` wrote.
pub fn read<'a, H: DeserializeOwned>(magic: &[u8], saved: &'a [u8]) -> PyResult<(H, &'a [u8])> {
    let rest = saved.strip_prefix(magic).ok_or_else(broken)?;
    let (length, rest) = rest.split_first_chunk::<8>().ok_or_else(broken)?;
    let length = usize::try_from(u64::from_le_bytes(*length)).map_err(|_| broken())?;
    let (header, state) = rest.split_at_checked(length).ok_or_else(broken)?;
    Ok((serde_json::from_slice(header).map_err(|_| broken())?, state))
}

/// What is said of other bytes.
pub fn broken() -> PyErr {
    StateError::new_err("these bytes are no saved tracker of this version of pursuit")
}
