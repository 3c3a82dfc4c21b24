use crate::depth::DepthOptions;
use crate::wrappers::Patience;
use std::ffi::OsString;
use std::path::PathBuf;

/// How to open an input. `OpenOptions::default()` decodes what is built in and knows no `ffmpeg`;
/// [`OpenOptions::from_env`] finds one as a shell would.
#[derive(Debug, Clone, PartialEq)]
pub struct OpenOptions {
    /// The `ffmpeg` executable to use for everything that is not built in.
    pub ffmpeg: Option<PathBuf>,
    /// Whether RTSP is left to `ffmpeg` also where this build speaks it.
    pub rtsp_by_ffmpeg: bool,
    /// Where to look for `ffmpeg` when none is named: the value of the caller's `PATH`.
    pub search_path: Option<OsString>,
    /// Frames per second of inputs that state no rate: image folders, Motion JPEG on standard input, `frames.csv`.
    pub default_fps: f64,
    /// Whether streams and cameras run in real time, so that frames which come while the caller is busy are dropped; by
    /// default what they are decides.
    pub live: Option<bool>,
    /// When streams and cameras that have gone silent are given up.
    pub patience: Patience,
    /// How depth images are to be read, where an input has some.
    pub depth: DepthOptions,
}

impl Default for OpenOptions {
    fn default() -> Self {
        Self {
            ffmpeg: None,
            rtsp_by_ffmpeg: false,
            search_path: None,
            default_fps: 30.0,
            live: None,
            patience: Patience::default(),
            depth: DepthOptions::default(),
        }
    }
}

impl OpenOptions {
    /// The defaults with what this process's environment says of `ffmpeg`: the executable in `PURSUIT_FFMPEG`, else the
    /// search path in `PATH`. The only place where the library reads the environment.
    #[allow(clippy::disallowed_methods, reason = "its purpose; whoever wants no environment builds the options")]
    pub fn from_env() -> Self {
        let ffmpeg = std::env::var_os("PURSUIT_FFMPEG").filter(|name| !name.is_empty()).map(Into::into);
        Self { ffmpeg, search_path: std::env::var_os("PATH"), ..Self::default() }
    }

    /// The `ffmpeg` to use: the one named, else the first on the search path.
    pub fn find_ffmpeg(&self) -> Option<PathBuf> {
        let name = if cfg!(windows) { "ffmpeg.exe" } else { "ffmpeg" };
        self.ffmpeg.clone().or_else(|| {
            let directories = std::env::split_paths(self.search_path.as_ref()?);
            directories.map(|d| d.join(name)).find(|p| p.is_file())
        })
    }
}
