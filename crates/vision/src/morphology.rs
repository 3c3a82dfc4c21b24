//! Erosion and dilation of masks and grey images with a square.

use multiversion::multiversion;
use pursuit_imaging::{Image, Result};

/// Scratch of [`erode`] and [`dilate`]; reuse it from frame to frame.
#[derive(Debug, Clone, Default)]
pub struct MorphologyScratch {
    transposed_pass: Vec<u8>,
    row: Vec<u8>,
    spare: Vec<u8>,
}

/// Erodes `image` in place `iterations` times with a 3×3 square: every pixel becomes the least of its neighbourhood.
///
/// Beyond the border counts as 255, so that an object cut by the border keeps its edge there.
///
/// # Errors
/// Never for an image that exists.
pub fn erode(image: &mut Image<u8>, iterations: usize, scratch: &mut MorphologyScratch) -> Result<()> {
    apply::<true>(image, iterations, scratch)
}

/// Dilates `image` in place `iterations` times with a 3×3 square: every pixel becomes the greatest of its neighbourhood.
///
/// Beyond the border counts as 0.
///
/// # Errors
/// Never for an image that exists.
pub fn dilate(image: &mut Image<u8>, iterations: usize, scratch: &mut MorphologyScratch) -> Result<()> {
    apply::<false>(image, iterations, scratch)
}

/// `n` iterations of a 3×3 square are one square of side 2n + 1, which separates; a run of 2n + 1 is made from runs of
/// doubled length, so the cost grows with the logarithm of `n`.
fn apply<const LEAST: bool>(image: &mut Image<u8>, n: usize, scratch: &mut MorphologyScratch) -> Result<()> {
    if n == 0 {
        return Ok(());
    }
    let (width, height) = (image.width(), image.height());
    let outside = if LEAST { 255 } else { 0 };

    let MorphologyScratch { transposed_pass, row, spare } = scratch;
    for y in 0..height {
        row.clear();
        row.resize(n, outside);
        row.extend_from_slice(image.row(y));
        row.resize(width + 2 * n, outside);
        running::<LEAST>(row, 1, 2 * n + 1, spare);
        image.row_mut(y).copy_from_slice(&row[..width]);
    }
    // The same along columns: whole rows are combined, so "one step" is one row.
    transposed_pass.clear();
    transposed_pass.resize(n * width, outside);
    transposed_pass.extend_from_slice(image.as_slice());
    transposed_pass.resize((height + 2 * n) * width, outside);
    running::<LEAST>(transposed_pass, width, 2 * n + 1, spare);
    image.as_mut_slice().copy_from_slice(&transposed_pass[..width * height]);
    Ok(())
}

/// Replaces `data[i]` by the extreme of `data[i], data[i + step], …` (`length` of them), where that many follow.
fn running<const LEAST: bool>(data: &mut [u8], step: usize, length: usize, spare: &mut Vec<u8>) {
    let mut have = 1;
    while have < length {
        let more = have.min(length - have);
        let shift = more * step;
        let valid = data.len() - shift;
        spare.clear();
        spare.extend_from_slice(&data[shift..]);
        combine(&mut data[..valid], spare, LEAST);
        have += more;
    }
}

#[multiversion(targets("x86_64+avx2", "x86_64+sse4.1", "aarch64+neon"))]
fn combine(into: &mut [u8], with: &[u8], least: bool) {
    if least {
        for (a, &b) in into.iter_mut().zip(with) {
            *a = (*a).min(b);
        }
    } else {
        for (a, &b) in into.iter_mut().zip(with) {
            *a = (*a).max(b);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use pursuit_testkit::Noise;

    /// The slow, obvious reference: 3×3, one iteration at a time.
    fn slow(image: &Image<u8>, iterations: usize, least: bool) -> Image<u8> {
        let mut image = image.clone();
        for _ in 0..iterations {
            image = Image::from_fn(image.width(), image.height(), |x, y| {
                let near = (y.saturating_sub(1)..(y + 2).min(image.height()))
                    .flat_map(|j| (x.saturating_sub(1)..(x + 2).min(image.width())).map(move |i| (i, j)))
                    .map(|(i, j)| image.row(j)[i]);
                if least { near.min().unwrap() } else { near.max().unwrap() }
            })
            .unwrap();
        }
        image
    }

    proptest! {
        #[test]
        fn iterations_equal_the_reference((w, h) in (1usize..30, 1usize..20), n in 0usize..8, seed in any::<u32>(), rare in 1u32..9) {
            let mut noise = Noise::new(seed | 1);
            let image = Image::from_fn(w, h, |_, _| {
                let state = noise.draw();
                if (state >> 16) % 9 < rare { 255 } else { (state >> 24) as u8 & 1 }
            }).unwrap();
            let mut scratch = MorphologyScratch::default();
            for least in [true, false] {
                let mut fast = image.clone();
                if least { erode(&mut fast, n, &mut scratch) } else { dilate(&mut fast, n, &mut scratch) }.unwrap();
                prop_assert_eq!(fast, slow(&image, n, least));
            }
        }
    }
}
