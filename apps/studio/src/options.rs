use pursuit::media::{Locator, OpenOptions};
use std::path::PathBuf;
use std::time::Duration;

/// How long a trial that nobody looks at stays open, unless told otherwise.
const PATIENCE: Duration = Duration::from_secs(120);

/// A box that was drawn, for whoever asked for one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Picked {
    /// The number of the frame it was drawn in.
    pub frame: u64,
    /// The box, in pixels of the input.
    pub bbox: pursuit::BBox,
}

/// How a studio is opened.
#[derive(Debug, Clone)]
pub struct Options {
    /// The input that the page opens at once, if any; the only one that need not lie below [`root`](Self::root).
    pub input: Option<Locator>,
    /// The name or address to listen at. Anything but the loopback makes a token necessary.
    pub host: String,
    /// The port; 0 for any that is free.
    pub port: u16,
    /// The folder that files named by the page must lie in, symbolic links resolved.
    pub root: PathBuf,
    /// Whether the first box that is drawn is all that is wanted; see [`Server::pick`](crate::Server::pick).
    pub pick: bool,
    /// How long a trial stays open that nobody looks at; what was done in it is kept in its folder.
    pub patience: Duration,
    /// How inputs are opened.
    pub open: OpenOptions,
}

impl Default for Options {
    /// The loopback, a free port, files of the current folder.
    fn default() -> Self {
        let (host, root) = ("127.0.0.1".to_owned(), PathBuf::from("."));
        Self { input: None, host, port: 0, root, pick: false, patience: PATIENCE, open: OpenOptions::default() }
    }
}
