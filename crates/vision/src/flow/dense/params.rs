use crate::error::{VisionError, require_range};
use pursuit_geometry::Size;
use serde::{Deserialize, Serialize};

/// Parameters of [`DenseFlow`](super::DenseFlow), with the symbols of kroeger2016.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DenseFlowParams {
    /// The finest level of the pyramid that is searched, 0 (every pixel) to 6; its flow is enlarged to the picture (θ_sf).
    pub finest: usize,
    /// Side of a patch, 8 or 12 pixels (θ_ps), the sides of the paper's operating points.
    pub patch_px: usize,
    /// How much neighbouring patches overlap, share of their side, 0 to 0.9 (θ_ov).
    pub overlap: f64,
    /// Most steps of the search of a patch on a level, 1 to 128 (θ_it).
    pub iterations: usize,
    /// The farthest motion that is sought, share of the picture's width, 0.01 to 1 (1/f of section 2.4; the paper has 1/5).
    pub reach: f64,
    /// Whether patches are compared less their means, which bears changes of light.
    pub normalized: bool,
    /// Added to the mean matrix of gradients of a patch, (grey codes per pixel)², 0 to 1000: where there is no texture but noise a
    /// patch stays where its coarser level led it. The paper has none (0), and follows a sensor's noise by tens of pixels.
    pub damping: f64,
    /// How the flow of each level is refined before the next finer one begins with it.
    pub refinement: RefinementParams,
}

impl Default for DenseFlowParams {
    fn default() -> Self {
        let refinement = RefinementParams::default();
        Self {
            finest: 1,
            patch_px: 8,
            overlap: 0.5,
            iterations: 16,
            reach: 0.2,
            normalized: true,
            damping: 25.0,
            refinement,
        }
    }
}

/// Parameters of the variational refinement (section 2.3 of kroeger2016).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RefinementParams {
    /// How often derivatives are taken anew at full resolution, 0 (no refinement) to 20; level l has l + 1 times as many (θ_vo; the
    /// paper has 1).
    pub rounds: usize,
    /// Sweeps of the solver after each, 1 to 1000 (θ_vi; the paper has 5).
    pub sweeps: usize,
    /// Weight of the constancy of brightness, 0 to 1000 (δ; the paper has 5).
    pub brightness: f64,
    /// Weight of the constancy of gradients, 0 to 1000 (γ; the paper has 10).
    pub gradients: f64,
    /// Weight of smoothness, 0.001 to 1000 (α; the paper has 10).
    pub smoothness: f64,
}

impl Default for RefinementParams {
    fn default() -> Self {
        Self { rounds: 0, sweeps: 5, brightness: 5.0, gradients: 10.0, smoothness: 10.0 }
    }
}

impl RefinementParams {
    /// The paper's.
    pub fn kroeger2016() -> Self {
        Self { rounds: 1, ..Self::default() }
    }

    fn check(&self) -> Result<(), VisionError> {
        require_range("refinement.rounds", self.rounds as f64, (0.0, 20.0), "from 0 to 20")?;
        require_range("refinement.sweeps", self.sweeps as f64, (1.0, 1000.0), "from 1 to 1000")?;
        require_range("refinement.brightness", self.brightness, (0.0, 1000.0), "from 0 to 1000")?;
        require_range("refinement.gradients", self.gradients, (0.0, 1000.0), "from 0 to 1000")?;
        require_range("refinement.smoothness", self.smoothness, (0.001, 1000.0), "from 0.001 to 1000")
    }
}

impl DenseFlowParams {
    /// The paper's operating point 2 without its refinement: a quarter of the resolution's time, coarse borders.
    pub fn kroeger2016_fast() -> Self {
        Self { finest: 3, overlap: 0.4, iterations: 12, damping: 0.0, ..Self::default() }
    }

    /// The paper's operating point 3 without its refinement: large patches, much overlap, half the picture's resolution.
    pub fn kroeger2016_fine() -> Self {
        Self { finest: 1, patch_px: 12, overlap: 0.75, iterations: 16, damping: 0.0, ..Self::default() }
    }

    pub(super) fn check(&self) -> Result<(), VisionError> {
        require_range("finest", self.finest as f64, (0.0, 6.0), "from 0 to 6")?;
        if !matches!(self.patch_px, 8 | 12) {
            let (value, range) = (self.patch_px as f64, "8 or 12 pixels");
            return Err(VisionError::Parameter { name: "patch_px", value, range });
        }
        require_range("overlap", self.overlap, (0.0, 0.9), "from 0 to 0.9")?;
        require_range("iterations", self.iterations as f64, (1.0, 128.0), "from 1 to 128")?;
        require_range("reach", self.reach, (0.01, 1.0), "from 0.01 to 1")?;
        require_range("damping", self.damping, (0.0, 1000.0), "from 0 to 1000")?;
        self.refinement.check()
    }

    /// Distance between neighbouring patches, pixels, ≥ 1.
    pub(super) fn step(&self) -> usize {
        ((self.patch_px as f64 * (1.0 - self.overlap)) as usize).max(1)
    }

    /// The level on which the search begins: a patch there spans what is to be reached (section 2.4), and none is smaller
    /// than a patch.
    pub(super) fn coarsest(&self, size: Size) -> usize {
        let wanted = (2.0 * self.reach * size.width as f64 / self.patch_px as f64).max(1.0).log2().round() as usize;
        let side = size.width.min(size.height);
        let fits = |level: &usize| side.div_ceil(1 << level) >= self.patch_px;
        (0..=wanted.max(self.finest).min(super::Pyramid::MAX_LEVELS - 1)).take_while(fits).last().unwrap_or(0)
    }
}
