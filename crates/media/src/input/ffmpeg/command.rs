use crate::wrappers::{Patience, Reconnect};
use pursuit_address::Locator;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// What an `ffmpeg` process is to read.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Target {
    File(PathBuf),
    Stream { url: Locator, scheme: Scheme },
    Camera(PathBuf),
}

/// A kind of network stream: its name, what it may in turn open, and whether it always runs in real time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Scheme {
    name: &'static str,
    protocols: &'static str,
    live: bool,
}

/// What ffmpeg is told about waiting, in its own units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Waiting {
    /// How long a web server may be silent, microseconds.
    silence_us: u128,
    /// The longest wait before a web address is asked again for the rest of a file, seconds; its waits double from 1.
    longest_wait_s: u64,
}

impl Waiting {
    pub fn of(patience: Patience) -> Self {
        let limit_s = match patience.reconnect {
            Reconnect::Never => 0,
            Reconnect::For(limit) => limit.as_secs(),
            Reconnect::Forever => 2 * MAX_LONGEST_WAIT_S,
        };
        Self { silence_us: patience.stall.as_micros().max(1), longest_wait_s: (limit_s / 2).min(MAX_LONGEST_WAIT_S) }
    }
}

/// More makes no sense: ffmpeg then waits for two hours in all.
const MAX_LONGEST_WAIT_S: u64 = 3600;

const SCHEMES: [Scheme; 8] = [
    Scheme { name: "http", protocols: "http,https,tcp,tls,httpproxy,crypto", live: false },
    Scheme { name: "https", protocols: "http,https,tcp,tls,httpproxy,crypto", live: false },
    Scheme { name: "rtsp", protocols: "rtsp,rtp,srtp,udp,tcp,tls,crypto", live: true },
    Scheme { name: "rtsps", protocols: "rtsp,rtp,srtp,udp,tcp,tls,crypto", live: true },
    Scheme { name: "rtmp", protocols: "rtmp,tcp", live: true },
    Scheme { name: "rtmps", protocols: "rtmps,tls,tcp", live: true },
    Scheme { name: "srt", protocols: "srt,udp", live: true },
    Scheme { name: "udp", protocols: "udp", live: true },
];

/// How many frames ffmpeg may hold back to guess the rate of a live stream by; its own 20 and more are a second without a picture.
const GUESSED_BY: &str = "3";

impl Scheme {
    /// Options of its protocol. A web file is asked for on from where it broke off.
    fn options(&self, waiting: Waiting) -> Vec<(&'static str, String)> {
        let once = waiting.longest_wait_s == 0;
        match self.name {
            "rtsp" | "rtsps" => vec![("rtsp_transport", "tcp".to_owned()), ("fpsprobesize", GUESSED_BY.to_owned())],
            "http" | "https" if once => vec![("rw_timeout", waiting.silence_us.to_string())],
            "http" | "https" => vec![
                ("rw_timeout", waiting.silence_us.to_string()),
                ("reconnect", "1".to_owned()),
                ("reconnect_delay_max", waiting.longest_wait_s.to_string()),
            ],
            _ => vec![("fpsprobesize", GUESSED_BY.to_owned())],
        }
    }
}

/// How the found `ffmpeg` wants its options: they were renamed in version 5.1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Dialect {
    Current,
    Before5_1,
}

impl Target {
    /// A network address, where `input` is one. None has control characters in it.
    pub fn stream(input: &str) -> Option<Self> {
        if input.chars().any(char::is_control) {
            return None;
        }
        let (name, rest) = input.split_once("://")?;
        let scheme = SCHEMES.into_iter().find(|s| s.name.eq_ignore_ascii_case(name))?;
        (!rest.is_empty()).then(|| Self::Stream { url: Locator::new(input), scheme })
    }

    /// Whether it always runs in real time; of web addresses only ffmpeg can tell.
    pub const fn is_live(&self) -> bool {
        match self {
            Self::File(_) => false,
            Self::Stream { scheme, .. } => scheme.live,
            Self::Camera(_) => true,
        }
    }

    /// Whether it comes from a web server.
    pub fn is_web(&self) -> bool {
        matches!(self, Self::Stream { scheme, .. } if scheme.name.starts_with("http"))
    }

    /// How long it is, where it is a file.
    pub fn file_bytes(&self) -> Option<u64> {
        match self {
            Self::File(path) => Some(path.metadata().ok()?.len()),
            Self::Stream { .. } | Self::Camera(_) => None,
        }
    }

    /// Whether it can only end by a failure: all that is live but a live playlist, whose end a server can announce.
    pub fn never_ends(&self, format: Option<&str>, live: bool) -> bool {
        live && format != Some("hls")
    }

    /// Whether it speaks RTSP without encryption.
    #[cfg(feature = "rtsp")]
    pub fn is_rtsp(&self) -> bool {
        matches!(self, Self::Stream { scheme, .. } if scheme.name == "rtsp")
    }

    /// What may be printed of it, and of what ffmpeg says of it.
    pub fn locator(&self) -> Option<&Locator> {
        match self {
            Self::Stream { url, .. } => Some(url),
            Self::File(_) | Self::Camera(_) => None,
        }
    }

    /// Whether it runs in real time, given what ffmpeg has said of it. A web address is a file, unless it is a live
    /// playlist or a camera's Motion JPEG.
    pub fn is_live_stream(&self, format: Option<&str>, codec: Option<&str>, has_duration: bool) -> bool {
        let Self::Stream { url, scheme } = self else { return self.is_live() };
        let path = url.reveal().split(['?', '#']).next().unwrap_or_default();
        let by_name = path.to_ascii_lowercase().ends_with(".m3u8");
        scheme.live
            || match format {
                // Behind a script nothing is known of the container.
                Some("concat") | None => by_name || codec == Some("mjpeg"),
                Some("hls") => !has_duration,
                Some(other) => other.contains("mpjpeg"),
            }
    }

    /// What ffmpeg is to read from its standard input: an address with credentials must not stand among the arguments,
    /// which every user of the machine can list. A script for ffmpeg's `concat` names it instead.
    pub(super) fn script(&self, waiting: Waiting) -> Option<String> {
        let Self::Stream { url, scheme } = self else { return None };
        let quoted = url.reveal().replace('\'', r"'\''");
        let options = scheme.options(waiting);
        let options: String = options.iter().map(|(name, value)| format!("option {name} {value}\n")).collect();
        url.has_secrets().then(|| format!("ffconcat version 1.0\nfile '{quoted}'\n{options}"))
    }

    /// The whole argument vector. Nothing of the input can be taken for an option: files have `file:` before their name,
    /// addresses their scheme.
    pub(super) fn arguments(&self, dialect: Dialect, waiting: Waiting) -> Vec<OsString> {
        let mut all: Vec<OsString> = Vec::new();
        let mut push = |words: &[&str]| all.extend(words.iter().map(OsString::from));
        push(&["-hide_banner", "-nostdin", "-nostats", "-loglevel", "level+info"]);
        match self {
            Self::File(path) => {
                push(&["-protocol_whitelist", "file,crypto,data", "-i"]);
                all.push(prefixed("file:", path));
            }
            Self::Stream { url, scheme } => {
                if scheme.live {
                    push(&["-fflags", "nobuffer", "-flags", "low_delay"]);
                }
                if url.has_secrets() {
                    let protocols = format!("pipe,fd,{}", scheme.protocols);
                    push(&["-protocol_whitelist", &protocols, "-f", "concat", "-safe", "0", "-i", "pipe:0"]);
                } else {
                    scheme.options(waiting).iter().for_each(|(name, value)| push(&[&format!("-{name}"), value]));
                    push(&["-protocol_whitelist", scheme.protocols, "-i", url.reveal()]);
                }
            }
            Self::Camera(device) => {
                let format = if cfg!(target_os = "macos") { "avfoundation" } else { "v4l2" };
                push(&["-fflags", "nobuffer", "-f", format, "-i"]);
                all.push(device.into());
            }
        }
        let mut push = |words: &[&str]| all.extend(words.iter().map(OsString::from));
        let formats = "format=yuv420p|yuvj420p|gray|gray16le";
        match dialect {
            Dialect::Current => push(&["-vf", &format!("{formats},showinfo=checksum=0"), "-fps_mode", "passthrough"]),
            Dialect::Before5_1 => push(&["-vf", &format!("{formats},showinfo"), "-vsync", "passthrough"]),
        }
        push(&["-map", "0:V:0", "-an", "-sn", "-dn", "-strict", "-1", "-f", "yuv4mpegpipe", "pipe:1"]);
        all
    }
}

fn prefixed(prefix: &str, path: &Path) -> OsString {
    let mut text = OsString::from(prefix);
    text.push(path);
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    fn waiting() -> Waiting {
        Waiting::of(Patience::default())
    }

    #[test]
    fn web_files_are_asked_for_again_as_long_as_wanted() {
        let words = |reconnect| {
            let patience = Patience { stall: Duration::from_millis(1500), reconnect };
            let words = Target::stream("http://h/a.mkv").unwrap().arguments(Dialect::Current, Waiting::of(patience));
            words.iter().map(|w| w.to_string_lossy().into_owned()).collect::<Vec<_>>().join(" ")
        };
        assert!(words(Reconnect::Never).contains("-rw_timeout 1500000 -protocol_whitelist"));
        let some = words(Reconnect::For(Duration::from_secs(60)));
        assert!(some.contains("-reconnect 1 -reconnect_delay_max 30 "), "{some}");
        assert!(words(Reconnect::Forever).contains("-reconnect_delay_max 3600 "));
    }

    #[test]
    fn no_input_becomes_an_option() {
        let words = Target::File("-y".into()).arguments(Dialect::Current, waiting());
        assert!(words.contains(&OsString::from("file:-y")) && !words.contains(&OsString::from("-y")));
        assert_eq!(Target::stream("-i://x"), None);
        assert_eq!(Target::stream("concat://x"), None);
        assert_eq!(Target::stream("rtsp://"), None);
        assert!(Target::stream("RTSP://camera/1").unwrap().is_live());
        assert!(!Target::stream("http://host/clip.mp4").unwrap().is_live());
        assert_eq!(Target::stream("http://host/\nfile x"), None);
    }

    #[test]
    fn credentials_are_no_arguments() {
        let plain = Target::stream("rtsp://camera/1").unwrap();
        let words = plain.arguments(Dialect::Current, waiting());
        assert!(words.contains(&"rtsp://camera/1".into()) && words.contains(&"-rtsp_transport".into()));
        assert_eq!(plain.script(waiting()), None);
        let secret = Target::stream("rtsp://user:se'same@camera/1").unwrap();
        let words = secret.arguments(Dialect::Current, waiting());
        assert!(words.iter().all(|w| !w.to_string_lossy().contains("same")), "{words:?}");
        assert_eq!(
            secret.script(waiting()).unwrap(),
            "ffconcat version 1.0\nfile 'rtsp://user:se'\\''same@camera/1'\noption rtsp_transport tcp\noption fpsprobesize 3\n"
        );
        assert_eq!(format!("{:?}", secret.locator().unwrap()), "\"rtsp://user:***@camera/1\"");
    }

    #[test]
    fn web_addresses_are_files_unless_they_go_on_for_ever() {
        let live =
            |url: &str, format, codec, duration| Target::stream(url).unwrap().is_live_stream(format, codec, duration);
        assert!(!live("http://h/a.mkv", Some("matroska,webm"), Some("vp9"), false));
        assert!(!live("http://h/a.avi", Some("avi"), Some("mjpeg"), true));
        assert!(live("http://h/a.m3u8", Some("hls"), Some("h264"), false));
        assert!(!live("http://h/a.m3u8", Some("hls"), Some("h264"), true));
        assert!(live("http://h/cam", Some("mpjpeg"), Some("mjpeg"), false));
        assert!(live("http://h/a.m3u8?x=1", Some("concat"), Some("h264"), false));
        assert!(live("http://h/cam", Some("concat"), Some("mjpeg"), false));
        assert!(!live("http://h/a.mp4", Some("concat"), Some("h264"), false));
        assert!(live("rtsp://h/a", Some("rtsp"), Some("h264"), true));
    }
}
