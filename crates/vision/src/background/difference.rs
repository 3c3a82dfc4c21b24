//! What the models share: pixels as rows of channels, and differences of them.

use super::{BACKGROUND, FOREGROUND, Learning};
use crate::error::{VisionError, require_range, require_size};
use multiversion::multiversion;
use pursuit_geometry::Size;
use pursuit_imaging::{ImageView, Rgb8};

mod sealed {
    pub trait Sealed {}
    impl Sealed for u8 {}
    impl Sealed for [u8; 3] {}
}

/// Pixels of 8-bit channels: grey codes and [`Rgb8`].
pub trait Channels: sealed::Sealed + Copy + Default + PartialEq + std::fmt::Debug + Send + Sync + 'static {
    /// Channels of a pixel.
    const COUNT: usize;

    /// The channels of all pixels, one pixel after the other.
    fn channels(pixels: &[Self]) -> &[u8];

    /// The channels of all pixels, to change.
    fn channels_mut(pixels: &mut [Self]) -> &mut [u8];
}

impl Channels for u8 {
    const COUNT: usize = 1;

    fn channels(pixels: &[Self]) -> &[u8] {
        pixels
    }

    fn channels_mut(pixels: &mut [Self]) -> &mut [u8] {
        pixels
    }
}

impl Channels for Rgb8 {
    const COUNT: usize = 3;

    fn channels(pixels: &[Self]) -> &[u8] {
        pixels.as_flattened()
    }

    fn channels_mut(pixels: &mut [Self]) -> &mut [u8] {
        pixels.as_flattened_mut()
    }
}

/// Checks a frame and what may be learnt from it against the size of the first frame.
pub(super) fn check(known: Option<Size>, frame: Size, learning: &Learning<'_>) -> Result<(), VisionError> {
    if let Some(rate) = learning.rate {
        require_range("the learning rate", rate, (0.0, 1.0), "from 0 to 1")?;
    }
    check_sizes(known, frame, learning.protect)
}

pub(super) fn check_sizes(
    known: Option<Size>,
    frame: Size,
    protect: Option<ImageView<'_, u8>>,
) -> Result<(), VisionError> {
    require_size("the frame", frame, known.unwrap_or(frame))?;
    protect.map_or(Ok(()), |p| require_size("the protecting mask", p.size(), frame))
}

/// Marks pixels of which some channel differs by more than `threshold`.
pub(super) fn mark_changed<P: Channels>(a: &[P], b: &[P], threshold: u8, mask: &mut [u8]) {
    let (a, b) = (P::channels(a), P::channels(b));
    match P::COUNT {
        1 => mark_gray(a, b, threshold, mask),
        _ => mark_color(a, b, threshold, mask),
    }
}

#[multiversion(targets("x86_64+avx2", "x86_64+sse4.1", "aarch64+neon"))]
fn mark_gray(a: &[u8], b: &[u8], threshold: u8, mask: &mut [u8]) {
    for ((mask, &a), &b) in mask.iter_mut().zip(a).zip(b) {
        *mask = if a.abs_diff(b) > threshold { FOREGROUND } else { BACKGROUND };
    }
}

#[multiversion(targets("x86_64+avx2", "x86_64+sse4.1", "aarch64+neon"))]
fn mark_color(a: &[u8], b: &[u8], threshold: u8, mask: &mut [u8]) {
    for ((mask, a), b) in mask.iter_mut().zip(a.as_chunks::<3>().0).zip(b.as_chunks::<3>().0) {
        let most = a[0].abs_diff(b[0]).max(a[1].abs_diff(b[1])).max(a[2].abs_diff(b[2]));
        *mask = if most > threshold { FOREGROUND } else { BACKGROUND };
    }
}

/// Copies the pixels of `from` to `to` where `keep` is 0 (or absent); elsewhere multiplies those of `to` by `gain`.
pub(super) fn replace_unless<P: Channels>(to: &mut [P], from: &[P], gain: f64, keep: Option<&[u8]>) {
    let Some(keep) = keep else { return to.copy_from_slice(from) };
    let to = P::channels_mut(to).chunks_exact_mut(P::COUNT);
    for ((to, from), keep) in to.zip(P::channels(from).chunks_exact(P::COUNT)).zip(keep) {
        if *keep == 0 {
            to.copy_from_slice(from);
        } else {
            to.iter_mut().for_each(|v| *v = (f64::from(*v) * gain + 0.5) as u8);
        }
    }
}
