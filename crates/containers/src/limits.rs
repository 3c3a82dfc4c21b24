//! How much is believed of what stands in a header.

use crate::{ContainerError, Result};

/// Width and height of a picture, in pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Extent {
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
}

/// The longest side of a picture accepted, in pixels.
pub const MAX_SIDE: usize = 1 << 15;

/// The largest image accepted, in pixels (64 Mi, as 8192 × 8192): larger ones are refused before they are decoded.
pub const MAX_PIXELS: usize = 1 << 26;

/// The largest compressed image or video sample accepted, in bytes: no codec needs more for [`MAX_PIXELS`] in practice.
pub const MAX_SAMPLE_BYTES: u64 = 256 << 20;

/// Refuses sizes from a header that nobody could mean, before anything is allocated for them.
///
/// # Errors
/// [`ContainerError::Malformed`] for a side of 0 or above [`MAX_SIDE`], or more pixels than [`MAX_PIXELS`].
pub fn check_size(width: u64, height: u64) -> Result<Extent> {
    let max = MAX_SIDE as u64;
    if width == 0 || height == 0 {
        return Err(ContainerError::malformed(format!("its header says {width}x{height} pixels, which is no image")));
    }
    if width > max || height > max || width * height > MAX_PIXELS as u64 {
        return Err(ContainerError::malformed(format!(
            "{width}x{height} pixels is too large (at most {max} a side and {} megapixels); scale it down first",
            MAX_PIXELS / 1_000_000
        )));
    }
    Ok(Extent { width: width as usize, height: height as usize })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_bounded_in_both_directions() {
        assert!(check_size(1, 1).is_ok());
        assert!(check_size(8192, 8192).is_ok());
        assert!(check_size(32_768, 2048).is_ok());
        for (w, h) in [(0, 5), (10_000, 10_000), (32_769, 1), (u64::MAX, u64::MAX)] {
            assert!(check_size(w, h).is_err(), "{w}x{h}");
        }
    }
}
