use pursuit_vision::fourier::highest;

/// Finds the peaks of a response plane that stand apart.
#[derive(Debug, Clone, Default)]
pub(super) struct Peaks {
    rest: Vec<f32>,
}

/// Half the side, in cells, of the square around a peak in which there is no other.
const APART: usize = 3;

impl Peaks {
    /// The `count` highest peaks of the plane (rows of `width`, wrapping around), highest first: column, row and value. Those
    /// lower than `share` of the highest are left out.
    pub fn find(
        &mut self,
        plane: &[f32],
        width: usize,
        count: usize,
        share: f64,
    ) -> impl Iterator<Item = (usize, usize, f32)> {
        self.rest.clear();
        self.rest.extend_from_slice(plane);
        let height = plane.len() / width.max(1);
        let mut least = f32::NEG_INFINITY;
        let rest = &mut self.rest;
        std::iter::from_fn(move || {
            let (x, y, value) = highest(rest, width);
            if !value.is_finite() || value < least {
                return None;
            }
            least = least.max(share as f32 * value);
            for dy in 0..=2 * APART {
                let row = (y + height + dy - APART.min(height)) % height * width;
                for dx in 0..=2 * APART {
                    if let Some(v) = rest.get_mut(row + (x + width + dx - APART.min(width)) % width) {
                        *v = f32::NEG_INFINITY;
                    }
                }
            }
            Some((x, y, value))
        })
        .take(count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn peaks_come_highest_first_and_apart() {
        let mut plane = vec![0.0f32; 16 * 12];
        let mut set = |x: usize, y: usize, v: f32| plane[y * 16 + x] = v;
        set(15, 0, 1.0);
        set(1, 11, 0.9); // Beside the first one, around the corner.
        set(8, 6, 0.7);
        set(8, 2, 0.4);
        let found: Vec<_> = Peaks::default().find(&plane, 16, 5, 0.5).collect();
        assert_eq!(found, [(15, 0, 1.0), (8, 6, 0.7)]);
        assert_eq!(Peaks::default().find(&plane, 16, 1, 0.5).count(), 1);
        assert_eq!(Peaks::default().find(&[f32::NAN; 16], 4, 3, 0.5).count(), 0);
        assert_eq!(Peaks::default().find(&[2.0; 4], 2, 3, 0.5).count(), 1);
    }
}
