//! What viewers are shown. The engine puts the newest frame here and goes on; a thread of its own makes a JPEG of it when
//! somebody looks, and viewers take the newest when they are ready: nobody who looks can slow the tracker.

use pursuit::Frame;
use pursuit::imaging::Image;
use pursuit::media::output::encode_jpeg;
use serde_json::Value;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::{Duration, Instant};
use tokio::sync::watch;

/// Shortest time from one picture to the next: what screens show.
pub(super) const PICTURE_EVERY: Duration = Duration::from_millis(33);
/// Of JPEG, from 1 to 100.
const QUALITY: u8 = 82;
/// Wider pictures are made smaller before they are sent; boxes stay in the pixels of the input.
const MOST_COLUMNS: usize = 1920;

/// One message to viewers: four bytes with the length of the JSON (little endian), the JSON, the JPEG (may be empty).
pub(crate) type Packet = Arc<Vec<u8>>;

/// The engine's end, and everybody's.
pub(crate) struct Screen {
    slot: Mutex<Slot>,
    changed: Condvar,
    viewers: AtomicUsize,
    packets: watch::Sender<Packet>,
}

#[derive(Default)]
struct Slot {
    number: u64,
    facts: Value,
    frame: Option<Arc<Frame>>,
    closed: bool,
}

/// Somebody who looks, until dropped.
pub(crate) struct Viewer {
    screen: Arc<Screen>,
    pub packets: watch::Receiver<Packet>,
}

impl Drop for Viewer {
    fn drop(&mut self) {
        self.screen.viewers.fetch_sub(1, Ordering::Relaxed);
    }
}

impl Screen {
    /// A screen and the thread that paints it, which ends with [`close`](Self::close).
    pub fn open() -> std::io::Result<Arc<Self>> {
        let (packets, _) = watch::channel(Packet::default());
        let (slot, changed, viewers) = (Mutex::default(), Condvar::new(), AtomicUsize::new(0));
        let screen = Arc::new(Self { slot, changed, viewers, packets });
        let painter = screen.clone();
        std::thread::Builder::new().name("painter".to_owned()).spawn(move || painter.paint())?;
        Ok(screen)
    }

    /// Shows this from now on.
    pub fn show(&self, facts: Value, frame: Option<Arc<Frame>>) {
        let mut slot = self.slot();
        slot.number += 1;
        (slot.facts, slot.frame) = (facts, frame);
        drop(slot);
        self.changed.notify_all();
    }

    /// Nothing more is shown; viewers see the end.
    pub fn close(&self) {
        self.slot().closed = true;
        self.changed.notify_all();
    }

    pub fn viewer(self: &Arc<Self>) -> Viewer {
        self.viewers.fetch_add(1, Ordering::Relaxed);
        let packets = self.packets.subscribe();
        // The painter may have had nobody to paint for; taking the lock, it cannot miss this.
        drop(self.slot());
        self.changed.notify_all();
        Viewer { screen: self.clone(), packets }
    }

    pub fn viewers(&self) -> usize {
        self.viewers.load(Ordering::Relaxed)
    }

    fn slot(&self) -> std::sync::MutexGuard<'_, Slot> {
        self.slot.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn paint(&self) {
        let (mut painted, mut picture) = (0, None::<(Arc<Frame>, Vec<u8>)>);
        loop {
            let idle = |slot: &mut Slot| !slot.closed && (slot.number == painted || self.viewers() == 0);
            let slot = self.changed.wait_while(self.slot(), idle).unwrap_or_else(PoisonError::into_inner);
            if slot.closed {
                // Told by an empty packet.
                self.packets.send_replace(Packet::default());
                return;
            }
            let (facts, frame) = (slot.facts.to_string(), slot.frame.clone());
            painted = slot.number;
            drop(slot);
            let began = Instant::now();
            let jpeg: &[u8] = match &frame {
                None => &[],
                Some(frame) => {
                    // The same frame is shown again with other facts.
                    let same = picture.take().filter(|(f, _)| Arc::ptr_eq(f, frame));
                    let made = same.unwrap_or_else(|| (frame.clone(), jpeg(frame).unwrap_or_default()));
                    &picture.insert(made).1
                }
            };
            let length = u32::try_from(facts.len()).unwrap_or(u32::MAX).to_le_bytes();
            self.packets.send_replace(Arc::new([&length, facts.as_bytes(), jpeg].concat()));
            std::thread::sleep(PICTURE_EVERY.saturating_sub(began.elapsed()));
        }
    }
}

/// The picture, made smaller by a whole factor where it is wide.
pub(crate) fn jpeg(frame: &Frame) -> Option<Vec<u8>> {
    let (size, mut picture) = (frame.size(), Image::filled(1, 1, [0; 3]).ok()?);
    let step = size.width.div_ceil(MOST_COLUMNS).max(1);
    // Converted for this alone: frames that are kept do not keep their colour as well.
    let made = frame.reduced_color([0, 0, size.width, size.height], step, &mut picture).ok()?;
    if made { encode_jpeg(picture.view(), QUALITY).ok() } else { None }
}
