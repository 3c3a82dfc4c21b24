use super::h264::H264Encoder;
use super::i420::I420;
use super::video::{VideoOptions, VideoWriter};
use crate::{MediaError, Result};
use pursuit_containers::Storage;
use pursuit_containers::mp4::{EncodedSample, Writer};
use pursuit_geometry::Size;
use pursuit_imaging::{ImageView, Rgb8};
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

/// Writes an H.264 MP4 file that browsers play.
///
/// The file is fragmented: its header comes first, then a self-contained fragment for every 8 frames or half second,
/// each in one write. Whatever happens, also the end of this process from outside, all fragments on disk play. Memory does
/// not grow with the clip's length beyond 16 bytes for every two seconds. Pictures with odd sides are widened by one pixel.
pub struct Mp4Writer {
    path: PathBuf,
    storage: Box<dyn Storage>,
    options: VideoOptions,
    stream: Option<Stream>,
    ended: Ended,
}

/// Whether more can be written.
enum Ended {
    Not,
    Finished,
    /// With what went wrong.
    Failed(String),
}

/// What exists from the first picture on.
struct Stream {
    size: Size,
    encoder: H264Encoder,
    planes: I420,
    encoded: EncodedSample,
    container: Writer,
}

impl Mp4Writer {
    /// Creates (or replaces) the file `path`.
    ///
    /// # Errors
    /// [`MediaError::Unwritable`] when it cannot be created.
    pub fn create(path: &Path, options: VideoOptions) -> Result<Self> {
        let file = File::create(path).map_err(|e| unwritable(path, &describe(&e)))?;
        Ok(Self::new(Box::new(file), path, options))
    }

    /// Writes to anything; `name` stands in error messages.
    pub fn new(storage: Box<dyn Storage>, name: &Path, options: VideoOptions) -> Self {
        Self { path: name.to_path_buf(), storage, options, stream: None, ended: Ended::Not }
    }

    /// Notes a failure, so that later calls fail alike, and turns it into an error.
    fn fail(&mut self, reason: String) -> MediaError {
        let error = unwritable(&self.path, &reason);
        self.ended = Ended::Failed(reason);
        error
    }

    fn add(&mut self, image: ImageView<'_, Rgb8>, time_s: f64) -> Result<(), String> {
        let stream = match &mut self.stream {
            Some(stream) => stream,
            none => none.insert(Stream::new(image.size(), time_s, &self.options)?),
        };
        if stream.size != image.size() {
            return Err(format!(
                "the frame size changed from {} to {}; one video has one size",
                stream.size,
                image.size()
            ));
        }
        stream.add(image, time_s, self.storage.as_mut())
    }
}

impl VideoWriter for Mp4Writer {
    fn write(&mut self, image: ImageView<'_, Rgb8>, time_s: f64) -> Result<()> {
        match &self.ended {
            Ended::Not => self.add(image, time_s).map_err(|reason| self.fail(reason)),
            Ended::Finished => Err(unwritable(&self.path, "it is already finished")),
            Ended::Failed(reason) => Err(unwritable(&self.path, reason)),
        }
    }

    fn finish(&mut self) -> Result<()> {
        if matches!(self.ended, Ended::Finished) {
            return Ok(());
        }
        let last_s = 1.0 / self.options.sane_fps();
        let closed = self
            .stream
            .as_mut()
            .map_or(Ok(()), |stream| stream.container.close(last_s, self.storage.as_mut()).map_err(|e| e.to_string()));
        match std::mem::replace(&mut self.ended, Ended::Finished) {
            Ended::Failed(reason) => Err(unwritable(&self.path, &reason)),
            _ => closed.map_err(|reason| self.fail(reason)),
        }
    }

    fn path(&self) -> &Path {
        &self.path
    }
}

impl Drop for Mp4Writer {
    /// Closes the file properly when nobody did; who wants to know whether that worked calls `finish`.
    fn drop(&mut self) {
        let _ = self.finish();
    }
}

impl Stream {
    fn new(size: Size, origin_s: f64, options: &VideoOptions) -> Result<Self, String> {
        let (width, height) = I420::padded(size.width, size.height);
        Ok(Self {
            size,
            encoder: H264Encoder::new(width, height, options)?,
            planes: I420::default(),
            encoded: EncodedSample::default(),
            // The encoder takes no larger pictures than fit.
            container: Writer::new(width as u16, height as u16, origin_s).with_pixel_aspect(options.pixel_aspect),
        })
    }

    fn add(&mut self, image: ImageView<'_, Rgb8>, time_s: f64, storage: &mut dyn Storage) -> Result<(), String> {
        self.planes.fill_from(image);
        // The first picture is a keyframe anyway.
        self.encoder.encode(&self.planes, self.container.keyframe_due(time_s), &mut self.encoded)?;
        self.container.add(&self.encoded, time_s, storage).map_err(|e| e.to_string())
    }
}

pub(super) fn unwritable(path: &Path, reason: &str) -> MediaError {
    MediaError::Unwritable { name: path.display().to_string(), reason: reason.to_owned() }
}

/// Why a file cannot be created, in words that say what would mend it.
fn describe(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::PermissionDenied => "permission denied; choose a folder you may write to".to_owned(),
        io::ErrorKind::ReadOnlyFilesystem => "the file system is read-only; choose another folder".to_owned(),
        io::ErrorKind::NotFound => "its folder does not exist; create it first".to_owned(),
        _ => error.to_string(),
    }
}
