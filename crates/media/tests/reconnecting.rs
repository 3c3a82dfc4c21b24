//! Live sources that go silent, break off, come back, and come back otherwise.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use pursuit_geometry::Size;
use pursuit_imaging::{Frame, Image};
use pursuit_media::input::{Cancel, StopHandle};
use pursuit_media::wrappers::{Connect, Patience, Prefetch, Reconnect, Reconnecting, StreamCounts};
use pursuit_media::{MediaError, Result, Source, SourceInfo};
use std::collections::VecDeque;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// What a connection does next.
enum Act {
    /// A frame of this time, its sides this long.
    Frame(f64, usize),
    Damage,
    Break(&'static str),
    End,
    /// Nothing, until it is stopped.
    Hang,
}

/// A connection that does what was written down, and tells when it is gone.
struct Scripted {
    info: SourceInfo,
    acts: VecDeque<Act>,
    stop: (Sender<()>, Receiver<()>),
    gone: Sender<()>,
}

impl Drop for Scripted {
    fn drop(&mut self) {
        _ = self.gone.send(());
    }
}

impl Source for Scripted {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn next_frame(&mut self) -> Result<Option<Frame>> {
        let broken = |reason: &str| MediaError::Broken { name: "camera".into(), frame: 7, reason: reason.into() };
        match self.acts.pop_front().unwrap_or(Act::Hang) {
            Act::Frame(time_s, side) => {
                Ok(Some(Frame::new(0, time_s, Image::from_fn(side, side, |_, _| 0_u8).unwrap())))
            }
            Act::Damage => {
                Err(MediaError::Damaged { name: "camera".into(), frame: 3, reason: "packets were lost".into() })
            }
            Act::Break(reason) => Err(broken(reason)),
            Act::End => Ok(None),
            Act::Hang => {
                _ = self.stop.1.recv();
                Err(broken("it was stopped"))
            }
        }
    }

    fn stop_handle(&self) -> Option<StopHandle> {
        let stop = Mutex::new(self.stop.0.clone());
        Some(StopHandle::new(move || _ = stop.lock().unwrap().send(())))
    }
}

/// A camera that is connected to again and again: each time what comes next is done, an error when connecting included.
struct Camera {
    source: Reconnecting,
    gone: Receiver<()>,
}

fn camera(connections: Vec<std::result::Result<Vec<Act>, &'static str>>, patience: Patience) -> Camera {
    let (gone, told) = channel();
    let mut scripts: VecDeque<_> = connections.into();
    let make = move |acts: Vec<Act>| Scripted {
        info: SourceInfo { fps: Some(25.0), live: true, ..SourceInfo::new("camera", Size::new(16, 16), "script") },
        acts: acts.into(),
        stop: channel(),
        gone: gone.clone(),
    };
    let first = make(scripts.pop_front().unwrap().unwrap());
    let scripts = Mutex::new(scripts);
    let make = Mutex::new(make);
    let connect: Connect = Arc::new(move |cancel: &Cancel| {
        let unreadable = |reason: &str| MediaError::Unreadable { name: "camera".into(), reason: reason.into() };
        match scripts.lock().unwrap().pop_front() {
            Some(Ok(acts)) => {
                let source = make.lock().unwrap()(acts);
                cancel.by(source.stop_handle().unwrap());
                Ok(Box::new(source) as _)
            }
            Some(Err(reason)) => Err(unreadable(reason)),
            None => Err(unreadable("nobody answers")),
        }
    });
    Camera { source: Reconnecting::new(Box::new(first), connect, patience).unwrap(), gone: told }
}

fn patience(stall_ms: u64, reconnect: Reconnect) -> Patience {
    Patience { stall: Duration::from_millis(stall_ms), reconnect }
}

fn counts(source: &Reconnecting) -> StreamCounts {
    source.info().stream.clone().unwrap().counts()
}

fn frames(source: &mut dyn Source, count: usize) -> Vec<(u64, f64)> {
    (0..count).map(|_| source.next_frame().unwrap().unwrap()).map(|f| (f.index(), f.time_s())).collect()
}

#[test]
fn a_camera_that_breaks_off_is_connected_to_again_and_time_goes_on() {
    let scripts = vec![
        Ok(vec![Act::Frame(0.0, 16), Act::Frame(0.04, 16), Act::Break("the connection was reset")]),
        Err("connection refused"),
        Ok(vec![Act::Frame(0.0, 16), Act::Damage, Act::Frame(0.08, 16), Act::End]),
    ];
    let Camera { mut source, gone } = camera(scripts, patience(60_000, Reconnect::Forever));
    assert_eq!((source.info().live, source.info().frame_count), (true, None));
    let seen = frames(&mut source, 4);
    assert_eq!(seen.iter().map(|f| f.0).collect::<Vec<_>>(), [0, 1, 2, 3]);
    assert_eq!((seen[0].1, seen[1].1), (0.0, 0.04));
    // Two waits, of 250 and 500 ms, lie between.
    let gap_s = seen[2].1 - seen[1].1;
    assert!(gap_s >= 0.75, "{gap_s}");
    assert!((seen[3].1 - seen[2].1 - 0.08).abs() < 1e-9);
    let counts = counts(&source);
    assert_eq!((counts.stalls, counts.breaks, counts.reconnects, counts.failed_attempts), (0, 1, 1, 1));
    assert_eq!(counts.damaged, 1);
    assert!(counts.longest_gap_s >= 0.75 && (counts.longest_gap_s - gap_s).abs() < 1e-6, "{counts:?} {gap_s}");
    // What ends by itself ends well.
    assert!(source.next_frame().unwrap().is_none() && source.next_frame().unwrap().is_none());
    assert_eq!(gone.iter().take(2).count(), 2, "no connection is left");
}

#[test]
fn a_camera_that_falls_silent_is_given_up_and_connected_to_again() {
    let scripts = vec![Ok(vec![Act::Frame(0.0, 16), Act::Hang]), Ok(vec![Act::Frame(5.0, 16), Act::End])];
    let Camera { mut source, gone } = camera(scripts, patience(50, Reconnect::Forever));
    let seen = frames(&mut source, 2);
    assert!(seen[1].1 >= 0.3, "{seen:?}");
    assert!(source.next_frame().unwrap().is_none());
    let counts = counts(&source);
    assert_eq!((counts.stalls, counts.breaks, counts.reconnects, counts.failed_attempts), (1, 0, 1, 0));
    assert_eq!(gone.iter().take(2).count(), 2, "the silent connection was ended");
}

#[test]
fn without_reconnecting_the_first_trouble_ends_it() {
    for (act, words) in [(Act::Hang, "no frame came for 0.1 s"), (Act::Break("it was cut"), "it was cut")] {
        let scripts = vec![Ok(vec![Act::Frame(0.0, 16), act]), Ok(vec![Act::Frame(0.0, 16)])];
        let Camera { mut source, .. } = camera(scripts, patience(50, Reconnect::Never));
        frames(&mut source, 1);
        let error = source.next_frame().unwrap_err();
        assert_eq!(error.to_string(), format!("camera breaks off at frame 1: {words}"));
        assert!(!error.is_damage() && source.next_frame().unwrap().is_none(), "once is enough");
        assert_eq!(counts(&source).reconnects, 0);
    }
}

#[test]
fn attempts_end_when_the_time_for_them_is_over() {
    let scripts = vec![Ok(vec![Act::Frame(0.0, 16), Act::Break("it was cut")]), Err("refused"), Err("refused")];
    let limit = Reconnect::For(Duration::from_millis(600));
    let Camera { mut source, .. } = camera(scripts, patience(60_000, limit));
    frames(&mut source, 1);
    let error = source.next_frame().unwrap_err().to_string();
    // At 250 ms, and no more: the next wait of 500 ms would go beyond.
    let words = "camera breaks off at frame 1: refused (attempts to connect again: 1, in 0.";
    assert!(error.starts_with(words), "{error}");
    assert_eq!(counts(&source).failed_attempts, 1);
}

#[test]
fn another_size_ends_it() {
    let scripts = vec![Ok(vec![Act::Frame(0.0, 16), Act::Break("it was cut")]), Ok(vec![Act::Frame(0.0, 32)])];
    let Camera { mut source, gone } = camera(scripts, patience(60_000, Reconnect::Forever));
    frames(&mut source, 1);
    let error = source.next_frame().unwrap_err();
    assert!(error.to_string().contains("came back with 32x32 pixels, before it had 16x16"), "{error}");
    assert!(source.next_frame().unwrap().is_none());
    drop(source);
    assert_eq!(gone.iter().take(2).count(), 2, "no connection is left");
}

#[test]
fn stopping_ends_every_wait() {
    for scripts in [
        vec![Ok(vec![Act::Frame(0.0, 16), Act::Hang])],
        vec![Ok(vec![Act::Frame(0.0, 16), Act::Break("it was cut")]), Ok(vec![Act::Hang])],
        vec![Ok(vec![Act::Frame(0.0, 16), Act::Break("it was cut")])],
    ] {
        let Camera { mut source, gone } = camera(scripts, patience(60_000, Reconnect::Forever));
        frames(&mut source, 1);
        let stop = source.stop_handle().unwrap();
        let waiting = std::thread::spawn(move || source.next_frame().map(|f| f.is_none()));
        std::thread::sleep(Duration::from_millis(400));
        stop.stop();
        assert!(waiting.join().unwrap().unwrap());
        gone.recv().unwrap();
    }
}

#[test]
fn dropping_it_leaves_no_connection_even_behind_a_queue() {
    let many = (0..100).map(|n| Act::Frame(f64::from(n), 16)).collect();
    let Camera { source, gone } = camera(vec![Ok(many)], patience(60_000, Reconnect::Forever));
    let stats = source.info().stream.clone().unwrap();
    let mut queue = Prefetch::new(Box::new(source), 2).unwrap();
    queue.next_frame().unwrap().unwrap();
    drop(queue);
    gone.recv().unwrap();
    assert_eq!(stats.counts().breaks, 0);
}
