use super::Plane;
use pursuit_geometry::Size;

/// Where a patch went, and how far its pixels are from what is there, grey codes.
pub(super) struct Found<const P: usize> {
    pub left: usize,
    pub top: usize,
    pub u: f32,
    pub v: f32,
    pub off: [[f32; P]; P],
}

/// The sums that the flow of a pixel is made of: each patch over it counts by one over its difference there, at most 1
/// (equation (3) of kroeger2016).
#[derive(Debug, Clone, Default)]
pub(super) struct Sums {
    size: Size,
    u: Vec<f32>,
    v: Vec<f32>,
    weights: Vec<f32>,
}

impl Sums {
    pub fn reset(&mut self, size: Size) {
        self.size = size;
        for plane in [&mut self.u, &mut self.v, &mut self.weights] {
            plane.clear();
            plane.resize(size.area(), 0.0);
        }
    }

    #[inline(always)]
    pub fn add<const P: usize>(&mut self, found: &Found<P>) {
        for (j, off) in found.off.iter().enumerate() {
            let at = (found.top + j) * self.size.width + found.left;
            let (u, v) = (&mut self.u[at..at + P], &mut self.v[at..at + P]);
            let weights = &mut self.weights[at..at + P];
            for i in 0..P {
                let weight = 1.0 / off[i].abs().max(1.0);
                u[i] += weight * found.u;
                v[i] += weight * found.v;
                weights[i] += weight;
            }
        }
    }

    /// The means; every pixel lies in a patch.
    pub fn divide(&self, plane: &mut Plane) {
        for (mean, sum) in [(&mut plane.u, &self.u), (&mut plane.v, &self.v)] {
            for ((mean, sum), weight) in mean.iter_mut().zip(sum).zip(&self.weights) {
                *mean = sum / weight.max(f32::MIN_POSITIVE);
            }
        }
    }
}
