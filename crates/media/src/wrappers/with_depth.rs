use crate::input::StopHandle;
use crate::{MediaError, Result, Source, SourceInfo};
use pursuit_imaging::{Frame, Pixels};

/// Puts the frames of a second source beside those of the first as their depth: 16-bit grey in millimetres, same size,
/// same order, registered to the picture.
pub struct WithDepth<S, D> {
    source: S,
    depth: D,
    info: SourceInfo,
    /// A depth image whose frame has not come yet.
    ahead: Option<Frame>,
}

impl<S: Source, D: Source> WithDepth<S, D> {
    /// Pairs `source` with `depth`.
    ///
    /// # Errors
    /// [`MediaError::Unreadable`] when their sizes differ.
    pub fn new(source: S, depth: D) -> Result<Self> {
        let (size, depth_size) = (source.info().size, depth.info().size);
        if size == depth_size {
            let seekable = source.info().seekable && depth.info().seekable;
            let info = SourceInfo { seekable, ..source.info().clone() };
            return Ok(Self { source, depth, info, ahead: None });
        }
        let reason = format!("the depth images are {depth_size} pixels, the frames {size}; they must be registered");
        Err(MediaError::unreadable(&depth.info().name, reason))
    }
}

impl<S, D: Source> WithDepth<S, D> {
    /// The first depth image with this number or a later one.
    fn depth_from(&mut self, index: u64) -> Result<Option<Frame>> {
        loop {
            match self.depth.next_frame() {
                Ok(Some(depth)) if depth.index() < index => {}
                Err(damage) if damage.is_damage() && damage.frame().is_some_and(|at| at < index) => {}
                other => return other,
            }
        }
    }
}

impl<S: Source, D: Source> Source for WithDepth<S, D> {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn next_frame(&mut self) -> Result<Option<Frame>> {
        let Some(frame) = self.source.next_frame()? else { return Ok(None) };
        // Where one of them leaves out what is damaged, the numbers still say what belongs together.
        let depth = match self.ahead.take().filter(|depth| depth.index() >= frame.index()) {
            Some(depth) => Some(depth),
            None => self.depth_from(frame.index())?,
        };
        if let Some(depth) = depth.as_ref().filter(|depth| depth.index() > frame.index()) {
            self.ahead = Some(depth.clone());
            return Ok(Some(frame));
        }
        let broken = |reason: &str| MediaError::broken(&self.depth.info().name, frame.index(), reason);
        let depth = depth.ok_or_else(|| broken("there are fewer depth images than frames"))?;
        let Pixels::Gray16(millimetres) = depth.pixels() else {
            return Err(broken("depth must be 16-bit grey in millimetres"));
        };
        if millimetres.size() != frame.size() {
            return Err(broken("the depth image has another size than its frame"));
        }
        let index = frame.index();
        // The depth image is shared with its frame, not copied.
        let frame = frame.with_depth(millimetres.clone());
        frame.map(Some).map_err(|e| MediaError::broken(&self.depth.info().name, index, e.to_string()))
    }

    fn seek(&mut self, index: u64) -> Result<()> {
        if !self.info.seekable {
            let reason = "it, or its depth, can only be read from front to back";
            return Err(MediaError::not_seekable(&self.info().name, index, reason));
        }
        // Both know beforehand how many frames they have: neither goes anywhere unless both can.
        self.source.info().check_seek(index)?;
        self.depth.info().check_seek(index)?;
        self.ahead = None;
        self.source.seek(index)?;
        self.depth.seek(index)
    }

    fn stop_handle(&self) -> Option<StopHandle> {
        let handles = [self.source.stop_handle(), self.depth.stop_handle()];
        Some(StopHandle::new(move || handles.iter().flatten().for_each(StopHandle::stop)))
    }
}
