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

    /// How many of the newest of a kind may still be in the making.
    const UNFINISHED: usize = 2;

    /// Plays those that are new and whole: all but the newest of each kind, and these too at the end.
    ///
    /// # Errors
    /// Where one does not play.
    pub fn play(&mut self, at_the_end: bool) -> Result<(), Box<dyn Error + Send + Sync>> {
        let list = std::fs::read_to_string(self.folder.with_file_name("segments.jsonl")).unwrap_or_default();
        let named = |kind: &str| -> Vec<String> {
            let files = list.lines().filter_map(|line| line.strip_prefix("{\"file\":\"clips/")?.split_once('"'));
            let mut names: Vec<String> =
                files.map(|(name, _)| name.to_owned()).filter(|name| name.starts_with(kind)).collect();
            if !at_the_end {
                names.truncate(names.len().saturating_sub(Self::UNFINISHED));
            }
            names
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
