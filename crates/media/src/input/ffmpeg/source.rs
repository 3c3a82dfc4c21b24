use super::command::{Dialect, Target};
use super::log::Log;
use crate::input::color::ColorInfo;
use crate::input::fault::Fault;
use crate::input::source::StopHandle;
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
    finished: bool,
}

impl FfmpegSource {
    /// Starts `program` on `target` and waits for the first frame.
    pub fn open(program: &Path, target: &Target, name: &str, options: &OpenOptions) -> Result<Self, Fault> {
        match Self::start(program, target, name, options, Dialect::Current) {
            Err(Fault::Malformed(reason)) if is_old_version(&reason) => {
                Self::start(program, target, name, options, Dialect::Before5_1)
            }
            other => other,
        }
    }

    fn start(program: &Path, target: &Target, name: &str, options: &OpenOptions, d: Dialect) -> Result<Self, Fault> {
        let (process, stdout, log) = Process::start(program, target, d)?;
        let mut reader = match Y4mReader::new(BufReader::with_capacity(1 << 20, stdout)) {
            Ok(reader) => reader,
            Err(fault) => return Err(process.failure(&log).unwrap_or(fault.into())),
        };
        let first = reader
            .next_planes()
            .map_err(Fault::from)
            .and_then(|p| p.ok_or_else(|| Fault::malformed("it has no frames")));
        let first = first.map_err(|fault| process.failure(&log).unwrap_or(fault))?;
        let said = log.said();
        let codec = said.codec.clone().unwrap_or_else(|| "unknown codec".to_owned());
        let live = target.is_live_stream(said.format.as_deref(), said.codec.as_deref(), said.has_duration);
        drop(said);
        let info = SourceInfo {
            name: name.to_owned(),
            size: Size::new(reader.header.size.width, reader.header.size.height),
            fps: reader.header.fps,
            frame_count: None,
            live: options.live.unwrap_or(live),
            decoder: format!("ffmpeg: {codec}"),
            truth: None,
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
            finished: false,
        })
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

    /// ffmpeg conceals damage and goes on; a live stream loses packets all the time, a file should not.
    fn damage(&self) -> Option<(u64, Fault)> {
        let frame = self.log.said().damaged_at.filter(|_| !self.info.live)?;
        let errors = self.log.errors().unwrap_or_default();
        Some((frame, Fault::malformed(format!("the file is damaged (ffmpeg: {errors})"))))
    }
}

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
    fn start(program: &Path, target: &Target, dialect: Dialect) -> Result<(Self, ChildStdout, Log), Fault> {
        let script = target.script();
        let started = Command::new(program)
            .args(target.arguments(dialect))
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
