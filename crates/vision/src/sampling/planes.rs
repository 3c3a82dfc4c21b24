use pursuit_geometry::Size;
use serde::{Deserialize, Serialize};

/// Several `f32` images of one size, one after the other: the multi-channel form of patches and features.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Planes {
    data: Vec<f32>,
    size: Size,
    channels: usize,
}

impl Planes {
    /// `channels` planes of zeros.
    pub fn new(size: Size, channels: usize) -> Self {
        Self { data: vec![0.0; size.area() * channels], size, channels }
    }

    /// Gives them another shape, keeping the allocation where it suffices; values are unspecified afterwards.
    pub fn reshape(&mut self, size: Size, channels: usize) {
        self.data.resize(size.area() * channels, 0.0);
        (self.size, self.channels) = (size, channels);
    }

    /// Width and height of each plane.
    pub const fn size(&self) -> Size {
        self.size
    }

    /// The number of planes.
    pub const fn channels(&self) -> usize {
        self.channels
    }

    /// Plane `c` (`c < channels`), row by row.
    pub fn plane(&self, c: usize) -> &[f32] {
        let n = self.size.area();
        &self.data[c * n..(c + 1) * n]
    }

    /// Plane `c` (`c < channels`), row by row, to change.
    pub fn plane_mut(&mut self, c: usize) -> &mut [f32] {
        let n = self.size.area();
        &mut self.data[c * n..(c + 1) * n]
    }

    /// All planes in order of channel.
    pub fn planes(&self) -> impl ExactSizeIterator<Item = &[f32]> {
        self.data.chunks_exact(self.size.area().max(1))
    }

    /// All planes in order of channel, to change.
    pub fn planes_mut(&mut self) -> impl ExactSizeIterator<Item = &mut [f32]> {
        self.data.chunks_exact_mut(self.size.area().max(1))
    }

    /// All values, plane after plane.
    pub fn as_slice(&self) -> &[f32] {
        &self.data
    }

    /// All values, plane after plane, to change.
    pub fn as_mut_slice(&mut self) -> &mut [f32] {
        &mut self.data
    }

    /// Whether the shape and the number of values agree, for states that were read from outside.
    pub fn is_consistent(&self) -> bool {
        self.size.width.checked_mul(self.size.height).and_then(|n| n.checked_mul(self.channels))
            == Some(self.data.len())
    }
}
