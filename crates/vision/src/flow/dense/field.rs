use super::Plane;
use crate::error::VisionError;
use pursuit_geometry::{Point, Size};
use pursuit_imaging::Image;

/// How far every pixel of a picture went: along x and y, pixels.
#[derive(Debug, Clone, PartialEq)]
pub struct FlowField {
    image: Image<[f32; 2]>,
}

/// What is wrong with the bytes of a `.flo` file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum FloError {
    /// It does not begin as such files do.
    #[error("no .flo file: it does not begin with PIEH")]
    Magic,
    /// A size that no picture has.
    #[error("a field of {width}x{height} cannot be; sides are from 1 to {}", FlowField::MOST_SIDE)]
    Size {
        /// Columns it says it has.
        width: i32,
        /// Rows it says it has.
        height: i32,
    },
    /// It is shorter, or longer, than its size says.
    #[error("{found} bytes where a field of its size has {expected}: the file is cut off, or something follows")]
    Length {
        /// How many it has.
        found: usize,
        /// How many it should have.
        expected: usize,
    },
}

impl FlowField {
    /// The longest side of a field that is read.
    pub const MOST_SIDE: i32 = 1 << 16;
    /// What is larger in a `.flo` file is no flow: the pixel has none.
    pub const UNKNOWN: f32 = 1e9;
    /// The first bytes of a `.flo` file: the number 202021.25.
    const MAGIC: [u8; 4] = *b"PIEH";

    /// A field without motion.
    ///
    /// # Errors
    /// A size that no picture has.
    pub fn zero(size: Size) -> Result<Self, VisionError> {
        Ok(Self { image: Image::filled(size.width, size.height, [0.0; 2])? })
    }

    /// A field of any motion, by column and row.
    ///
    /// # Errors
    /// A size that no picture has.
    pub fn from_fn(size: Size, motion: impl FnMut(usize, usize) -> [f32; 2]) -> Result<Self, VisionError> {
        Ok(Self { image: Image::from_fn(size.width, size.height, motion)? })
    }

    /// Columns and rows.
    pub fn size(&self) -> Size {
        self.image.size()
    }

    /// The motions, row by row.
    pub const fn image(&self) -> &Image<[f32; 2]> {
        &self.image
    }

    /// The motion of the pixel in column `x` and row `y`; `None` beyond.
    pub fn get(&self, x: usize, y: usize) -> Option<[f32; 2]> {
        self.image.view().get(x, y).copied()
    }

    /// The motion at a point (continuous pixels), bilinear; beyond the border that goes on.
    pub fn at(&self, point: Point) -> [f32; 2] {
        let (x, y) = (point.x - 0.5, point.y - 0.5);
        let (column, row) = (x.floor(), y.floor());
        let (fx, fy) = ((x - column) as f32, (y - row) as f32);
        let (i, j) = (column as isize, row as isize);
        let view = self.image.view();
        let at = |dx: isize, dy: isize| view.clamped(i.saturating_add(dx), j.saturating_add(dy));
        let corners = [at(0, 0), at(1, 0), at(0, 1), at(1, 1)];
        std::array::from_fn(|k| {
            let [a, b, c, d] = corners.map(|m| m[k]);
            (1.0 - fy) * ((1.0 - fx) * a + fx * b) + fy * ((1.0 - fx) * c + fx * d)
        })
    }

    /// Mean distance between the motions of two fields of one size, pixels: the end-point error.
    ///
    /// # Errors
    /// When they are not equally large.
    pub fn end_point_error(&self, truth: &Self) -> Result<f64, VisionError> {
        crate::error::require_size("the true flow", truth.size(), self.size())?;
        let off = |([a, b], [c, d]): (&[f32; 2], &[f32; 2])| f64::from((a - c).hypot(b - d));
        let sum: f64 = self.image.as_slice().iter().zip(truth.image.as_slice()).map(off).sum();
        Ok(sum / self.size().area() as f64)
    }

    /// The bytes of a `.flo` file (Middlebury: Baker et al. 2011): `PIEH`, width and height as 32-bit integers, then both
    /// components pixel by pixel as 32-bit floats, all little-endian.
    pub fn to_flo(&self) -> Vec<u8> {
        let Size { width, height } = self.size();
        let mut bytes = Vec::with_capacity(12 + 8 * self.size().area());
        bytes.extend(Self::MAGIC);
        for side in [width, height] {
            bytes.extend(i32::try_from(side).unwrap_or(i32::MAX).to_le_bytes());
        }
        bytes.extend(self.image.as_slice().iter().flatten().flat_map(|m| m.to_le_bytes()));
        bytes
    }

    /// The field that the bytes of a `.flo` file hold. Pixels without flow have what the file says, beyond
    /// [`UNKNOWN`](Self::UNKNOWN).
    ///
    /// # Errors
    /// [`FloError`] when they are no such file, or cut off.
    pub fn from_flo(bytes: &[u8]) -> Result<Self, FloError> {
        let Some((head, rest)) = bytes.split_first_chunk::<12>() else {
            let cut_off = FloError::Length { found: bytes.len(), expected: 12 };
            return Err(if Self::MAGIC.starts_with(&bytes[..bytes.len().min(4)]) { cut_off } else { FloError::Magic });
        };
        if head[..4] != Self::MAGIC {
            return Err(FloError::Magic);
        }
        let side = |at: usize| i32::from_le_bytes([head[at], head[at + 1], head[at + 2], head[at + 3]]);
        let (width, height) = (side(4), side(8));
        if [width, height].iter().any(|s| !(1..=Self::MOST_SIDE).contains(s)) {
            return Err(FloError::Size { width, height });
        }
        let expected = 8 * width as usize * height as usize;
        if rest.len() != expected {
            return Err(FloError::Length { found: bytes.len(), expected: 12 + expected });
        }
        let number = |b: &[u8; 4]| f32::from_le_bytes(*b);
        let motions = rest.as_chunks::<4>().0.as_chunks::<2>().0.iter().map(|[u, v]| [number(u), number(v)]).collect();
        let image = Image::from_vec(motions, width as usize, height as usize);
        image.map(|image| Self { image }).map_err(|_| FloError::Size { width, height })
    }

    /// Takes the flow of a level, enlarged to the picture: pixel x of the picture is pixel x/2ˡ of level l.
    pub(super) fn enlarge(&mut self, plane: &Plane, size: Size, level: usize) -> Result<(), VisionError> {
        self.image.resize_for_overwrite(size, [0.0; 2])?;
        let (scale, shrink) = ((1usize << level) as f32, 0.5f32.powi(level as i32));
        for y in 0..size.height {
            let row = self.image.row_mut(y);
            if level == 0 {
                let from = y * size.width;
                let motions = plane.u[from..].iter().zip(&plane.v[from..]);
                row.iter_mut().zip(motions).for_each(|(m, (u, v))| *m = [*u, *v]);
                continue;
            }
            for (x, motion) in row.iter_mut().enumerate() {
                let (u, v) = plane.at(x as f32 * shrink, y as f32 * shrink);
                *motion = [scale * u, scale * v];
            }
        }
        Ok(())
    }
}
