use super::folder::FolderSource;
use super::image::{ImageSource, JPEG_MAGIC, PNG_MAGIC};
use super::y4m::{self, Y4mSource};
use crate::{MediaError, OpenOptions, Result, Source};
use std::fs::File;
use std::io::{BufReader, ErrorKind, Read};
use std::path::Path;

/// Opens an input: a video file, a folder of images, a single image.
///
/// What it is, is decided by its content: a JPEG named `clip.mp4` is one image.
///
/// # Errors
/// [`MediaError::Unreadable`] naming the input, what is wrong with it, and what would mend it.
pub fn open(input: &str, options: &OpenOptions) -> Result<Box<dyn Source>> {
    if input.is_empty() {
        return Err(MediaError::unreadable("the input", "its name is empty"));
    }
    let path = Path::new(input);
    let metadata = std::fs::metadata(path).map_err(|e| {
        MediaError::unreadable(
            input,
            match e.kind() {
                ErrorKind::NotFound => "there is no such file or folder".to_owned(),
                _ => e.to_string(),
            },
        )
    })?;
    if metadata.is_dir() {
        return Ok(Box::new(FolderSource::list(path, input, options.default_fps)?));
    }
    open_file(path, input, options)
}

/// What a file holds, by its first bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Empty,
    Y4m,
    Mp4,
    Image,
    Other,
}

fn sniff(head: &[u8]) -> Kind {
    match head {
        [] => Kind::Empty,
        _ if head.starts_with(y4m::MAGIC) => Kind::Y4m,
        _ if head.starts_with(JPEG_MAGIC) || head.starts_with(PNG_MAGIC) => Kind::Image,
        [_, _, _, _, kind @ ..] if is_mp4_box(kind) => Kind::Mp4,
        _ => Kind::Other,
    }
}

/// The boxes an MP4 or QuickTime file may begin with.
fn is_mp4_box(bytes: &[u8]) -> bool {
    [b"ftyp", b"moov", b"mdat", b"free", b"skip", b"wide", b"pnot", b"styp", b"moof", b"sidx"]
        .iter()
        .any(|kind| bytes.starts_with(*kind))
}

fn open_file(path: &Path, name: &str, options: &OpenOptions) -> Result<Box<dyn Source>> {
    let unreadable = |e: std::io::Error| MediaError::unreadable(name, e.to_string());
    let mut file = File::open(path).map_err(unreadable)?;
    let mut head = Vec::new();
    file.by_ref().take(16).read_to_end(&mut head).map_err(unreadable)?;
    let reopen = || File::open(path).map_err(unreadable);
    match sniff(&head) {
        Kind::Empty => Err(MediaError::unreadable(name, "the file is empty; record or copy it again")),
        Kind::Y4m => {
            let len = file.metadata().ok().filter(std::fs::Metadata::is_file).map(|m| m.len());
            let reader = BufReader::with_capacity(1 << 16, reopen()?);
            let source = Y4mSource::new(reader, name, len, options.default_fps).map_err(|f| f.unreadable(name))?;
            Ok(Box::new(source))
        }
        Kind::Image => Ok(Box::new(ImageSource::open(path, name).map_err(|f| f.unreadable(name))?)),
        #[cfg(feature = "h264")]
        Kind::Mp4 => {
            let source = super::h264::Mp4Source::new(Box::new(reopen()?), name).map_err(|f| f.unreadable(name))?;
            Ok(Box::new(source))
        }
        _ => Err(MediaError::unreadable(name, "it is no video or image that is decoded here")),
    }
}
