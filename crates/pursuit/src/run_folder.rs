//! Where a run writes: nothing of the user's is overwritten, and no two runs write into one folder.

use crate::RunError;
use crate::revise::EDITS;
use crate::segments::{self, JOURNAL};
use crate::sinks::Format;
use crate::{measure, trajectory_plots};
use pursuit_address::Locator;
use std::fs::File;
use std::io::{self, ErrorKind, Read};
use std::path::{Path, PathBuf};

/// The facts of a run; a folder that holds them holds a run.
pub(crate) const FACTS: &str = "run.json";
/// The overlay video.
pub(crate) const OVERLAY: &str = "overlay.mp4";
/// What the targets know, of a run that was interrupted.
pub(crate) const STATE: &str = "state.bin";
/// The folder of plots.
pub(crate) const PLOTS: &str = "plots";
/// The link to the newest of the numbered folders, beside them.
const LATEST: &str = "latest";
/// The facts of a run are a few kilobytes; what is larger is something else.
const MOST_FACTS_BYTES: u64 = 1 << 24;

/// Where a run is going to write, checked.
#[derive(Debug)]
pub(crate) struct Destination {
    path: PathBuf,
    /// The first of `path`, `path-2`, `path-3` … that is not there yet.
    numbered: bool,
    /// Whether segments that an earlier run left stay: they go by their age.
    keeps_segments: bool,
    inputs: Vec<PathBuf>,
}

/// The folder that a run writes, its own until it is dropped.
#[derive(Debug)]
pub(crate) struct RunFolder {
    path: PathBuf,
    _lock: Option<File>,
}

impl Destination {
    /// `out` as named by the user, else a new folder named after `input`; with `overwrite` the first of that name, whose
    /// earlier run is replaced. `inputs` are never written.
    ///
    /// # Errors
    /// When a file of a run's name is there and no run wrote it, or it is an input.
    pub fn new(
        out: Option<&Path>,
        overwrite: bool,
        input: &Locator,
        inputs: impl IntoIterator<Item = PathBuf>,
    ) -> Result<Self, RunError> {
        let path = out.map_or_else(|| default_folder(input), Path::to_path_buf);
        let numbered = out.is_none() && !overwrite;
        let destination = Self { path, numbered, keeps_segments: false, inputs: inputs.into_iter().collect() };
        if !numbered {
            destination.check()?;
        }
        Ok(destination)
    }

    /// Leaves the segments of earlier runs where they are.
    #[must_use]
    pub fn keeping_segments(self, keeps_segments: bool) -> Self {
        Self { keeps_segments, ..self }
    }

    /// The folder, or the first that is tried.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Whether an earlier run may be replaced.
    fn check(&self) -> Result<(), RunError> {
        let path = &self.path;
        if path.exists() && !path.is_dir() {
            return Err(RunError::output(path)(ErrorKind::NotADirectory.into()));
        }
        let there = results_in(path);
        for file in &there {
            if let Some(input) = self.inputs.iter().find(|i| same_file::is_same_file(i, file).unwrap_or(false)) {
                return Err(RunError::usage(format!(
                    "{} would be overwritten, and it is the input {}; name another folder with `--out`",
                    file.display(),
                    input.display()
                )));
            }
        }
        match there.first() {
            Some(file) if !holds_a_run(path) => Err(RunError::usage(format!(
                "{} would be overwritten, and no run wrote it ({} is missing or no run's); name another folder with `--out`",
                file.display(),
                path.join(FACTS).display()
            ))),
            _ => Ok(()),
        }
    }

    /// Takes the folder as it is, to go on with the run in it.
    ///
    /// # Errors
    /// When another run is writing into it.
    pub fn reopen(self) -> Result<RunFolder, RunError> {
        RunFolder::taken(&self.path)
    }

    /// Makes the folder, takes it, and removes what an earlier run left there.
    ///
    /// # Errors
    /// When it cannot be made, or another run is writing into it.
    pub fn open(self) -> Result<RunFolder, RunError> {
        if self.numbered {
            return RunFolder::numbered(&self.path);
        }
        std::fs::create_dir_all(&self.path).map_err(RunError::output(&self.path))?;
        let lock = lock(&self.path)?;
        // What was checked first may be otherwise by now.
        self.check()?;
        let kept: Vec<PathBuf> = match self.keeps_segments {
            true => segments::listed(&self.path).chain([self.path.join(JOURNAL)]).collect(),
            false => Vec::new(),
        };
        for file in results_in(&self.path).into_iter().filter(|file| !kept.contains(file)) {
            std::fs::remove_file(&file).map_err(RunError::output(&file))?;
        }
        Ok(RunFolder { path: self.path, _lock: lock })
    }
}

impl RunFolder {
    /// The first of `base`, `base-2`, `base-3` … that is not there yet.
    ///
    /// # Errors
    /// When it cannot be made.
    pub fn numbered(base: &Path) -> Result<Self, RunError> {
        let path = new_folder(base)?;
        let lock = lock(&path)?;
        link_latest(&path);
        Ok(Self { path, _lock: lock })
    }

    /// A folder as it is.
    ///
    /// # Errors
    /// When another run is writing into it.
    pub fn taken(path: &Path) -> Result<Self, RunError> {
        Ok(Self { path: path.to_path_buf(), _lock: lock(path)? })
    }

    /// The folder.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// A file in it.
    pub fn file(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }
}

/// The folder of the run of `input` to go on with: the one named, else the newest of those that its name gives.
pub(crate) fn earlier(out: Option<&Path>, overwrite: bool, input: &Locator) -> PathBuf {
    let first = out.map_or_else(|| default_folder(input), Path::to_path_buf);
    if out.is_some() || overwrite {
        return first;
    }
    let numbered = |n: u64| {
        let mut name = first.as_os_str().to_owned();
        name.push(format!("-{n}"));
        PathBuf::from(name)
    };
    let newest = (2..).map(numbered).take_while(|path| path.exists()).last();
    newest.unwrap_or(first)
}

/// The files in `folder` that have the names of a run's results; links that lead nowhere are there too, devices and pipes
/// hold nothing that could be lost.
fn results_in(folder: &Path) -> Vec<PathBuf> {
    let fixed = [FACTS, OVERLAY, STATE, EDITS, segments::EVENTS]
        .into_iter()
        .chain(Format::ALL.iter().map(|f| f.file_name()))
        .map(|name| folder.join(name));
    let entries = |folder: &Path| std::fs::read_dir(folder).into_iter().flatten().flatten();
    let is_plot = |name: &str| trajectory_plots::is_plot(name) || measure::is_result(name);
    let plots = entries(&folder.join(PLOTS)).filter(|e| e.file_name().to_str().is_some_and(is_plot)).map(|e| e.path());
    let measured = entries(folder).filter(|e| e.file_name().to_str().is_some_and(measure::is_result)).map(|e| e.path());
    let holds = |file: &PathBuf| match file.metadata() {
        Ok(target) => target.is_file() || target.is_dir(),
        Err(_) => file.is_symlink(),
    };
    let numbered = (2..).map(|n| folder.join(format!("overlay-{n}.mp4"))).take_while(|path| path.exists());
    // The list goes last, so that a removal that is interrupted leaves no file that nobody knows.
    let cut = segments::listed(folder).chain([folder.join(JOURNAL)]);
    fixed.chain(plots).chain(measured).chain(numbered).chain(cut).filter(holds).collect()
}

fn holds_a_run(folder: &Path) -> bool {
    let facts = || -> io::Result<serde_json::Value> {
        let mut text = String::new();
        File::open(folder.join(FACTS))?.take(MOST_FACTS_BYTES).read_to_string(&mut text)?;
        Ok(serde_json::from_str(&text)?)
    };
    facts().is_ok_and(|f| f["recipe"]["tracker"].is_string() && f["status"].is_string())
}

/// The first of `base`, `base-2`, `base-3` … that is not there yet, made.
fn new_folder(base: &Path) -> Result<PathBuf, RunError> {
    if let Some(parent) = base.parent() {
        std::fs::create_dir_all(parent).map_err(RunError::output(parent))?;
    }
    let mut path = base.to_path_buf();
    for number in 2_u64.. {
        match std::fs::create_dir(&path) {
            Err(e) if e.kind() == ErrorKind::AlreadyExists => {
                let mut name = base.as_os_str().to_owned();
                name.push(format!("-{number}"));
                path = name.into();
            }
            made => return made.map(|()| path.clone()).map_err(RunError::output(&path)),
        }
    }
    Ok(path)
}

/// Holds the folder against other runs, where the system can; the system lets go when the process ends, however it ends.
fn lock(folder: &Path) -> Result<Option<File>, RunError> {
    let Ok(file) = File::open(folder) else { return Ok(None) };
    match file.try_lock() {
        Ok(()) => Ok(Some(file)),
        Err(std::fs::TryLockError::WouldBlock) => {
            Err(RunError::output(folder)(io::Error::other("another run is writing into it; name another folder")))
        }
        Err(std::fs::TryLockError::Error(_)) => Ok(None),
    }
}

/// Lets `latest`, beside the numbered folders, lead to this one. A convenience: what hinders it is no error, and what is
/// there and no link stays.
fn link_latest(folder: &Path) {
    #[cfg(unix)]
    if let (Some(parent), Some(name)) = (folder.parent(), folder.file_name()) {
        let link = parent.join(LATEST);
        let replaceable = link.symlink_metadata().map_or(true, |m| m.is_symlink());
        let fresh = parent.join(format!(".{LATEST}-{}", std::process::id()));
        if replaceable && std::os::unix::fs::symlink(name, &fresh).is_ok() && std::fs::rename(&fresh, &link).is_err() {
            let _ = std::fs::remove_file(&fresh);
        }
    }
    #[cfg(not(unix))]
    let _ = (folder, LATEST);
}

/// `pursuit-out/NAME`, with NAME made from the input's.
fn default_folder(input: &Locator) -> PathBuf {
    Path::new("pursuit-out").join(name_of(input))
}

/// A name for a folder, after the input.
pub(crate) fn name_of(input: &Locator) -> String {
    let shown = input.to_string();
    // Neither the user of a camera nor what stands for the password names a folder.
    let input = shown.rsplit_once("***@").map_or(&*shown, |(_, host)| host);
    let last = input.trim_end_matches('/').rsplit(['/', '\\']).next().unwrap_or(input);
    let stem = Path::new(last).file_stem().and_then(|s| s.to_str()).unwrap_or(last);
    let safe: String = stem.chars().map(|c| if c.is_alphanumeric() || "-_.".contains(c) { c } else { '-' }).collect();
    let safe = safe.trim_matches(['.', '-']);
    if safe.is_empty() { "run".to_owned() } else { safe.to_owned() }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;

    const RUN: &str = r#"{"status": "done", "recipe": {"tracker": "kcf"}}"#;

    fn at(out: &Path, inputs: &[&Path]) -> Result<RunFolder, RunError> {
        Destination::new(Some(out), false, &"x".into(), inputs.iter().map(|p| p.to_path_buf()))?.open()
    }

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> =
            std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn folders_are_named_after_inputs_and_stay_inside() {
        for (input, folder) in [
            ("a/b/clip.mp4", "clip"),
            ("a/b/", "b"),
            ("-", "run"),
            ("..", "run"),
            ("rtsp://host/stream?x=1", "stream-x-1"),
            ("rtsp://user:sesame@host", "host"),
            ("http://user:sesame@host/a/b.mp4?token=abc", "b"),
            ("camera:0", "camera-0"),
            ("scene:table-tennis?seed=1", "scene-table-tennis-seed-1"),
        ] {
            assert_eq!(default_folder(&input.into()), Path::new("pursuit-out").join(folder), "{input}");
        }
    }

    #[test]
    fn an_earlier_run_is_replaced_as_a_whole_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path();
        std::fs::create_dir(out.join(PLOTS)).unwrap();
        for file in ["run.json", "trajectory.jsonl", "overlay.mp4", "notes.txt", "plots/x.svg", "plots/mine.svg"] {
            std::fs::write(out.join(file), RUN).unwrap();
        }
        assert_eq!(at(out, &[]).unwrap().path(), out);
        assert_eq!(names(out), ["notes.txt", "plots"]);
        assert_eq!(names(&out.join(PLOTS)), ["mine.svg"]);
    }

    #[test]
    fn what_no_run_wrote_is_not_overwritten() {
        for facts in [None, Some("{}"), Some("no JSON")] {
            let folder = tempfile::tempdir().unwrap();
            let out = folder.path();
            std::fs::write(out.join("trajectory.csv"), "mine").unwrap();
            if let Some(facts) = facts {
                std::fs::write(out.join(FACTS), facts).unwrap();
            }
            let refused = at(out, &[]).unwrap_err();
            assert_eq!(refused.exit_code(), 2);
            assert!(refused.to_string().contains("no run wrote it"), "{refused}");
            assert_eq!(std::fs::read_to_string(out.join("trajectory.csv")).unwrap(), "mine");
        }
        let file = tempfile::NamedTempFile::new().unwrap();
        assert_eq!(at(file.path(), &[]).unwrap_err().exit_code(), 4);
    }

    #[test]
    fn an_input_is_not_overwritten_by_whatever_name() {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("run");
        std::fs::create_dir(&out).unwrap();
        std::fs::write(out.join(FACTS), RUN).unwrap();
        std::fs::write(out.join(OVERLAY), "film").unwrap();
        let other = folder.path().join("film.mp4");
        std::fs::hard_link(out.join(OVERLAY), &other).unwrap();
        let missing = folder.path().join("missing");
        for input in [out.join(OVERLAY), out.join("../run/overlay.mp4"), other] {
            let refused = at(&out, &[&missing, &input]).unwrap_err();
            assert!(refused.to_string().contains("it is the input"), "{refused}");
            assert_eq!(names(&out), ["overlay.mp4", "run.json"]);
        }
        assert!(at(&out, &[&missing]).is_ok());
    }

    #[test]
    fn a_folder_is_one_runs_at_a_time() {
        let folder = tempfile::tempdir().unwrap();
        let first = at(folder.path(), &[]).unwrap();
        if first._lock.is_some() {
            let refused = at(folder.path(), &[]).unwrap_err();
            assert_eq!(refused.exit_code(), 4);
            assert!(refused.to_string().contains("another run is writing into it"), "{refused}");
        }
        drop(first);
        assert!(at(folder.path(), &[]).is_ok());
    }

    #[test]
    fn without_a_name_every_run_has_a_folder_of_its_own() {
        let folder = tempfile::tempdir().unwrap();
        let base = folder.path().join("clip");
        let numbered = || {
            Destination { path: base.clone(), numbered: true, keeps_segments: false, inputs: Vec::new() }
                .open()
                .unwrap()
        };
        for name in ["clip", "clip-2", "clip-3"] {
            let run = numbered();
            assert_eq!(run.path(), folder.path().join(name));
            #[cfg(unix)]
            assert_eq!(std::fs::read_link(folder.path().join(LATEST)).unwrap(), Path::new(name));
        }
        // What is called so and is no link is somebody's.
        #[cfg(unix)]
        std::fs::remove_file(folder.path().join(LATEST)).unwrap();
        std::fs::write(folder.path().join(LATEST), "mine").unwrap();
        assert_eq!(numbered().path(), folder.path().join("clip-4"));
        assert_eq!(std::fs::read_to_string(folder.path().join(LATEST)).unwrap(), "mine");
        assert_eq!(names(folder.path()), ["clip", "clip-2", "clip-3", "clip-4", "latest"]);
    }
}
