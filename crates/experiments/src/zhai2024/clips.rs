//! Many clips of the scene `rgbd-occlusion`.

use super::clip::{Followed, Shown, follow};
use crate::ExperimentError;
use pursuit_evaluation::metrics::mean;
use pursuit_evaluation::metrics::princeton::{ErrorTypes, error_types};
use pursuit_imaging::Frame;
use pursuit_tracking::Recipe;
use rayon::prelude::*;
use std::fmt;
use std::ops::Range;

/// What the paper's Table 1 says of a tracker, and how it bears occlusion, over many clips.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClipFigures {
    /// Clips.
    pub clips: usize,
    /// Mean area under the curve of success over the visible frames.
    pub auc: f64,
    /// Mean error of the centre over the visible frames, in pixels: along x, along y, in all.
    pub center_px: [f64; 3],
    /// Share of visible frames with an overlap above one half.
    pub precision: f64,
    /// Share of clips at whose end the target is not followed.
    pub missed: f64,
    /// Share of frames wholly out of sight that are told.
    pub told: f64,
    /// Share of frames wholly in sight that are called occluded.
    pub false_alarms: f64,
    /// Share of occlusions after which it was followed again within five frames.
    pub relocked: f64,
    /// The Princeton benchmark's types.
    pub types: ErrorTypes,
    /// Updates per second.
    pub fps: f64,
}

/// Frames of a scene with their truth.
pub(super) fn scene_frames(query: &str) -> Result<impl Iterator<Item = (Frame, Shown)>, ExperimentError> {
    let scene = pursuit_scenes::open(query).map_err(|e| ExperimentError::usage(e.to_string()))?;
    let view = scene.home();
    Ok((0..scene.frame_count()).map(move |k| {
        let time_s = scene.frame_time_s(k);
        let moment = scene.render(time_s);
        let truth = moment.targets.first().copied().unwrap_or(pursuit_scenes::TargetTruth::ABSENT);
        (moment.into_frame(k, time_s, &view), Shown { bbox: truth.extent, visible: truth.visible_fraction })
    }))
}

/// A tracker on one clip of `rgbd-occlusion` with these keys.
pub(crate) fn clip(recipe: &dyn Recipe, seed: u64, keys: &str) -> Result<Followed, ExperimentError> {
    let own = super::tracking::keys(seed);
    let more = match keys {
        "" => String::new(),
        "mixed" => format!("&{own}"),
        keys => format!("&{keys}"),
    };
    follow(recipe, scene_frames(&format!("scene:rgbd-occlusion?seed={seed}{more}"))?)
}

/// The clips of some seeds, followed by one tracker: all together, and each.
#[derive(Debug, Clone, PartialEq)]
pub struct DepthClips {
    /// Of all clips.
    pub all: ClipFigures,
    /// Of each clip, by its seed.
    pub each: Vec<(u64, ClipFigures)>,
}

/// Follows the target of `rgbd-occlusion` for each of `seeds`, with further `keys` (`key=value&key=value`) of the scene, or
/// with those of the paper's comparison (`mixed`).
///
/// # Errors
/// A key or value that the scene does not have, or an error of the tracker.
pub fn depth_clips(recipe: &dyn Recipe, seeds: Range<u64>, keys: &str) -> Result<DepthClips, ExperimentError> {
    let clips = seeds.clone().into_par_iter().map(|seed| clip(recipe, seed, keys)).collect::<Result<Vec<_>, _>>()?;
    let each = seeds.zip(&clips).map(|(seed, clip)| (seed, figures(std::slice::from_ref(clip)))).collect();
    Ok(DepthClips { all: figures(&clips), each })
}

/// The figures of several clips; each clip weighs the same where a share is of clips, each frame where it is of frames.
pub(crate) fn figures(clips: &[Followed]) -> ClipFigures {
    let over = |value: fn(&Followed) -> f64| mean(&clips.iter().map(value).collect::<Vec<_>>());
    let share = |count: fn(&Followed) -> (usize, usize)| {
        let (part, whole) = clips.iter().map(count).fold((0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
        if whole > 0 { part as f64 / whole as f64 } else { 0.0 }
    };
    let axis = |k: usize| {
        let errors: Vec<f64> = clips.iter().flat_map(Followed::center_errors).map(|e| e[k]).collect();
        mean(&errors)
    };
    let back: Vec<f64> = clips.iter().filter_map(Followed::relocked).map(|r| f64::from(u8::from(r))).collect();
    let claims: Vec<_> = clips.iter().flat_map(Followed::claims).collect();
    let (frames, seconds) = clips.iter().fold((0, 0.0), |a, c| (a.0 + c.frames.len(), a.1 + c.seconds));
    ClipFigures {
        clips: clips.len(),
        auc: over(Followed::auc),
        center_px: std::array::from_fn(axis),
        precision: over(Followed::precision),
        missed: over(|c| f64::from(u8::from(c.missed()))),
        told: share(Followed::occlusions_told),
        false_alarms: share(Followed::false_alarms),
        relocked: mean(&back),
        types: error_types(&claims, 0.5),
        fps: if seconds > 0.0 { frames as f64 / seconds } else { 0.0 },
    }
}

impl fmt::Display for ClipFigures {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y, all] = self.center_px;
        write!(
            f,
            "AUC {:.3} CPE {all:.2} ({x:.2} {y:.2}) AP {:.3} missed {:.3} TPR {:.3} FPR {:.4} relocked {:.3} \
             types {:.3}/{:.3}/{:.3} fps {:.0}",
            self.auc,
            self.precision,
            self.missed,
            self.told,
            self.false_alarms,
            self.relocked,
            self.types.wrong_box,
            self.types.false_box,
            self.types.missing_box,
            self.fps
        )
    }
}
