//! What is known of targets, as arrays of numpy.

use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pursuit::TrackState;
use pursuit::tracking::many::Track;
use pyo3::prelude::*;

/// What is known of every target after a frame: arrays of one row for each, in ascending order of ids.
#[pyclass(frozen, module = "pursuit")]
pub struct Tracks {
    /// Numbers of the targets, from 1, int64 (m,).
    #[pyo3(get)]
    ids: Py<PyArray1<i64>>,
    /// Left, top, width, height in pixels, float64 (m, 4): measured when tracking, predicted when occluded, last believed when lost.
    #[pyo3(get)]
    boxes: Py<PyArray2<f64>>,
    /// The probability of each box as far as it is known, in [0, 1], float64 (m,).
    #[pyo3(get)]
    scores: Py<PyArray1<f64>>,
    /// TRACKING, UNSURE, OCCLUDED or LOST, int8 (m,).
    #[pyo3(get)]
    states: Py<PyArray1<i8>>,
    /// Which of the boxes given each target took, int64 (m,); -1: none.
    #[pyo3(get)]
    detections: Py<PyArray1<i64>>,
    /// The class that most of a target's detections were of, weighed by their scores, int64 (m,); -1: not known.
    #[pyo3(get)]
    class_ids: Py<PyArray1<i64>>,
    count: usize,
}

/// The same before it is arrays.
#[derive(Default)]
pub struct Told {
    ids: Vec<i64>,
    boxes: Vec<f64>,
    scores: Vec<f64>,
    states: Vec<i8>,
    detections: Vec<i64>,
    class_ids: Vec<i64>,
}

const TRACKING: i8 = 0;
const OCCLUDED: i8 = 1;
const LOST: i8 = 2;
const UNSURE: i8 = 3;

/// A place or a number as numpy's integer.
fn signed(n: impl TryInto<i64>) -> i64 {
    n.try_into().unwrap_or(i64::MAX)
}

impl Told {
    pub fn of(tracks: &[Track]) -> Self {
        let n = tracks.len();
        let mut told = Self {
            ids: Vec::with_capacity(n),
            boxes: Vec::with_capacity(4 * n),
            scores: Vec::with_capacity(n),
            states: Vec::with_capacity(n),
            detections: Vec::with_capacity(n),
            class_ids: Vec::with_capacity(n),
        };
        for track in tracks {
            let Some(estimate) = &track.estimate else { continue };
            let (left, top, width, height) = estimate.bbox.ltwh();
            told.ids.push(signed(track.id.0));
            told.boxes.extend([left, top, width, height]);
            told.scores.push(estimate.score);
            told.states.push(match estimate.state {
                TrackState::Tracking => TRACKING,
                TrackState::Unsure => UNSURE,
                TrackState::Occluded => OCCLUDED,
                TrackState::Lost => LOST,
            });
            told.detections.push(track.detection.map_or(-1, signed));
            told.class_ids.push(track.class.as_ref().and_then(|c| c.as_str().parse().ok()).unwrap_or(-1));
        }
        told
    }

    pub fn arrays(&self, py: Python<'_>) -> PyResult<Tracks> {
        let count = self.ids.len();
        Ok(Tracks {
            ids: PyArray1::from_slice(py, &self.ids).unbind(),
            boxes: PyArray1::from_slice(py, &self.boxes).reshape([count, 4])?.unbind(),
            scores: PyArray1::from_slice(py, &self.scores).unbind(),
            states: PyArray1::from_slice(py, &self.states).unbind(),
            detections: PyArray1::from_slice(py, &self.detections).unbind(),
            class_ids: PyArray1::from_slice(py, &self.class_ids).unbind(),
            count,
        })
    }
}

#[pymethods]
#[allow(missing_docs, reason = "constants of the class, said in `states`")]
impl Tracks {
    #[classattr]
    const TRACKING: i8 = TRACKING;
    #[classattr]
    const UNSURE: i8 = UNSURE;
    #[classattr]
    const OCCLUDED: i8 = OCCLUDED;
    #[classattr]
    const LOST: i8 = LOST;

    fn __len__(&self) -> usize {
        self.count
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        Ok(format!("Tracks(ids={})", self.ids.bind(py).repr()?))
    }
}
