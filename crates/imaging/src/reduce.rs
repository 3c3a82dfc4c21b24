//! Pictures, and parts of them, at a whole fraction of their size: what is large in a large picture needs no more.

use crate::{Frame, Image, ImageView, Pixels, Result, Rgb8, Yuv420};
use multiversion::multiversion;
use pursuit_geometry::Size;

/// Blocks that are summed at once.
const RUN: usize = 64;
/// The largest block: sums of its pixels fit in 32 bits, those of its columns in 16.
pub(crate) const MOST_STEP: usize = 64;

impl Frame {
    /// The part of `width` × `height` pixels whose top left pixel is `(x, y)` as 8-bit colour, every `step` × `step` pixels
    /// (at most 64 × 64) one, their mean; pixels at the right and at the bottom that make no whole block are left out. Of
    /// planar video only this part is converted. `out` is overwritten and resized; it is empty of meaning unless this
    /// returns true: the part lies in the picture and has at least one block.
    ///
    /// # Errors
    /// When there is no memory for the result.
    pub fn reduced_color(&self, [x, y, width, height]: [usize; 4], step: usize, out: &mut Image<Rgb8>) -> Result<bool> {
        let size = self.size();
        let fits = |from: usize, length: usize, whole: usize| from.checked_add(length).is_some_and(|end| end <= whole);
        let (columns, rows) = (width / step.max(1), height / step.max(1));
        let inside = fits(x, width, size.width) && fits(y, height, size.height);
        if !inside || columns == 0 || rows == 0 || step > MOST_STEP {
            return Ok(false);
        }
        out.resize_for_overwrite(Size::new(columns, rows), [0; 3])?;
        match self.pixels() {
            // What has been converted already need not be again.
            Pixels::Yuv420(image) if !self.has_derived_color() => reduce_planes(image, (x, y), step, out),
            _ => reduce_color(self.color(), (x, y), step, out),
        }
        Ok(true)
    }
}

/// Means of blocks of an image of interleaved channels.
fn reduce_color(image: ImageView<'_, Rgb8>, (x, y): (usize, usize), step: usize, out: &mut Image<Rgb8>) {
    if step == 1 {
        for row in 0..out.height() {
            let pixels = &image.row(y + row)[x..x + out.width()];
            out.row_mut(row).copy_from_slice(pixels);
        }
        return;
    }
    for row in 0..out.height() {
        let mut sums = [[0_u32; 3]; RUN];
        for (run, out) in out.row_mut(row).chunks_mut(RUN).enumerate() {
            sums.fill([0; 3]);
            let from = x + run * RUN * step;
            for line in 0..step {
                let pixels = &image.row(y + row * step + line)[from..from + out.len() * step];
                for (sum, block) in sums.iter_mut().zip(pixels.chunks_exact(step)) {
                    for pixel in block {
                        sum.iter_mut().zip(pixel).for_each(|(sum, &c)| *sum += u32::from(c));
                    }
                }
            }
            let mean = |sum: u32| mean(sum, step * step);
            out.iter_mut().zip(&sums).for_each(|(out, sum)| *out = sum.map(mean));
        }
    }
}

/// Means of the planes, and the colour of those.
fn reduce_planes(image: &Yuv420, (x, y): (usize, usize), step: usize, out: &mut Image<Rgb8>) {
    let (luma, (u, v)) = (image.luma(), image.chroma());
    let (mut planes, mut columns) = ([[0_u8; RUN]; 3], [0_u16; RUN * MOST_STEP]);
    for row in 0..out.height() {
        let top = y + row * step;
        for (run, out) in out.row_mut(row).chunks_mut(RUN).enumerate() {
            let left = x + run * RUN * step;
            means(luma, (left, top), step, &mut columns, &mut planes[0][..out.len()]);
            for (plane, means) in [u, v].into_iter().zip(&mut planes[1..]) {
                chroma_means(plane, (left, top), step, &mut columns, &mut means[..out.len()]);
            }
            let [luma, u, v] = &planes;
            image.convert(luma, u, v, out);
        }
    }
}

/// Means of blocks of one plane, from the pixel `(left, top)` on; `columns` is scratch.
pub(crate) fn means(
    plane: ImageView<'_, u8>,
    (left, top): (usize, usize),
    step: usize,
    columns: &mut [u16],
    out: &mut [u8],
) {
    if step == 1 {
        out.copy_from_slice(&plane.row(top)[left..left + out.len()]);
        return;
    }
    let columns = &mut columns[..out.len() * step];
    for line in 0..step {
        add_row(&plane.row(top + line)[left..left + columns.len()], columns, line == 0);
    }
    match step {
        2 => sum_blocks::<2>(columns, out),
        3 => sum_blocks::<3>(columns, out),
        4 => sum_blocks::<4>(columns, out),
        _ => {
            for (out, block) in out.iter_mut().zip(columns.chunks_exact(step)) {
                *out = mean(block.iter().map(|&s| u32::from(s)).sum(), step * step);
            }
        }
    }
}

#[multiversion(targets("x86_64+avx2", "x86_64+sse4.1", "aarch64+neon"))]
fn add_row(row: &[u8], columns: &mut [u16], first: bool) {
    if first {
        columns.iter_mut().zip(row).for_each(|(sum, &p)| *sum = u16::from(p));
    } else {
        columns.iter_mut().zip(row).for_each(|(sum, &p)| *sum += u16::from(p));
    }
}

#[multiversion(targets("x86_64+avx2", "x86_64+sse4.1", "aarch64+neon"))]
fn sum_blocks<const STEP: usize>(columns: &[u16], out: &mut [u8]) {
    let (blocks, _) = columns.as_chunks::<STEP>();
    let area = (STEP * STEP) as u32;
    for (out, block) in out.iter_mut().zip(blocks) {
        *out = ((block.iter().map(|&s| u32::from(s)).sum::<u32>() + area / 2) / area) as u8;
    }
}

/// Means of the samples of a halved plane that belong to each block of the picture.
fn chroma_means(
    plane: ImageView<'_, u8>,
    (left, top): (usize, usize),
    step: usize,
    columns: &mut [u16],
    out: &mut [u8],
) {
    if step.is_multiple_of(2) && left.is_multiple_of(2) && top.is_multiple_of(2) {
        return means(plane, (left / 2, top / 2), step / 2, columns, out);
    }
    if step == 1 {
        let row = &plane.row(top / 2)[left / 2..];
        out.iter_mut().enumerate().for_each(|(i, out)| *out = row[(left % 2 + i) / 2]);
        return;
    }
    // A block takes every sample that it touches, also those that it shares with the next.
    let (first, last) = (top / 2, (top + step - 1) / 2);
    let (from, to) = (left / 2, (left + out.len() * step - 1) / 2);
    let columns = &mut columns[..=to - from];
    for row in first..=last {
        add_row(&plane.row(row)[from..=to], columns, row == first);
    }
    for (i, out) in out.iter_mut().enumerate() {
        let from_pixel = left + i * step;
        let block = &columns[from_pixel / 2 - from..=(from_pixel + step - 1) / 2 - from];
        *out = mean(block.iter().map(|&s| u32::from(s)).sum(), (last + 1 - first) * block.len());
    }
}

/// Rounded; a mean of bytes is a byte.
const fn mean(sum: u32, count: usize) -> u8 {
    ((sum + count as u32 / 2) / count as u32) as u8
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::{ColorMatrix, ColorRange};
    use pursuit_testkit::Noise;

    pub(crate) fn noise(width: usize, height: usize, seed: u32) -> Image<u8> {
        let mut noise = Noise::new(seed);
        Image::from_fn(width, height, |_, _| noise.byte()).unwrap()
    }

    pub(crate) fn yuv(width: usize, height: usize, range: ColorRange) -> Yuv420 {
        let (w, h) = (width.div_ceil(2), height.div_ceil(2));
        // Mild chroma, so that no channel is cut and means of colours are colours of means.
        let mild = |seed| {
            let plane = noise(w, h, seed);
            Image::from_fn(w, h, |x, y| 118 + plane.row(y)[x] / 13).unwrap()
        };
        let luma = noise(width, height, 7);
        let luma = Image::from_fn(width, height, |x, y| 70 + luma.row(y)[x] / 3).unwrap();
        Yuv420::new(luma, mild(3), mild(11), ColorMatrix::Bt709, range).unwrap()
    }

    /// The slow, obvious reference: the mean of the block of the converted picture.
    pub(crate) fn slow(frame: &Frame, x: usize, y: usize, step: usize) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for (i, j) in (0..step).flat_map(|j| (0..step).map(move |i| (i, j))) {
            let pixel = frame.color().row(y + j)[x + i];
            sum.iter_mut().zip(pixel).for_each(|(sum, c)| *sum += f64::from(c));
        }
        sum.map(|s| s / (step * step) as f64)
    }

    #[test]
    fn blocks_are_the_means_of_their_pixels() {
        let mut out = Image::filled(1, 1, [0; 3]).unwrap();
        let rgb = noise(3 * 201, 40, 5);
        let rgb = Image::from_fn(201, 40, |x, y| [0, 1, 2].map(|c| rgb.row(y)[3 * x + c])).unwrap();
        for range in [ColorRange::Full, ColorRange::Limited] {
            for (frame, even_chroma) in
                [(Frame::new(0, 0.0, rgb.clone()), true), (Frame::new(0, 0.0, yuv(201, 40, range)), false)]
            {
                let fresh = frame.undecorated();
                for (step, [x, y]) in [(1, [5, 3]), (2, [4, 2]), (2, [3, 1]), (3, [0, 0]), (4, [8, 4]), (5, [1, 2])] {
                    let part = [x, y, 190, 34];
                    // The reference derives the colour of `frame`, which is then taken; that of `fresh` never is.
                    assert!(frame.reduced_color(part, step, &mut out).unwrap());
                    let derived = out.clone();
                    assert!(fresh.reduced_color(part, step, &mut out).unwrap());
                    let apart = derived.as_slice().iter().flatten().zip(out.as_slice().iter().flatten());
                    assert!(step > 1 || apart.clone().all(|(a, b)| a == b));
                    assert_eq!((out.width(), out.height()), (190 / step, 34 / step));
                    // A block that ends inside a chroma sample takes all of it: as many codes off as chroma is noisy.
                    let exact = even_chroma || step == 1 || (step % 2 == 0 && x % 2 == 0);
                    // Half a code of luma and of chroma, times their gains, and half a code of each pixel of the reference.
                    let allowed = if exact { 3.0 } else { 24.0 };
                    for (i, j) in (0..out.height()).flat_map(|j| (0..out.width()).map(move |i| (i, j))) {
                        let want = slow(&frame, x + i * step, y + j * step, step);
                        let got = out.row(j)[i];
                        let near = got.iter().zip(want).all(|(g, w)| (f64::from(*g) - w).abs() <= allowed);
                        assert!(near, "{step} {x} {y}: {got:?} {want:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn what_is_no_part_of_the_picture_has_no_colour() {
        let frame = Frame::new(0, 0.0, yuv(40, 30, ColorRange::Full));
        let mut out = Image::filled(1, 1, [0; 3]).unwrap();
        for (part, step) in [
            ([0, 0, 41, 30], 1),
            ([1, 0, 40, 30], 2),
            ([0, 29, 40, 2], 1),
            ([0, 0, 3, 30], 4),
            ([0, 0, 40, 30], 65),
            ([usize::MAX, 0, 2, 2], 1),
        ] {
            assert!(!frame.reduced_color(part, step, &mut out).unwrap(), "{part:?} {step}");
        }
    }
}
