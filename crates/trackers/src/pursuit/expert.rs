//! A network that is asked now and then, about a place of its own.

use super::FusionParams;
use super::convention::BoxConvention;
use super::offset::SearchOffset;
use crate::siamese::{SiameseLocalizer, SiameseModel};
use pursuit_estimation::logit;
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_tracking::Result;
use serde::{Deserialize, Serialize};

/// What an expert said in one look.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Opinion {
    /// Its box by the convention of the first one.
    pub bbox: BBox,
    /// The same in its own terms, from which it goes on.
    pub own: BBox,
    /// Log odds of its score.
    pub score: f64,
    /// How much its features there are like the first ones, −1 to 1.
    pub embedding: f64,
}

/// What is remembered of what it said last.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Remark {
    /// Log odds of its score.
    pub score: f64,
    /// Overlap of its box with what the other witnesses took for the target.
    pub overlap: f64,
    /// How much its features there are like the first ones, −1 to 1.
    pub embedding: f64,
}

impl Remark {
    /// Of a network that is never asked.
    pub const USUAL: Self = Self { score: 1.0, overlap: 0.8, embedding: 0.8 };
}

/// A network that runs free beside the witnesses: it is asked in every so many frames and whenever there is a doubt, and looks about
/// where it saw the target itself.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(bound = "P: SiameseModel")]
pub(super) struct Expert<P: SiameseModel> {
    localizer: SiameseLocalizer<P>,
    convention: BoxConvention,
    offset: SearchOffset,
    /// Frames since it was asked.
    frames: usize,
    remark: Remark,
}

impl<P: SiameseModel> Expert<P> {
    /// One that knows the target at `bbox`.
    ///
    /// # Errors
    /// When the network cannot be run.
    pub fn new(params: &P, fusion: &FusionParams, frame: &Frame, bbox: BBox) -> Result<Self> {
        let mut localizer = SiameseLocalizer::new(params, frame, bbox)?;
        let seen = localizer.look_first(frame, &bbox)?;
        let convention = seen.map_or_else(BoxConvention::default, |seen| BoxConvention::new(fusion, &bbox, &seen.raw));
        let remark = Remark { score: seen.map_or(0.0, |seen| log_odds(seen.score)), overlap: 1.0, embedding: 1.0 };
        Ok(Self { localizer, convention, offset: SearchOffset::new(&bbox), frames: 0, remark })
    }

    /// Whether it is to be asked in this frame, where it is in every so many.
    pub const fn is_due(&self, every: usize) -> bool {
        self.frames + 1 >= every
    }

    /// What it sees where the loop expects the target at `expected`.
    ///
    /// # Errors
    /// When the network cannot be run.
    pub fn look(&mut self, frame: &Frame, expected: &BBox) -> Result<Option<Opinion>> {
        let about = self.offset.at(expected);
        self.look_about(frame, &about)
    }

    /// What it sees about `about`.
    ///
    /// # Errors
    /// When the network cannot be run.
    pub fn look_about(&mut self, frame: &Frame, about: &BBox) -> Result<Option<Opinion>> {
        let found = self.localizer.look(frame, about)?;
        Ok(found.map(|l| Opinion {
            bbox: self.convention.of(&l.bbox),
            own: l.bbox,
            score: log_odds(l.score),
            embedding: self.localizer.embedding(frame, &l.bbox).unwrap_or(Remark::USUAL.embedding),
        }))
    }

    /// What it said last.
    pub const fn remark(&self) -> Remark {
        self.remark
    }

    /// A frame is over in which it said `remark`, if it was asked.
    pub const fn note(&mut self, remark: Option<Remark>) {
        match remark {
            Some(remark) => (self.frames, self.remark) = (0, remark),
            None => self.frames += 1,
        }
    }

    /// It looks at `own` from now on, while `reported` is what the loop goes on from.
    pub fn place(&mut self, own: &BBox, reported: &BBox) {
        self.offset.set(own, reported);
    }
}

fn log_odds(score: f64) -> f64 {
    logit(score.clamp(1e-6, 1.0 - 1e-6))
}
