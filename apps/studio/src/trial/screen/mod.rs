//! What viewers are shown. The engine puts the newest frame here and goes on; a thread of its own makes a picture of it when
//! somebody looks, once for all who look, and viewers take pictures when they are ready: nobody who looks can slow the
//! tracker.

mod packet;
mod painter;
mod viewer;

pub(crate) use packet::Packet;
pub(crate) use painter::jpeg;
pub(crate) use viewer::{Viewer, Wish};

use painter::Painter;
use pursuit::Frame;
use serde_json::Value;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use tokio::sync::{broadcast, watch};

/// Shortest time from one picture to the next: what screens show.
pub(crate) const PICTURE_EVERY: Duration = Duration::from_millis(33);
/// Packets of the video that are kept for whoever is a little late.
const KEPT: usize = 16;

/// The engine's end, and everybody's.
pub(crate) struct Screen {
    slot: Mutex<Slot>,
    changed: Condvar,
    /// Who takes each frame as JPEG, and who takes video.
    looking: [AtomicUsize; 2],
    /// Whether somebody cannot go on without a key frame.
    key_wanted: AtomicBool,
    /// The newest as JPEG; none at the end.
    stills: watch::Sender<Option<Arc<Packet>>>,
    /// Everything, in order; none at the end.
    video: broadcast::Sender<Option<Arc<Packet>>>,
}

#[derive(Default)]
struct Slot {
    number: u64,
    shown: Option<Shown>,
    closed: bool,
}

/// Says where a trial is. It is asked on the painter's thread, and only when somebody looks.
pub(crate) type Facts = Box<dyn FnOnce() -> Value + Send>;

/// What is to be seen.
struct Shown {
    facts: Facts,
    frame: Arc<Frame>,
    /// Whether more is to follow at once: then it is a video, else a still picture.
    running: bool,
}

impl Screen {
    /// A screen and the thread that paints it, which ends with [`close`](Self::close).
    pub fn open() -> std::io::Result<Arc<Self>> {
        let screen = Arc::new(Self {
            slot: Mutex::default(),
            changed: Condvar::new(),
            looking: [const { AtomicUsize::new(0) }; 2],
            key_wanted: AtomicBool::new(false),
            stills: watch::channel(None).0,
            video: broadcast::channel(KEPT).0,
        });
        let painter = Painter::new(screen.clone());
        std::thread::Builder::new().name("painter".to_owned()).spawn(move || painter.paint())?;
        Ok(screen)
    }

    /// Shows this from now on; `running` says that the next frame follows at once.
    pub fn show(&self, facts: Facts, frame: Arc<Frame>, running: bool) {
        let mut slot = self.slot();
        if slot.closed {
            return;
        }
        slot.number += 1;
        slot.shown = Some(Shown { facts, frame, running });
        drop(slot);
        self.changed.notify_all();
    }

    /// Nothing more is shown; viewers see the end.
    pub fn close(&self) {
        self.slot().closed = true;
        self.changed.notify_all();
    }

    /// Somebody who looks, in the way wished for.
    pub fn viewer(self: &Arc<Self>, wish: Wish) -> Viewer {
        let viewer = Viewer::new(self.clone(), wish);
        // The painter may have had nobody to paint for; taking the lock, it cannot miss this.
        drop(self.slot());
        self.changed.notify_all();
        viewer
    }

    pub fn viewers(&self) -> usize {
        self.looking.iter().map(|count| count.load(Ordering::Relaxed)).sum()
    }

    fn looks(&self, wish: Wish) -> bool {
        self.looking[wish as usize].load(Ordering::Relaxed) > 0
    }

    fn slot(&self) -> MutexGuard<'_, Slot> {
        self.slot.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits until somebody looks and there is something newer than number `painted`; none once nothing more is shown.
    fn next(&self, painted: &mut u64) -> Option<Shown> {
        let idle = |slot: &mut Slot| !slot.closed && (slot.number == *painted || self.viewers() == 0);
        let mut slot = self.changed.wait_while(self.slot(), idle).unwrap_or_else(PoisonError::into_inner);
        // What was shown last is seen also by whoever looks when it ends.
        if slot.closed && (slot.number == *painted || self.viewers() == 0) {
            return None;
        }
        *painted = slot.number;
        slot.shown.take()
    }
}
