use super::{Moment, Sink, create};
use crate::revise::{Edit, Row};
use crate::{Record, RunError};
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};

/// So many bytes are worth a write call of their own, where nobody waits for each frame.
const ENOUGH: usize = 64 << 10;

/// A frame of a trajectory, as a text format is told of it.
pub(super) struct TextRow<'a> {
    pub frame: u64,
    pub records: &'a [Record],
    /// Targets whose box a user drew in this frame.
    pub drawn: &'a [u64],
    /// Targets that were followed backward into this frame.
    pub backward: &'a [u64],
}

/// How a trajectory becomes text.
pub(super) trait Text: Send {
    /// Writes what stands before the first frame.
    fn begin(&mut self, _out: &mut Vec<u8>) {}

    /// Writes what a frame adds, or gathers it for the end.
    fn add(&mut self, row: &TextRow<'_>, out: &mut Vec<u8>);

    /// Writes what stands after the last frame.
    fn end(&mut self, _out: &mut Vec<u8>) {}
}

/// The whole text of a trajectory.
pub(super) fn whole<'a>(mut text: Box<dyn Text>, rows: impl IntoIterator<Item = &'a Row>, edits: &[Edit]) -> Vec<u8> {
    let mut out = Vec::new();
    text.begin(&mut out);
    for Row { frame, records, backward, .. } in rows {
        let drawn: Vec<u64> = edits.iter().filter(|e| e.frame == *frame).filter_map(Edit::drawn).collect();
        text.add(&TextRow { frame: *frame, records, drawn: &drawn, backward }, &mut out);
    }
    text.end(&mut out);
    out
}

/// A text that goes to its file frame by frame: one write call for all that a frame adds, so that a crash leaves whole lines.
pub(crate) struct TextSink {
    path: PathBuf,
    /// Whether it is a file, and not standard output, say.
    is_file: bool,
    out: Box<dyn Write + Send>,
    text: Box<dyn Text>,
    pending: Vec<u8>,
    ended: bool,
}

impl TextSink {
    /// # Errors
    /// [`RunError::Output`] when the file cannot be made or its beginning cannot be written.
    pub(super) fn create(path: &Path, text: Box<dyn Text>) -> Result<Self, RunError> {
        let mut sink = Self { is_file: true, ..Self::new(path, Box::new(create(path)?), text) };
        sink.begin()?;
        Ok(sink)
    }

    /// Goes on with a file that is there.
    ///
    /// # Errors
    /// [`RunError::Output`] when it cannot be opened.
    pub(super) fn append(path: &Path, text: Box<dyn Text>) -> Result<Self, RunError> {
        let file = File::options().append(true).open(path).map_err(RunError::output(path))?;
        Ok(Self { is_file: true, ..Self::new(path, Box::new(file), text) })
    }

    /// # Errors
    /// [`RunError::Output`] when the beginning cannot be written.
    pub(super) fn to_writer(name: &str, out: Box<dyn Write + Send>, text: Box<dyn Text>) -> Result<Self, RunError> {
        let mut sink = Self::new(Path::new(name), out, text);
        sink.begin()?;
        Ok(sink)
    }

    fn new(path: &Path, out: Box<dyn Write + Send>, text: Box<dyn Text>) -> Self {
        Self { path: path.to_path_buf(), is_file: false, out, text, pending: Vec::new(), ended: false }
    }

    fn begin(&mut self) -> Result<(), RunError> {
        self.text.begin(&mut self.pending);
        self.flush()
    }

    /// Adds a frame; it is written with others, once they are enough.
    pub fn add(&mut self, frame: u64, records: &[Record]) -> Result<(), RunError> {
        self.text.add(&TextRow { frame, records, drawn: &[], backward: &[] }, &mut self.pending);
        if self.pending.len() < ENOUGH { Ok(()) } else { self.flush() }
    }

    /// Ends the text, once.
    pub fn end(&mut self) -> Result<(), RunError> {
        if !std::mem::replace(&mut self.ended, true) {
            self.text.end(&mut self.pending);
        }
        self.flush()
    }

    fn flush(&mut self) -> Result<(), RunError> {
        let written = self.out.write_all(&self.pending).and_then(|()| self.out.flush());
        self.pending.clear();
        written.map_err(RunError::output(&self.path))
    }
}

impl Sink for TextSink {
    fn write(&mut self, moment: &Moment<'_>) -> Result<(), RunError> {
        let row = TextRow { frame: moment.frame.index(), records: moment.records, drawn: &[], backward: &[] };
        self.text.add(&row, &mut self.pending);
        self.flush()
    }

    fn finish(&mut self) -> Result<(), RunError> {
        self.end()
    }

    fn files(&self) -> Vec<PathBuf> {
        self.is_file.then(|| self.path.clone()).into_iter().collect()
    }
}
