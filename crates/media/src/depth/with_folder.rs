use super::{DepthOptions, DepthReader, Pairing, PairingFacts};
use crate::input::StopHandle;
use crate::input::folder::list_images;
use crate::{Result, Source, SourceInfo};
use pursuit_imaging::Frame;
use std::path::{Path, PathBuf};

/// Puts the depth images of a folder beside the frames of a source, in their order; frames beyond the last have none.
pub struct WithDepthFolder<S> {
    source: S,
    files: Vec<PathBuf>,
    reader: DepthReader,
    info: SourceInfo,
}

impl<S: Source> WithDepthFolder<S> {
    /// Pairs `source` with the depth images in `folder`.
    ///
    /// # Errors
    /// [`MediaError::Unreadable`](crate::MediaError::Unreadable) when there are none, or options make no sense.
    pub fn new(source: S, folder: &Path, options: &DepthOptions) -> Result<Self> {
        let files = list_images(folder, &folder.display().to_string())?;
        let reader = DepthReader::new(options, files.iter().map(PathBuf::as_path))?;
        let frames = source.info().frame_count.map_or(files.len(), |n| usize::try_from(n).unwrap_or(usize::MAX));
        let paired = files.len().min(frames);
        let facts = PairingFacts {
            pairing: Pairing::Order,
            paired,
            unpaired: frames - paired,
            largest_offset_s: None,
            mean_offset_s: None,
        };
        let depth = Some(reader.facts(options, facts));
        let info = SourceInfo { depth, ..source.info().clone() };
        Ok(Self { info, source, files, reader })
    }
}

impl<S: Source> Source for WithDepthFolder<S> {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn next_frame(&mut self) -> Result<Option<Frame>> {
        let Some(frame) = self.source.next_frame()? else { return Ok(None) };
        let index = frame.index();
        let file = usize::try_from(index).ok().and_then(|k| self.files.get(k)).map(PathBuf::as_path);
        let name = || file.map_or_else(|| self.info().name.clone(), |f| f.display().to_string());
        self.reader.add(frame, file).map(Some).map_err(|fault| fault.broken(&name(), index))
    }

    fn seek(&mut self, index: u64) -> Result<()> {
        self.source.seek(index)
    }

    fn stop_handle(&self) -> Option<StopHandle> {
        self.source.stop_handle()
    }
}
