//! Two cameras followed for hours of their own time, faster than real: in segments that are kept for a while, with clips of what
//! happens, over connections that break, one of them on a head that obeys late, loses commands, does not answer for minutes and
//! starts anew now and then. Memory and disk stay what they were, and every clip plays (`cargo xtask soak --hours 6`).
//!
//!     days [HOURS [FOLDER]]
//!
//! What breaks when is the same every time. The heads' thread keeps the time of this machine, as it does in earnest.
#![allow(clippy::print_stdout)]

#[path = "common/clips.rs"]
mod clips;
#[path = "common/held.rs"]
mod held;
#[path = "common/turning.rs"]
mod turning;

use clips::Clips;
use held::Held;
use pursuit::events::EventOptions;
use pursuit::media::wrappers::{Connect, Faults, Faulty, Patience, Reconnect, Reconnecting};
use pursuit::media::{OpenOptions, Source, SourceInfo};
use pursuit::{Frame, Run, RunConfig};
use pursuit_tracking::TrackState;
use std::error::Error;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

type Outcome<T = ()> = Result<T, Box<dyn Error + Send + Sync>>;

/// Pictures per second of the camera that stands.
const FPS: u64 = 5;
/// Seconds of a segment, and for which segments and clips are kept.
const SEGMENT_S: u64 = 600;
const KEEP_S: u64 = 3600;
/// How long connections last, seconds of the camera's time: by turns.
const LASTS_S: [u64; 5] = [610, 1900, 95, 3100, 1247];
/// Of so many attempts to connect one fails.
const REFUSED: u64 = 4;
/// By how much the mean of what is held may grow from the first third to the last.
const GROWS_KIB: f64 = 3072.0;
/// How far one camera's time may be ahead of the other's, seconds: both are watched while both go on.
const AHEAD_S: u64 = 60;
/// In which part of the frames a target has to be seen: less would mean that nothing was followed.
const SEEN: f64 = 0.5;

fn main() -> Outcome {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let hours: f64 = words.first().map_or(Ok(6.0), |word| word.parse())?;
    let seconds = (3600.0 * hours) as u64;
    let own = tempfile::tempdir()?;
    let folder = words.get(1).map_or(own.path(), |word| Path::new(word));
    let yard = Yard::default();
    let told = std::thread::scope(|scope| {
        let runs = [
            scope.spawn(|| yard.ended(STANDING, stand(&yard, seconds, &folder.join(NAMES[STANDING])))),
            scope.spawn(|| yard.ended(TURNING, turn(&yard, seconds, &folder.join(NAMES[TURNING])))),
        ];
        let told = watch(&yard, seconds, folder);
        // Nobody has to wait for hours to learn what went wrong in the first minute.
        yard.failed.fetch_or(told.is_err(), Ordering::Relaxed);
        let ended: Vec<Outcome<String>> =
            runs.into_iter().map(|run| run.join().map_err(|_| "a run panicked")?).collect();
        for (name, end) in NAMES.iter().zip(ended) {
            println!("{name}: {}", end?);
        }
        told
    })?;
    println!("{told}");
    Ok(())
}

/// The two cameras, by their places in what follows.
const NAMES: [&str; 2] = ["standing", "turning"];
const STANDING: usize = 0;
const TURNING: usize = 1;

/// How far both have come, which go on side by side.
#[derive(Default)]
struct Yard {
    /// Seconds of their own time.
    times_s: [AtomicU64; 2],
    over: [AtomicBool; 2],
    /// Whether one of them, or whoever watches, found something wrong: then all end.
    failed: AtomicBool,
}

impl Yard {
    /// The time of the one that is behind.
    fn time_s(&self) -> u64 {
        self.times_s.iter().map(|time_s| time_s.load(Ordering::Relaxed)).min().unwrap_or(0)
    }

    fn is_any_over(&self) -> bool {
        self.over.iter().any(|over| over.load(Ordering::Relaxed))
    }

    fn is_all_over(&self) -> bool {
        self.over.iter().all(|over| over.load(Ordering::Relaxed))
    }

    /// A camera has come so far, and waits for the other one; whether it goes on.
    fn goes_on(&self, camera: usize, time_s: f64) -> bool {
        self.times_s[camera].store(time_s as u64, Ordering::Relaxed);
        let failed = || self.failed.load(Ordering::Relaxed);
        while !failed() && !self.is_any_over() && time_s as u64 > self.time_s() + AHEAD_S {
            std::thread::sleep(Duration::from_millis(2));
        }
        !failed()
    }

    /// A camera's run has ended.
    fn ended(&self, camera: usize, how: Outcome<String>) -> Outcome<String> {
        self.failed.fetch_or(how.is_err(), Ordering::Relaxed);
        self.over[camera].store(true, Ordering::Relaxed);
        how
    }
}

fn config(folder: &Path, events: EventOptions, rest: RunConfig) -> Outcome<RunConfig> {
    let (segment, keep) = (Some(format!("{SEGMENT_S}s").parse()?), Some(format!("{KEEP_S}s").parse()?));
    let events = EventOptions { clips: Some(true), before_s: Some(4.0), after_s: Some(4.0), ..events };
    Ok(RunConfig { out: Some(folder.to_path_buf()), segment, keep, events, ..rest })
}

/// Something bright before a camera that stands: it goes in and out of a zone, and is another thing after every break.
fn stand(yard: &Yard, seconds: u64, folder: &Path) -> Outcome<String> {
    let events = EventOptions { zones: vec!["left=0,0,80,0,80,120,0,120".to_owned()], ..EventOptions::default() };
    let (tracker, detect) = (Some("mosse".to_owned()), Some("ball".to_owned()));
    let config = config(folder, events, RunConfig { tracker, detect, ..RunConfig::default() })?;
    let connect = |number: u64| -> Outcome<Box<dyn Source>> {
        let lasts_s = LASTS_S[(number % LASTS_S.len() as u64) as usize];
        let scene = pursuit::open(
            format!("scene:drift?seed={number}&width=160&height=120&fps={FPS}&duration={}", lasts_s + 10).as_str(),
        )?;
        Ok(Box::new(Faulty::new(scene, Faults { fail_at: Some(FPS * lasts_s), drop: 0.01, ..Faults::default() })))
    };
    let source = breaking(connect)?;
    let run = Run::prepare_source(config, source, &OpenOptions::from_env())?;
    carry_out((yard, STANDING), run, seconds)
}

/// A walker all about a camera on a head.
fn turn(yard: &Yard, seconds: u64, folder: &Path) -> Outcome<String> {
    let events =
        EventOptions { clip_on: ["appear", "lost", "found"].map(str::to_owned).into(), ..EventOptions::default() };
    let mount = turning::Mount::new()?;
    let boxes = vec![mount.first_box().ok_or("nobody to follow")?];
    let config = RunConfig { tracker: Some("kcf".to_owned()), boxes, ..RunConfig::default() };
    let config = pursuit::head::compensated(self::config(folder, events, config)?);
    let mount_again = mount.clone();
    let connect = move |number: u64| -> Outcome<Box<dyn Source>> {
        let lasts_s = LASTS_S[((number + 2) % LASTS_S.len() as u64) as usize];
        let fail_at = Some(turning::FPS * lasts_s);
        Ok(Box::new(Faulty::new(mount.picture_source()?, Faults { fail_at, ..Faults::default() })))
    };
    let source = breaking(connect)?;
    let run = Run::prepare_source(config, source, &OpenOptions::from_env())?;
    let run = pursuit::head::follow(run, mount_again.pilot()?, |_| {});
    let said = carry_out((yard, TURNING), run, seconds)?;
    Ok(format!("{said}; {}", mount_again.said(seconds)?))
}

/// Connections that end as they are told to, one after the other, and attempts that fail.
fn breaking(connect: impl Fn(u64) -> Outcome<Box<dyn Source>> + Send + Sync + 'static) -> Outcome<Box<dyn Source>> {
    let patience = Patience { stall: Duration::from_secs(20), reconnect: Reconnect::Forever };
    let first = connect(0)?;
    let info = SourceInfo { live: true, ..first.info().clone() };
    let (count, name) = (AtomicU64::new(1), info.name.clone());
    let again: Connect = Arc::new(move |_| {
        let number = count.fetch_add(1, Ordering::Relaxed);
        let broken = |e: Box<dyn Error + Send + Sync>| pursuit::media::MediaError::Unreadable {
            name: name.clone(),
            reason: e.to_string(),
        };
        if number % REFUSED == REFUSED - 1 {
            return Err(broken("nobody answers".into()));
        }
        let source = connect(number).map_err(broken)?;
        Ok(Box::new(Live { info: SourceInfo { live: true, ..source.info().clone() }, source }))
    });
    Ok(Box::new(Reconnecting::new(Box::new(Live { info, source: first }), again, patience)?))
}

/// A source that says of itself that its pictures do not come again.
struct Live {
    info: SourceInfo,
    source: Box<dyn Source>,
}

impl Source for Live {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn next_frame(&mut self) -> Result<Option<Frame>, pursuit::media::MediaError> {
        self.source.next_frame()
    }
}

/// Runs until the camera's time is over, and says what became of it.
fn carry_out((yard, camera): (&Yard, usize), run: Run, seconds: u64) -> Outcome<String> {
    let (remote, stats) = (run.remote(), run.input().stream.clone().ok_or("no live source")?);
    let (mut seen, mut frames) = (0_u64, 0_u64);
    let finished = run.run(|progress| {
        let time_s = progress.frame.time_s();
        frames += 1;
        seen += u64::from(progress.records.iter().any(|r| {
            r.estimate.as_ref().is_some_and(|e| matches!(e.state, TrackState::Tracking | TrackState::Unsure))
        }));
        if !yard.goes_on(camera, time_s) || time_s >= seconds as f64 {
            remote.stop();
        }
    })?;
    if yard.failed.load(Ordering::Relaxed) {
        return Ok("stopped early".to_owned());
    }
    let (counts, least) = (stats.counts(), seconds / 1500);
    if counts.reconnects < least {
        return Err(format!("{} reconnections are less than {least}", counts.reconnects).into());
    }
    let part = seen as f64 / frames.max(1) as f64;
    if part < SEEN {
        return Err(format!("its target was seen in {:.1} % of {frames} frames only", 100.0 * part).into());
    }
    let segments = finished.facts.segments.clone().ok_or("no segments")?;
    Ok(format!(
        "{frames} frames, its target seen in {:.1} %, {} reconnections and {} attempts in vain, {} segment files and {} clips and pictures \
         left, {} removed",
        100.0 * part,
        counts.reconnects,
        counts.failed_attempts,
        segments.files.len(),
        segments.clips,
        segments.removed
    ))
}

/// A look at everything.
struct Look {
    camera_s: u64,
    held: Held,
    disk: u64,
}

/// Looks at what is held and written while both cameras go on, and plays every clip; says how all that went.
fn watch(yard: &Yard, seconds: u64, folder: &Path) -> Outcome<String> {
    let (began, mut looks, mut shown_s) = (Instant::now(), Vec::<Look>::new(), 0);
    let mut clips = NAMES.map(|name| Clips::of(&folder.join(name)));
    println!("camera's time  ours      held");
    while !yard.is_all_over() {
        std::thread::sleep(Duration::from_millis(500));
        for (clips, time_s) in clips.iter_mut().zip(&yard.times_s) {
            clips.play(time_s.load(Ordering::Relaxed) as f64)?;
        }
        let (camera_s, disk) = (yard.time_s(), size_of(folder));
        let held = Held::now().map_err(|e| e.to_string())?;
        if camera_s >= shown_s + 900 {
            let (hours, ours) = (camera_s as f64 / 3600.0, began.elapsed().as_secs());
            println!("{hours:>8.2} h  {ours:>6} s  {held}, {:.1} MB on disk", disk as f64 / 1e6);
            shown_s = camera_s;
        }
        // What one of two holds says nothing about what both do.
        if !yard.is_any_over() {
            looks.push(Look { camera_s, held, disk });
        }
    }
    if yard.failed.load(Ordering::Relaxed) {
        return Ok("stopped early".to_owned());
    }
    clips.iter_mut().try_for_each(|clips| clips.play(f64::INFINITY))?;
    // Before the camera that stands somebody comes and goes; the one on a head may keep its target for hours.
    for ((name, clips), least) in NAMES.iter().zip(&clips).zip([seconds / 3600, 1]) {
        clips.check(least).map_err(|reason| format!("{name}: {reason}"))?;
    }
    let said: Vec<String> = NAMES.iter().zip(&clips).map(|(name, clips)| format!("{name}: {clips}")).collect();
    let verdict = verdict(&looks, seconds)?;
    Ok(format!("{verdict}\n{}", said.join("\n")))
}

/// Whether memory and disk stay what they are, once the oldest segments have begun to go.
fn verdict(looks: &[Look], seconds: u64) -> Outcome<String> {
    let warm = (KEEP_S + 2 * SEGMENT_S).min(seconds / 3);
    let looks: Vec<&Look> = looks.iter().filter(|look| look.camera_s >= warm).collect();
    if looks.len() < 9 {
        return Err("it was too short".into());
    }
    let third = looks.len() / 3;
    let (first, last) = (&looks[..third], &looks[looks.len() - third..]);
    let kib = |looks: &[&Look]| looks.iter().map(|look| look.held.kib as f64).sum::<f64>() / looks.len() as f64;
    let disk = |looks: &[&Look]| looks.iter().map(|look| look.disk).max().unwrap_or(0) as f64;
    let extremes = |of: fn(&Look) -> u64| {
        let (least, most) = (looks.iter().map(|look| of(look)).min(), looks.iter().map(|look| of(look)).max());
        (least.unwrap_or(0), most.unwrap_or(0))
    };
    let (least_kib, most_kib) = extremes(|look| look.held.kib);
    let (threads, files) = (extremes(|look| look.held.threads as u64), extremes(|look| look.held.files as u64));
    let said = format!(
        "from {:.2} h on: memory {:.1} to {:.1} MiB (mean of the first third {:.1}, of the last {:.1}), threads {} to {}, files {} to {}, \
         disk at most {:.1} MB in the first third, {:.1} in the last",
        warm as f64 / 3600.0,
        least_kib as f64 / 1024.0,
        most_kib as f64 / 1024.0,
        kib(first) / 1024.0,
        kib(last) / 1024.0,
        threads.0,
        threads.1,
        files.0,
        files.1,
        disk(first) / 1e6,
        disk(last) / 1e6
    );
    // Before the first segments go, what is written can but grow.
    let bounded = seconds < 2 * KEEP_S || disk(last) <= 1.25 * disk(first);
    let said = if seconds < 2 * KEEP_S { said + " (too short to judge the disk by)" } else { said };
    let flat = kib(last) - kib(first) <= GROWS_KIB && bounded;
    // A connection that ends and the one that replaces it may be there together, and a clip with the one after it.
    let lost = threads.1 > threads.0 + 8 || files.1 > files.0 + 24;
    if flat && !lost { Ok(said) } else { Err(format!("not flat: {said}").into()) }
}

/// Bytes of all files below a folder.
fn size_of(folder: &Path) -> u64 {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let size = |entry: std::fs::DirEntry| match entry.metadata() {
        Ok(data) if data.is_dir() => size_of(&entry.path()),
        Ok(data) => data.len(),
        Err(_) => 0,
    };
    entries.map(size).sum()
}
