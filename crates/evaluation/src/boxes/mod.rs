//! Boxes from files: what detectors and trackers of others write, in the forms that are in use.
//!
//! Files come from anybody: a line that makes no sense is an error that names it, and a file takes no more memory than its
//! rows, of which there may be [`MAX_ROWS`].

mod coco;
mod jsonl;
pub(crate) mod lines;
mod rows;
mod yolo;

pub use rows::{BoxRow, Boxes};

use crate::{EvaluationError, Result};
use pursuit_geometry::Size;
use rows::Builder;
use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::str::FromStr;

/// More boxes than this are refused: memory is to stay bounded.
pub const MAX_ROWS: usize = 20_000_000;
/// Frame numbers above this are damage.
pub const MAX_FRAME: u64 = 10_000_000;
/// JSON that is not a line a box is read whole; files above this are refused.
const MAX_JSON_BYTES: u64 = 512 << 20;

/// A form that boxes are written in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BoxFormat {
    /// MOTChallenge: `frame,id,left,top,width,height,score[,class,visibility]`, frames and corners from 1.
    Mot,
    /// KITTI tracking: `frame id type truncated occluded alpha left top right bottom … [score]`, frames and pixels from 0.
    Kitti,
    /// COCO: a list of `image_id`, `bbox`, `score`, `category_id`, or an object with `images` and `annotations`.
    Coco,
    /// YOLO: a folder with a text file a frame, `class cx cy w h [score [id]]` in parts of the picture.
    Yolo,
    /// An object a line: `frame` from 0, `box` (left, top, width, height), `score`, `class`, `target`.
    Jsonl,
}

impl BoxFormat {
    /// Every form.
    pub const ALL: [Self; 5] = [Self::Mot, Self::Kitti, Self::Coco, Self::Yolo, Self::Jsonl];

    /// The word that names it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Mot => "mot",
            Self::Kitti => "kitti",
            Self::Coco => "coco",
            Self::Yolo => "yolo",
            Self::Jsonl => "jsonl",
        }
    }

    /// By the name of what is to be read, and for text by its first line.
    ///
    /// # Errors
    /// What cannot be read, or whose form cannot be told.
    pub fn of(path: &Path) -> Result<Self> {
        if path.is_dir() {
            return Ok(Self::Yolo);
        }
        let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        match extension.as_deref() {
            Some("json") => Ok(Self::Coco),
            Some("jsonl" | "ndjson") => Ok(Self::Jsonl),
            _ => {
                let mut first = String::new();
                let file = File::open(path).map_err(|e| unreadable(path, &e))?;
                let mut start = BufReader::new(file.take(lines::MAX_LINE));
                // What is not text has no comma either, and is refused where it is read.
                let _ = start.read_line(&mut first);
                Ok(if !first.contains(',') && first.split_whitespace().count() >= 10 { Self::Kitti } else { Self::Mot })
            }
        }
    }
}

impl std::fmt::Display for BoxFormat {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for BoxFormat {
    type Err = EvaluationError;

    fn from_str(s: &str) -> Result<Self> {
        Self::ALL.into_iter().find(|f| f.name() == s).ok_or_else(|| {
            EvaluationError::Option(format!("unknown form of boxes `{s}`; there are mot, kitti, coco, yolo and jsonl"))
        })
    }
}

/// Reads boxes from a file, or for [`BoxFormat::Yolo`] from a folder; in the form told or, without, in the one it seems to have.
/// `size` is that of the picture, which YOLO's parts are of.
///
/// # Errors
/// What cannot be read, a line that makes no sense (named by its number), too many boxes, and YOLO without a size.
pub fn read_boxes(path: &Path, format: Option<BoxFormat>, size: Option<Size>) -> Result<Boxes> {
    let format = match format {
        Some(format) => format,
        None => BoxFormat::of(path)?,
    };
    if format == BoxFormat::Yolo {
        return yolo::read(path, size);
    }
    let file = File::open(path).map_err(|e| unreadable(path, &e))?;
    if format == BoxFormat::Coco && file.metadata().map_err(|e| unreadable(path, &e))?.len() > MAX_JSON_BYTES {
        let reason = "is larger than 512 MiB; write it as `jsonl`, a box a line";
        return Err(EvaluationError::dataset(path, None, reason));
    }
    parse_boxes(&mut BufReader::new(file), path, format, size)
}

/// As [`read_boxes`], of bytes in hand; `path` is what errors call them. YOLO's are of one frame, 0.
///
/// # Errors
/// As [`read_boxes`].
pub fn parse_boxes(bytes: &mut dyn BufRead, path: &Path, format: BoxFormat, size: Option<Size>) -> Result<Boxes> {
    let mut builder = Builder::new(path);
    match format {
        BoxFormat::Mot => lines::mot(bytes, &mut builder)?,
        BoxFormat::Kitti => lines::kitti(bytes, &mut builder)?,
        BoxFormat::Coco => coco::read(bytes, &mut builder)?,
        BoxFormat::Yolo => yolo::lines(bytes, 0, yolo::known(path, size)?, &mut builder)?,
        BoxFormat::Jsonl => jsonl::read(bytes, &mut builder)?,
    }
    Ok(builder.finish(if format == BoxFormat::Mot { 1.0 } else { 0.0 }))
}

fn unreadable(path: &Path, e: &std::io::Error) -> EvaluationError {
    EvaluationError::dataset(path, None, format!("cannot be read: {e}"))
}

#[cfg(test)]
mod tests;
