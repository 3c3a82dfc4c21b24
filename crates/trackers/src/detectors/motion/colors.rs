//! What somebody wears: histograms of the colours of the pixels that stand out, band by band from head to feet. Two sights of one
//! person are more alike than those of two people, so that association can tell who is who where people have met.

use super::params::ColorsParams;
use pursuit_geometry::BBox;
use pursuit_imaging::{Image, ImageView};
use pursuit_vision::PixelWindow;
use pursuit_vision::background::Channels;
use std::sync::Arc;

/// Pixels looked at in a region, about: of a larger one every second or third in each direction.
const SAMPLES: f64 = 4000.0;

/// Square roots of the shares that the colours have in each band, so that the cosine between two is the Bhattacharyya coefficient;
/// `None` where too little stands out, or where nothing is to be said of colours.
pub(super) fn colors<P: Channels>(
    params: &ColorsParams,
    bounds: &BBox,
    mask: &Image<u8>,
    frame: ImageView<'_, P>,
) -> Option<Arc<[f32]>> {
    let window = PixelWindow::of(bounds, frame.size()).filter(|_| params.bands > 0 && mask.size() == frame.size())?;
    let (bands, bins) = (params.bands, params.bins.max(2));
    let colors = (0..P::COUNT).fold(1, |all, _| all * bins);
    let step = ((window.width * window.height) as f64 / SAMPLES).sqrt().floor().max(1.0) as usize;
    let mut shares = vec![0.0f32; bands * colors];
    let mut count = 0usize;
    for y in (0..window.height).step_by(step) {
        let from = (y * bands / window.height).min(bands - 1) * colors;
        let Some(band) = shares.get_mut(from..from + colors) else { continue };
        let columns = window.x..window.x + window.width;
        let (marks, pixels) = (&mask.row(window.y + y)[columns.clone()], &frame.row(window.y + y)[columns]);
        for (_, pixel) in marks.iter().zip(pixels).step_by(step).filter(|(mark, _)| **mark != 0) {
            spread(band, bins, P::channels(std::slice::from_ref(pixel)), 1.0, 0);
            count += 1;
        }
    }
    if count < params.least_px {
        return None;
    }
    shares.iter_mut().for_each(|share| *share = (*share / count as f32).sqrt());
    Some(shares.into())
}

/// Adds `weight` to the bins about a colour, the nearest getting most of it; `at` is the place of the bins of the channels before.
fn spread(band: &mut [f32], bins: usize, channels: &[u8], weight: f32, at: usize) {
    let Some((&first, rest)) = channels.split_first() else {
        if let Some(bin) = band.get_mut(at) {
            *bin += weight;
        }
        return;
    };
    // Bin k has its middle at (k + ½) / bins; beyond the outer middles all goes to the outer bin.
    let place = (f32::from(first) + 0.5) / 256.0 * bins as f32 - 0.5;
    let low = place.floor().clamp(0.0, (bins - 2) as f32);
    let above = (place - low).clamp(0.0, 1.0);
    let at = at * bins + low as usize;
    spread(band, bins, rest, weight * (1.0 - above), at);
    spread(band, bins, rest, weight * above, at + 1);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cosine(a: &[f32], b: &[f32]) -> f32 {
        a.iter().zip(b).map(|(a, b)| a * b).sum()
    }

    /// Somebody with a coat and trousers of these colours before a wall.
    fn dressed(coat: [u8; 3], trousers: [u8; 3], size: usize) -> (BBox, Image<u8>, Image<[u8; 3]>) {
        let inside = |x: usize, y: usize| (8..8 + size).contains(&x) && (4..4 + 3 * size).contains(&y);
        let mask = Image::from_fn(64, 100, |x, y| u8::from(inside(x, y)) * 255).unwrap();
        let color = |x: usize, y: usize| match (inside(x, y), y < 4 + 3 * size / 2) {
            (true, true) => coat,
            (true, false) => trousers,
            (false, _) => [90, 120, 40],
        };
        (BBox::from_ltwh(8.0, 4.0, size as f64, 3.0 * size as f64), mask, Image::from_fn(64, 100, color).unwrap())
    }

    fn three() -> ColorsParams {
        ColorsParams { bands: 3, ..ColorsParams::default() }
    }

    fn seen((bounds, mask, frame): &(BBox, Image<u8>, Image<[u8; 3]>)) -> Arc<[f32]> {
        colors(&three(), bounds, mask, frame.view()).unwrap()
    }

    #[test]
    fn one_person_is_more_alike_than_two() {
        let red = seen(&dressed([200, 30, 40], [40, 40, 90], 12));
        assert!((cosine(&red, &red) - 1.0).abs() < 1e-5, "of length 1");
        let nearer = seen(&dressed([190, 36, 44], [45, 38, 84], 24));
        let swapped = seen(&dressed([40, 40, 90], [200, 30, 40], 12));
        let other = seen(&dressed([30, 160, 60], [40, 40, 90], 12));
        assert!(cosine(&red, &nearer) > 0.9, "nearer, in another light: {}", cosine(&red, &nearer));
        assert!(cosine(&red, &other) < 0.75, "another coat: {}", cosine(&red, &other));
        assert!(cosine(&red, &swapped) < 0.5, "coat and trousers swapped: {}", cosine(&red, &swapped));
    }

    #[test]
    fn too_little_says_nothing() {
        let (bounds, mask, frame) = dressed([200, 30, 40], [40, 40, 90], 12);
        let said = |params: &ColorsParams, bounds: &BBox| colors(params, bounds, &mask, frame.view());
        assert!(said(&three(), &bounds).is_some());
        assert!(said(&ColorsParams::default(), &bounds).is_none(), "nobody asked");
        assert!(said(&three(), &BBox::from_ltwh(40.0, 4.0, 12.0, 36.0)).is_none(), "nothing stands out");
        assert!(said(&three(), &bounds.translated(500.0, 0.0)).is_none(), "outside");
    }

    #[test]
    fn spread_weighs_sum_to_one_and_lean_to_the_nearest() {
        let mut band = [0.0f32; 16];
        spread(&mut band, 4, &[0, 128], 1.0, 0);
        assert!((band.iter().sum::<f32>() - 1.0).abs() < 1e-6);
        // The middles of bins 1 and 2 are at 96 and 160.
        assert!((band[1] - band[2]).abs() < 0.02 && band[1] > 0.45, "{band:?}");
        spread(&mut band, 4, &[255, 255], 1.0, 0);
        assert_eq!(band[15], 1.0);
    }
}
