use super::View;
use crate::sinks::Sink;
use crate::{Record, RunError};
use pursuit_imaging::Frame;
use std::path::PathBuf;
use std::sync::Arc;

/// Hands on what was found in a view in the input's pixels.
pub(crate) struct InInput {
    view: View,
    sink: Box<dyn Sink>,
    records: Vec<Record>,
}

impl InInput {
    /// `sink` itself, where there is no view.
    pub fn around(sink: Box<dyn Sink>, view: Option<View>) -> Box<dyn Sink> {
        match view {
            Some(view) => Box::new(Self { view, sink, records: Vec::new() }),
            None => sink,
        }
    }
}

impl Sink for InInput {
    fn write(&mut self, frame: &Arc<Frame>, records: &[Record]) -> Result<(), RunError> {
        let view = self.view;
        let mapped = records.iter().map(|record| Record {
            estimate: record.estimate.as_ref().map(|e| view.estimate_in_input(e)),
            ..record.clone()
        });
        self.records.clear();
        self.records.extend(mapped);
        self.sink.write(frame, &self.records)
    }

    fn finish(&mut self) -> Result<(), RunError> {
        self.sink.finish()
    }

    fn files(&self) -> Vec<PathBuf> {
        self.sink.files()
    }
}
