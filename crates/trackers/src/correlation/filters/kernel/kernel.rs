use serde::{Deserialize, Serialize};

/// How alike two patches are, as a function of their inner product (henriques2015, section 6).
///
/// Inner products and distances are divided by the number of values, as in the authors' released code, so that parameters do
/// not depend on the size of the patch.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Kernel {
    /// ⟨x, z⟩ / n (eq. 30).
    Linear,
    /// (⟨x, z⟩ / n + a)ᵇ (eq. 29).
    Polynomial {
        /// Additive term a.
        offset: f64,
        /// Exponent b.
        power: f64,
    },
    /// exp(−max(0, ‖x‖² + ‖z‖² − 2⟨x, z⟩) / (σ² n)) (eq. 31).
    Gaussian {
        /// Bandwidth σ.
        sigma: f64,
    },
}

impl Kernel {
    /// Turns inner products into kernel values, in place. `n` is the number of values in a patch, `norms` = ‖x‖² + ‖z‖².
    pub fn apply(self, products: &mut [f32], n: f64, norms: f64) {
        match self {
            Self::Linear => {
                let scale = (1.0 / n) as f32;
                products.iter_mut().for_each(|c| *c *= scale);
            }
            Self::Polynomial { offset, power } => {
                let (scale, offset, power) = ((1.0 / n) as f32, offset as f32, power as f32);
                products.iter_mut().for_each(|c| *c = (*c * scale + offset).powf(power));
            }
            Self::Gaussian { sigma } => {
                let scale = (-1.0 / (sigma * sigma * n)) as f32;
                let norms = norms as f32;
                products.iter_mut().for_each(|c| *c = (scale * (norms - 2.0 * *c).max(0.0)).exp());
            }
        }
    }
}
