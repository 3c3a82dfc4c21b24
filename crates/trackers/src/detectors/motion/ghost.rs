//! Tells a thing from the background it has uncovered: the outline of a thing is an edge of the frame, the outline of a
//! ghost is an edge of what was learnt.

use super::params::GhostParams;
use pursuit_geometry::Point;
use pursuit_imaging::ImageView;
use pursuit_vision::background::Channels;

/// So many times the reach to the side of an outline lie the edges that those along it are compared with.
const BESIDE: usize = 3;

/// How far from an outline edges are looked at, in pixels.
pub(super) const fn farthest_px(params: &GhostParams) -> usize {
    (BESIDE + 1) * params.reach_px
}

/// Edge strength along `outline` in `background` over that in `frame`; at most 1 where the background is as full of edges beside the
/// outline as along it: a plain coat before a bookcase is no ghost. `mask` tells what lies beside the outline of a region
/// about `middle`.
pub(super) fn ghostliness<P: Channels>(
    params: &GhostParams,
    (outline, mask, middle): (&[(usize, usize)], ImageView<'_, u8>, Point),
    frame: ImageView<'_, P>,
    background: ImageView<'_, P>,
) -> f64 {
    let reach = params.reach_px;
    let within = |v: usize, n: usize| v >= reach && v < n.saturating_sub(reach);
    let inside = |x: usize, y: usize| within(x, frame.width()) && within(y, frame.height());
    let (mut on, mut beside) = (Edges::default(), Edges::default());
    let step = (BESIDE * reach) as isize;
    for &(x, y) in outline {
        // At the border of the picture there is no other side.
        if !inside(x, y) {
            continue;
        }
        on.add(gradient(frame, x, y, reach), gradient(background, x, y, reach));
        let away = |v: usize, middle: f64| v.wrapping_add_signed((v as f64 - middle).signum() as isize * step);
        let (x, y) = (away(x, middle.x), away(y, middle.y));
        if inside(x, y) && mask.row(y)[x] == 0 {
            beside.add(gradient(frame, x, y, reach), gradient(background, x, y, reach));
        }
    }
    let ratio = on.learnt(params.noise) / on.now(params.noise);
    // The outline of a ghost is an edge of its own in the background, not one of many.
    let own = on.learnt(params.noise) > params.own * beside.learnt(params.noise);
    if own { ratio } else { ratio.min(1.0) }
}

/// Sums of edge strengths in the frame and in the background.
#[derive(Debug, Clone, Copy, Default)]
struct Edges {
    now: f64,
    learnt: f64,
    count: usize,
}

impl Edges {
    fn add(&mut self, now: f64, learnt: f64) {
        (self.now, self.learnt, self.count) = (self.now + now, self.learnt + learnt, self.count + 1);
    }

    /// The mean in the frame, with that of noise.
    fn now(&self, noise: f64) -> f64 {
        self.now / self.count.max(1) as f64 + noise
    }

    /// The mean in the background, with that of noise.
    fn learnt(&self, noise: f64) -> f64 {
        self.learnt / self.count.max(1) as f64 + noise
    }
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
        let mask = Image::from_fn(40, 40, |x, y| if inside(x, y) { 255u8 } else { 0 }).unwrap();
        let told = |outline: &[(usize, usize)], frame: &Image<u8>, background: &Image<u8>| {
            ghostliness(&params, (outline, mask.view(), Point::new(15.0, 19.0)), frame.view(), background.view())
        };
        let (thing, ghost) = (told(&outline, &with, &without), told(&outline, &without, &with));
        assert!((thing - 6.0 / 106.0).abs() < 1e-12 && (ghost - 106.0 / 6.0).abs() < 1e-12, "{thing} {ghost}");
        // Cut by the border, and nowhere at all.
        assert_eq!(told(&[(0, 5), (39, 5), (5, 1), (5, 38)], &with, &without), 1.0);
        assert_eq!(told(&[], &with, &without), 1.0);
        // Something plain before stripes: the background has more edges along the outline, and beside it.
        let stripes = Image::from_fn(40, 40, |x, _| if x % 8 < 4 { 60u8 } else { 110 }).unwrap();
        let plain = Image::from_fn(40, 40, |x, y| if inside(x, y) { 85u8 } else { stripes.row(y)[x] }).unwrap();
        assert!(told(&outline, &plain, &stripes) <= 1.0);
    }
}
