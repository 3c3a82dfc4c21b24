//! A detector that finds what a file says.

use crate::RunError;
use pursuit_evaluation::boxes::{BoxFormat, BoxRow, Boxes, read_boxes};
use pursuit_geometry::{BBox, Size};
use pursuit_imaging::Frame;
use pursuit_tracking::{Detection, Detector, Followed};
use std::path::Path;

/// Finds in a frame what a file says of the frame of that number.
#[derive(Debug, Clone)]
pub struct FileDetector {
    boxes: Boxes,
    /// Whether boxes are in parts of the picture.
    parts: bool,
}

impl FileDetector {
    /// Reads the file, or for YOLO the folder; in the form told or, without, in the one it seems to have.
    ///
    /// # Errors
    /// What cannot be read or makes no sense, and scores that are no probabilities.
    pub fn read(path: &Path, format: Option<BoxFormat>) -> Result<Self, RunError> {
        let format = format.map_or_else(|| BoxFormat::of(path), Ok)?;
        // Of a picture of one pixel, a part is a pixel.
        let boxes = read_boxes(path, Some(format), Some(Size::new(1, 1)))?.in_pixels();
        are_probabilities(path, &boxes)?;
        Ok(Self { boxes, parts: format == BoxFormat::Yolo })
    }
}

impl Detector for FileDetector {
    fn detect(&mut self, frame: &Frame, _: &[Followed]) -> pursuit_tracking::Result<Vec<Detection>> {
        let (across, down) = match self.parts {
            true => (frame.size().width as f64, frame.size().height as f64),
            false => (1.0, 1.0),
        };
        let scaled = |b: BBox| {
            let (l, t, w, h) = b.ltwh();
            BBox::from_ltwh(l * across, t * down, w * across, h * down)
        };
        let rows = self.boxes.of(frame.index()).iter();
        Ok(rows.map(|row| Detection { bbox: scaled(row.bbox), ..detection(row) }).collect())
    }
}

/// A row as a detection.
pub(super) fn detection(row: &BoxRow) -> Detection {
    Detection { class: row.class.clone(), ..Detection::new(row.bbox, row.score) }
}

/// Scores have to be probabilities: what is not cannot be weighed.
pub(super) fn are_probabilities(path: &Path, boxes: &Boxes) -> Result<(), RunError> {
    match boxes.rows().iter().find(|r| !(0.0..=1.0).contains(&r.score)) {
        Some(BoxRow { frame, score, .. }) => Err(RunError::usage(format!(
            "{}: the score {score} (frame {frame} counted from 0) is no probability; bring scores to 0 … 1, for example by 1/(1+exp(-score))",
            path.display()
        ))),
        None => Ok(()),
    }
}
