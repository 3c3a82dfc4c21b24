//! A live source that outlives its connections.

mod mailbox;
mod policy;
mod stats;

pub use policy::Reconnect;
pub use stats::{StreamCounts, StreamStats};

use crate::input::{Cancel, StopHandle, open_within};
use crate::{MediaError, Result, Source, SourceInfo};
use mailbox::{Mailbox, Taken};
use pursuit_imaging::Frame;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Beyond the time that a running stream may be silent: connecting, and waiting for a picture that needs none before it.
const CONNECTING: Duration = Duration::from_secs(15);

/// A clock that goes this much further than ours between two frames has been set anew, seconds.
const LEAP_S: f64 = 10.0;
/// No two frames are of one time, seconds.
const SHORTEST_STEP_S: f64 = 1e-3;

/// When a live source is given up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Patience {
    /// How long a running stream may be silent.
    pub stall: Duration,
    /// For how long it is connected to again after that.
    pub reconnect: Reconnect,
}

impl Default for Patience {
    fn default() -> Self {
        Self { stall: Duration::from_secs(5), reconnect: Reconnect::For(Duration::from_secs(60)) }
    }
}

impl Patience {
    /// How long a connection may take to its first picture.
    pub fn connecting(&self) -> Duration {
        self.stall.saturating_add(CONNECTING)
    }
}

/// Connects anew; what takes long is told how it can be ended.
pub type Connect = Arc<dyn Fn(&Cancel) -> Result<Box<dyn Source>> + Send + Sync>;

/// A live source that is connected to again when it has gone silent or has broken off.
///
/// Frames are numbered on; their times go on by the clock of this machine where a connection was lost, so that whoever
/// follows something knows how long nothing was seen. A frame of another size ends it: nothing that was believed of the
/// old picture holds in the new one. Connections are read on threads of their own, at most one of them listened to.
pub struct Reconnecting {
    connect: Connect,
    patience: Patience,
    info: SourceInfo,
    stats: StreamStats,
    mailbox: Mailbox,
    /// Ends the connection listened to.
    current: Arc<Mutex<Cancel>>,
    clock: Clock,
    trouble: Option<Trouble>,
    next: u64,
    finished: bool,
}

/// Time that goes on from connection to connection.
#[derive(Default)]
struct Clock {
    /// When the last frame came, and its time.
    last: Option<(Instant, f64)>,
    /// What is added to the times of this connection; none before its first frame.
    offset_s: Option<f64>,
}

/// While nothing comes.
struct Trouble {
    began: Instant,
    attempts: u32,
}

impl Reconnecting {
    /// Reads `source`, and what `connect` makes when that has gone.
    ///
    /// # Errors
    /// [`MediaError::Unreadable`] when the system gives no thread.
    pub fn new(source: Box<dyn Source>, connect: Connect, patience: Patience) -> Result<Self> {
        let stats = StreamStats::default();
        let stream = Some(stats.clone());
        let info = SourceInfo { frame_count: None, duration_s: None, seekable: false, stream, ..source.info().clone() };
        let source = Self {
            connect,
            patience,
            info,
            stats,
            mailbox: Mailbox::default(),
            current: Arc::default(),
            clock: Clock::default(),
            trouble: None,
            next: 0,
            finished: false,
        }
        .reading(source)?;
        Ok(source)
    }

    fn reading(mut self, source: Box<dyn Source>) -> Result<Self> {
        let cancel = Cancel::default();
        source.stop_handle().into_iter().for_each(|stop| cancel.by(stop));
        self.listen(cancel, move |_| Ok(source))?;
        Ok(self)
    }

    /// Reads what `open` gives, on a thread of its own, in place of what was read before.
    fn listen(
        &mut self,
        cancel: Cancel,
        open: impl FnOnce(&Cancel) -> Result<Box<dyn Source>> + Send + 'static,
    ) -> Result<()> {
        let number = self.mailbox.next_connection();
        self.clock.offset_s = None;
        let replaced = std::mem::replace(&mut *self.cancel(), cancel.clone());
        replaced.cancel();
        let (mailbox, stats) = (self.mailbox.clone(), self.stats.clone());
        let read = move || match open(&cancel) {
            Ok(source) => pump(source, number, &mailbox, &stats),
            Err(error) => _ = mailbox.put(number, Err(error)),
        };
        let thread = std::thread::Builder::new().name("stream".to_owned()).spawn(read);
        thread.map_err(|e| MediaError::broken(&self.info.name, self.next, format!("no thread to read it on ({e})")))?;
        Ok(())
    }

    fn cancel(&self) -> std::sync::MutexGuard<'_, Cancel> {
        self.current.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn end(&mut self, error: MediaError) -> Result<Option<Frame>> {
        self.finished = true;
        self.cancel().cancel();
        Err(error)
    }

    /// A frame has come: numbers it on, and puts it on the clock.
    fn deliver(&mut self, frame: Frame) -> Result<Option<Frame>> {
        if frame.size() != self.info.size {
            let (now, before) = (frame.size(), self.info.size);
            let reason = format!("the stream came back with {now} pixels, before it had {before}; start anew on it");
            let error = MediaError::broken(&self.info.name, self.next, reason);
            return self.end(error);
        }
        let now = Instant::now();
        if let Some((last, _)) = self.clock.last {
            self.stats.gap(now.duration_since(last));
        }
        if let Some(trouble) = self.trouble.take() {
            self.stats.change(|counts| counts.reconnects += 1);
            let away = now.duration_since(trouble.began).as_secs_f64();
            tracing::warn!("{}: back after {away:.1} s, attempt {}", self.info.name, trouble.attempts);
        }
        let time_s = self.clock.tell(frame.time_s(), now);
        let index = self.next;
        self.next += 1;
        Ok(Some(frame.retimed(index, time_s)))
    }

    /// Nothing more comes from this connection: connects again, or gives up.
    fn lose(&mut self, why: &str) -> Result<(), MediaError> {
        let (now, name) = (Instant::now(), self.info.name.clone());
        let (began, attempts) = self.trouble.as_ref().map_or((now, 0), |t| (t.began, t.attempts));
        if self.trouble.is_some() {
            self.stats.change(|counts| counts.failed_attempts += 1);
            tracing::info!("{name}: attempt {attempts} failed: {why}");
        } else {
            tracing::warn!("{name}: {why}");
        }
        self.cancel().cancel();
        let wait = policy::wait_before(attempts);
        if !self.patience.reconnect.allows(now.duration_since(began).saturating_add(wait)) {
            let tried = match attempts {
                0 => String::new(),
                n => format!(" (attempts to connect again: {n}, in {:.1} s)", now.duration_since(began).as_secs_f64()),
            };
            return Err(MediaError::broken(&name, self.next, format!("{why}{tried}")));
        }
        self.trouble = Some(Trouble { began, attempts: attempts + 1 });
        self.mailbox.pause(wait);
        let (connect, limit) = (self.connect.clone(), self.patience.connecting());
        self.listen(Cancel::default(), move |cancel| open_within(limit, &name, cancel, |cancel| connect(cancel)))
    }
}

impl Clock {
    /// The time of a frame that its connection says is of `time_s`, and that came `now`. A connection's own clock counts
    /// as long as it goes on; where it is new, goes back or leaps, the time since the last frame is taken from ours.
    fn tell(&mut self, time_s: f64, now: Instant) -> f64 {
        let Some((last, last_s)) = self.last else {
            self.offset_s = Some(0.0);
            self.last = Some((now, time_s));
            return time_s;
        };
        let passed_s = now.duration_since(last).as_secs_f64();
        let by_its_own = self.offset_s.map(|offset_s| time_s + offset_s);
        let goes_on = |t: &f64| *t > last_s && *t <= last_s + passed_s + LEAP_S;
        let told_s = by_its_own.filter(goes_on).unwrap_or(last_s + passed_s.max(SHORTEST_STEP_S));
        self.offset_s = Some(told_s - time_s);
        self.last = Some((now, told_s));
        told_s
    }
}

/// Hands on what a connection delivers, until it ends or nobody listens.
fn pump(mut source: Box<dyn Source>, number: u64, mailbox: &Mailbox, stats: &StreamStats) {
    loop {
        let item = source.next_frame();
        if item.as_ref().is_err_and(MediaError::is_damage) {
            // Packets get lost all the time; what matters of it is counted.
            stats.change(|counts| counts.damaged += 1);
            continue;
        }
        let goes_on = matches!(item, Ok(Some(_)));
        if !mailbox.put(number, item) || !goes_on {
            return;
        }
    }
}

impl Source for Reconnecting {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn next_frame(&mut self) -> Result<Option<Frame>> {
        while !self.finished {
            // While connecting, the connection itself says when it took too long.
            let patience = self.trouble.is_none().then_some(self.patience.stall);
            let lost = match self.mailbox.take(patience) {
                Taken::Item(Ok(Some(frame))) => return self.deliver(frame),
                Taken::Item(Ok(None)) | Taken::Stopped => break,
                Taken::Item(Err(error)) => {
                    self.stats.change(|counts| counts.breaks += u64::from(self.trouble.is_none()));
                    self.lose(&reason(error))
                }
                Taken::Silence => {
                    self.stats.change(|counts| counts.stalls += 1);
                    self.lose(&format!("no frame came for {:.1} s", self.patience.stall.as_secs_f64()))
                }
            };
            if let Err(error) = lost {
                return self.end(error);
            }
        }
        self.finished = true;
        Ok(None)
    }

    fn stop_handle(&self) -> Option<StopHandle> {
        let (mailbox, current) = (self.mailbox.clone(), self.current.clone());
        Some(StopHandle::new(move || {
            mailbox.stop();
            let cancel = current.lock().unwrap_or_else(PoisonError::into_inner).clone();
            cancel.cancel();
        }))
    }
}

impl Drop for Reconnecting {
    fn drop(&mut self) {
        self.mailbox.stop();
        self.cancel().cancel();
    }
}

/// What is wrong, without the name: that is said once.
fn reason(error: MediaError) -> String {
    match error {
        MediaError::Unreadable { reason, .. } | MediaError::Broken { reason, .. } => reason,
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_goes_on_whatever_the_connections_say() {
        let began = Instant::now();
        let at = |s: f64| began + Duration::from_secs_f64(s);
        let mut clock = Clock::default();
        let close = |told: f64, wanted: f64| assert!((told - wanted).abs() < 1e-9, "{told} {wanted}");
        close(clock.tell(0.5, at(0.0)), 0.5);
        close(clock.tell(0.54, at(0.1)), 0.54);
        // A connection that is new begins where our clock is.
        clock.offset_s = None;
        close(clock.tell(0.0, at(3.1)), 3.54);
        close(clock.tell(0.04, at(3.2)), 3.58);
        // One that goes back, or leaps.
        close(clock.tell(0.0, at(3.3)), 3.68);
        close(clock.tell(0.04, at(3.4)), 3.72);
        close(clock.tell(99.0, at(3.5)), 3.82);
        close(clock.tell(99.04, at(3.5)), 3.86);
        // Frames that come together are told apart.
        close(clock.tell(99.04, at(3.5)), 3.861);
    }
}
