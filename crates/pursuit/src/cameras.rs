//! Several inputs at once, in one process: cameras that are watched for days.

use crate::config::RunConfig;
use crate::{Finished, Remote, Run, RunError};
use pursuit_address::Locator;
use pursuit_media::OpenOptions;
use pursuit_media::wrappers::{Patience, Reconnect};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// The table of a configuration that names them.
const TABLE: &str = "cameras";
/// Where results go unless it is said.
const OUT: &str = "pursuit-out";
/// The exit status of what makes no sense, and of an input that cannot be read.
const USAGE: u8 = 2;
const UNREADABLE: u8 = 3;
/// How often it is looked whether to stop.
const GLANCE: Duration = Duration::from_millis(100);
/// How long a camera that cannot be opened is left alone.
const AGAIN: Duration = Duration::from_secs(10);

/// What a configuration says of several cameras: of all, and of each.
#[derive(Debug, Clone, PartialEq)]
pub struct Cameras {
    common: RunConfig,
    own: BTreeMap<String, RunConfig>,
}

/// One of them.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    /// Its name.
    pub name: String,
    /// How it is watched.
    pub config: RunConfig,
}

/// What became of one.
#[derive(Debug)]
pub struct Watched {
    /// Its name.
    pub name: String,
    /// What it left, or why there is nothing.
    pub finished: Result<Finished, RunError>,
}

impl Cameras {
    /// Reads a configuration that has `[cameras.NAME]` tables; none where it has not.
    ///
    /// # Errors
    /// [`RunError::Usage`] when it cannot be read, or holds something that has no meaning.
    pub fn read(path: &Path) -> Result<Option<Self>, RunError> {
        let wrong = |problem: String| RunError::usage(format!("configuration {}: {problem}", path.display()));
        let text = std::fs::read_to_string(path).map_err(|e| wrong(e.to_string()))?;
        let mut table: toml::Table = text.parse().map_err(|e: toml::de::Error| wrong(e.to_string()))?;
        let Some(cameras) = table.remove(TABLE) else { return Ok(None) };
        let toml::Value::Table(cameras) = cameras else {
            return Err(wrong(format!("`{TABLE}` is no table; write [{TABLE}.NAME] for each camera")));
        };
        let one = |name: &str, table: toml::Table| {
            RunConfig::deserialize(table).map_err(|e| {
                let place = if name.is_empty() { String::new() } else { format!("[{TABLE}.{name}]: ") };
                wrong(format!("{place}{}", e.to_string().trim_end()))
            })
        };
        let common = RunConfig { read_from: Some(path.to_path_buf()), ..one("", table)? };
        if common.input.is_some() {
            return Err(wrong(format!("`input` belongs to one camera; write it below [{TABLE}.NAME]")));
        }
        let mut own = BTreeMap::new();
        for (name, value) in cameras {
            let fits = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
            if name.is_empty() || !name.chars().all(fits) {
                return Err(wrong(format!(
                    "`{name}` is no name of a camera: letters from A to Z, digits, - and _ alone"
                )));
            }
            let toml::Value::Table(table) = value else {
                return Err(wrong(format!(
                    "`{TABLE}.{name}` is no table; write [{TABLE}.{name}] and its `input` below"
                )));
            };
            let config = one(&name, table)?;
            if config.input.is_none() {
                return Err(wrong(format!("[{TABLE}.{name}] has no `input`; name its camera, stream or file")));
            }
            own.insert(name, config);
        }
        if own.is_empty() {
            return Err(wrong(format!("`{TABLE}` has no camera; write [{TABLE}.NAME] for each")));
        }
        Ok(Some(Self { common, own }))
    }

    /// Each camera with what `over` says in the place of both. Where a folder or a broker is named for all, each has a part of its own
    /// there, named after it.
    pub fn overridden_by(self, over: &RunConfig) -> Vec<Camera> {
        let Self { common, own } = self;
        let one = |(name, own): (String, RunConfig)| {
            let shared = common.clone().overridden_by(RunConfig {
                out: over.out.clone(),
                publish: over.publish.clone(),
                ..RunConfig::default()
            });
            let is_said = |of_over: bool, of_own: bool| of_own && !of_over;
            let out = match &own.out {
                Some(out) if is_said(over.out.is_some(), true) => out.clone(),
                _ => shared.out.clone().unwrap_or_else(|| PathBuf::from(OUT)).join(&name),
            };
            let publish = match &own.publish {
                Some(publish) if is_said(over.publish.is_some(), true) => Some(publish.clone()),
                _ => shared.publish.as_ref().map(|address| below(address, &name)),
            };
            let config = common.clone().overridden_by(own).overridden_by(over.clone());
            Camera { config: RunConfig { out: Some(out), publish, ..config }, name }
        };
        own.into_iter().map(one).collect()
    }
}

/// The address of a broker with one more level in its prefix.
fn below(address: &Locator, name: &str) -> Locator {
    let text = address.reveal();
    let rest = text.split_once("://").map_or(text, |(_, rest)| rest);
    match rest.split_once('/') {
        Some((_, prefix)) if !prefix.is_empty() => Locator::new(format!("{}/{name}", text.trim_end_matches('/'))),
        _ => Locator::new(format!("{}/pursuit/{name}", text.trim_end_matches('/'))),
    }
}

/// Watches all cameras, each on a thread of its own, until they have ended or `stop` is true. Nothing is written before every camera's
/// configuration is known to make sense. One that cannot be opened, or breaks off, holds up no other; a stream that does not answer
/// is tried again for as long as `options` allow.
///
/// # Errors
/// [`RunError::Usage`] naming the first camera whose configuration makes no sense, and when the system gives no threads.
pub fn watch(cameras: Vec<Camera>, options: &OpenOptions, stop: &AtomicBool) -> Result<Vec<Watched>, RunError> {
    let room = Room { stop, options, remotes: Mutex::new(Vec::new()) };
    let names: Vec<String> = cameras.iter().map(|camera| camera.name.clone()).collect();
    std::thread::scope(|scope| {
        let (checked, checks) = channel();
        let mut going = Vec::new();
        let mut threads = Vec::new();
        for Camera { name, config } in cameras {
            let (go, goes) = channel();
            let (checked, room) = (checked.clone(), &room);
            let run = move || room.watch(config, &checked, &goes);
            let thread = std::thread::Builder::new().name(format!("watch {name}")).spawn_scoped(scope, run);
            threads.push(thread.map_err(RunError::output("a thread for each camera"))?);
            going.push(go);
        }
        drop(checked);
        // Each says once whether its configuration makes sense.
        let wrong = checks.iter().take(names.len()).find_map(|outcome: Result<(), RunError>| outcome.err());
        if let Some(error) = wrong {
            drop(going);
            room.stop_all();
            return Err(error);
        }
        // One that has ended before does not wait.
        going.iter().for_each(|go| go.send(()).unwrap_or_default());
        while threads.iter().any(|thread| !thread.is_finished()) {
            if stop.load(Ordering::Relaxed) {
                room.stop_all();
            }
            std::thread::sleep(GLANCE);
        }
        let broken = || Err(RunError::usage("it ended without a word; please report this"));
        let ended = threads.into_iter().map(|thread| thread.join().unwrap_or_else(|_| broken()));
        Ok(names.into_iter().zip(ended).map(|(name, finished)| Watched { name, finished }).collect())
    })
}

/// What all of them share.
struct Room<'a> {
    stop: &'a AtomicBool,
    options: &'a OpenOptions,
    remotes: Mutex<Vec<Remote>>,
}

impl Room<'_> {
    fn remotes(&self) -> MutexGuard<'_, Vec<Remote>> {
        self.remotes.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn stop_all(&self) {
        self.remotes().iter().for_each(Remote::stop);
    }

    /// One camera to its end: first whether it makes sense is told, then it waits for the word to go.
    fn watch(
        &self,
        config: RunConfig,
        checked: &Sender<Result<(), RunError>>,
        go: &Receiver<()>,
    ) -> Result<Finished, RunError> {
        let first = Run::prepare(config.clone(), self.options);
        let not_begun = || RunError::usage("it was not begun");
        match &first {
            Err(error) if error.exit_code() == USAGE => {
                let _ = checked.send(Err(RunError::usage(error.to_string())));
                return Err(not_begun());
            }
            _ => drop(checked.send(Ok(()))),
        }
        go.recv().map_err(|_| not_begun())?;
        let run = match first {
            Ok(run) => run,
            Err(error) => self.open_again(config, error)?,
        };
        let remote = run.remote();
        // Whoever is stopped before it has begun is stopped at its first frame.
        if self.stop.load(Ordering::Relaxed) {
            remote.stop();
        }
        self.remotes().push(remote);
        run.run(|_| {})
    }

    /// Opens a stream that did not answer, again and again for as long as is allowed.
    fn open_again(&self, config: RunConfig, mut error: RunError) -> Result<Run, RunError> {
        let Patience { reconnect, .. } = self.options.patience;
        let is_stream = config.input.as_ref().is_some_and(|input| input.scheme().is_some());
        let limit = match reconnect {
            _ if !is_stream => Duration::ZERO,
            Reconnect::Never => Duration::ZERO,
            Reconnect::For(limit) => limit,
            Reconnect::Forever => Duration::MAX,
        };
        let began = Instant::now();
        // A folder that cannot be written does not mend itself.
        while error.exit_code() == UNREADABLE && began.elapsed() < limit {
            tracing::warn!("{error}; it is tried again in {} s", AGAIN.as_secs());
            let paused = Instant::now();
            while paused.elapsed() < AGAIN {
                if self.stop.load(Ordering::Relaxed) {
                    return Err(error);
                }
                std::thread::sleep(GLANCE);
            }
            match Run::prepare(config.clone(), self.options) {
                Ok(run) => return Ok(run),
                Err(again) => error = again,
            }
        }
        Err(error)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Option<Cameras>, RunError> {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), text).unwrap();
        Cameras::read(file.path())
    }

    #[test]
    fn what_is_said_of_all_is_of_each_unless_it_says_otherwise() {
        let text = "tracker = 'mosse'\nout = 'days'\npublish = 'mqtt://house/watch/'\n\
            [cameras.yard]\ninput = 'rtsp://yard/1'\ntracker = 'kcf'\n\
            [cameras.door]\ninput = 'rtsp://door/1'\nout = 'elsewhere'\npublish = 'mqtt://other/door'";
        let all = read(text).unwrap().unwrap().overridden_by(&RunConfig::default());
        let [door, yard] = &all[..] else { unreachable!("{all:?}") };
        assert_eq!((&*door.name, door.config.tracker.as_deref()), ("door", Some("mosse")));
        assert_eq!(yard.config.tracker.as_deref(), Some("kcf"));
        assert_eq!(yard.config.out.as_deref(), Some(Path::new("days/yard")));
        assert_eq!(door.config.out.as_deref(), Some(Path::new("elsewhere")));
        assert_eq!(yard.config.publish.as_ref().unwrap().reveal(), "mqtt://house/watch/yard");
        assert_eq!(door.config.publish.as_ref().unwrap().reveal(), "mqtt://other/door");
        // What the command line says is said of each.
        let flags = RunConfig {
            tracker: Some("csk".into()),
            out: Some("flag".into()),
            publish: Some(Locator::new("mqtt://flag")),
            ..RunConfig::default()
        };
        for camera in read(text).unwrap().unwrap().overridden_by(&flags) {
            assert_eq!(camera.config.tracker.as_deref(), Some("csk"));
            assert_eq!(camera.config.out, Some(Path::new("flag").join(&camera.name)));
            let topic = format!("mqtt://flag/pursuit/{}", camera.name);
            assert_eq!(camera.config.publish.unwrap().reveal(), topic);
        }
    }

    #[test]
    fn what_names_no_cameras_is_told() {
        assert_eq!(read("tracker = 'mosse'").unwrap(), None);
        for (text, words) in [
            ("cameras = 3", "write [cameras.NAME]"),
            ("[cameras]", "has no camera"),
            ("[cameras.yard]\ntracker = 'mosse'", "[cameras.yard] has no `input`"),
            ("[cameras.yard]\ninput = 'a'\ntraker = 'mosse'", "[cameras.yard]: unknown field `traker`"),
            ("traker = 'mosse'\n[cameras.yard]\ninput = 'a'", "unknown field `traker`"),
            ("input = 'b'\n[cameras.yard]\ninput = 'a'", "`input` belongs to one camera"),
            ("[cameras.'a/b']\ninput = 'a'", "`a/b` is no name"),
            ("cameras.yard = 'rtsp://yard/1'", "`cameras.yard` is no table"),
        ] {
            let error = read(text).unwrap_err();
            assert!(error.exit_code() == 2 && error.to_string().contains(words), "{text}: {error}");
        }
    }

    #[test]
    fn one_that_makes_no_sense_keeps_all_from_beginning() {
        let folder = tempfile::tempdir().unwrap();
        let camera = |name: &str, tracker: &str| Camera {
            name: name.into(),
            config: RunConfig {
                input: Some(Locator::new("scene:drift?duration=1")),
                tracker: Some(tracker.into()),
                video: Some(false),
                out: Some(folder.path().join(name)),
                ..RunConfig::default()
            },
        };
        let wrong = vec![camera("a", "mosse"), camera("b", "no-such-tracker")];
        let error = watch(wrong, &OpenOptions::default(), &AtomicBool::new(false)).unwrap_err();
        assert!(error.to_string().contains("no-such-tracker"), "{error}");
        assert!(!folder.path().join("a").exists(), "nothing is written");
        // A file that is not there holds up no other.
        let mut right = vec![camera("a", "mosse"), camera("b", "mosse"), camera("c", "mosse")];
        right[1].config.input = Some(Locator::new("/nowhere/clip.mp4"));
        let all = watch(right, &OpenOptions::default(), &AtomicBool::new(false)).unwrap();
        let frames = |watched: &Watched| watched.finished.as_ref().map(|f| f.facts.frame_count).ok();
        assert_eq!(all.iter().map(frames).collect::<Vec<_>>(), [Some(30), None, Some(30)]);
    }
}
