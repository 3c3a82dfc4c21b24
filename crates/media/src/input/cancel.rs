use super::source::StopHandle;
use crate::{MediaError, Result, Source};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// Ends from elsewhere what is being opened: whoever opens it says how, as soon as there is something to end.
#[derive(Debug, Clone, Default)]
pub struct Cancel(Arc<Mutex<State>>);

#[derive(Debug, Default)]
struct State {
    cancelled: bool,
    ways: Vec<StopHandle>,
}

impl Cancel {
    /// Ends it, now or as soon as it can be.
    pub fn cancel(&self) {
        let mut state = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        state.cancelled = true;
        let ways = std::mem::take(&mut state.ways);
        drop(state);
        ways.iter().for_each(StopHandle::stop);
    }

    /// Whether it was ended.
    pub fn is_cancelled(&self) -> bool {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).cancelled
    }

    /// How to end it; at once where that was asked for before.
    pub fn by(&self, way: StopHandle) {
        let mut state = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if state.cancelled {
            drop(state);
            way.stop();
        } else {
            state.ways.push(way);
        }
    }
}

/// Opens a source, and gives it up when it takes longer than `limit`.
pub(crate) fn open_within(
    limit: Duration,
    name: &str,
    cancel: &Cancel,
    open: impl FnOnce(&Cancel) -> Result<Box<dyn Source>>,
) -> Result<Box<dyn Source>> {
    let (opened, waiting) = channel::<()>();
    let late = cancel.clone();
    let watch = move || {
        let timed_out = waiting.recv_timeout(limit) == Err(RecvTimeoutError::Timeout);
        if timed_out {
            late.cancel();
        }
        timed_out
    };
    let watch = std::thread::Builder::new().name("stream watch".to_owned()).spawn(watch);
    let watch = watch.map_err(|e| MediaError::unreadable(name, format!("no thread to watch it ({e})")))?;
    let source = open(cancel);
    drop(opened);
    match (source, watch.join()) {
        (Err(_), Ok(true)) => {
            Err(MediaError::unreadable(name, format!("no picture came within {:.0} s", limit.as_secs_f64())))
        }
        (source, _) => source,
    }
}
