//! How well whoever moves is followed, by motion alone, on a clip with truth: stares, coverage and identities.
//!
//!     cargo run --profile suite -p pursuit-trackers --example movers -- CLIP TRUTH one|many [VARY] [KEY=VALUE …]
//!
//! CLIP is a file, or `fault:NAME`, a scene in which one thing leads a background astray (`tests/movers/faults.rs`); TRUTH is then its seed.
//! Else TRUTH is `frame,x,y,w,h` with a title line (no line: nobody is there), or a MOT ground truth (`.txt`, frames from 1). VARY is
//! one of the changes of [`vary`]; settings are those of the detector, `many.KEY` and `acquire.KEY` those of what follows.
//! `fps=N` says how fast a folder of pictures was taken (25 a second), `mot=FILE` writes what was told (MOTChallenge).
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "an instrument for developers may panic")]

#[path = "../tests/movers/faults.rs"]
mod faults;
#[path = "../tests/movers/figures.rs"]
mod figures;

use faults::{Fault, Staged};
use figures::{Figures, Truth};
use pursuit_geometry::BBox;
use pursuit_imaging::{Frame, Image, Pixels};
use pursuit_media::{OpenOptions, open};
use pursuit_parameters::Parameters;
use pursuit_trackers::registry;
use pursuit_tracking::many::{Acquiring, AcquisitionParams, Associating};
use pursuit_tracking::{MultiTracker, Track, TrackState};
use std::fmt::Write;
use std::time::{Duration, Instant};

fn truth(path: &str) -> Truth {
    let text = std::fs::read_to_string(path).unwrap();
    let mut all = Truth::new();
    for line in text.lines() {
        let n: Vec<Option<f64>> =
            line.split(',').map(|v| v.trim().parse().ok().filter(|v: &f64| !v.is_nan())).collect();
        let mot = path.ends_with(".txt");
        let numbers = n.len();
        let (at, from) = if mot { (n[0].map(|f| f - 1.0), 2) } else { (n[0], numbers.saturating_sub(4)) };
        let sides: Option<Vec<f64>> = n.get(from..from + 4).and_then(|s| s.iter().copied().collect());
        if let (Some(at), Some(s)) = (at, sides.filter(|s| s[2] > 0.0)) {
            all.entry(at as u64).or_default().push(BBox::from_ltwh(s[0], s[1], s[2], s[3]));
        }
    }
    all
}

/// The clip as another camera would have seen it: `ramp` (exposure goes down to half and up again), `switch` (the light goes to
/// 60 % and back), `shake` (by up to 2 px), `noise`, `dark`, `cut` (the first frame is shown again for 2 s from frame 400 on).
fn vary(frame: Frame, how: &str, first: &mut Option<Frame>) -> Frame {
    let k = frame.index();
    first.get_or_insert_with(|| frame.clone());
    let gain = match how {
        "ramp" => 0.75 + 0.25 * (k as f64 * std::f64::consts::TAU / 150.0).cos(),
        "switch" if (k / 100) % 2 == 1 => 0.6,
        "dark" => 0.5,
        _ => 1.0,
    };
    let hash = |a: u64| (a.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40) as i64;
    let (dx, dy) = if how == "shake" { (hash(k) % 5 - 2, hash(k + 7_777) % 5 - 2) } else { (0, 0) };
    let source = if how == "cut" && (400..450).contains(&k) { first.clone().unwrap() } else { frame.clone() };
    if how == "none" {
        return frame;
    }
    let image = source.color();
    let (width, height) = (image.width(), image.height());
    let at = |v: usize, d: i64, n: usize| (v as i64 + d).clamp(0, n as i64 - 1) as usize;
    let changed = Image::from_fn(width, height, |x, y| {
        let pixel = image.row(at(y, dy, height))[at(x, dx, width)];
        let noise = if how == "noise" { hash(k * 7919 + (y * width + x) as u64) % 17 - 8 } else { 0 };
        pixel.map(|v| (f64::from(v) * gain + noise as f64).clamp(0.0, 255.0) as u8)
    });
    Frame::new(k, frame.time_s(), Pixels::Rgb8(changed.unwrap().into()))
}

/// What follows, from the settings.
fn targets(mode: &str, settings: &[String]) -> Box<dyn MultiTracker> {
    let table = |prefix: &str| -> toml::Table {
        let of = |s: &&String| {
            if prefix.is_empty() {
                !s.starts_with("many.") && !s.starts_with("acquire.")
            } else {
                s.starts_with(prefix)
            }
        };
        settings.iter().filter(of).map(|s| &s[prefix.len()..]).collect::<Vec<_>>().join("\n").parse().unwrap()
    };
    let entry = registry::detector("motion").unwrap();
    let detector = entry.detector(&table("")).unwrap();
    let many = registry::many(entry).with("many", &table("many.")).unwrap();
    if mode == "many" {
        return Box::new(Associating::new(detector, many).unwrap());
    }
    let params = AcquisitionParams::default().with("acquire", &table("acquire.")).unwrap();
    let recipe = registry::tracker(if mode == "one" { "person" } else { mode }).unwrap().default_recipe();
    Box::new(Acquiring::new(detector, recipe, params).unwrap())
}

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [clip, truth_path, mode, rest @ ..] = args.as_slice() else {
        panic!("CLIP TRUTH one|many [VARY] [KEY=VALUE …]")
    };
    let (mut settings, how): (Vec<String>, Vec<String>) = rest.iter().cloned().partition(|s| s.contains('='));
    let mut said_apart = |name: &str| {
        let at = settings.iter().position(|s| s.starts_with(name))?;
        Some(settings.remove(at).split_off(name.len()))
    };
    let default_fps = said_apart("fps=").map_or(25.0, |fps| fps.parse().unwrap());
    let mot = said_apart("mot=");
    let verbose = how.iter().any(|h| h == "verbose");
    let how = how.iter().find(|h| *h != "verbose").map_or("none", String::as_str);
    let truth = if clip.starts_with("fault:") { Truth::new() } else { truth(truth_path) };
    let targets = Some(targets(mode, &settings));
    let mut run = Run { targets, truth: truth.clone(), seen: truth, one: mode != "many", verbose, ..Run::default() };
    if let Some(scene) = clip.strip_prefix("fault:") {
        let fault = *Fault::ALL.iter().find(|f| f.name() == scene).expect("no such fault");
        let staged = Staged::new(fault, truth_path.parse().unwrap());
        for k in 0..staged.frames() {
            let moment = staged.moment(k);
            run.seen.insert(k, moment.seen);
            run.truth.insert(k, moment.half_seen);
            run.look(&moment.frame);
        }
    } else {
        let mut first = None;
        let mut source = open(clip, &OpenOptions { default_fps, ..OpenOptions::from_env() }).unwrap();
        while let Some(frame) = source.next_frame().unwrap() {
            run.look(&vary(frame, how, &mut first));
        }
    }
    if let Some(file) = mot {
        std::fs::write(file, run.mot()).unwrap();
    }
    let (took, frames) = (run.took.as_secs_f64(), run.said.len().max(1));
    println!(
        "{clip} {mode} {how} {settings:?}: {}, {:.2} ms a frame",
        run.figures().line(),
        1e3 * took / frames as f64
    );
}

/// What is followed, and what was said so far.
#[derive(Default)]
struct Run {
    targets: Option<Box<dyn MultiTracker>>,
    truth: Truth,
    seen: Truth,
    one: bool,
    verbose: bool,
    said: Vec<(u64, Vec<Track>)>,
    took: Duration,
}

impl Run {
    fn look(&mut self, frame: &Frame) {
        let mut tracks = Vec::new();
        let _ = frame.color();
        let began = Instant::now();
        self.targets.as_mut().unwrap().step(frame, &mut tracks).unwrap();
        self.took += began.elapsed();
        for (track, e) in tracks.iter().filter(|_| self.verbose).filter_map(|t| Some((t, t.estimate.as_ref()?))) {
            let foreground = e.diagnostics.get("foreground").unwrap_or(0.0);
            println!("{} {} {:?} {:?} {:.2} {foreground:.3}", frame.index(), track.id, e.state, e.bbox.ltwh(), e.score);
        }
        self.said.push((frame.index(), tracks));
    }

    /// A line a box that is told as tracked: frame, identity, left, top, width, height; frames and pixels are counted from 1.
    fn mot(&self) -> String {
        let mut text = String::new();
        for (k, tracks) in &self.said {
            for (id, e) in tracks.iter().filter_map(|t| Some((t.id, t.estimate.as_ref()?))) {
                let (left, top, width, height) = e.bbox.ltwh();
                if e.state == TrackState::Tracking {
                    writeln!(
                        text,
                        "{},{id},{:.2},{:.2},{width:.2},{height:.2},{:.3},-1,-1,-1",
                        k + 1,
                        left + 1.0,
                        top + 1.0,
                        e.score
                    )
                    .unwrap();
                }
            }
        }
        text
    }

    fn figures(&self) -> Figures {
        let mut figures = Figures::default();
        for (k, tracks) in &self.said {
            figures.count(*k, tracks, (&self.seen, &self.truth), self.one);
        }
        figures
    }
}
