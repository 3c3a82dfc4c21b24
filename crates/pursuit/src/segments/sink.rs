use super::Shelf;
use crate::RunError;
use crate::sinks::{Moment, Sink};
use std::path::{Path, PathBuf};

/// Makes the sink of one segment.
type Make = Box<dyn Fn(&Path) -> Result<Box<dyn Sink>, RunError> + Send>;

/// A sink whose file is cut: each segment is one of its own, finished properly before the next is begun.
pub(crate) struct SegmentedSink {
    shelf: Shelf,
    stream: &'static str,
    make: Make,
    current: Option<(u64, Box<dyn Sink>)>,
}

impl SegmentedSink {
    /// Of segments that `make` makes; the first is begun with the first frame.
    pub fn new(
        shelf: Shelf,
        stream: &'static str,
        make: impl Fn(&Path) -> Result<Box<dyn Sink>, RunError> + Send + 'static,
    ) -> Self {
        Self { shelf, stream, make: Box::new(make), current: None }
    }
}

impl Sink for SegmentedSink {
    fn write(&mut self, moment: &Moment<'_>) -> Result<(), RunError> {
        let time_s = moment.frame.time_s();
        let segment = self.shelf.segment_of(time_s);
        // A clock that was set back does not begin what is over again.
        let goes_on = self.current.as_ref().is_some_and(|(number, _)| segment <= *number);
        if !goes_on {
            self.finish()?;
            let path = self.shelf.add(self.stream, time_s)?;
            self.current = Some((segment, (self.make)(&path)?));
        }
        self.current.as_mut().map_or(Ok(()), |(_, sink)| sink.write(moment))
    }

    fn finish(&mut self) -> Result<(), RunError> {
        self.current.take().map_or(Ok(()), |(_, mut sink)| sink.finish())
    }

    fn files(&self) -> Vec<PathBuf> {
        Vec::new()
    }
}
