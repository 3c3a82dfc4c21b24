use crate::{Scene, SceneError, SceneQuery, scene};
use pursuit_geometry::Truth;
use pursuit_imaging::Frame;
use pursuit_media::{MediaError, Source, SourceInfo};

/// A scene as an input like any other, with the truth of its first target.
pub struct SceneSource {
    scene: Box<dyn Scene>,
    info: SourceInfo,
    next: u64,
    begin: u64,
    end: u64,
}

impl SceneSource {
    /// Opens `scene:NAME[?seed=1&key=value]`.
    ///
    /// # Errors
    /// As [`open`](crate::open).
    pub fn open(query: &str) -> Result<Self, SceneError> {
        let parsed: SceneQuery = query.parse()?;
        Ok(Self::new(scene(&parsed.name, parsed.seed, &parsed.params)?, query))
    }

    /// Films `scene` from begin to end at its nominal rate, under the name `name`.
    pub fn new(scene: Box<dyn Scene>, name: impl Into<String>) -> Self {
        let end = scene.frame_count();
        let truth = |index| {
            let targets = scene.targets(scene.frame_time_s(index));
            targets.first().and_then(crate::TargetTruth::visible).map_or(Truth::Absent, Truth::Visible)
        };
        let info = SourceInfo {
            fps: Some(scene.fps()),
            frame_count: Some(end),
            truth: Some((0..end).map(truth).collect()),
            seekable: true,
            ..SourceInfo::new(name, scene.size(), "synthetic scene")
        };
        Self { scene, info, next: 0, begin: 0, end }
    }

    /// Delivers only the frames `from <= index < to`; they keep their numbers and times.
    #[must_use]
    pub fn between(mut self, from: u64, to: u64) -> Self {
        self.end = to.min(self.scene.frame_count());
        self.begin = from.min(self.end);
        self.next = self.begin;
        self.info.frame_count = Some(self.end - self.next);
        self
    }
}

impl Source for SceneSource {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn next_frame(&mut self) -> pursuit_media::Result<Option<Frame>> {
        if self.next >= self.end {
            return Ok(None);
        }
        let index = self.next;
        self.next += 1;
        let time_s = self.scene.frame_time_s(index);
        Ok(Some(self.scene.render(time_s).into_frame(index, time_s, &self.scene.home())))
    }

    fn seek(&mut self, index: u64) -> pursuit_media::Result<()> {
        if !(self.begin..self.end).contains(&index) {
            return Err(MediaError::NotSeekable {
                name: self.info.name.clone(),
                frame: index,
                reason: format!("it shows frames {} to {}", self.begin, self.end.saturating_sub(1)),
            });
        }
        self.next = index;
        Ok(())
    }
}
