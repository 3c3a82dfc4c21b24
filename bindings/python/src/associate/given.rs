//! Arrays of numpy as detections.

use crate::errors::usage;
use numpy::{AllowTypeChange, Element, PyArrayLikeDyn, PyUntypedArrayMethods};
use pursuit::BBox;
use pursuit::parameters::{Parameter, Parameters};
use pursuit::tracking::many::ManyParams;
use pursuit::tracking::{Class, Detection};
use pyo3::prelude::*;
use std::borrow::Cow;
use std::sync::Arc;

/// The parameters that an associator has.
pub fn schema() -> Vec<Parameter> {
    ManyParams::default().schema()
}

/// An array, or what numpy makes one of.
struct Array<'py, T: Element>(PyArrayLikeDyn<'py, T, AllowTypeChange>);

impl<'py, T: Element + Copy + 'py> Array<'py, T>
where
    for<'a> Vec<T>: FromPyObject<'a, 'py>,
{
    fn of(name: &str, object: &Bound<'py, PyAny>) -> PyResult<Self> {
        let array = object.extract::<PyArrayLikeDyn<'py, T, AllowTypeChange>>();
        array.map(Self).map_err(|e| usage(format!("{name} is no array of numbers: {e}")))
    }

    fn shape(&self) -> &[usize] {
        self.0.shape()
    }

    /// The numbers row by row, in place where they lie so.
    fn numbers(&self) -> Cow<'_, [T]> {
        // A slice of the array itself would hold columns where numpy keeps them together.
        let array = self.0.as_array();
        array.to_slice().map_or_else(|| array.iter().copied().collect(), Cow::Borrowed)
    }

    /// One number for each box.
    fn one_each(&self, name: &str, boxes: usize) -> PyResult<Cow<'_, [T]>> {
        match self.shape() {
            [count] if *count == boxes => Ok(self.numbers()),
            shape => Err(usage(format!("{name} has shape {shape:?}, not ({boxes},): one for each box"))),
        }
    }
}

/// What was given of a frame.
pub struct Given {
    pub detections: Vec<Detection>,
}

impl Given {
    pub fn read<'py>(
        boxes: &Bound<'py, PyAny>,
        corners: bool,
        scores: Option<&Bound<'py, PyAny>>,
        classes: Option<&Bound<'py, PyAny>>,
        embeddings: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Self> {
        let mut detections = read_boxes(boxes, corners)?;
        if let Some(scores) = scores {
            let scores = Array::<f64>::of("scores", scores)?;
            let scores = scores.one_each("scores", detections.len())?;
            detections.iter_mut().zip(&*scores).for_each(|(d, score)| d.confidence = *score);
        }
        if let Some(classes) = classes {
            let classes = Array::<f64>::of("classes", classes)?;
            let classes = classes.one_each("classes", detections.len())?;
            // Frames have few classes: a word is made once for those that follow each other.
            let mut last: Option<(f64, Option<Class>)> = None;
            for (detection, id) in detections.iter_mut().zip(&*classes) {
                let known = last.take().filter(|(of, _)| of == id);
                let (_, class) = last.insert(match known {
                    Some(known) => known,
                    None => (*id, class(*id)?),
                });
                detection.class.clone_from(class);
            }
        }
        if let Some(embeddings) = embeddings {
            read_embeddings(embeddings, &mut detections)?;
        }
        Ok(Self { detections })
    }
}

fn read_boxes(boxes: &Bound<'_, PyAny>, corners: bool) -> PyResult<Vec<Detection>> {
    let boxes = Array::<f64>::of("boxes", boxes)?;
    match boxes.shape() {
        [_, 4] | [0] => {}
        shape => return Err(usage(format!("boxes has shape {shape:?}, not (n, 4): four numbers for each box"))),
    }
    let bbox = |n: &[f64; 4]| match (n, corners) {
        ([left, top, width, height], false) => BBox::from_ltwh(*left, *top, *width, *height),
        ([left, top, right, bottom], true) => BBox::from_ltrb(*left, *top, *right, *bottom),
    };
    Ok(boxes.numbers().as_chunks::<4>().0.iter().map(|n| Detection::new(bbox(n), 1.0)).collect())
}

/// Whole numbers that `f64` holds are classes; those below 0 say that none is known.
fn class(id: f64) -> PyResult<Option<Class>> {
    /// 2⁵³: beyond it `f64` has gaps.
    const MOST: f64 = 9_007_199_254_740_992.0;
    if id.fract() != 0.0 || id.abs() > MOST || id.is_nan() {
        return Err(usage(format!(
            "classes has {id} among it; classes are whole numbers, below 0 where none is known"
        )));
    }
    Ok((id >= 0.0).then(|| Class::from((id as i64).to_string())))
}

fn read_embeddings(embeddings: &Bound<'_, PyAny>, detections: &mut [Detection]) -> PyResult<()> {
    let embeddings = Array::<f32>::of("embeddings", embeddings)?;
    let (rows, length) = match embeddings.shape() {
        [rows, length] => (*rows, *length),
        [0] => (0, 0),
        shape => return Err(usage(format!("embeddings has shape {shape:?}, not (n, d): one row for each box"))),
    };
    if rows != detections.len() {
        let boxes = detections.len();
        return Err(usage(format!("embeddings has {rows} rows for {boxes} boxes; give one for each")));
    }
    if length == 0 {
        return Ok(());
    }
    for (detection, row) in detections.iter_mut().zip(embeddings.numbers().chunks_exact(length)) {
        detection.embedding = row.iter().all(|v| v.is_finite()).then(|| Arc::from(row));
    }
    Ok(())
}
