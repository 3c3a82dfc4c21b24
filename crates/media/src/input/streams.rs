//! Cameras and network streams: opened within a bounded time, and connected to again when they break off.

use super::cancel::{Cancel, open_within};
use super::fault::Fault;
use super::ffmpeg::{FfmpegSource, Target};
#[cfg(feature = "rtsp")]
use super::rtsp::RtspSource;
use crate::wrappers::{Connect, Reconnecting};
use crate::{OpenOptions, Result, Source};
use std::path::PathBuf;
use std::sync::Arc;

/// Opens a camera or a stream; `words` say what it is.
pub(super) fn open(target: &Target, words: &str, name: &str, options: &OpenOptions) -> Result<Box<dyn Source>> {
    let patience = options.patience;
    let connector = Connector {
        target: target.clone(),
        words: words.to_owned(),
        program: options.find_ffmpeg(),
        name: name.to_owned(),
        options: options.clone(),
    };
    let mut live = false;
    let first = open_within(patience.connecting(), name, &Cancel::default(), |cancel| {
        let connection = connector.connect(cancel)?;
        live = connection.live;
        Ok(connection.source)
    })?;
    if !live {
        return Ok(first);
    }
    let connect: Connect = Arc::new(move |cancel| Ok(connector.connect(cancel)?.source));
    Ok(Box::new(Reconnecting::new(first, connect, patience)?))
}

/// What it takes to connect.
struct Connector {
    target: Target,
    words: String,
    program: Option<PathBuf>,
    name: String,
    options: OpenOptions,
}

struct Connection {
    source: Box<dyn Source>,
    /// Whether it runs in real time, whatever it is taken for.
    live: bool,
}

impl Connector {
    fn connect(&self, cancel: &Cancel) -> Result<Connection> {
        let connected = match self.in_this_process(cancel) {
            Some(Err(Fault::Unsupported(what))) => {
                tracing::info!("{}: {what} is not decoded here; trying ffmpeg", self.name);
                self.by_ffmpeg(cancel)
            }
            Some(connected) => connected,
            None => self.by_ffmpeg(cancel),
        };
        connected.map_err(|fault| fault.unreadable(&self.name))
    }

    fn by_ffmpeg(&self, cancel: &Cancel) -> Result<Connection, Fault> {
        let program = self.program.as_deref().ok_or_else(|| Fault::no_ffmpeg(&self.words))?;
        let source = FfmpegSource::open(program, &self.target, &self.name, &self.options, cancel)?;
        Ok(Connection { live: source.is_live(), source: Box::new(source) })
    }

    /// RTSP, where this build can.
    #[cfg(feature = "rtsp")]
    fn in_this_process(&self, cancel: &Cancel) -> Option<Result<Connection, Fault>> {
        let locator = self.target.locator().filter(|_| self.target.is_rtsp() && !self.options.rtsp_by_ffmpeg)?;
        let live = self.options.live.unwrap_or(true);
        Some(RtspSource::open(locator, live, cancel).map(|s| Connection { source: Box::new(s), live: true }))
    }

    #[cfg(not(feature = "rtsp"))]
    fn in_this_process(&self, _: &Cancel) -> Option<Result<Connection, Fault>> {
        None
    }
}
