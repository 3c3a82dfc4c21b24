//! A live source at 100 frames a second that breaks off again and again, followed for a long time: memory stays flat, and no
//! thread and no file descriptor is lost (`cargo xtask soak`).
//!
//!     soak SECONDS [SECONDS-BETWEEN-BREAKS [INPUT]]
//!
//! Without an input the source is a scene, filmed anew after each break; an input, such as a camera, breaks by itself.
#![allow(clippy::print_stdout)]

#[path = "common/held.rs"]
mod held;

use held::Held;
use pursuit::media::wrappers::{Connect, Faults, Faulty, Patience, Prefetch, Reconnect, Reconnecting, Throttled};
use pursuit::media::{MediaError, OpenOptions, Source};
use pursuit::{BBox, Session, recipe};
use std::error::Error;
use std::sync::Arc;
use std::time::{Duration, Instant};

const FPS: u64 = 100;
/// How far memory may be from the middle of what is held after the first minute.
const FLAT_KIB: u64 = 2048;

fn main() -> Result<(), Box<dyn Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let number = |at: usize, otherwise: u64| words.get(at).map_or(Ok(otherwise), |w| w.parse());
    let (seconds, between_s) = (number(0, 60)?, number(1, 30)?);
    let patience = Patience { stall: Duration::from_secs(5), reconnect: Reconnect::Forever };
    let source = match words.get(2) {
        Some(input) => pursuit::open_with(input, &OpenOptions { patience, ..OpenOptions::from_env() })?,
        None => breaking(between_s, patience)?,
    };
    let stats = source.info().stream.clone().ok_or("the input is no live source")?;
    let size = source.info().size;
    let side = 0.15 * size.height as f64;
    let start = source
        .info()
        .truth_at(0)
        .bbox()
        .unwrap_or_else(|| BBox::from_ltwh(0.4 * size.width as f64, 0.4 * size.height as f64, side, side));
    let queue = Prefetch::new(source, 8)?;
    let dropped = queue.stats();
    let mut session = Session::new(Box::new(queue), recipe("mosse")?).starting_on(vec![start]);
    let (began, mut watch) = (Instant::now(), Watch::new(seconds));
    let mut frames = 0;
    while began.elapsed() < Duration::from_secs(seconds) {
        let Some(progress) = session.step()? else { return Err("the source ended".into()) };
        frames = progress.frames;
        watch.look(began.elapsed())?;
    }
    drop(session);
    let counts = stats.counts();
    println!("{frames} frames, {} dropped, {counts:?}", dropped.dropped_frames());
    println!("{}", watch.verdict()?);
    let wanted = if words.len() < 3 { seconds / (between_s + 2) } else { 0 };
    if counts.reconnects < wanted || frames < FPS / 2 * seconds.min(60) {
        return Err(format!("{} reconnects and {frames} frames are too few", counts.reconnects).into());
    }
    Ok(())
}

/// A scene in real time, filmed anew after each break.
fn breaking(between_s: u64, patience: Patience) -> Result<Box<dyn Source>, MediaError> {
    let connect = move || -> Result<Box<dyn Source>, MediaError> {
        let name = format!("scene:drift?seed=7&fps={FPS}&duration={}", between_s + 10);
        let unreadable = |e: pursuit::RunError| MediaError::Unreadable { name: name.clone(), reason: e.to_string() };
        let scene = pursuit::open(&name).map_err(unreadable)?;
        let faults = Faults { fail_at: Some(FPS * between_s), ..Faults::default() };
        Ok(Box::new(Throttled::new(Faulty::new(scene, faults), 1.0)))
    };
    let again: Connect = Arc::new(move |_| connect());
    Ok(Box::new(Reconnecting::new(connect()?, again, patience)?))
}

/// Looks once a second.
struct Watch {
    /// When everything is supposed to be warm.
    warm: Duration,
    next: Duration,
    first: Option<Held>,
    least: Held,
    most: Held,
}

impl Watch {
    fn new(seconds: u64) -> Self {
        let none = Held { kib: 0, threads: 0, files: 0 };
        let most = Held { kib: u64::MAX, threads: usize::MAX, files: usize::MAX };
        let warm = Duration::from_secs(60.min(seconds / 3));
        Self { warm, next: warm, first: None, least: most, most: none }
    }

    fn look(&mut self, now: Duration) -> Result<(), Box<dyn Error>> {
        if now < self.next {
            return Ok(());
        }
        self.next = now + Duration::from_secs(1);
        let held = Held::now()?;
        self.first.get_or_insert(held);
        let by = |f: fn(usize, usize) -> usize, a: Held, b: Held, kib: u64| Held {
            kib,
            threads: f(a.threads, b.threads),
            files: f(a.files, b.files),
        };
        self.least = by(usize::min, self.least, held, self.least.kib.min(held.kib));
        self.most = by(usize::max, self.most, held, self.most.kib.max(held.kib));
        Ok(())
    }

    fn verdict(&self) -> Result<String, Box<dyn Error>> {
        let first = self.first.ok_or("it was too short")?;
        let said =
            format!("from {:.0} s on {first:?}; least {:?}, most {:?}", self.warm.as_secs_f64(), self.least, self.most);
        // About the middle of what was held: a sample taken during a break has less than any other, the first one too.
        let flat = self.most.kib - self.least.kib <= 2 * FLAT_KIB;
        // A connection that ends and the one that replaces it may be there together.
        let lost = self.most.threads > self.least.threads + 3 || self.most.files > self.least.files + 3;
        if flat && !lost { Ok(said) } else { Err(format!("not flat: {said}").into()) }
    }
}
