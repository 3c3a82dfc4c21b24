//! What is to be worked on.

use super::Associate;
use crate::RunError;
use pursuit_evaluation::boxes::BoxFormat;
use pursuit_evaluation::{CrowdSequence, EvaluationError};
use pursuit_geometry::Size;
use std::path::{Path, PathBuf};

/// Where the files of sequences go.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Layout {
    /// Side by side.
    Flat,
    /// In a folder for each set.
    BySet,
}

/// The detections of one sequence.
#[derive(Debug, Clone)]
pub(super) struct Work {
    pub set: String,
    pub name: String,
    pub detections: PathBuf,
    pub fps: Option<f64>,
    pub size: Option<Size>,
    pub frames: Option<u64>,
}

impl Work {
    pub fn of(options: &Associate, sequence: &CrowdSequence) -> Result<Self, RunError> {
        let detections = sequence.detections.clone().ok_or_else(|| EvaluationError::NoSequences {
            name: sequence.title(),
            reason: "can be associated: it has no det.txt or det/det.txt".to_owned(),
        })?;
        Ok(Self {
            set: sequence.set.clone(),
            name: sequence.name.clone(),
            detections,
            fps: options.fps.or(sequence.fps),
            size: options.size.or(sequence.size),
            frames: sequence.frames,
        })
    }

    fn alone(options: &Associate, path: &Path) -> Self {
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let detections = path.to_owned();
        Self { set: String::new(), name, detections, fps: options.fps, size: options.size, frames: None }
    }

    pub fn title(&self, layout: Layout) -> String {
        match layout {
            Layout::Flat => self.name.clone(),
            Layout::BySet => format!("{}/{}", self.set, self.name),
        }
    }

    pub fn file(&self, layout: Layout, out: &Path) -> PathBuf {
        out.join(self.title(layout) + ".txt")
    }

    /// An output is never one of the inputs.
    pub fn spares_inputs(&self, file: &Path) -> Result<(), RunError> {
        let same = |a: &Path, b: &Path| matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b);
        if same(file, &self.detections) {
            let file = file.display();
            return Err(RunError::usage(format!("{file} is the input; name another folder with --out")));
        }
        Ok(())
    }
}

/// What `input` is.
pub(super) fn works(options: &Associate, input: &Path) -> Result<Vec<Work>, RunError> {
    if input.is_file() {
        return Ok(vec![known_file(options, input)?]);
    }
    let yolo = options.format == Some(BoxFormat::Yolo);
    if input.is_dir() && (yolo || (options.format.is_none() && holds_text_alone(input))) {
        return Ok(vec![Work::alone(options, input)]);
    }
    let sequences = CrowdSequence::discover(input)?;
    let with: Vec<Work> =
        sequences.iter().filter(|s| s.detections.is_some()).map(|s| Work::of(options, s)).collect::<Result<_, _>>()?;
    match (with.is_empty(), sequences.first()) {
        (true, Some(first)) => Work::of(options, first).map(|work| vec![work]),
        _ => Ok(with),
    }
}

/// A `det.txt` is of the sequence whose folder it lies in, where `seqinfo.ini` says what that is.
fn known_file(options: &Associate, file: &Path) -> Result<Work, RunError> {
    let folder = file.canonicalize().ok().and_then(|p| p.parent().map(Path::to_path_buf)).unwrap_or_default();
    let is_det = file.file_name().is_some_and(|n| n == "det.txt");
    let places = [Some(folder.as_path()), folder.parent().filter(|_| folder.ends_with("det"))];
    for place in places.into_iter().flatten().filter(|p| is_det && p.join("seqinfo.ini").is_file()) {
        if let [sequence] = &CrowdSequence::discover(place)?[..] {
            let work = Work::of(options, sequence)?;
            return Ok(Work { detections: file.to_owned(), set: String::new(), ..work });
        }
    }
    Ok(Work::alone(options, file))
}

/// Whether a folder is one of YOLO's: text files, none of which has a name that sequences have, and no folders.
fn holds_text_alone(folder: &Path) -> bool {
    let Ok(entries) = std::fs::read_dir(folder) else { return false };
    let mut texts = 0;
    for path in entries.filter_map(|e| Some(e.ok()?.path())) {
        let name = path.file_name().unwrap_or_default();
        if path.is_dir() || name == "det.txt" || name == "gt.txt" || name == "seqinfo.ini" {
            return false;
        }
        texts += usize::from(path.extension().is_some_and(|e| e == "txt"));
    }
    texts > 0
}
