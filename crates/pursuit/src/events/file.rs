use super::message::{EventMessage, in_words};
use crate::RunError;
use crate::sinks::{Lines, Moment, Sink};
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};

/// `events.jsonl`: a JSON object a line.
pub(crate) struct EventFile {
    path: PathBuf,
    file: File,
}

impl EventFile {
    /// How its lines are told apart.
    pub const LINES: Lines = Lines {
        has_header: false,
        frame_of: |line| serde_json::from_str::<serde_json::Value>(line).ok()?["frame"].as_u64(),
    };

    /// Creates the file, or goes on with it.
    ///
    /// # Errors
    /// [`RunError::Output`] when it cannot be written.
    pub fn open(path: &Path, goes_on: bool) -> Result<Self, RunError> {
        let file = File::options().create(true).write(true).append(goes_on).truncate(!goes_on).open(path);
        Ok(Self { path: path.to_path_buf(), file: file.map_err(RunError::output(path))? })
    }
}

impl Sink for EventFile {
    fn write(&mut self, moment: &Moment<'_>) -> Result<(), RunError> {
        let Some(watched) = moment.watched().filter(|watched| !watched.events.is_empty()) else { return Ok(()) };
        let mut lines = Vec::new();
        for event in &watched.events {
            tracing::info!("frame {}, {:.2} s: {}", event.frame, event.time_s, in_words(event));
            lines.extend(EventMessage::of(event, watched).json());
            lines.push(b'\n');
        }
        self.file.write_all(&lines).map_err(RunError::output(&self.path))
    }

    fn finish(&mut self) -> Result<(), RunError> {
        Ok(())
    }

    fn files(&self) -> Vec<PathBuf> {
        vec![self.path.clone()]
    }
}
