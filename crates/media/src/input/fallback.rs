use super::cancel::Cancel;
use super::fault::Fault;
use super::ffmpeg::{FfmpegSource, Target};
use super::mp4::Mp4Source;
use super::source::StopHandle;
use crate::{OpenOptions, Result, Source, SourceInfo};
use pursuit_imaging::Frame;
use std::path::{Path, PathBuf};

/// An MP4 that is decoded here until something comes that is not, and by `ffmpeg` from that frame on.
///
/// Both give the same pictures in the same order, so the change shows only in how long it takes.
pub(crate) struct Mp4WithFallback {
    path: PathBuf,
    options: OpenOptions,
    built_in: Mp4Source,
    ffmpeg: Option<FfmpegSource>,
    delivered: u64,
}

impl Mp4WithFallback {
    pub fn new(built_in: Mp4Source, path: &Path, options: &OpenOptions) -> Self {
        Self { path: path.to_owned(), options: options.clone(), built_in, ffmpeg: None, delivered: 0 }
    }

    /// Starts `ffmpeg` and skips what has been delivered; `None` where there is no `ffmpeg`, or it cannot either.
    fn change_over(&self) -> Option<FfmpegSource> {
        let program = self.options.find_ffmpeg()?;
        let target = Target::File(self.path.clone());
        let name = &self.info().name;
        let mut source = FfmpegSource::open(&program, &target, name, &self.options, &Cancel::default()).ok()?;
        for _ in 0..self.delivered {
            source.next_frame().ok()??;
        }
        (source.info().size == self.info().size).then_some(source)
    }
}

impl Source for Mp4WithFallback {
    fn info(&self) -> &SourceInfo {
        self.built_in.info()
    }

    fn next_frame(&mut self) -> Result<Option<Frame>> {
        if let Some(ffmpeg) = &mut self.ffmpeg {
            return ffmpeg.next_frame();
        }
        match self.built_in.next() {
            Ok(frame) => {
                self.delivered += u64::from(frame.is_some());
                Ok(frame)
            }
            Err(trouble) => {
                if let Fault::Unsupported(_) = trouble.fault
                    && let Some(mut ffmpeg) = self.change_over()
                {
                    let frame = ffmpeg.next_frame();
                    self.ffmpeg = Some(ffmpeg);
                    return frame;
                }
                Err(trouble.error(&self.info().name))
            }
        }
    }

    fn stop_handle(&self) -> Option<StopHandle> {
        self.ffmpeg.as_ref().and_then(Source::stop_handle)
    }
}
