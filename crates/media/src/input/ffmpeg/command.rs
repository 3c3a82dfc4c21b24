use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// What an `ffmpeg` process is to read.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Target {
    File(PathBuf),
    Stream { url: String, scheme: Scheme },
    Camera(PathBuf),
}

/// A kind of network stream: its name, what it may in turn open, and whether it always runs in real time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Scheme {
    name: &'static str,
    protocols: &'static str,
    live: bool,
}

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

/// How the found `ffmpeg` wants its options: they were renamed in version 5.1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Dialect {
    Current,
    Before5_1,
}

impl Target {
    /// A network address, where `input` is one.
    pub fn stream(input: &str) -> Option<Self> {
        let (name, rest) = input.split_once("://")?;
        let scheme = SCHEMES.into_iter().find(|s| s.name.eq_ignore_ascii_case(name))?;
        (!rest.is_empty()).then(|| Self::Stream { url: input.to_owned(), scheme })
    }

    /// Whether it always runs in real time; of web addresses only ffmpeg can tell.
    pub const fn is_live(&self) -> bool {
        match self {
            Self::File(_) => false,
            Self::Stream { scheme, .. } => scheme.live,
            Self::Camera(_) => true,
        }
    }

    pub const fn is_web(&self) -> bool {
        matches!(self, Self::Stream { scheme, .. } if !scheme.live)
    }

    /// The whole argument vector. Nothing of the input can be taken for an option: files have `file:` before their name,
    /// addresses their scheme.
    pub(super) fn arguments(&self, dialect: Dialect) -> Vec<OsString> {
        let mut all: Vec<OsString> = Vec::new();
        let mut push = |words: &[&str]| all.extend(words.iter().map(OsString::from));
        push(&["-hide_banner", "-nostdin", "-nostats", "-loglevel", "level+info"]);
        match self {
            Self::File(path) => {
                push(&["-protocol_whitelist", "file,crypto,data", "-i"]);
                all.push(prefixed("file:", path));
            }
            Self::Stream { url, scheme } => {
                if scheme.name.starts_with("rtsp") {
                    push(&["-rtsp_transport", "tcp"]);
                }
                if scheme.live {
                    push(&["-fflags", "nobuffer", "-flags", "low_delay"]);
                } else {
                    push(&["-rw_timeout", "20000000"]);
                }
                push(&["-protocol_whitelist", scheme.protocols, "-i", url]);
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

    #[test]
    fn no_input_becomes_an_option() {
        let words = Target::File("-y".into()).arguments(Dialect::Current);
        assert!(words.contains(&OsString::from("file:-y")) && !words.contains(&OsString::from("-y")));
        assert_eq!(Target::stream("-i://x"), None);
        assert_eq!(Target::stream("concat://x"), None);
        assert_eq!(Target::stream("rtsp://"), None);
        assert!(Target::stream("RTSP://camera/1").unwrap().is_live());
        assert!(!Target::stream("http://host/clip.mp4").unwrap().is_live());
    }
}
