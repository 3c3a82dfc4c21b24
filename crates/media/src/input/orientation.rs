use pursuit_geometry::Size;
use pursuit_imaging::{Image, Result};

/// How stored pixels are turned for display: mirrored first where said, then turned clockwise by quarter turns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Orientation {
    /// Mirror left to right before turning.
    pub mirror: bool,
    /// Quarter turns clockwise, 0–3.
    pub quarter_turns: u8,
}

impl Orientation {
    /// From the upper left 2 × 2 of a track matrix (ISO/IEC 14496-12 §6.2.2: `x' = a x + c y`, `y' = b x + d y`), whose signs
    /// alone matter. `None` for shears and turns that are no multiple of 90°.
    pub fn from_matrix([a, b, c, d]: [i32; 4]) -> Option<Self> {
        let turn = |mirror, quarter_turns| Some(Self { mirror, quarter_turns });
        match [a.signum(), b.signum(), c.signum(), d.signum()] {
            [1, 0, 0, 1] => turn(false, 0),
            [0, 1, -1, 0] => turn(false, 1),
            [-1, 0, 0, -1] => turn(false, 2),
            [0, -1, 1, 0] => turn(false, 3),
            [-1, 0, 0, 1] => turn(true, 0),
            [0, -1, -1, 0] => turn(true, 1),
            [1, 0, 0, -1] => turn(true, 2),
            [0, 1, 1, 0] => turn(true, 3),
            _ => None,
        }
    }

    /// The size an image of `size` has after turning.
    pub const fn turned_size(self, size: Size) -> Size {
        if self.quarter_turns.is_multiple_of(2) { size } else { Size::new(size.height, size.width) }
    }

    /// Turns one plane.
    pub fn apply(self, plane: Image<u8>) -> Result<Image<u8>> {
        if self == Self::default() {
            return Ok(plane);
        }
        let (w, h) = (plane.width(), plane.height());
        let source = plane.as_slice();
        let mirrored = |x: usize| if self.mirror { w - 1 - x } else { x };
        let size = self.turned_size(plane.size());
        Image::from_fn(size.width, size.height, |x, y| {
            let (column, row) = match self.quarter_turns {
                0 => (x, y),
                1 => (y, h - 1 - x),
                2 => (w - 1 - x, h - 1 - y),
                _ => (w - 1 - y, x),
            };
            source[row * w + mirrored(column)]
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Where the matrix itself sends each pixel centre, shifted back to the origin: the slow, obvious reference.
    fn by_matrix([a, b, c, d]: [i32; 4], image: &Image<u8>) -> Image<u8> {
        let mut points = Vec::new();
        for y in 0..image.height() as i32 {
            for x in 0..image.width() as i32 {
                points.push((a * x + c * y, b * x + d * y, image.row(y as usize)[x as usize]));
            }
        }
        let left = points.iter().map(|p| p.0).min().unwrap();
        let top = points.iter().map(|p| p.1).min().unwrap();
        let width = points.iter().map(|p| p.0 - left).max().unwrap() as usize + 1;
        points.sort_by_key(|p| (p.1 - top, p.0 - left));
        let height = points.len() / width;
        Image::from_vec(points.iter().map(|p| p.2).collect(), width, height).unwrap()
    }

    #[test]
    fn every_orientation_does_what_its_matrix_says() {
        let image = Image::from_fn(3, 2, |x, y| (10 * y + x) as u8).unwrap();
        for [a, b] in [[1, 0], [-1, 0], [0, 1], [0, -1]] {
            for sign in [1, -1] {
                let matrix = if a != 0 { [a, 0, 0, sign] } else { [0, b, sign, 0] };
                let turned = Orientation::from_matrix(matrix).unwrap().apply(image.clone()).unwrap();
                assert_eq!(turned, by_matrix(matrix, &image), "{matrix:?}");
            }
        }
        assert!(Orientation::from_matrix([1, 1, 0, 1]).is_none());
    }
}
