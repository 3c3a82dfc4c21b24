//! Tells a thing from the background it has uncovered: the outline of a thing is an edge of the frame, the outline of a
//! ghost is an edge of what was learnt.

use super::params::GhostParams;
use pursuit_imaging::ImageView;
use pursuit_vision::background::Channels;

/// Edge strength along `outline` in `background` over that in `frame`.
pub(super) fn ghostliness<P: Channels>(
    params: &GhostParams,
    outline: &[(usize, usize)],
    frame: ImageView<'_, P>,
    background: ImageView<'_, P>,
) -> f64 {
    let reach = params.reach_px;
    let (mut now, mut learnt, mut count) = (0.0, 0.0, 0usize);
    for &(x, y) in outline {
        // At the border of the picture there is no other side.
        if x < reach || y < reach || x + reach >= frame.width() || y + reach >= frame.height() {
            continue;
        }
        now += gradient(frame, x, y, reach);
        learnt += gradient(background, x, y, reach);
        count += 1;
    }
    let noise = params.noise * count.max(1) as f64;
    (learnt + noise) / (now + noise)
}

/// Sum over the channels of the greater of the differences across the pixel, between those `reach` pixels to either side.
fn gradient<P: Channels>(image: ImageView<'_, P>, x: usize, y: usize, reach: usize) -> f64 {
    let difference = |a: P, b: P| -> f64 {
        let (a, b) = ([a], [b]);
        P::channels(&a).iter().zip(P::channels(&b)).map(|(a, b)| f64::from(a.abs_diff(*b))).sum()
    };
    let row = image.row(y);
    let across = difference(row[x - reach], row[x + reach]);
    let down = difference(image.row(y - reach)[x], image.row(y + reach)[x]);
    across.max(down) / P::COUNT as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_imaging::Image;

    #[test]
    fn outlines_tell_things_from_ghosts() {
        let params = GhostParams::default();
        let inside = |x: usize, y: usize| (10..20).contains(&x) && (8..30).contains(&y);
        let with = Image::from_fn(40, 40, |x, y| if inside(x, y) { 180u8 } else { 80 }).unwrap();
        let without = Image::filled(40, 40, 80u8).unwrap();
        let outline: Vec<_> = (8..30).flat_map(|y| [(10, y), (19, y)]).collect();
        let thing = ghostliness(&params, &outline, with.view(), without.view());
        let ghost = ghostliness(&params, &outline, without.view(), with.view());
        assert!((thing - 6.0 / 106.0).abs() < 1e-12 && (ghost - 106.0 / 6.0).abs() < 1e-12, "{thing} {ghost}");
        // Cut by the border, and nowhere at all.
        assert_eq!(ghostliness(&params, &[(0, 5), (39, 5), (5, 1), (5, 38)], with.view(), without.view()), 1.0);
        assert_eq!(ghostliness(&params, &[], with.view(), without.view()), 1.0);
    }
}
