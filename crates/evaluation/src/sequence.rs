use pursuit_geometry::{BBox, Mask, Truth};
use pursuit_imaging::Frame;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Where a sequence's frames come from.
#[derive(Debug, Clone)]
pub enum Footage {
    /// A video file or a folder of images, opened by the media layer; the sequence starts at frame `first` (from 0).
    Input {
        /// What to open.
        path: PathBuf,
        /// How many frames of it come before the sequence.
        first: usize,
    },
    /// Frames in memory: scenes, tests.
    Memory(Arc<Vec<Frame>>),
}

impl Footage {
    /// Bytes of the file, or of all files in the folder; `None` of frames in memory and of what cannot be read.
    pub(crate) fn bytes(&self) -> Option<u64> {
        let Self::Input { path, .. } = self else { return None };
        let about = path.metadata().ok()?;
        if !about.is_dir() {
            return Some(about.len());
        }
        let files = path.read_dir().ok()?.map(|entry| Some(entry.ok()?.metadata().ok()?.len()));
        files.sum()
    }
}

/// Frames with truth: frame `i` of the sequence is described by `truth()[i]`.
#[derive(Debug, Clone)]
pub struct Sequence {
    name: String,
    footage: Footage,
    truth: Vec<Truth>,
    origin: f64,
    attributes: BTreeSet<String>,
    /// The true mask of each frame, where it is known; empty where none is.
    masks: Arc<[Option<Mask>]>,
}

impl Sequence {
    /// From its parts; there are as many frames as entries in `truth`.
    pub fn new(name: impl Into<String>, footage: Footage, truth: Vec<Truth>) -> Self {
        Self { name: name.into(), footage, truth, origin: 0.0, attributes: BTreeSet::new(), masks: Arc::new([]) }
    }

    /// From frames in memory.
    pub fn from_frames(name: impl Into<String>, frames: Vec<Frame>, truth: Vec<Truth>) -> Self {
        Self::new(name, Footage::Memory(Arc::new(frames)), truth)
    }

    /// The same with the true masks of its frames, where they are known.
    #[must_use]
    pub fn with_masks(self, masks: Vec<Option<Mask>>) -> Self {
        Self { masks: masks.into(), ..self }
    }

    /// The true mask of frame `index`; `None` where it is not known. An empty one says that the target is away.
    pub fn mask(&self, index: usize) -> Option<&Mask> {
        self.masks.get(index)?.as_ref()
    }

    pub(crate) fn from_path(name: impl Into<String>, path: &Path, first: usize, truth: Vec<Truth>) -> Self {
        Self::new(name, Footage::Input { path: path.to_owned(), first }, truth)
    }

    /// The same, published with pixels counted so that the image's left and top edge are at `origin`; `truth` is counted from 0.
    pub(crate) fn published_from(self, origin: f64) -> Self {
        Self { origin, ..self }
    }

    /// Where the published files have the image's left and top edge: 1 where they are counted as MATLAB does. Result files
    /// of other programs follow them.
    pub(crate) const fn origin(&self) -> f64 {
        self.origin
    }

    /// What is said of it, by which figures are told apart: `occlusion`, `IV`.
    pub const fn attributes(&self) -> &BTreeSet<String> {
        &self.attributes
    }

    /// Adds an attribute.
    pub fn add_attribute(&mut self, name: impl Into<String>) {
        self.attributes.insert(name.into());
    }

    /// Its name: the path below the folder searched, with `/` between folders.
    pub fn name(&self) -> &str {
        &self.name
    }

    pub(crate) fn rename(&mut self, name: String) {
        self.name = name;
    }

    /// Where its frames come from.
    pub const fn footage(&self) -> &Footage {
        &self.footage
    }

    /// What is known about every frame.
    pub fn truth(&self) -> &[Truth] {
        &self.truth
    }

    /// The first frame whose box is known, and the box.
    pub fn first_visible(&self) -> Option<(usize, BBox)> {
        self.truth.iter().enumerate().find_map(|(i, t)| t.bbox().map(|b| (i, b)))
    }

    /// Whether the target is away in some frame after the first annotated one.
    pub fn has_absence(&self) -> bool {
        let first = self.first_visible().map_or(0, |(i, _)| i);
        self.truth.iter().skip(first).any(|t| *t == Truth::Absent)
    }
}
