//! Detections of anybody's detector, from files, to tracks: what `pursuit associate` does.

mod detector;
mod follow;
mod inputs;

pub use detector::FileDetector;

use crate::RunError;
use crate::config::{MANY_PREFIX, Participants, Settings};
use crate::sinks::Format;
use follow::Track;
use inputs::{Layout, Work, works};
use pursuit_address::Locator;
use pursuit_evaluation::CrowdSequence;
use pursuit_evaluation::boxes::BoxFormat;
use pursuit_geometry::Size;
use pursuit_inference::onnx::Device;
use pursuit_media::OpenOptions;
use pursuit_parameters::Parameters;
use pursuit_tracking::many::{EmbeddingModel, ManyParams, Preset};
use rayon::prelude::*;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

/// What is to be associated, and how.
#[derive(Debug, Clone, Default)]
pub struct Associate {
    /// The form of the detections; told by their name and first line without.
    pub format: Option<BoxFormat>,
    /// The video that they are of, for one sequence: for the camera's motion, appearance, times and size.
    pub video: Option<Locator>,
    /// Frames a second; what is said here counts more than what `seqinfo.ini` and the video say.
    pub fps: Option<f64>,
    /// The size of the picture, likewise.
    pub size: Option<Size>,
    /// A published way to associate, in place of our own defaults.
    pub preset: Option<Preset>,
    /// How targets are told apart: `many.KEY`; counts more than the preset.
    pub parameters: toml::Table,
    /// Whether the whole clip is looked at at once, see [`pursuit_tracking::many::offline`].
    pub offline: bool,
    /// Further formats, each into a folder of its name.
    pub formats: Vec<Format>,
    /// How the video is opened.
    pub open: OpenOptions,
    /// What a network by file that tells looks apart (`many.embedding`) runs on; the processor without.
    pub device: Option<Device>,
}

/// What became of one sequence.
#[derive(Debug, Clone, PartialEq)]
pub struct Associated {
    /// Its name; SET/NAME where there are several sets.
    pub sequence: String,
    /// How many frames it has.
    pub frames: u64,
    /// How long association took, reading and writing apart.
    pub seconds: f64,
    /// How many targets were told apart.
    pub targets: u64,
    /// Frames a second that were assumed because nobody said how many there are.
    pub assumed_fps: Option<f64>,
    /// The file with the tracks, in MOTChallenge's form.
    pub file: PathBuf,
}

impl Associate {
    /// Associates what `input` is: a file of detections, a folder of YOLO's files, a sequence with `det.txt`, or a folder of such,
    /// which are worked on by all threads. Leaves `SEQUENCE.txt` (in `SET/` where there are several sets) and `times.csv` in `out`.
    ///
    /// Setting `stop` ends it after the frame in hand: what is written is kept.
    ///
    /// # Errors
    /// Detections that cannot be read or make no sense, parameters that nobody knows, files that cannot be written.
    pub fn run(&self, input: &Path, out: &Path, stop: &AtomicBool) -> Result<Vec<Associated>, RunError> {
        self.all(&works(self, input)?, Layout::Flat, out, stop)
    }

    /// The same of sequences that are known; leaves `SET/SEQUENCE.txt`.
    ///
    /// # Errors
    /// As [`run`](Self::run), and sequences without detections.
    pub fn sequences(
        &self,
        sequences: &[CrowdSequence],
        out: &Path,
        stop: &AtomicBool,
    ) -> Result<Vec<Associated>, RunError> {
        let works: Vec<Work> = sequences.iter().map(|s| Work::of(self, s)).collect::<Result<_, _>>()?;
        self.all(&works, Layout::BySet, out, stop)
    }

    /// How targets are told apart, with every parameter.
    ///
    /// # Errors
    /// Parameters that nobody knows, bad values.
    pub fn params(&self) -> Result<ManyParams, RunError> {
        let who = Participants { many: true, ..Participants::default() };
        let settings = Settings::split(&self.parameters, &who)?;
        Ok(self.preset.map_or_else(ManyParams::default, Preset::params).with(MANY_PREFIX, &settings.many)?)
    }

    fn all(&self, works: &[Work], layout: Layout, out: &Path, stop: &AtomicBool) -> Result<Vec<Associated>, RunError> {
        if self.fps.is_some_and(|fps| !(fps.is_finite() && fps > 0.0)) {
            return Err(RunError::usage("--fps must be a number of frames a second above 0, for example 25"));
        }
        if self.video.is_some() && works.len() != 1 {
            let count = works.len();
            return Err(RunError::usage(format!("--video is of one sequence; there are {count}, name one of them")));
        }
        if self.video.is_some() && self.offline {
            return Err(RunError::usage(
                "--offline goes by the boxes alone; leave --video out, and say --fps and --size",
            ));
        }
        let params = self.params()?;
        if params.embedding.model != EmbeddingModel::None && self.video.is_none() {
            return Err(RunError::usage(
                "many.embedding.model wants pixels: name the video that the detections are of, `--video clip.mp4`",
            ));
        }
        let layout = if works.iter().all(|w| w.set == works[0].set) { layout } else { Layout::BySet };
        for work in works {
            work.spares_inputs(&work.file(layout, out))?;
        }
        std::fs::create_dir_all(out).map_err(RunError::output(out))?;
        let one = |work: &Work| Track { options: self, params: &params, work, layout, out, stop }.run();
        let all: Vec<Associated> = works.par_iter().with_max_len(1).map(one).collect::<Result<_, _>>()?;
        let mut times = "sequence,frames,seconds\n".to_owned();
        for done in &all {
            times += &format!("{},{},{:.6}\n", done.sequence, done.frames, done.seconds);
        }
        let path = out.join("times.csv");
        std::fs::write(&path, times).map_err(RunError::output(&path))?;
        Ok(all)
    }
}

#[cfg(test)]
mod tests;
