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
    extension: String,
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
        let extension = name.rsplit_once('.').map_or("", |(_, extension)| extension);
        let plain = extension.len() <= 8 && extension.bytes().all(|b| b.is_ascii_alphanumeric());
        let extension = if plain { extension.to_ascii_lowercase() } else { String::new() };
        let mut kept = self.kept();
        if kept.names.len() + kept.coming >= MOST {
            return Err(Refusal::too_many(format!("{MOST} files were uploaded already; start the studio again")));
        }
        let file = tempfile::NamedTempFile::new_in(self.folder.path());
        let file = file.map_err(|e| Refusal::conflict(format!("the upload cannot be kept: {e}")))?;
        kept.coming += 1;
        Ok(Upload { uploads: self, file: Some(file), extension })
    }

    /// The uploaded file called `name` by the page.
    pub fn resolve(&self, name: &str) -> Result<Locator, Refusal> {
        let known = self.kept().names.iter().any(|n| n == name);
        let path: PathBuf = self.folder.path().join(name);
        if known { Ok(Locator::from(path)) } else { Err(Refusal::missing("there is no such upload")) }
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
        let dot = if self.extension.is_empty() { "" } else { "." };
        let name = format!("{number}{dot}{}", self.extension);
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
