//! Which inputs the page may name: files below one folder, scenes, cameras, RTSP.

use crate::error::{Refusal, StudioError};
use pursuit::media::Locator;
use pursuit::parameters::{Kind, Parameter};
use pursuit::toml::{Table, Value};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Entries of a folder that are listed, and looked at before it is opened as a sequence.
const MOST_ENTRIES: usize = 100_000;
/// Entries of a folder that are shown.
const MOST_SHOWN: usize = 2_000;
/// A longer name of an input is none.
const LONGEST_NAME: usize = 2_000;

/// The folder that files may come from, with every symbolic link on the way to it resolved.
#[derive(Debug, Clone)]
pub(crate) struct Root(PathBuf);

/// An entry of a folder.
#[derive(Debug, Serialize)]
pub(crate) struct Entry {
    pub name: String,
    /// As a source names it: relative to the root.
    pub path: String,
    pub folder: bool,
    pub bytes: u64,
}

impl Root {
    /// # Errors
    /// [`StudioError::Root`] unless it is a folder that can be read.
    pub fn new(path: &Path) -> Result<Self, StudioError> {
        let wrong = |reason: String| StudioError::Root { path: path.display().to_string(), reason };
        let resolved = path.canonicalize().map_err(|e| wrong(e.to_string()))?;
        if !resolved.is_dir() {
            return Err(wrong("it is no folder; name the folder that your clips are in".to_owned()));
        }
        Ok(Self(resolved))
    }

    /// The input called `name` by the page.
    ///
    /// # Errors
    /// What lies outside the root, is of no kind that a page may open, or is not there.
    pub fn resolve(&self, name: &str) -> Result<Locator, Refusal> {
        let name = name.trim();
        if name.is_empty() || name.len() > LONGEST_NAME || name.contains(['\0', '\n', '\r']) {
            return Err(Refusal::unfit("no source; name a file below the root, scene:NAME, camera:0 or rtsp://…"));
        }
        let open_to_all = ["scene:", "camera:", "rtsp://", "rtsps://"];
        if open_to_all.iter().any(|kind| name.starts_with(kind)) {
            return Ok(Locator::new(name));
        }
        if name.contains("://") || name == "-" {
            return Err(Refusal::unfit(
                "a source of this kind cannot be opened from the page; give it on the command line: pursuit studio INPUT",
            ));
        }
        let path = self.inside(Path::new(name))?;
        self.resolve_path(&path)?;
        Ok(Locator::from(path))
    }

    /// Whether nothing that belongs to this input lies outside.
    fn resolve_path(&self, path: &Path) -> Result<(), Refusal> {
        if path.is_dir() {
            self.check_folder(path)?;
        } else if path.is_file() {
            // The truth that lies beside a video is read along with it.
            let truth = path.with_extension("csv");
            if truth.exists() {
                self.check(&truth)?;
            }
        } else {
            return Err(Refusal::unfit("this is neither a file nor a folder"));
        }
        Ok(())
    }

    /// Whether every file that parameters name lies below the root; names are made into paths.
    ///
    /// # Errors
    /// The first that does not.
    pub fn hold(&self, schema: &[Parameter], parameters: &mut Table) -> Result<(), Refusal> {
        for (name, value) in parameters {
            let Some(parameter) = schema.iter().find(|p| p.name == name) else { continue };
            match (&parameter.kind, value) {
                (Kind::File, Value::String(file)) if !file.is_empty() => {
                    let outside =
                        |_| Refusal::unfit(format!("`{name}`: there is no such file or folder below the root"));
                    *file = self.inside(Path::new(file)).map_err(outside)?.display().to_string();
                }
                (Kind::Group { parameters }, Value::Table(inner)) => self.hold(parameters, inner)?,
                _ => {}
            }
        }
        Ok(())
    }

    /// Where trials are kept, as runs of the command are.
    pub fn kept(&self) -> PathBuf {
        self.0.join("pursuit-out")
    }

    /// A folder below the root, or the root itself.
    pub fn folder(&self, path: &str) -> Result<PathBuf, Refusal> {
        let folder = self.inside(Path::new(path.trim()))?;
        if folder.is_dir() { Ok(folder) } else { Err(Refusal::missing("there is no such folder below the root")) }
    }

    /// A file below the root, links resolved.
    pub fn file(&self, path: &Path) -> Result<PathBuf, Refusal> {
        let file = self.inside(path)?;
        if file.is_file() { Ok(file) } else { Err(Refusal::missing("there is no such file below the root")) }
    }

    /// As a source names what lies below the root.
    pub fn shown(&self, path: &Path) -> Result<String, Refusal> {
        let resolved = self.inside(path)?;
        let shown = resolved.strip_prefix(&self.0).ok().and_then(Path::to_str).map(str::to_owned);
        shown.ok_or_else(|| Refusal::missing("there is no such file or folder below the root"))
    }

    /// As a source names this input.
    pub fn shown_as(&self, input: &Locator) -> String {
        self.shown(input.path()).unwrap_or_else(|_| input.to_string())
    }

    /// The folder or video whose path ends with the name of a sequence, if there is exactly one; links are not followed.
    pub fn footage(&self, sequence: &str) -> Option<PathBuf> {
        let (mut found, mut seen, mut waiting) = (Vec::new(), 0, vec![self.0.clone()]);
        while let Some(folder) = waiting.pop() {
            for entry in std::fs::read_dir(&folder).into_iter().flatten().flatten() {
                seen += 1;
                if seen > MOST_ENTRIES {
                    return None;
                }
                let Ok(kind) = entry.file_type() else { continue };
                let path = entry.path();
                // The boxes that an evaluation keeps have the names of its sequences too.
                let boxes = kind.is_dir() && path.file_name().is_some_and(|name| name == "boxes");
                let bare = if kind.is_file() { path.with_extension("") } else { path.clone() };
                if !kind.is_symlink() && !boxes && bare.ends_with(sequence) && self.resolve_path(&path).is_ok() {
                    found.push(path);
                } else if kind.is_dir() && !boxes {
                    waiting.push(path);
                }
            }
        }
        // A video and the truth beside it bear the same name.
        found.retain(|path| path.is_dir() || path.extension().is_none_or(|e| e != "csv" && e != "txt" && e != "json"));
        if found.len() == 1 { found.pop() } else { None }
    }

    /// What is in a folder, sorted by name, folders first; entries that lead outside are left out.
    pub fn list(&self, folder: &str) -> Result<Vec<Entry>, Refusal> {
        let path = self.inside(Path::new(folder.trim()))?;
        let entries =
            std::fs::read_dir(&path).map_err(|_| Refusal::missing("there is no such folder below the root"))?;
        let mut list: Vec<Entry> = entries
            .take(MOST_ENTRIES)
            .filter_map(|entry| {
                let entry = entry.ok()?;
                let (name, at) = (entry.file_name().into_string().ok()?, entry.path().canonicalize().ok()?);
                let (inside, hidden) = (at.starts_with(&self.0), name.starts_with('.'));
                let facts = std::fs::metadata(&at).ok().filter(|m| inside && !hidden && (m.is_dir() || m.is_file()))?;
                let shown = entry.path().strip_prefix(&self.0).ok()?.to_str()?.to_owned();
                Some(Entry { name, path: shown, folder: facts.is_dir(), bytes: facts.len() })
            })
            .collect();
        list.sort_by(|a, b| b.folder.cmp(&a.folder).then_with(|| a.name.cmp(&b.name)));
        list.truncate(MOST_SHOWN);
        Ok(list)
    }

    /// The path with every link resolved. Whether a file outside exists is not told.
    fn inside(&self, path: &Path) -> Result<PathBuf, Refusal> {
        let missing = || Refusal::missing("there is no such file or folder below the root");
        let resolved = self.0.join(path).canonicalize().map_err(|_| missing())?;
        if resolved.starts_with(&self.0) { Ok(resolved) } else { Err(missing()) }
    }

    fn check(&self, path: &Path) -> Result<(), Refusal> {
        match path.canonicalize() {
            Ok(resolved) if resolved.starts_with(&self.0) => Ok(()),
            _ => Err(Refusal::unfit("a file that belongs to this source is a link that leads outside the root")),
        }
    }

    /// A sequence is read image by image: none of them, nor of its parts, may be a link that leads outside.
    fn check_folder(&self, folder: &Path) -> Result<(), Refusal> {
        let mut seen = 0;
        let mut waiting = vec![(folder.to_path_buf(), 0)];
        while let Some((folder, depth)) = waiting.pop() {
            let Ok(entries) = std::fs::read_dir(&folder) else { continue };
            for entry in entries.flatten() {
                seen += 1;
                if seen > MOST_ENTRIES {
                    return Err(Refusal::unfit("this folder has too many entries to be looked through"));
                }
                match entry.file_type() {
                    Ok(kind) if kind.is_symlink() => self.check(&entry.path())?,
                    // `rgb/`, `depth/` and the like.
                    Ok(kind) if kind.is_dir() && depth == 0 => waiting.push((entry.path(), depth + 1)),
                    _ => {}
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outside_and_inside() -> (tempfile::TempDir, Root) {
        let all = tempfile::tempdir().unwrap();
        std::fs::create_dir_all(all.path().join("root/clips")).unwrap();
        std::fs::write(all.path().join("secret.y4m"), "x").unwrap();
        std::fs::write(all.path().join("root/clips/a.y4m"), "x").unwrap();
        let root = Root::new(&all.path().join("root")).unwrap();
        (all, root)
    }

    #[test]
    fn what_lies_below_the_root_can_be_named_and_nothing_else() {
        let (all, root) = outside_and_inside();
        let inside = all.path().join("root/clips/a.y4m").canonicalize().unwrap();
        assert_eq!(root.resolve("clips/a.y4m").unwrap().path(), inside);
        assert_eq!(root.resolve(inside.to_str().unwrap()).unwrap().path(), inside);
        let secret = all.path().join("secret.y4m");
        for bad in
            ["../secret.y4m", "clips/../../secret.y4m", secret.to_str().unwrap(), "clips/b.y4m", "/etc/passwd", "a\0b"]
        {
            assert!(root.resolve(bad).is_err(), "{bad}");
        }
        for bad in ["", "-", "http://h/x", "file:///etc/passwd", "concat://a"] {
            assert_eq!(root.resolve(bad).unwrap_err().status, 422, "{bad}");
        }
        assert_eq!(root.resolve("scene:drift?seed=1").unwrap().reveal(), "scene:drift?seed=1");
        assert!(Root::new(&secret).is_err());
    }

    #[test]
    #[cfg(unix)]
    fn links_that_lead_outside_are_not_followed() {
        use std::os::unix::fs::symlink;
        let (all, root) = outside_and_inside();
        let clips = all.path().join("root/clips");
        symlink(all.path().join("secret.y4m"), clips.join("link.y4m")).unwrap();
        symlink(clips.join("a.y4m"), clips.join("good.y4m")).unwrap();
        assert!(root.resolve("clips/link.y4m").is_err());
        assert!(root.resolve("clips/good.y4m").is_ok());
        assert!(root.resolve("clips").is_err(), "a sequence with an image from outside");
        let names: Vec<String> = root.list("clips").unwrap().into_iter().map(|e| e.name).collect();
        assert_eq!(names, ["a.y4m", "good.y4m"]);
        std::fs::remove_file(clips.join("link.y4m")).unwrap();
        assert!(root.resolve("clips").is_ok());
        symlink(all.path().join("secret.y4m"), clips.join("a.csv")).unwrap();
        assert!(root.resolve("clips/a.y4m").is_err(), "its truth lies outside");
    }

    #[test]
    fn parameters_name_files_below_the_root_and_no_others() {
        let (all, root) = outside_and_inside();
        let schema = pursuit::trackers::registry::tracker("siamese").unwrap().default_recipe().schema();
        let held = |text: &str| {
            let mut table: Table = text.parse().unwrap();
            root.hold(&schema, &mut table).map(|()| table)
        };
        let inside = all.path().join("root/clips/a.y4m").canonicalize().unwrap().display().to_string();
        let table = held("model = 'clips/a.y4m'\nlayout = '../secret.y4m'\n[runtime]\nonnxruntime = ''").unwrap();
        assert_eq!(table["model"].as_str(), Some(&*inside));
        assert_eq!(table["layout"].as_str(), Some("../secret.y4m"), "no file");
        assert_eq!(held(&format!("model = '{inside}'")).unwrap(), held("model = 'clips/a.y4m'").unwrap());
        for (bad, name) in [
            ("model = '../secret.y4m'", "`model`"),
            ("model = '/etc/passwd'", "`model`"),
            ("[runtime]\nonnxruntime = '../secret.y4m'", "`onnxruntime`"),
        ] {
            let refusal = held(bad).unwrap_err();
            assert!(refusal.status == 422 && refusal.message.contains(name), "{bad}: {refusal:?}");
        }
    }

    #[test]
    fn folders_come_first() {
        let (_all, root) = outside_and_inside();
        std::fs::write(root.0.join("0.mp4"), "1234").unwrap();
        let list = root.list("").unwrap();
        assert_eq!(list.iter().map(|e| (&*e.path, e.folder)).collect::<Vec<_>>(), [("clips", true), ("0.mp4", false)]);
        assert_eq!(list[1].bytes, 4);
        assert!(root.list("..").is_err() && root.list("0.mp4").is_err());
    }
}
