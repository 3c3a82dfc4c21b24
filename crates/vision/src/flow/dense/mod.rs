//! Dense optical flow: by inverse search on a grid of patches, from coarse to fine, and a weighted mean of what overlaps
//! (DIS: Kroeger, Timofte, Dai and Van Gool 2016, “Fast optical flow using dense inverse search”), refined variationally where
//! that is wanted.

mod densify;
mod field;
mod level;
mod params;
mod refine;
#[cfg(test)]
mod refine_tests;
mod search;
#[cfg(test)]
mod tests;
pub mod wheel;

pub use field::{FloError, FlowField};
pub use params::{DenseFlowParams, RefinementParams};

use super::Pyramid;
use crate::error::{VisionError, require_size};
use densify::Sums;
use level::Padded;
use pursuit_geometry::Size;
use refine::Refiner;
use search::Search;

/// Estimates dense flow; owns its scratch, so nothing is allocated from frame to frame of one size.
#[derive(Debug, Clone)]
pub struct DenseFlow {
    params: DenseFlowParams,
    first: Padded,
    second: Padded,
    sums: Sums,
    refiner: Refiner,
    /// Flow of the level before, and of this one, pixels of the level.
    coarse: Plane,
    fine: Plane,
}

/// Flow of a level: along x and along y, row by row.
#[derive(Debug, Clone, Default)]
pub(crate) struct Plane {
    pub size: Size,
    pub u: Vec<f32>,
    pub v: Vec<f32>,
}

impl Plane {
    fn reset(&mut self, size: Size) {
        self.size = size;
        for plane in [&mut self.u, &mut self.v] {
            plane.clear();
            plane.resize(size.area(), 0.0);
        }
    }

    /// Between the pixels, bilinear; beyond the border that goes on. Whole numbers are middles of pixels.
    pub fn at(&self, x: f32, y: f32) -> (f32, f32) {
        let Size { width, height } = self.size;
        let axis = |at: f32, n: usize| {
            let at = at.clamp(0.0, (n - 1) as f32);
            let first = (at as usize).min(n.saturating_sub(2));
            (first, (first + 1).min(n - 1), at - first as f32)
        };
        let ((left, right, fx), (top, bottom, fy)) = (axis(x, width), axis(y, height));
        let of = |plane: &[f32]| {
            let row = |y: usize| {
                let (a, b) = (plane[y * width + left], plane[y * width + right]);
                a + fx * (b - a)
            };
            let (above, below) = (row(top), row(bottom));
            above + fy * (below - above)
        };
        (of(&self.u), of(&self.v))
    }
}

impl DenseFlow {
    /// An estimator.
    ///
    /// # Errors
    /// When a parameter is out of its range.
    pub fn new(params: DenseFlowParams) -> Result<Self, VisionError> {
        params.check()?;
        let (first, second) = (Padded::default(), Padded::default());
        let (coarse, fine) = (Plane::default(), Plane::default());
        Ok(Self { params, first, second, sums: Sums::default(), refiner: Refiner::default(), coarse, fine })
    }

    /// The parameters.
    pub const fn params(&self) -> &DenseFlowParams {
        &self.params
    }

    /// How many levels the pyramids of a picture need for the whole reach; with fewer, what moves far is missed.
    pub fn levels(&self, size: Size) -> usize {
        1 + self.params.coarsest(size)
    }

    /// Where every pixel of `from` went in `to`, into `field`.
    ///
    /// # Errors
    /// When the two pictures are not equally large, or smaller than a patch.
    pub fn estimate(&mut self, from: &Pyramid, to: &Pyramid, field: &mut FlowField) -> Result<(), VisionError> {
        require_size("the second pyramid", to.size(), from.size())?;
        let (size, patch) = (from.size(), self.params.patch_px);
        if size.width.min(size.height) < patch {
            let (name, value) = ("the shorter side of a picture for dense flow", size.width.min(size.height) as f64);
            return Err(VisionError::Parameter { name, value, range: "at least as long as a patch" });
        }
        let coarsest = self.params.coarsest(size).min(from.levels() - 1).min(to.levels() - 1);
        let finest = self.params.finest.min(coarsest);
        for level in (finest..=coarsest).rev() {
            let (Some(first), Some(second)) = (from.image(level), to.image(level)) else { continue };
            self.first.take(first, patch + 1);
            self.second.take(second, patch + 1);
            std::mem::swap(&mut self.coarse, &mut self.fine);
            self.fine.reset(first.size());
            self.sums.reset(first.size());
            let search = Search { params: &self.params, first: &self.first, second: &self.second };
            let before = (level < coarsest).then_some(&self.coarse);
            search.run(before, &mut self.sums);
            self.sums.divide(&mut self.fine);
            self.refiner.run([first, second], &mut self.fine, &self.params.refinement, level);
        }
        field.enlarge(&self.fine, size, finest)
    }
}
