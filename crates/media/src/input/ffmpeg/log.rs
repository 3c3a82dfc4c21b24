use pursuit_imaging::{ColorMatrix, ColorRange};
use std::collections::VecDeque;
use std::io::{BufRead, BufReader, Read};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use crate::input::Locator;
use crate::input::color::ColorInfo;

/// Error lines kept for our own message.
const MAX_ERRORS: usize = 3;
/// A longer line of a log is cut: nothing we look for comes that late in one.
const MAX_LINE_BYTES: u64 = 4096;
/// How long to wait for the line that belongs to a frame which has already arrived.
const PATIENCE: Duration = Duration::from_secs(2);

/// What an `ffmpeg` process has said so far.
#[derive(Debug, Default)]
pub(super) struct Said {
    /// Times of frames not yet taken, in seconds; `None` where ffmpeg knows none.
    times_s: VecDeque<Option<f64>>,
    /// Frames announced so far.
    announced: u64,
    /// The container, in ffmpeg's words.
    pub format: Option<String>,
    pub codec: Option<String>,
    pub has_duration: bool,
    pub color: ColorInfo,
    /// The last errors, oldest first.
    errors: VecDeque<String>,
    /// The frame that was next when a decoder first complained about its data.
    pub damaged_at: Option<u64>,
    closed: bool,
    about: Option<Locator>,
}

/// The log of a process, read on its own thread so that a full pipe never stops the process.
#[derive(Clone)]
pub(super) struct Log(Arc<(Mutex<Said>, Condvar)>);

impl Log {
    /// Starts reading; `about` is what the process reads, whose secrets are kept out of the errors.
    pub fn follow(stderr: impl Read + Send + 'static, about: Option<Locator>) -> std::io::Result<Self> {
        let log = Self(Arc::default());
        log.said().about = about;
        let writer = log.clone();
        std::thread::Builder::new().name("ffmpeg log".to_owned()).spawn(move || writer.read(stderr))?;
        Ok(log)
    }

    fn read(&self, stderr: impl Read) {
        let mut reader = BufReader::new(stderr);
        let mut line = Vec::new();
        while matches!(reader.by_ref().take(MAX_LINE_BYTES).read_until(b'\n', &mut line), Ok(1..)) {
            self.said().hear(String::from_utf8_lossy(&line).trim_end());
            self.0.1.notify_all();
            line.clear();
        }
        self.said().closed = true;
        self.0.1.notify_all();
    }

    /// What was said so far.
    pub fn said(&self) -> MutexGuard<'_, Said> {
        self.0.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The time of the next frame in seconds, which has been read from the pipe already.
    pub fn next_time_s(&self) -> Option<f64> {
        let waiting = |said: &mut Said| said.times_s.is_empty() && !said.closed;
        let waited = self.0.1.wait_timeout_while(self.said(), PATIENCE, waiting);
        waited.unwrap_or_else(PoisonError::into_inner).0.times_s.pop_front().flatten()
    }

    /// The errors, in one line, once the process has closed its log.
    pub fn errors(&self) -> Option<String> {
        let waited = self.0.1.wait_timeout_while(self.said(), PATIENCE, |said| !said.closed);
        let said = waited.unwrap_or_else(PoisonError::into_inner).0;
        (!said.errors.is_empty()).then(|| said.errors.iter().cloned().collect::<Vec<_>>().join("; "))
    }
}

impl Said {
    fn hear(&mut self, line: &str) {
        if line.contains("Parsed_showinfo") {
            self.hear_frame(line);
        } else if let Some(text) = ["[error] ", "[fatal] ", "[panic] "].iter().find_map(|tag| after(line, tag)) {
            self.hear_error(text);
        } else if let Some(text) = after(line, "[warning] ").filter(|text| text.contains("corrupt decoded frame")) {
            self.hear_error(text);
        } else if self.codec.is_none()
            && let Some(text) = after(line, "Video: ")
        {
            self.codec = text.split([' ', ',']).next().map(str::to_owned);
        } else if let Some(text) = after(line, "Input #0, ") {
            self.format = text.rsplit_once(", from ").map(|(format, _)| format.to_owned());
        } else if let Some(text) = after(line, "Duration: ") {
            self.has_duration |= !text.starts_with("N/A");
        }
    }

    fn hear_frame(&mut self, line: &str) {
        let color = ColorInfo { matrix: after(line, "color_space:").and_then(matrix), range: full_range(line) };
        self.color = color.or(self.color);
        if let Some(time) = after(line, "pts_time:") {
            let time = time.split_ascii_whitespace().next().and_then(|t| t.parse().ok());
            self.times_s.push_back(time.filter(|t: &f64| t.is_finite()));
            self.announced += 1;
        }
    }

    fn hear_error(&mut self, text: &str) {
        const DAMAGE: [&str; 6] =
            ["Invalid data", "corrupt", "partial file", "error while decoding", "Error submitting", "truncat"];
        if DAMAGE.iter().any(|sign| text.contains(sign)) {
            self.damaged_at.get_or_insert(self.announced);
        }
        let text = self.about.as_ref().map_or_else(|| text.to_owned(), |about| about.redact(text));
        if self.errors.back().is_none_or(|last| *last != text) {
            if self.errors.len() == MAX_ERRORS {
                self.errors.pop_front();
            }
            self.errors.push_back(text);
        }
    }
}

fn after<'a>(line: &'a str, tag: &str) -> Option<&'a str> {
    line.split_once(tag).map(|(_, rest)| rest)
}

fn matrix(text: &str) -> Option<ColorMatrix> {
    match text.split_ascii_whitespace().next()? {
        "bt709" => Some(ColorMatrix::Bt709),
        "bt470bg" | "smpte170m" | "fcc" => Some(ColorMatrix::Bt601),
        _ => None,
    }
}

fn full_range(line: &str) -> Option<ColorRange> {
    let full = line.contains("color_range:pc") || line.contains("fmt:yuvj420p");
    full.then_some(ColorRange::Full)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_codec_and_errors_are_found() {
        let text = "[info] Input #0, matroska,webm, from 'file:x':\n\
            [info]   Duration: 00:00:01.00, start: 0.000000, bitrate: 9 kb/s\n\
            [info]   Stream #0:0: Video: vp9 (Profile 0), yuv420p(tv, bt709), 64x48\n\
            [Parsed_showinfo_1 @ 0x1] [info] n:   0 pts:      0 pts_time:0.04 duration: 1 fmt:yuv420p\n\
            [Parsed_showinfo_1 @ 0x1] [info] color_range:pc color_space:bt709 color_primaries:bt709\n\
            [vp9 @ 0x2] [error] Invalid data found when processing input\n\
            [Parsed_showinfo_1 @ 0x1] [info] n:   1 pts:      2 pts_time:0.14 duration: 1 fmt:yuv420p\n";
        let log = Log::follow(text.as_bytes(), None).unwrap();
        assert_eq!(log.errors().unwrap(), "Invalid data found when processing input");
        assert_eq!((log.next_time_s(), log.next_time_s(), log.next_time_s()), (Some(0.04), Some(0.14), None));
        let said = log.said();
        assert_eq!((said.codec.as_deref(), said.has_duration, said.damaged_at), (Some("vp9"), true, Some(1)));
        assert_eq!(said.format.as_deref(), Some("matroska,webm"));
        let color = ColorInfo { matrix: Some(ColorMatrix::Bt709), range: Some(ColorRange::Full) };
        assert_eq!(said.color, color);
    }

    #[test]
    fn errors_tell_no_secret() {
        let text = "[in#0 @ 0x1] [error] Impossible to open 'rtsp://user:sesame@camera/1'\n";
        let log = Log::follow(text.as_bytes(), Some(Locator::new("rtsp://user:sesame@camera/1"))).unwrap();
        assert_eq!(log.errors().unwrap(), "Impossible to open 'rtsp://user:***@camera/1'");
    }
}
