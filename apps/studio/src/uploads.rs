//! Files that came through the browser: a few, each bounded, gone with the studio.

use crate::error::Refusal;
use pursuit::media::Locator;
use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard, PoisonError};
use tempfile::TempDir;

/// How a source names an uploaded file.
pub(crate) const PREFIX: &str = "upload:";
/// Uploads that are kept at most.
const MOST: usize = 16;
/// What is kept of a longer name is its end.
const LONGEST_NAME: usize = 80;
/// The largest, bytes.
pub(crate) const LARGEST: u64 = 512 << 20;

pub(crate) struct Uploads {
    folder: TempDir,
    kept: Mutex<Kept>,
}

#[derive(Default)]
struct Kept {
    names: Vec<String>,
    /// Being written.
    coming: usize,
}

/// A file that is being written; it goes away unless [`finish`](Self::finish) is called.
pub(crate) struct Upload<'a> {
    uploads: &'a Uploads,
    file: Option<tempfile::NamedTempFile>,
    name: String,
}

/// What the file was called that this source was made of: `upload:2-bees.mp4` of `bees.mp4`.
pub(crate) fn name_of(source: &str) -> Option<&str> {
    let (_, name) = source.strip_prefix(PREFIX)?.split_once('-')?;
    (!name.is_empty()).then_some(name)
}

impl Uploads {
    pub fn new() -> std::io::Result<Self> {
        Ok(Self { folder: tempfile::Builder::new().prefix("pursuit-studio-").tempdir()?, kept: Mutex::default() })
    }

    fn kept(&self) -> MutexGuard<'_, Kept> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// # Errors
    /// Too many uploads, a disk that cannot be written.
    pub fn begin(&self, name: &str) -> Result<Upload<'_>, Refusal> {
        // What a file is, is decided by its content; its name only tells people.
        let safe = |c: char| if c.is_ascii_alphanumeric() || "-_.".contains(c) { c } else { '-' };
        let name: String = name.chars().map(safe).collect();
        let name = name.trim_matches(['.', '-']).chars().rev().take(LONGEST_NAME).collect::<Vec<_>>();
        let name: String = name.into_iter().rev().collect();
        let mut kept = self.kept();
        if kept.names.len() + kept.coming >= MOST {
            return Err(Refusal::too_many(format!("{MOST} files were uploaded already; start the studio again")));
        }
        let file = tempfile::NamedTempFile::new_in(self.folder.path());
        let file = file.map_err(|e| Refusal::conflict(format!("the upload cannot be kept: {e}")))?;
        kept.coming += 1;
        Ok(Upload { uploads: self, file: Some(file), name })
    }

    /// The uploaded file called `name` by the page.
    pub fn resolve(&self, name: &str) -> Result<Locator, Refusal> {
        let known = self.kept().names.iter().any(|n| n == name);
        let path: PathBuf = self.folder.path().join(name);
        if known { Ok(Locator::from(path)) } else { Err(Refusal::missing("there is no such upload")) }
    }
}

impl Uploads {
    /// Says in a message what the page calls an upload, in place of where it lies.
    pub fn named(&self, mut refusal: Refusal) -> Refusal {
        let folder = format!("{}/", self.folder.path().display());
        refusal.message = refusal.message.replace(&folder, PREFIX);
        refusal
    }
}

impl Upload<'_> {
    pub fn file(&self) -> std::io::Result<std::fs::File> {
        self.file.as_ref().map_or_else(|| Err(std::io::ErrorKind::NotFound.into()), |f| f.as_file().try_clone())
    }

    /// Keeps the file, and says how a source names it.
    pub fn finish(mut self) -> Result<String, Refusal> {
        let failed = |e: String| Refusal::conflict(format!("the upload cannot be kept: {e}"));
        let file = self.file.take().ok_or_else(|| failed("it is gone".to_owned()))?;
        let mut kept = self.uploads.kept();
        let number = kept.names.len() + 1;
        let dash = if self.name.is_empty() { "" } else { "-" };
        let name = format!("{number}{dash}{}", self.name);
        file.persist(self.uploads.folder.path().join(&name)).map_err(|e| failed(e.to_string()))?;
        kept.names.push(name.clone());
        drop(kept);
        Ok(format!("{PREFIX}{name}"))
    }
}

impl Drop for Upload<'_> {
    fn drop(&mut self) {
        self.uploads.kept().coming -= 1;
    }
}
