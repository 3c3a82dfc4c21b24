//! The planes that a frame derives from its pixels.

use crate::{Image, ImageView, Rgb8};
use multiversion::multiversion;

fn mapped<P, Q>(image: ImageView<'_, P>, data: Vec<Q>) -> Image<Q> {
    Image::from_vec(data, image.width(), image.height()).unwrap_or_else(|_| unreachable!("one pixel for each pixel"))
}

/// BT.601 luma of colour.
pub(crate) fn rgb_to_gray(image: ImageView<'_, Rgb8>) -> Image<u8> {
    let mut data = vec![0; image.size().area()];
    match image.as_contiguous() {
        Some(pixels) => rgb_to_luma(pixels, &mut data),
        None => data.chunks_exact_mut(image.width()).zip(image.rows()).for_each(|(out, row)| rgb_to_luma(row, out)),
    }
    mapped(image, data)
}

/// BT.601 luma in 14-bit fixed point.
#[multiversion(targets("x86_64+avx2", "x86_64+sse4.1", "aarch64+neon"))]
fn rgb_to_luma(rgb: &[Rgb8], out: &mut [u8]) {
    for (out, &[r, g, b]) in out.iter_mut().zip(rgb) {
        *out = ((u32::from(r) * 4899 + u32::from(g) * 9617 + u32::from(b) * 1868 + 8192) >> 14) as u8;
    }
}

/// Grey as colour with equal channels.
pub(crate) fn gray_to_rgb(gray: ImageView<'_, u8>) -> Image<Rgb8> {
    mapped(gray, gray.rows().flatten().map(|&g| [g; 3]).collect())
}

/// Stretches 16-bit grey to 8 bits between the 0.1 % and 99.9 % quantiles, so that neither a hot pixel nor a sensor's
/// unused range eats the contrast.
pub(crate) fn stretch(image: ImageView<'_, u16>) -> Image<u8> {
    const SHIFT: u32 = 4;
    let mut histogram = vec![0usize; 1 << (16 - SHIFT)];
    image.rows().flatten().for_each(|&v| histogram[usize::from(v >> SHIFT)] += 1);
    let outliers = image.size().area() / 1000;
    let mut seen = 0;
    let first_past = |&count: &usize| {
        seen += count;
        seen > outliers
    };
    let low = histogram.iter().position(first_past).unwrap_or(0) << SHIFT;
    seen = 0;
    let first_past = |&count: &usize| {
        seen += count;
        seen > outliers
    };
    let high = ((histogram.iter().rposition(first_past).unwrap_or(0) + 1) << SHIFT) - 1;
    let (low, span) = (low as i64, (high as i64 - low as i64).max(1));
    let data = image.rows().flatten().map(|&v| ((i64::from(v) - low) * 255 / span).clamp(0, 255) as u8).collect();
    mapped(image, data)
}
