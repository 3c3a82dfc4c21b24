use super::command::{Dialect, Target, Waiting};
use super::log::Log;
use crate::input::Cancel;
use crate::input::color::ColorInfo;
use crate::input::fault::Fault;
use crate::input::source::{StopHandle, not_square};
use crate::input::y4m::pixels;
use crate::{OpenOptions, Result, Source, SourceInfo};
use pursuit_containers::y4m::{Planes, Y4mReader};
use pursuit_geometry::Size;
use pursuit_imaging::Frame;
use std::io::{BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Stdio};
use std::sync::{Arc, Mutex, PoisonError};

/// Frames from an `ffmpeg` process.
pub(crate) struct FfmpegSource {
    process: Process,
    reader: Y4mReader<BufReader<ChildStdout>>,
    log: Log,
    info: SourceInfo,
    /// Read when opening, so that what cannot be read is known at once.
    first: Option<Planes>,
    next: u64,
    /// ffmpeg's time of the first frame, which becomes 0.
    origin_s: Option<f64>,
    last_s: Option<f64>,
    step_s: f64,
    /// Whether it runs in real time, whatever it is taken for.
    is_live: bool,
    /// Whether it can only end by a failure.
    never_ends: bool,
    /// The bytes of the file, where it is one.
    file_bytes: Option<u64>,
    finished: bool,
}

/// Why there is no first frame: `fault`, or what is behind it. An MP4 whose index comes last is read from its end; a web server that
/// sends whole files only cannot be asked to go back.
fn refusal(target: &Target, log: &Log, fault: Fault) -> Fault {
    if target.is_web() && log.said().passed_by {
        return Fault::malformed(
            "its index (moov) comes behind the pictures, and the server sends no parts of a file (byte ranges), so nobody can go back to \
             them; download the file, or move its index to the front: ffmpeg -i IN.mp4 -c copy -movflags +faststart OUT.mp4",
        );
    }
    fault
}

impl FfmpegSource {
    /// Starts `program` on `target` and waits for the first frame.
    pub fn open(
        program: &Path,
        target: &Target,
        name: &str,
        options: &OpenOptions,
        cancel: &Cancel,
    ) -> Result<Self, Fault> {
        let start = |dialect| {
            let process = Process::start(program, target, dialect, Waiting::of(options.patience), cancel)?;
            Self::start(process, target, name, options)
        };
        match start(Dialect::Current) {
            Err(Fault::Malformed(reason)) if is_old_version(&reason) => start(Dialect::Before5_1),
            other => other,
        }
    }

    fn start(
        (process, stdout, log): (Process, ChildStdout, Log),
        target: &Target,
        name: &str,
        options: &OpenOptions,
    ) -> Result<Self, Fault> {
        let mut reader = match Y4mReader::new(BufReader::with_capacity(1 << 20, stdout)) {
            Ok(reader) => reader,
            Err(fault) => return Err(refusal(target, &log, process.failure(&log).unwrap_or(fault.into()))),
        };
        let first = reader
            .next_planes()
            .map_err(Fault::from)
            .and_then(|p| p.ok_or_else(|| Fault::malformed("it has no frames")));
        let first = first.map_err(|fault| refusal(target, &log, process.failure(&log).unwrap_or(fault)))?;
        let said = log.said();
        let codec = said.codec.clone().unwrap_or_else(|| "unknown codec".to_owned());
        let live = target.is_live_stream(said.format.as_deref(), said.codec.as_deref(), said.has_duration);
        let never_ends = target.never_ends(said.format.as_deref(), live);
        let duration_s = said.announced_s().filter(|_| !live);
        drop(said);
        let size = Size::new(reader.header.size.width, reader.header.size.height);
        let info = SourceInfo {
            fps: reader.header.fps,
            duration_s,
            live: options.live.unwrap_or(live),
            pixel_aspect: not_square(reader.header.pixel_aspect),
            ..SourceInfo::new(name, size, format!("ffmpeg: {codec}"))
        };
        let step_s = 1.0 / info.fps.unwrap_or(options.default_fps);
        Ok(Self {
            process,
            reader,
            log,
            info,
            first: Some(first),
            next: 0,
            origin_s: None,
            last_s: None,
            step_s,
            is_live: live,
            never_ends,
            file_bytes: target.file_bytes(),
            finished: false,
        })
    }

    /// Whether it runs in real time, whatever it is taken for.
    pub const fn is_live(&self) -> bool {
        self.is_live
    }

    fn read_frame(&mut self) -> Result<Option<Frame>, (u64, Fault)> {
        let planes = match self.first.take() {
            Some(planes) => Ok(Some(planes)),
            None => self.reader.next_planes(),
        };
        match planes {
            Ok(Some(planes)) => {
                let time_s = self.time_s();
                let header = &self.reader.header;
                let color = self.log.said().color.or(ColorInfo::of_range(header.full_range));
                let pixels = pixels(planes, header.size, color).map_err(|fault| (self.next, fault))?;
                let frame = Frame::new(self.next, time_s, pixels);
                self.next += 1;
                Ok(Some(frame))
            }
            Ok(None) => match self.process.failure(&self.log) {
                Some(fault) => Err((self.next, fault)),
                None if self.is_live => self.end_of_stream(),
                None => self.damage().map_or(Ok(None), Err),
            },
            Err(fault) => Err((self.next, self.process.failure(&self.log).unwrap_or(fault.into()))),
        }
    }

    fn time_s(&mut self) -> f64 {
        let told = self.log.next_time_s().map(|t| t - *self.origin_s.get_or_insert(t));
        let guess = self.last_s.map_or(0.0, |last| last + self.step_s);
        let time_s = told.unwrap_or(guess);
        self.last_s = Some(time_s);
        time_s
    }

    /// A camera does not end. A playlist does where its server says so, and nothing was amiss.
    fn end_of_stream(&self) -> Result<Option<Frame>, (u64, Fault)> {
        match self.log.errors() {
            None if !self.never_ends => Ok(None),
            None => Err((self.next, Fault::malformed("the stream ended"))),
            Some(errors) => Err((self.next, Fault::malformed(format!("the stream ended (ffmpeg: {errors})")))),
        }
    }

    /// ffmpeg conceals damage and goes on; a live stream loses packets all the time, a file should not. Nor should it end
    /// before it says.
    fn damage(&self) -> Option<(u64, Fault)> {
        let damaged_at = self.log.said().damaged_at;
        if let Some(frame) = damaged_at {
            let errors = self.log.errors().unwrap_or_default();
            return Some((frame, Fault::malformed(format!("the file is damaged (ffmpeg: {errors})"))));
        }
        let said = self.log.said();
        let is_transport = said.format.as_deref() == Some("mpegts");
        if is_transport && self.file_bytes.is_some_and(|bytes| PACKETS.iter().all(|packet| bytes % packet != 0)) {
            return Some((
                self.next,
                Fault::malformed("the file ends within a packet; it may not have been copied to its end"),
            ));
        }
        let (length_s, last_s) = (said.length_s()?, self.last_s?);
        let end_s = last_s + said.last_shown_s.unwrap_or_default().max(self.step_s);
        let ends_early = length_s - end_s > LENGTH_TOLERANCE_S.max(LENGTH_TOLERANCE * length_s);
        let reason = || format!("the file says that it is {length_s:.2} s long, and ends after {end_s:.2} s");
        ends_early.then(|| (self.next, Fault::malformed(reason())))
    }
}

/// Bytes of a packet of a transport stream: as broadcast, on discs, with error correction.
const PACKETS: [u64; 3] = [188, 192, 204];
/// How much shorter than it says a sound file may be, seconds.
const LENGTH_TOLERANCE_S: f64 = 0.5;
/// The same as a part of its length.
const LENGTH_TOLERANCE: f64 = 0.02;

impl Source for FfmpegSource {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn next_frame(&mut self) -> Result<Option<Frame>> {
        if self.finished {
            return Ok(None);
        }
        let frame = self.read_frame();
        self.finished = !matches!(frame, Ok(Some(_)));
        frame.map_err(|(index, fault)| fault.broken(&self.info.name, index))
    }

    fn stop_handle(&self) -> Option<StopHandle> {
        let child = self.process.child.clone();
        Some(StopHandle::new(move || kill(&child)))
    }
}

/// Versions before 5.1 do not know today's option names.
fn is_old_version(reason: &str) -> bool {
    reason.contains("fps_mode") || reason.contains("'checksum'")
}

/// A child process that does not outlive us.
struct Process {
    child: Arc<Mutex<Child>>,
}

impl Process {
    fn start(
        program: &Path,
        target: &Target,
        dialect: Dialect,
        waiting: Waiting,
        cancel: &Cancel,
    ) -> Result<(Self, ChildStdout, Log), Fault> {
        let script = target.script(waiting);
        let started = Command::new(program)
            .args(target.arguments(dialect, waiting))
            .stdin(if script.is_some() { Stdio::piped() } else { Stdio::null() })
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn();
        let cannot = |e| Fault::malformed(format!("{} cannot be started ({e})", program.display()));
        let mut child = started.map_err(cannot)?;
        if let Some((script, mut stdin)) = script.zip(child.stdin.take()) {
            // A process that is gone already says why itself.
            _ = stdin.write_all(script.as_bytes());
        }
        let pipes = child.stdout.take().zip(child.stderr.take());
        let process = Self { child: Arc::new(Mutex::new(child)) };
        let child = process.child.clone();
        cancel.by(StopHandle::new(move || kill(&child)));
        let (stdout, stderr) = pipes.ok_or_else(|| Fault::malformed("ffmpeg's output cannot be read"))?;
        let log = Log::follow(stderr, target.locator().cloned())?;
        Ok((process, stdout, log))
    }

    /// Ends the process, whose output has ended or can no longer be understood; why it failed, if it did.
    fn failure(&self, log: &Log) -> Option<Fault> {
        // The log closes when the process goes; one that still runs after that wait is of no use any more.
        let errors = log.errors();
        let mut child = self.child.lock().unwrap_or_else(PoisonError::into_inner);
        let status = match child.try_wait() {
            Ok(Some(status)) => status,
            _ => {
                _ = child.kill();
                child.wait().ok()?
            }
        };
        let reason = || errors.unwrap_or_else(|| format!("it stopped with {status}"));
        (!status.success()).then(|| Fault::malformed(format!("ffmpeg: {}", reason())))
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        kill(&self.child);
    }
}

/// Ends the process if it still runs, and waits so that nothing of it is left.
fn kill(child: &Mutex<Child>) {
    let mut child = child.lock().unwrap_or_else(PoisonError::into_inner);
    // Both fail only when the process has already gone.
    _ = child.kill();
    _ = child.wait();
}
