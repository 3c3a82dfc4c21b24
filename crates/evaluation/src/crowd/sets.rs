//! Sets of sequences of many targets: folders as MOTChallenge and KITTI publish them, with or without pictures.

use crate::boxes::BoxFormat;
use crate::datasets::{matches, natural_order};
use crate::{EvaluationError, Result};
use pursuit_geometry::Size;
use std::path::{Path, PathBuf};

/// Folders nested deeper than this are not searched: a link that leads back up must end somewhere.
const MAX_DEPTH: usize = 6;

/// A sequence of many targets.
#[derive(Debug, Clone, PartialEq)]
pub struct CrowdSequence {
    /// The set it belongs to: the name of the folder around it.
    pub set: String,
    /// Its name.
    pub name: String,
    /// The file with the truth, where there is one.
    pub truth: Option<PathBuf>,
    /// The file with detections, where there is one.
    pub detections: Option<PathBuf>,
    /// Frames a second, where `seqinfo.ini` says so.
    pub fps: Option<f64>,
    /// How many frames there are, where it says so.
    pub frames: Option<u64>,
    /// The size of the picture, where it says so.
    pub size: Option<Size>,
}

impl CrowdSequence {
    /// Every sequence below `root`: folders with `gt.txt`, `gt/gt.txt`, `det.txt` or `det/det.txt`, and the files of KITTI's
    /// `label_02`. `root` may be one sequence.
    ///
    /// # Errors
    /// A folder that cannot be read or that has none, and a `seqinfo.ini` that makes no sense.
    pub fn discover(root: &Path) -> Result<Vec<Self>> {
        let mut found = Vec::new();
        let whole =
            root.canonicalize().map_err(|e| EvaluationError::dataset(root, None, format!("cannot be read: {e}")))?;
        if whole.is_dir() {
            search(&whole, 0, &mut found)?;
        }
        if found.is_empty() {
            let name = root.display().to_string();
            let reason = "of many targets was found; those are folders with gt.txt or gt/gt.txt, det.txt or det/det.txt, and \
                          seqinfo.ini, or KITTI's label_02";
            return Err(EvaluationError::NoSequences { name, reason: reason.to_owned() });
        }
        found.sort_by(|a: &Self, b| natural_order(&a.set, &b.set).then_with(|| natural_order(&a.name, &b.name)));
        Ok(found)
    }

    /// Those of several folders whose name, or SET/NAME, matches one of the comma-separated `patterns`.
    ///
    /// # Errors
    /// As [`discover`](Self::discover), two sequences of one name in one set, and patterns that match nothing.
    pub fn discover_all(roots: &[PathBuf], patterns: Option<&str>) -> Result<Vec<Self>> {
        let mut all = Vec::new();
        for root in roots {
            all.extend(Self::discover(root)?);
        }
        if let Some(patterns) = patterns {
            let wanted =
                |s: &Self| patterns.split(',').map(str::trim).any(|p| matches(p, &s.name) || matches(p, &s.title()));
            all.retain(wanted);
            if all.is_empty() {
                return Err(EvaluationError::Option(format!("{patterns}: no sequence matches")));
            }
        }
        for (i, one) in all.iter().enumerate() {
            if all.iter().skip(i + 1).any(|other| other.set == one.set && other.name == one.name) {
                let title = one.title();
                return Err(EvaluationError::Option(format!(
                    "{title} is the name of two sequences; give one of them alone"
                )));
            }
        }
        Ok(all)
    }

    /// SET/NAME.
    pub fn title(&self) -> String {
        format!("{}/{}", self.set, self.name)
    }

    fn in_folder(folder: &Path, truth: Option<PathBuf>, detections: Option<PathBuf>) -> Result<Self> {
        let mut sequence = Self {
            set: name_of(folder.parent()),
            name: name_of(Some(folder)),
            truth,
            detections,
            fps: None,
            frames: None,
            size: None,
        };
        let file = folder.join("seqinfo.ini");
        if file.is_file() {
            sequence.take_info(&file)?;
        }
        Ok(sequence)
    }

    /// What `seqinfo.ini` says.
    fn take_info(&mut self, file: &Path) -> Result<()> {
        let text = crate::datasets::text::read(file)?;
        let (mut width, mut height) = (0, 0);
        for (at, line) in (1..).zip(text.lines()) {
            let Some((key, value)) = line.split_once('=') else { continue };
            let value = value.trim();
            let wrong =
                |what: &str| EvaluationError::dataset(file, at, format!("{} = {value:.40} is not {what}", key.trim()));
            let count = || {
                value
                    .parse::<usize>()
                    .ok()
                    .filter(|n| (1..=100_000_000).contains(n))
                    .ok_or_else(|| wrong("a number above 0"))
            };
            match key.trim() {
                "frameRate" => {
                    let fps = value.parse::<f64>().ok().filter(|f| f.is_finite() && *f > 0.0);
                    self.fps = Some(fps.ok_or_else(|| wrong("a number of frames a second"))?);
                }
                "seqLength" => self.frames = Some(count()? as u64),
                "imWidth" => width = count()?,
                "imHeight" => height = count()?,
                _ => {}
            }
        }
        self.size = (width > 0 && height > 0).then(|| Size::new(width, height));
        Ok(())
    }
}

fn search(folder: &Path, depth: usize, found: &mut Vec<CrowdSequence>) -> Result<()> {
    let first = |names: [&str; 2]| names.map(|n| folder.join(n)).into_iter().find(|p| p.is_file());
    let (truth, detections) = (first(["gt/gt.txt", "gt.txt"]), first(["det/det.txt", "det.txt"]));
    if truth.is_some() || detections.is_some() {
        found.push(CrowdSequence::in_folder(folder, truth, detections)?);
        return Ok(());
    }
    let entries = std::fs::read_dir(folder)
        .map_err(|e| EvaluationError::dataset(folder, None, format!("cannot be read: {e}")))?;
    let mut inside: Vec<PathBuf> = entries.filter_map(|e| Some(e.ok()?.path())).collect();
    inside.sort();
    if folder.file_name().is_some_and(|n| n == "label_02") {
        for file in inside.iter().filter(|p| p.extension().is_some_and(|e| e == "txt")) {
            if BoxFormat::of(file)? == BoxFormat::Kitti {
                let mut sequence = CrowdSequence::in_folder(folder, Some(file.clone()), None)?;
                sequence.name = file.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
                found.push(sequence);
            }
        }
        return Ok(());
    }
    let hidden = |p: &Path| p.file_name().is_some_and(|n| n.to_string_lossy().starts_with('.'));
    for inner in inside.iter().filter(|p| p.is_dir() && !hidden(p) && depth < MAX_DEPTH) {
        search(inner, depth + 1, found)?;
    }
    Ok(())
}

fn name_of(path: Option<&Path>) -> String {
    path.and_then(Path::file_name).map(|n| n.to_string_lossy().into_owned()).unwrap_or_default()
}
