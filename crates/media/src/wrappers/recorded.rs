use crate::input::StopHandle;
use crate::{MediaError, Result, Source, SourceInfo};
use png::{BitDepth, ColorType, Encoder};
use pursuit_imaging::{Frame, ImageView, Pixels};
use std::borrow::Cow;
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

/// What is done with every frame before it is handed on.
type Record = Box<dyn FnMut(&Frame) -> Result<()> + Send>;

/// Shows every frame to a recorder on its way.
pub struct Recorded<S> {
    source: S,
    record: Record,
}

impl<S: Source> Recorded<S> {
    /// Calls `record` with every frame; its error ends the reading.
    pub fn new(source: S, record: impl FnMut(&Frame) -> Result<()> + Send + 'static) -> Self {
        Self { source, record: Box::new(record) }
    }

    /// Writes every frame as `000000.png`, named by its number, into `folder`, which is created.
    ///
    /// # Errors
    /// [`MediaError::Unwritable`] when the folder cannot be created.
    pub fn to_folder(source: S, folder: &Path) -> Result<Self> {
        std::fs::create_dir_all(folder).map_err(|e| unwritable(folder, &e))?;
        let folder: PathBuf = folder.to_owned();
        Ok(Self::new(source, move |frame| write_png(frame, &folder.join(format!("{:06}.png", frame.index())))))
    }
}

impl<S: Source> Source for Recorded<S> {
    fn info(&self) -> &SourceInfo {
        self.source.info()
    }

    fn next_frame(&mut self) -> Result<Option<Frame>> {
        let frame = self.source.next_frame()?;
        frame.iter().try_for_each(&mut self.record)?;
        Ok(frame)
    }

    fn seek(&mut self, index: u64) -> Result<()> {
        self.source.seek(index)
    }

    fn stop_handle(&self) -> Option<StopHandle> {
        self.source.stop_handle()
    }
}

/// Writes a frame as PNG: grey stays grey with its depth, colour becomes 8-bit RGB.
///
/// # Errors
/// [`MediaError::Unwritable`] when the file cannot be written.
pub fn write_png(frame: &Frame, path: &Path) -> Result<()> {
    let (color, depth, bytes) = match frame.pixels() {
        Pixels::Gray8(image) => (ColorType::Grayscale, BitDepth::Eight, bytes_of(image.view())),
        Pixels::Gray16(image) => {
            let bytes = image.view().rows().flatten().flat_map(|v| v.to_be_bytes()).collect();
            (ColorType::Grayscale, BitDepth::Sixteen, Cow::Owned(bytes))
        }
        Pixels::Rgb8(_) | Pixels::Yuv420(_) => {
            let bytes = frame.color().rows().flat_map(<[_]>::as_flattened).copied().collect();
            (ColorType::Rgb, BitDepth::Eight, Cow::Owned(bytes))
        }
    };
    let file = File::create(path).map_err(|e| unwritable(path, &e))?;
    // Sides are at most 32 768, so they fit.
    let (width, height) = (frame.size().width as u32, frame.size().height as u32);
    let mut encoder = Encoder::new(BufWriter::new(file), width, height);
    encoder.set_color(color);
    encoder.set_depth(depth);
    let written = encoder.write_header().and_then(|mut writer| {
        writer.write_image_data(&bytes)?;
        writer.finish()
    });
    written.map_err(|e| unwritable(path, &e))
}

/// The pixels row by row, copied only where rows have gaps between them.
fn bytes_of(image: ImageView<'_, u8>) -> Cow<'_, [u8]> {
    image.as_contiguous().map_or_else(|| Cow::Owned(image.to_image().into_vec()), Cow::Borrowed)
}

fn unwritable(path: &Path, error: &dyn std::error::Error) -> MediaError {
    MediaError::Unwritable { name: path.display().to_string(), reason: error.to_string() }
}
