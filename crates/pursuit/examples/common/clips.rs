//! Clips of events, each played once before it is removed.

use std::collections::BTreeSet;
use std::error::Error;
use std::fmt;
use std::path::{Path, PathBuf};

/// The clips and pictures of a run's folder.
pub struct Clips {
    folder: PathBuf,
    /// Names that were played, or seen.
    done: BTreeSet<String>,
    clips: u64,
    frames: u64,
    pictures: u64,
    missed: u64,
}

impl Clips {
    pub fn of(run: &Path) -> Self {
        let folder = run.join("clips");
        Self { folder, done: BTreeSet::new(), clips: 0, frames: 0, pictures: 0, missed: 0 }
    }

    /// A clip is whole so long after its event, seconds: it goes on for a minute at most.
    const WHOLE_S: f64 = 90.0;

    /// Plays those that are new, and whole when the camera's time is `now_s`.
    ///
    /// # Errors
    /// Where one does not play, or went before it was played.
    pub fn play(&mut self, now_s: f64) -> Result<(), Box<dyn Error + Send + Sync>> {
        let list = std::fs::read_to_string(self.folder.with_file_name("segments.jsonl")).unwrap_or_default();
        let whole = |line: &&str| {
            let time_s = line.rsplit_once("\"time_s\":").and_then(|(_, rest)| rest.trim_end_matches('}').parse().ok());
            time_s.is_some_and(|time_s: f64| time_s + Self::WHOLE_S <= now_s)
        };
        let named = |kind: &str| -> Vec<String> {
            let files =
                list.lines().filter(whole).filter_map(|line| line.strip_prefix("{\"file\":\"clips/")?.split_once('"'));
            files.map(|(name, _)| name.to_owned()).filter(|name| name.starts_with(kind)).collect()
        };
        for name in named("clip-") {
            if self.done.insert(name.clone()) {
                match count(&self.folder.join(&name)) {
                    Ok(0) => return Err(format!("{name} has no picture").into()),
                    Ok(frames) => (self.clips, self.frames) = (self.clips + 1, self.frames + frames),
                    Err(_) if !self.folder.join(&name).exists() => self.missed += 1,
                    Err(error) => return Err(format!("{name} does not play: {error}").into()),
                }
            }
        }
        for name in named("snapshot-") {
            if self.done.insert(name.clone()) {
                match std::fs::read(self.folder.join(&name)) {
                    Ok(bytes) if bytes.starts_with(&[0xff, 0xd8]) && bytes.ends_with(&[0xff, 0xd9]) => {
                        self.pictures += 1
                    }
                    Ok(_) => return Err(format!("{name} is no whole JPEG").into()),
                    Err(_) => self.missed += 1,
                }
            }
        }
        if self.missed > 0 {
            return Err(format!("{} clips or pictures went before they could be looked at", self.missed).into());
        }
        Ok(())
    }

    /// Refuses fewer than `least` clips and as many pictures.
    ///
    /// # Errors
    /// How many there were.
    pub fn check(&self, least: u64) -> Result<(), String> {
        let enough = self.clips.min(self.pictures) >= least.max(1);
        if enough { Ok(()) } else { Err(format!("only {self}")) }
    }
}

/// How many pictures a clip has.
fn count(path: &Path) -> Result<u64, Box<dyn Error + Send + Sync>> {
    let mut source = pursuit::open(path.to_string_lossy().as_ref())?;
    let mut frames = 0;
    while source.next_frame()?.is_some() {
        frames += 1;
    }
    Ok(frames)
}

impl fmt::Display for Clips {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} clips with {} pictures played, {} snapshots whole", self.clips, self.frames, self.pictures)
    }
}
