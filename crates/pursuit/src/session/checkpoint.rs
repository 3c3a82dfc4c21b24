use crate::RunError;
use pursuit_tracking::MultiTracker;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// What a file of ours begins with.
const MAGIC: &[u8; 8] = b"pursuitR";
/// How often a run that goes on writes down where it is.
const EVERY: Duration = Duration::from_secs(10);

/// Where a session writes down what it knows, to go on from there when it was interrupted.
#[derive(Debug)]
pub(crate) struct Checkpoint {
    path: PathBuf,
    written: Instant,
    /// Something could not be written; said once.
    failed: bool,
}

impl Checkpoint {
    /// To the file `path`.
    pub fn new(path: PathBuf) -> Self {
        Self { path, written: Instant::now(), failed: false }
    }

    /// Writes what `targets` know after `frame`, if that was not done lately.
    pub fn keep(&mut self, frame: u64, targets: &dyn MultiTracker) {
        if self.written.elapsed() >= EVERY {
            self.write(frame, targets);
        }
    }

    /// Writes it in one step: whoever reads the file sees the old one or the new one. A run goes on without.
    pub fn write(&mut self, frame: u64, targets: &dyn MultiTracker) {
        self.written = Instant::now();
        let temporary = self.path.with_extension("part");
        let written = targets.save().map_err(|e| e.to_string()).and_then(|state| {
            let bytes = [MAGIC.as_slice(), &frame.to_le_bytes(), &state].concat();
            std::fs::write(&temporary, bytes).map_err(|e| e.to_string())?;
            std::fs::rename(&temporary, &self.path).map_err(|e| e.to_string())
        });
        if let Err(why) = written
            && !std::mem::replace(&mut self.failed, true)
        {
            tracing::warn!("this run could not be resumed if it were interrupted: {}: {why}", self.path.display());
        }
    }

    /// Nothing is left to go on with.
    pub fn discard(&self) {
        let _ = std::fs::remove_file(&self.path);
    }

    /// The frame looked at last and what the targets knew then; `None` without a file.
    ///
    /// # Errors
    /// [`RunError::Usage`] for a file that is none of ours or cannot be read.
    pub fn read(path: &Path) -> Result<Option<(u64, Vec<u8>)>, RunError> {
        let bytes = match std::fs::read(path) {
            Ok(bytes) => bytes,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            Err(e) => return Err(RunError::usage(format!("{} cannot be read: {e}", path.display()))),
        };
        let state = bytes.strip_prefix(MAGIC).and_then(|rest| rest.split_first_chunk::<8>());
        let wrong =
            || RunError::usage(format!("{} is damaged; remove it to start from the first frame", path.display()));
        state.map(|(frame, state)| Some((u64::from_le_bytes(*frame), state.to_vec()))).ok_or_else(wrong)
    }
}
