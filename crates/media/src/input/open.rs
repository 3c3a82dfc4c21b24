use super::annotations::{self, Annotated, LIST_NAME};
use super::avi::AviSource;
use super::cancel::Cancel;
use super::fault::Fault;
use super::ffmpeg::{FfmpegSource, Target};
use super::folder::FolderSource;
use super::image::ImageSource;
use super::mjpeg::{self, MjpegSource};
use super::rgbd;
use super::sniff::{Kind, describe, sniff};
use super::streams;
use super::y4m::Y4mSource;
use crate::{MediaError, OpenOptions, Result, Source};
use pursuit_address::Locator;
use std::fs::File;
use std::io::{BufReader, Cursor, ErrorKind, Read};
use std::path::{Path, PathBuf};

/// Opens an input as the user wrote it:
///
/// - a video file, with the truth in `NAME.csv` beside it where there is one; what it is, is decided by its content, so
///   that a JPEG named `clip.mp4` is one image;
/// - a folder with `frames.csv`, a folder with `depth/` beside `rgb/` or `color/` (Princeton, CDTB, DepthTrack), or a folder of JPEG or PNG images in natural order; a single image;
/// - an MCAP file or the folder of a ROS 2 bag with images (feature `mcap`; bags of SQLite: `db3`); of several topics the one named, `bag.mcap?topic=/camera/image`;
/// - `-` for Y4M or Motion JPEG on standard input;
/// - `camera:0` or a video device; `rtsp://`, `http://`, `https://` and other streams `ffmpeg` knows.
///
/// # Errors
/// [`MediaError::Unreadable`] naming the input, what is wrong with it, and what would mend it.
pub fn open(input: impl Into<Locator>, options: &OpenOptions) -> Result<Box<dyn Source>> {
    open_at(&input.into(), options)
}

fn open_at(locator: &Locator, options: &OpenOptions) -> Result<Box<dyn Source>> {
    let input = locator.reveal();
    if input.is_empty() {
        return Err(MediaError::unreadable("the input", "its name is empty"));
    }
    if input == "-" {
        return open_stream(Box::new(std::io::stdin()), "standard input", options);
    }
    if let Some(camera) = camera(input)? {
        return streams::open(&camera, "a camera", input, options);
    }
    if let Some(stream) = Target::stream(input) {
        let name = locator.to_string();
        return streams::open(&stream, "a network stream", &name, options);
    }
    if let Some(recording) = recording(input)? {
        return Ok(recording);
    }
    let path = locator.path();
    let input = &*locator.to_string();
    let metadata = std::fs::metadata(path).map_err(|e| MediaError::unreadable(input, io_reason(&e)))?;
    let unreadable = |e: std::io::Error| MediaError::unreadable(input, io_reason(&e));
    if metadata.is_dir() {
        if let Some(bag) = bag(path, input)? {
            return Ok(bag);
        }
        return Ok(if path.join(LIST_NAME).is_file() {
            Box::new(annotations::open_list(path, input, options)?)
        } else if let Some((images, depth)) = rgbd::parts(path) {
            Box::new(rgbd::open_folders(&images, &depth, input, options)?)
        } else {
            Box::new(FolderSource::list(path, input, options.default_fps)?)
        });
    }
    if metadata.is_file() {
        open_file(path, input, options)
    } else {
        open_stream(Box::new(File::open(path).map_err(unreadable)?), input, options)
    }
}

/// Opens Y4M or Motion JPEG that comes from a pipe.
///
/// # Errors
/// [`MediaError::Unreadable`] when it is neither, or ends before its first frame.
pub fn open_stream(mut reader: Box<dyn Read + Send>, name: &str, options: &OpenOptions) -> Result<Box<dyn Source>> {
    let mut head = Vec::new();
    reader.by_ref().take(16).read_to_end(&mut head).map_err(|e| MediaError::unreadable(name, e.to_string()))?;
    let kind = sniff(&head);
    let reader = BufReader::with_capacity(1 << 16, Cursor::new(head).chain(reader));
    let fps = options.default_fps;
    let source: Result<Box<dyn Source>, Fault> = match kind {
        Kind::Y4m => Y4mSource::new(reader, name, None, fps).map(|s| Box::new(s) as _),
        Kind::Jpeg => MjpegSource::new(reader, name, fps).map(|s| Box::new(s) as _),
        Kind::Empty => Err(Fault::malformed("nothing came")),
        _ => Err(Fault::malformed(
            "it is neither Y4M nor Motion JPEG; convert it on the way, for example with ffmpeg -i INPUT -f yuv4mpegpipe -",
        )),
    };
    source.map_err(|fault| fault.unreadable(name))
}

/// Opens a regular file by its content.
fn open_file(path: &Path, name: &str, options: &OpenOptions) -> Result<Box<dyn Source>> {
    let unreadable = |e: std::io::Error| MediaError::unreadable(name, io_reason(&e));
    let mut file = File::open(path).map_err(unreadable)?;
    let len = file.metadata().map_err(unreadable)?.len();
    let mut head = Vec::new();
    file.by_ref().take(1 << 14).read_to_end(&mut head).map_err(unreadable)?;
    let truth = annotations::truth_beside(path)?;
    let file = File::open(path).map_err(unreadable)?;
    let fps = options.default_fps;
    let source = match sniff(&head) {
        Kind::Playlist => {
            let reason = "it is a playlist, which names other media; name those themselves";
            return Err(MediaError::unreadable(name, reason));
        }
        Kind::Empty => return Err(MediaError::unreadable(name, "the file is empty; record or copy it again")),
        Kind::Y4m => Y4mSource::new(BufReader::with_capacity(1 << 16, file), name, Some(len), fps).map(boxed),
        Kind::Jpeg => open_jpeg(path, name, fps),
        #[cfg(feature = "mcap")]
        Kind::Mcap => Ok(boxed(super::mcap::McapSource::open(path, name, None)?)),
        #[cfg(not(feature = "mcap"))]
        Kind::Mcap => return Err(MediaError::unreadable(name, WITHOUT_MCAP)),
        #[cfg(feature = "db3")]
        Kind::Sqlite => Ok(boxed(super::mcap::McapSource::open(path, name, None)?)),
        #[cfg(not(feature = "db3"))]
        Kind::Sqlite => {
            let reason = format!("it is a database, such as older bags of ROS 2 are; {}", super::sniff::WITHOUT_DB3);
            return Err(MediaError::unreadable(name, reason));
        }
        Kind::Png => ImageSource::open(path, name).map(boxed),
        Kind::Avi => AviSource::new(Box::new(file), name).map(boxed),
        #[cfg(feature = "h264")]
        Kind::Mp4 => super::mp4::Mp4Source::new(Box::new(file), name)
            .map(|s| boxed(super::fallback::Mp4WithFallback::new(s, path, options))),
        _ if is_notes(path, &head) => {
            let reason = "it is text, no footage; name the video or the folder of images that it belongs to";
            return Err(MediaError::unreadable(name, reason));
        }
        _ => Err(Fault::unsupported(describe(&head))),
    };
    let source = match source {
        Ok(source) => source,
        Err(Fault::Unsupported(what)) => open_with_ffmpeg(path, &what, name, options)?,
        Err(fault) => return Err(fault.unreadable(name)),
    };
    Ok(match truth {
        Some(truth) => Box::new(Annotated::new(source, truth)),
        None => source,
    })
}

/// Why an MCAP file is not read.
#[cfg(not(feature = "mcap"))]
const WITHOUT_MCAP: &str = "it is an MCAP file, which this build does not read; build with `--features mcap`";

/// A file of which one topic is asked for: `bag.mcap?topic=/camera/image`.
#[cfg(feature = "mcap")]
fn recording(input: &str) -> Result<Option<Box<dyn Source>>> {
    // A file may be called so.
    if Path::new(input).exists() {
        return Ok(None);
    }
    let Some((path, topic)) = super::mcap::split_topic(input) else { return Ok(None) };
    let path = Path::new(path);
    std::fs::metadata(path).map_err(|e| MediaError::unreadable(input, io_reason(&e)))?;
    super::mcap::McapSource::open(path, input, Some(topic)).map(|source| Some(boxed(source)))
}

#[cfg(not(feature = "mcap"))]
fn recording(input: &str) -> Result<Option<Box<dyn Source>>> {
    match input.split_once("?topic=") {
        Some((path, _)) if path.ends_with(".mcap") => Err(MediaError::unreadable(input, WITHOUT_MCAP)),
        _ => Ok(None),
    }
}

/// A folder that is a ROS 2 bag.
#[cfg(feature = "mcap")]
fn bag(path: &Path, name: &str) -> Result<Option<Box<dyn Source>>> {
    if !super::mcap::is_bag(path) {
        return Ok(None);
    }
    super::mcap::McapSource::open(path, name, None).map(|source| Some(boxed(source)))
}

#[cfg(not(feature = "mcap"))]
fn bag(path: &Path, name: &str) -> Result<Option<Box<dyn Source>>> {
    let has_mcap = |entry: std::fs::DirEntry| entry.path().extension().is_some_and(|e| e == "mcap");
    let is_bag = path.join("metadata.yaml").is_file();
    let has_any = || std::fs::read_dir(path).is_ok_and(|entries| entries.flatten().any(has_mcap));
    if is_bag && has_any() { Err(MediaError::unreadable(name, WITHOUT_MCAP)) } else { Ok(None) }
}

/// Whether a file is what stands beside footage: a truth, a trajectory, a configuration.
fn is_notes(path: &Path, head: &[u8]) -> bool {
    let named = path
        .extension()
        .and_then(|e| e.to_str())
        .is_some_and(|e| ["csv", "json", "jsonl", "toml", "txt"].iter().any(|known| e.eq_ignore_ascii_case(known)));
    named && head.iter().all(|byte| !byte.is_ascii_control() || byte.is_ascii_whitespace())
}

/// One photograph, or Motion JPEG without a container.
fn open_jpeg(path: &Path, name: &str, fps: f64) -> Result<Box<dyn Source>, Fault> {
    let reader = || File::open(path).map(|file| BufReader::with_capacity(1 << 16, file));
    if mjpeg::is_stream(&mut reader()?) {
        MjpegSource::new(reader()?, name, fps).map(boxed)
    } else {
        ImageSource::open(path, name).map(boxed)
    }
}

/// A file that is not decoded here; `what` says in words what that is.
fn open_with_ffmpeg(path: &Path, what: &str, name: &str, options: &OpenOptions) -> Result<Box<dyn Source>> {
    let program = options.find_ffmpeg().ok_or_else(|| Fault::no_ffmpeg(what).unreadable(name))?;
    let target = Target::File(path.to_owned());
    let source = FfmpegSource::open(&program, &target, name, options, &Cancel::default());
    source.map(boxed).map_err(|fault| fault.unreadable(name))
}

/// `camera:N`, or a video device by its path.
fn camera(input: &str) -> Result<Option<Target>> {
    let device = match input.strip_prefix("camera:") {
        Some(number) if number.parse::<u8>().is_ok() && cfg!(target_os = "macos") => {
            return Ok(Some(Target::Camera(number.into())));
        }
        Some(number) if number.parse::<u8>().is_ok() => PathBuf::from(format!("/dev/video{number}")),
        Some(_) => return Err(MediaError::unreadable(input, "a camera is named by its number, as in camera:0")),
        None if input.starts_with("/dev/video") => PathBuf::from(input),
        None => return Ok(None),
    };
    if device.exists() {
        return Ok(Some(Target::Camera(device)));
    }
    let mut found: Vec<_> = std::fs::read_dir("/dev")
        .into_iter()
        .flatten()
        .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
        .filter(|name| name.starts_with("video"))
        .collect();
    found.sort();
    let found = if found.is_empty() { "no video device at all".to_owned() } else { found.join(", ") };
    Err(MediaError::unreadable(input, format!("there is no {}; in /dev there is {found}", device.display())))
}

fn io_reason(error: &std::io::Error) -> String {
    match error.kind() {
        ErrorKind::NotFound => "there is no such file or folder".to_owned(),
        ErrorKind::PermissionDenied => "it may not be read; check its permissions".to_owned(),
        _ => error.to_string(),
    }
}

fn boxed<S: Source + 'static>(source: S) -> Box<dyn Source> {
    Box::new(source)
}
