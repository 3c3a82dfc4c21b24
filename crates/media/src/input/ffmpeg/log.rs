use pursuit_imaging::{ColorMatrix, ColorRange};
use std::collections::VecDeque;
use std::io::{BufRead, BufReader, Read};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use crate::input::color::ColorInfo;
use pursuit_address::Locator;

/// Error lines kept for our own message.
const MAX_ERRORS: usize = 3;
/// A longer line of a log is cut: nothing we look for comes that late in one.
const MAX_LINE_BYTES: u64 = 4096;
/// How long to wait for the line that belongs to a frame which has already arrived.
const PATIENCE: Duration = Duration::from_secs(2);

/// What an `ffmpeg` process has said so far.
#[derive(Debug, Default)]
pub(super) struct LogState {
    /// Times of frames not yet taken, in seconds; `None` where ffmpeg knows none.
    times_s: VecDeque<Option<f64>>,
    /// Frames announced so far.
    announced: u64,
    /// The container, in ffmpeg's words.
    pub format: Option<String>,
    pub codec: Option<String>,
    pub has_duration: bool,
    /// How the file announces itself.
    announcement: Announcement,
    /// How long the last frame is shown, seconds, where ffmpeg knows.
    pub last_shown_s: Option<f64>,
    pub color: ColorInfo,
    /// The last errors, oldest first.
    errors: VecDeque<String>,
    /// The frame that was next when a decoder first complained about its data.
    pub damaged_at: Option<u64>,
    /// Whether its reader of MP4 went past pictures on the way to the index, and could not go back to them.
    pub passed_by: bool,
    closed: bool,
    about: Option<Locator>,
}

/// What a file says of its length before its first frame.
#[derive(Debug, Default)]
struct Announcement {
    /// Of the whole file, seconds.
    whole_s: Option<f64>,
    /// Of its video, seconds.
    video_s: Option<f64>,
    streams: usize,
    /// Whether what comes now is said of the video.
    of_video: bool,
    complete: bool,
}

impl Announcement {
    fn hear(&mut self, line: &str) {
        self.complete |= line.contains("Stream mapping:") || line.contains("Output #0");
        if self.complete {
        } else if let Some(stream) = after(line, "Stream #0:") {
            self.streams += 1;
            self.of_video = stream.contains(": Video: ");
        } else if let Some(text) = after(line, "Duration: ") {
            self.whole_s = seconds(text);
        } else if let Some((name, value)) = line.split_once(':').filter(|_| self.of_video)
            && name.trim_end().ends_with("DURATION")
        {
            self.video_s = seconds(value.trim_start());
        }
    }

    /// How long the video is said to be; of a file with sound as well nothing is known but what it says of the video.
    fn seconds(&self) -> Option<f64> {
        self.video_s.or(self.whole_s.filter(|_| self.streams == 1))
    }
}

/// Seconds from `HH:MM:SS.fraction`.
fn seconds(text: &str) -> Option<f64> {
    let text = text.split([',', ' ']).next()?;
    text.split(':').try_fold(0.0, |sum, part| Some(60.0 * sum + part.parse::<f64>().ok()?))
}

/// The log of a process, read on its own thread so that a full pipe never stops the process.
#[derive(Clone)]
pub(super) struct Log(Arc<(Mutex<LogState>, Condvar)>);

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
    pub fn said(&self) -> MutexGuard<'_, LogState> {
        self.0.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The time of the next frame in seconds, which has been read from the pipe already.
    pub fn next_time_s(&self) -> Option<f64> {
        let waiting = |said: &mut LogState| said.times_s.is_empty() && !said.closed;
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

impl LogState {
    fn hear(&mut self, line: &str) {
        self.announcement.hear(line);
        let by_filter = line.contains("Parsed_showinfo");
        if by_filter || is_of_frame(line) {
            self.hear_frame(line);
        }
        if by_filter {
            return;
        }
        if let Some(text) = ["[error] ", "[fatal] ", "[panic] "].iter().find_map(|tag| after(line, tag)) {
            self.hear_error(text);
        } else if let Some(text) = after(line, "[warning] ").filter(|text| text.contains("corrupt")) {
            self.hear_error(text);
        } else if let Some(text) = after(line, "[info] ").filter(|text| text.starts_with("concealing ")) {
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

    /// How long the file says that it is, seconds: with its sound, where it says nothing of the video alone.
    pub fn announced_s(&self) -> Option<f64> {
        self.announcement.video_s.or(self.announcement.whole_s)
    }

    /// How long the video is, seconds, as far as the file says.
    pub fn length_s(&self) -> Option<f64> {
        self.announcement.seconds()
    }

    fn hear_frame(&mut self, line: &str) {
        let color = ColorInfo { matrix: after(line, "color_space:").and_then(matrix), range: full_range(line) };
        self.color = color.or(self.color);
        if let Some(time) = after(line, "pts_time:") {
            let time = time.split_ascii_whitespace().next().and_then(|t| t.parse().ok());
            self.times_s.push_back(time.filter(|t: &f64| t.is_finite()));
            let shown_s = after(line, "duration_time:").and_then(|t| t.split_ascii_whitespace().next()?.parse().ok());
            self.last_shown_s = shown_s.filter(|s: &f64| s.is_finite() && *s >= 0.0);
            self.announced += 1;
        }
    }

    fn hear_error(&mut self, text: &str) {
        // What sound files say as well: a stream that is cut out of a longer one, and times that no muxer likes.
        const HARMLESS: [&str; 4] = ["co located POCs", "mmco:", "monotonically increasing", "Last message repeated"];
        if HARMLESS.iter().any(|sign| text.contains(sign)) {
            return;
        }
        self.damaged_at.get_or_insert(self.announced);
        self.passed_by |= self.announced == 0 && text.starts_with("stream ") && text.ends_with(": partial file");
        let text = self.about.as_ref().map_or_else(|| text.to_owned(), |about| about.redact(text));
        if self.errors.back().is_none_or(|last| *last != text) {
            if self.errors.len() == MAX_ERRORS {
                self.errors.pop_front();
            }
            self.errors.push_back(text);
        }
    }
}

/// Whether it says `n: 3 pts: 90 pts_time:0.09 …`, with or without the filter's name before it: ffmpeg's threads write
/// their lines in pieces, so one can stand within another's.
fn is_of_frame(line: &str) -> bool {
    line.split_once(" pts_time:").and_then(|(before, _)| before.rsplit_once("n:")).is_some_and(|(_, text)| {
        let mut words = text.split_ascii_whitespace();
        let number = words.next().is_some_and(|word| word.parse::<u64>().is_ok());
        number && words.next().is_some_and(|word| word.starts_with("pts:"))
    })
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
    fn a_frame_is_heard_within_the_line_of_another_thread() {
        let text = "[vost#0:0 @ 0x5] [warning] Non-monotonic DTS; previous: 1, current: 1; \
            n:   3 pts:     90 pts_time:0.09    duration:     30 duration_time:0.03    fmt:yuvj420p type:P \
            changing to 2. This may result in incorrect timestamps in the output file.\n\
            [Parsed_showinfo_1 @ 0x1] [info] n:   4 pts:    160 pts_time:0.16    duration:     90 duration_time:0.09\n\
            [h264 @ 0x2] [error] cannot decode n:   5 pts:    250 pts_time:0.25    duration:     90 a block\n\
            [info]     title           : pts_time:7 n: x pts: pts_time:8\n";
        let log = Log::follow(text.as_bytes(), None).unwrap();
        assert!(log.errors().unwrap().starts_with("cannot decode"));
        let times = std::array::from_fn(|_| log.next_time_s());
        assert_eq!(times, [Some(0.09), Some(0.16), Some(0.25), None]);
        assert_eq!(log.said().color.range, Some(ColorRange::Full));
    }

    #[test]
    fn the_length_is_that_of_the_video() {
        let heard = |text: &str| {
            let log = Log::follow(std::io::Cursor::new(text.to_owned()), None).unwrap();
            log.errors();
            log.said().length_s()
        };
        let one = "[info]   Duration: 01:01:20.50, start: 0.000000\n[info]   Stream #0:0: Video: h264\n";
        assert_eq!(heard(one), Some(3680.5));
        let sound = "[info]   Stream #0:1: Audio: aac\n[info]       DURATION        : 00:00:19.5\n";
        assert_eq!(heard(&format!("{one}{sound}")), None);
        let video = "[info]       DURATION        : 00:00:20.000000000\n";
        assert_eq!(heard(&format!("{one}{video}{sound}")), Some(20.0));
        assert_eq!(heard(&format!("{one}[info] Stream mapping:\n[info] Stream #0:0: Video: x\n")), Some(3680.5));
        assert_eq!(heard("[info]   Duration: N/A, bitrate: 3 kb/s\n[info]   Stream #0:0: Video: h264\n"), None);
    }

    #[test]
    fn a_file_with_sound_says_about_how_long_it_is() {
        let video = "[info]   Duration: 01:01:20.50, start: 0.000000\n[info]   Stream #0:0: Video: h264\n";
        let sound = "[info]   Stream #0:1: Audio: aac\n";
        let log = Log::follow(std::io::Cursor::new(format!("{video}{sound}")), None).unwrap();
        log.errors();
        assert_eq!(log.said().announced_s(), Some(3680.5));
        assert_eq!(log.said().length_s(), None);
    }

    #[test]
    fn every_complaint_is_damage_but_those_of_sound_files() {
        for (line, damaged) in [
            ("[in#0/matroska,webm @ 0x5] [error] File ended prematurely", true),
            ("[http @ 0x5] [error] Stream ends prematurely at 4, should be 9", true),
            ("[in#0/mov @ 0x5] [warning] Packet corrupt (stream = 0, dts = 93696).", true),
            ("[h264 @ 0x5] [info] concealing 114 DC, 114 AC, 114 MV errors in P frame", true),
            ("[h264 @ 0x5] [error] mmco: unref short failure", false),
            ("[vost#0:0] [error] Application provided invalid, non monotonically increasing dts to muxer", false),
            ("[swscaler @ 0x5] [warning] deprecated pixel format used", false),
        ] {
            let log = Log::follow(std::io::Cursor::new(format!("{line}\n")), None).unwrap();
            let errors = log.errors();
            assert_eq!((log.said().damaged_at, errors.is_some()), (damaged.then_some(0), damaged), "{line}");
        }
    }

    #[test]
    fn pictures_that_were_passed_by_are_noticed_before_the_first() {
        let heard = |text: &'static str| {
            let log = Log::follow(text.as_bytes(), None).unwrap();
            log.errors();
            log.said().passed_by
        };
        assert!(heard("[mov,mp4 @ 0x1] [error] stream 0, offset 0x30: partial file\n"));
        assert!(!heard("[mov,mp4 @ 0x1] [error] moov atom not found\n"));
        let after_one = "[Parsed_showinfo_1 @ 0x1] [info] n:   0 pts:      0 pts_time:0.04 duration: 1 fmt:yuv420p\n\
            [mov,mp4 @ 0x1] [error] stream 0, offset 0x30: partial file\n";
        assert!(!heard(after_one));
    }

    #[test]
    fn errors_tell_no_secret() {
        let text = "[in#0 @ 0x1] [error] Impossible to open 'rtsp://user:sesame@camera/1'\n";
        let log = Log::follow(text.as_bytes(), Some(Locator::new("rtsp://user:sesame@camera/1"))).unwrap();
        assert_eq!(log.errors().unwrap(), "Impossible to open 'rtsp://user:***@camera/1'");
    }
}
