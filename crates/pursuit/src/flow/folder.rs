//! The folder of a flow: nothing of the user's is overwritten.

use crate::RunError;
use crate::run_folder::{OVERLAY, RunFolder, name_of};
use pursuit_media::output::VideoWriter;
#[cfg(feature = "encode")]
use pursuit_media::output::{Mp4Writer, VideoOptions};
use pursuit_media::{Locator, SourceInfo};
use std::fs::File;
use std::io::{BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};

/// The facts of a flow; a folder that holds them holds one.
const FACTS: &str = "flow.json";
/// The points that were followed.
const POINTS: &str = "points.csv";
/// A grid of a field.
const GRID: &str = "field.csv";
/// The folder of fields.
const FIELDS: &str = "flo";

/// Where results go.
pub(super) struct Folder(RunFolder);

/// A file of rows.
pub(super) struct Rows {
    path: PathBuf,
    out: BufWriter<File>,
}

impl Folder {
    /// `out`, where no results are but those of an earlier flow, which are removed; without, a new folder named after `input`.
    ///
    /// # Errors
    /// Results that no flow left, the input among them, or a folder that cannot be made.
    pub fn open(out: Option<&Path>, input: &Locator) -> Result<Self, RunError> {
        let Some(path) = out else {
            return RunFolder::numbered(&Path::new("pursuit-out").join(format!("{}-flow", name_of(input)))).map(Self);
        };
        if path.exists() && !path.is_dir() {
            return Err(RunError::output(path)(ErrorKind::NotADirectory.into()));
        }
        std::fs::create_dir_all(path).map_err(RunError::output(path))?;
        let folder = Self(RunFolder::taken(path)?);
        let there = folder.results();
        for file in &there {
            if same_file::is_same_file(input.reveal(), file).unwrap_or(false) {
                return Err(RunError::usage(format!(
                    "{} would be overwritten, and it is the input; name another folder with `--out`",
                    file.display()
                )));
            }
        }
        let own = folder.0.file(FACTS).is_file();
        if let Some(file) = there.first().filter(|_| !own) {
            return Err(RunError::usage(format!(
                "{} would be overwritten, and no flow wrote it ({FACTS} is missing); name another folder with `--out`",
                file.display()
            )));
        }
        for file in there {
            std::fs::remove_file(&file).map_err(RunError::output(&file))?;
        }
        Ok(folder)
    }

    pub fn path(&self) -> &Path {
        self.0.path()
    }

    /// The files that have the names of a flow's results.
    fn results(&self) -> Vec<PathBuf> {
        let fields = std::fs::read_dir(self.0.file(FIELDS)).into_iter().flatten().flatten().map(|e| e.path());
        let fields = fields.filter(|path| path.extension().is_some_and(|e| e == "flo"));
        let fixed = [POINTS, GRID, OVERLAY, FACTS].map(|name| self.0.file(name));
        fixed.into_iter().filter(|file| file.symlink_metadata().is_ok()).chain(fields).collect()
    }

    /// The file of points, with its heads.
    pub fn points(&self) -> Result<Rows, RunError> {
        Rows::create(self.0.file(POINTS), "frame,time_s,point,x_px,y_px,forward_backward_px,state")
    }

    /// The file of a field's grid, with its heads.
    pub fn grid(&self) -> Result<Rows, RunError> {
        Rows::create(self.0.file(GRID), "frame,time_s,x_px,y_px,dx_px,dy_px,dt_s")
    }

    /// The folder of fields, made.
    pub fn fields(&self) -> Result<PathBuf, RunError> {
        let path = self.0.file(FIELDS);
        std::fs::create_dir_all(&path).map_err(RunError::output(&path))?;
        Ok(path)
    }

    /// The overlay video.
    #[cfg(feature = "encode")]
    pub fn overlay(&self, input: &SourceInfo) -> Result<Box<dyn VideoWriter>, RunError> {
        let nominal_fps = input.fps.unwrap_or(VideoOptions::default().nominal_fps);
        let aspect = input.pixel_aspect.unwrap_or((1, 1));
        let shown = input.view.map_or(aspect, |view| view.pixel_aspect(aspect));
        let pixel_aspect = Some(shown).filter(|(width, height)| width != height);
        let options = VideoOptions { nominal_fps, pixel_aspect };
        Ok(Box::new(Mp4Writer::create(&self.0.file(OVERLAY), options)?))
    }

    #[cfg(not(feature = "encode"))]
    pub fn overlay(&self, _: &SourceInfo) -> Result<Box<dyn VideoWriter>, RunError> {
        Err(RunError::usage(crate::NO_OVERLAY.unwrap_or("this build writes no video")))
    }

    /// Writes the facts.
    pub fn facts(&self, facts: &serde_json::Value) -> Result<(), RunError> {
        let path = self.0.file(FACTS);
        std::fs::write(&path, format!("{facts:#}\n")).map_err(RunError::output(&path))
    }
}

impl Rows {
    fn create(path: PathBuf, heads: &str) -> Result<Self, RunError> {
        let out = BufWriter::new(File::create(&path).map_err(RunError::output(&path))?);
        let mut rows = Self { path, out };
        rows.add(heads)?;
        Ok(rows)
    }

    /// A row.
    pub fn add(&mut self, row: &str) -> Result<(), RunError> {
        writeln!(self.out, "{row}").map_err(RunError::output(&self.path))
    }

    /// What was added survives a crash of this process.
    pub fn flush(&mut self) -> Result<(), RunError> {
        self.out.flush().map_err(RunError::output(&self.path))
    }
}
