use crate::input::StopHandle;
use crate::{MediaError, Result, Source, SourceInfo};
use pursuit_imaging::Frame;
use std::collections::VecDeque;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;

/// Decodes ahead on a thread of its own, through a queue of bounded length.
///
/// A source that can wait is made to wait when the queue is full. One that cannot ([`SourceInfo::live`]) loses its oldest
/// queued frame instead, so that what comes out is never older than the queue is long; [`PrefetchStats`] counts them.
/// Errors come out in their place, after the frames before them. Dropping ends the thread as soon as the frame it is
/// decoding is finished, without waiting for it; a source that has a [`StopHandle`] is stopped at once.
pub struct Prefetch {
    shared: Arc<Shared>,
    info: SourceInfo,
    stop: Option<StopHandle>,
    thread: Option<JoinHandle<()>>,
}

#[derive(Default)]
struct Shared {
    state: Mutex<State>,
    /// Something was put in, or nothing more will be.
    filled: Condvar,
    /// Something was taken out, or nobody wants any more.
    drained: Condvar,
    stats: PrefetchStats,
}

#[derive(Default)]
struct State {
    queue: VecDeque<Result<Frame>>,
    /// Whether somebody waits for a frame.
    asked: bool,
    finished: bool,
    unwanted: bool,
    /// Whether the thread has ended.
    gone: bool,
    /// Where to go before the next frame is decoded.
    seek: Option<u64>,
}

/// Running counts of a [`Prefetch`], shared: clones see later changes.
#[derive(Debug, Clone, Default)]
pub struct PrefetchStats(Arc<Counters>);

#[derive(Debug, Default)]
struct Counters {
    decoded: AtomicU64,
    dropped: AtomicU64,
}

impl PrefetchStats {
    /// Frames decoded so far.
    pub fn decoded_frames(&self) -> u64 {
        self.0.decoded.load(Ordering::Relaxed)
    }

    /// Frames of a live source that were dropped because nobody took them in time.
    pub fn dropped_frames(&self) -> u64 {
        self.0.dropped.load(Ordering::Relaxed)
    }
}

impl Prefetch {
    /// Starts decoding `source` at most `capacity` frames ahead. With 0 a frame is decoded when it is asked for, while whoever
    /// asks waits: both together keep one processor busy. Of a live source one frame is kept at least.
    ///
    /// # Errors
    /// [`MediaError::Unreadable`] when the system gives no thread.
    pub fn new(source: Box<dyn Source>, capacity: usize) -> Result<Self> {
        let shared = Arc::new(Shared::default());
        let (info, stop) = (source.info().clone(), source.stop_handle());
        let (live, seekable, in_step) = (info.live, info.seekable, capacity == 0 && !info.live);
        let producer = Producer { shared: shared.clone(), capacity: capacity.max(1), in_step, live, seekable };
        let thread = std::thread::Builder::new().name("decoder".to_owned()).spawn(move || producer.run(source));
        let thread = thread.map_err(|e| MediaError::unreadable(&info.name, format!("no thread to decode on ({e})")))?;
        Ok(Self { shared, info, stop, thread: Some(thread) })
    }

    /// Counts that stay readable after the source has been given away.
    pub fn stats(&self) -> PrefetchStats {
        self.shared.stats.clone()
    }
}

impl Source for Prefetch {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn next_frame(&mut self) -> Result<Option<Frame>> {
        let waiting = |state: &mut State| state.queue.is_empty() && !state.finished;
        let mut state = self.shared.lock();
        if waiting(&mut state) {
            state.asked = true;
            self.shared.drained.notify_one();
        }
        let waited = self.shared.filled.wait_while(state, waiting);
        let mut state = waited.unwrap_or_else(PoisonError::into_inner);
        // A source that can be entered anywhere keeps its thread when it has come to its end.
        let at_end = state.finished && self.info.seekable && !state.gone;
        let (item, unwanted) = (state.queue.pop_front(), state.unwanted || at_end);
        drop(state);
        self.shared.drained.notify_one();
        match item {
            Some(item) => item.map(Some),
            // Stopped from outside: the thread may be waiting for a source that never says anything again.
            None if unwanted => Ok(None),
            // The thread has ended; only a defect in a decoder makes it end by a panic.
            None => match self.thread.take().map(JoinHandle::join) {
                Some(Err(_)) => {
                    let frame = self.stats().decoded_frames();
                    Err(MediaError::broken(&self.info.name, frame, "the decoder failed; please report this file"))
                }
                _ => Ok(None),
            },
        }
    }

    fn seek(&mut self, index: u64) -> Result<()> {
        if !self.info.seekable {
            return Err(MediaError::not_seekable(&self.info.name, index, "it can only be read from front to back"));
        }
        self.info.check_seek(index)?;
        let mut state = self.shared.lock();
        if state.unwanted || state.gone {
            return Err(MediaError::not_seekable(&self.info.name, index, "it has been stopped"));
        }
        state.queue.clear();
        (state.seek, state.finished) = (Some(index), false);
        drop(state);
        self.shared.drained.notify_one();
        Ok(())
    }

    fn stop_handle(&self) -> Option<StopHandle> {
        let (shared, inner) = (Arc::downgrade(&self.shared), self.stop.clone());
        Some(StopHandle::new(move || {
            if let Some(shared) = shared.upgrade() {
                shared.end();
            }
            inner.iter().for_each(StopHandle::stop);
        }))
    }
}

impl Drop for Prefetch {
    fn drop(&mut self) {
        self.shared.end();
        self.stop.iter().for_each(StopHandle::stop);
    }
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Nobody wants any more frames, not even those decoded ahead: wakes the thread, and whoever waits for it.
    fn end(&self) {
        let mut state = self.lock();
        (state.unwanted, state.finished) = (true, true);
        state.queue.clear();
        drop(state);
        self.drained.notify_all();
        self.filled.notify_all();
    }
}

/// The thread's half.
struct Producer {
    shared: Arc<Shared>,
    capacity: usize,
    /// Whether nothing is decoded before it is asked for.
    in_step: bool,
    live: bool,
    seekable: bool,
}

impl Producer {
    fn run(self, mut source: Box<dyn Source>) {
        let stats = self.shared.stats.clone();
        loop {
            self.wait_to_be_asked();
            let target = self.shared.lock().seek.take();
            if let Some(index) = target
                && let Err(error) = source.seek(index)
            {
                if !(self.put(Err(error)) && self.wait_for_seek()) {
                    break;
                }
                continue;
            }
            let item = match source.next_frame() {
                Ok(None) if self.wait_for_seek() => continue,
                Ok(None) => break,
                Ok(Some(frame)) => Ok(frame),
                Err(error) => Err(error),
            };
            stats.0.decoded.fetch_add(u64::from(item.is_ok()), Ordering::Relaxed);
            let last = item.as_ref().is_err_and(|e| !e.is_damage());
            if !self.put(item) || (last && !self.wait_for_seek()) {
                break;
            }
        }
    }

    fn wait_to_be_asked(&self) {
        if self.in_step {
            let waiting = |state: &mut State| !state.asked && !state.unwanted && state.seek.is_none();
            let waited = self.shared.drained.wait_while(self.shared.lock(), waiting);
            waited.unwrap_or_else(PoisonError::into_inner).asked = false;
        }
    }

    /// At the end of the input: waits until somebody goes elsewhere. `false` when nobody can or will.
    fn wait_for_seek(&self) -> bool {
        if !self.seekable {
            return false;
        }
        let mut state = self.shared.lock();
        state.finished = state.seek.is_none();
        self.shared.filled.notify_all();
        let waiting = |state: &mut State| state.seek.is_none() && !state.unwanted;
        let state = self.shared.drained.wait_while(state, waiting).unwrap_or_else(PoisonError::into_inner);
        !state.unwanted
    }

    /// Whether anybody still wants frames.
    fn put(&self, item: Result<Frame>) -> bool {
        let mut state = self.shared.lock();
        if self.live {
            if state.queue.len() >= self.capacity {
                state.queue.pop_front();
                self.shared.stats.0.dropped.fetch_add(1, Ordering::Relaxed);
            }
        } else {
            let full =
                |state: &mut State| state.queue.len() >= self.capacity && !state.unwanted && state.seek.is_none();
            state = self.shared.drained.wait_while(state, full).unwrap_or_else(PoisonError::into_inner);
        }
        // What was decoded before somebody went elsewhere is of no use there.
        if !state.unwanted && state.seek.is_none() {
            state.queue.push_back(item);
        }
        let wanted = !state.unwanted;
        drop(state);
        self.shared.filled.notify_one();
        wanted
    }
}

impl Drop for Producer {
    /// However the thread ends, nobody waits for it.
    fn drop(&mut self) {
        let mut state = self.shared.lock();
        (state.finished, state.gone) = (true, true);
        drop(state);
        self.shared.filled.notify_all();
    }
}
