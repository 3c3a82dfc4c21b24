use super::packet::{Kind, Packet};
use super::{KEPT, Screen};
use serde::Deserialize;
use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use tokio::sync::broadcast::error::{RecvError, TryRecvError};
use tokio::sync::{broadcast, watch};

/// How somebody wants to look.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
pub(crate) enum Wish {
    /// Each picture as JPEG.
    #[default]
    #[serde(rename = "jpeg")]
    Stills,
    /// H.264 while a run goes on, where this build can.
    #[serde(rename = "h264")]
    Video,
}

/// Somebody who looks, until dropped.
pub(crate) struct Viewer {
    screen: Arc<Screen>,
    wish: Wish,
    taking: Taking,
}

enum Taking {
    /// The newest; those in between are kept for nobody.
    Stills(watch::Receiver<Option<Arc<Packet>>>),
    Video(Queue),
}

struct Queue {
    packets: broadcast::Receiver<Option<Arc<Packet>>>,
    /// What has come and was not taken yet.
    waiting: VecDeque<Arc<Packet>>,
    /// Whether the packets since the last key frame were all taken.
    whole: bool,
    /// Whether a key frame was asked for since then.
    asked: bool,
    ended: bool,
}

impl Drop for Viewer {
    fn drop(&mut self) {
        self.screen.looking[self.wish as usize].fetch_sub(1, Ordering::Relaxed);
    }
}

impl Viewer {
    pub(super) fn new(screen: Arc<Screen>, wish: Wish) -> Self {
        screen.looking[wish as usize].fetch_add(1, Ordering::Relaxed);
        let taking = match wish {
            Wish::Stills => Taking::Stills(screen.stills.subscribe()),
            Wish::Video => Taking::Video(Queue::new(screen.video.subscribe())),
        };
        let viewer = Self { screen, wish, taking };
        if wish == Wish::Video {
            viewer.ask_for_key();
        }
        viewer
    }

    /// Has the next picture made so that one can begin with it.
    pub fn ask_for_key(&self) {
        self.screen.key_wanted.store(true, Ordering::Relaxed);
    }

    /// The next packet that this viewer can make sense of, as new as can be; `None` at the end. Nothing is lost when the
    /// future is dropped.
    pub async fn next(&mut self) -> Option<Arc<Packet>> {
        match &mut self.taking {
            Taking::Stills(newest) => {
                newest.changed().await.ok()?;
                newest.borrow_and_update().clone()
            }
            Taking::Video(queue) => loop {
                queue.take_in();
                if let Some(packet) = queue.pop() {
                    return Some(packet);
                }
                if !queue.whole && !queue.asked {
                    queue.asked = true;
                    self.screen.key_wanted.store(true, Ordering::Relaxed);
                }
                if queue.ended {
                    return None;
                }
                let received = queue.packets.recv().await;
                queue.add(received);
            },
        }
    }
}

impl Queue {
    const fn new(packets: broadcast::Receiver<Option<Arc<Packet>>>) -> Self {
        Self { packets, waiting: VecDeque::new(), whole: false, asked: true, ended: false }
    }

    /// Takes in everything that has come.
    fn take_in(&mut self) {
        loop {
            let received = match self.packets.try_recv() {
                Ok(packet) => Ok(packet),
                Err(TryRecvError::Empty) => return,
                Err(TryRecvError::Lagged(missed)) => Err(RecvError::Lagged(missed)),
                Err(TryRecvError::Closed) => Err(RecvError::Closed),
            };
            self.add(received);
            if self.ended {
                return;
            }
        }
    }

    fn add(&mut self, received: Result<Option<Arc<Packet>>, RecvError>) {
        match received {
            Ok(Some(packet)) => {
                if packet.kind == Kind::Key {
                    // Whatever came before it is no longer needed.
                    self.waiting.clear();
                } else if self.waiting.len() >= KEPT {
                    self.lose();
                }
                self.waiting.push_back(packet);
            }
            Ok(None) | Err(RecvError::Closed) => self.ended = true,
            Err(RecvError::Lagged(_)) => self.lose(),
        }
    }

    fn lose(&mut self) {
        self.waiting.clear();
        (self.whole, self.asked) = (false, false);
    }

    /// The next packet that can be made sense of.
    fn pop(&mut self) -> Option<Arc<Packet>> {
        while let Some(packet) = self.waiting.pop_front() {
            match packet.kind {
                Kind::Still => return Some(packet),
                Kind::Key => {
                    (self.whole, self.asked) = (true, false);
                    return Some(packet);
                }
                Kind::Delta if self.whole => return Some(packet),
                Kind::Delta => {}
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn packet(number: u64, kind: Kind) -> Option<Arc<Packet>> {
        Some(Arc::new(Packet::new(json!({ "number": number }), json!(null), &[], kind)))
    }

    fn number(packet: &Packet) -> u64 {
        let text = String::from_utf8(packet.as_ref()[4..].to_vec()).unwrap();
        serde_json::from_str::<serde_json::Value>(&text).unwrap()["number"].as_u64().unwrap()
    }

    /// What a viewer takes that looks now.
    fn taken(queue: &mut Queue) -> Vec<u64> {
        queue.take_in();
        std::iter::from_fn(|| queue.pop().map(|p| number(&p))).collect()
    }

    #[test]
    fn whoever_comes_late_begins_with_a_key_frame_and_misses_none_after_it() {
        let (sender, receiver) = broadcast::channel(KEPT);
        let mut queue = Queue::new(receiver);
        let send = |number, kind| drop(sender.send(packet(number, kind)));
        send(1, Kind::Delta);
        send(2, Kind::Still);
        assert_eq!(taken(&mut queue), [2], "a still picture needs nothing before it");
        send(3, Kind::Delta);
        assert_eq!(taken(&mut queue), [0; 0], "and is no beginning");
        (4..8).for_each(|n| send(n, if n == 5 { Kind::Key } else { Kind::Delta }));
        assert_eq!(taken(&mut queue), [5, 6, 7]);
        send(8, Kind::Still);
        send(9, Kind::Delta);
        assert_eq!(taken(&mut queue), [8, 9]);
    }

    #[test]
    fn whoever_is_slow_goes_on_with_the_next_key_frame_and_nothing_piles_up() {
        let (sender, receiver) = broadcast::channel(KEPT);
        let mut queue = Queue::new(receiver);
        let send = |number, kind| drop(sender.send(packet(number, kind)));
        send(0, Kind::Key);
        assert_eq!(taken(&mut queue), [0]);
        // Some are taken in, none is taken.
        for n in 1..1000 {
            send(n, Kind::Delta);
            if n % 3 == 0 {
                queue.take_in();
            }
            assert!(queue.waiting.len() <= KEPT + 1, "{}", queue.waiting.len());
        }
        assert_eq!((taken(&mut queue), queue.whole, queue.asked), (vec![], false, false));
        send(1000, Kind::Delta);
        send(1001, Kind::Key);
        send(1002, Kind::Delta);
        assert_eq!(taken(&mut queue), [1001, 1002]);
        // What is shown when it stands still reaches everybody.
        (1003..1100).for_each(|n| send(n, Kind::Delta));
        send(1100, Kind::Still);
        assert_eq!(taken(&mut queue), [1100]);
        drop(sender);
        assert!(taken(&mut queue).is_empty() && queue.ended);
    }
}
