//! A camera that shakes a little: how far the frame is shifted against the background, told from the edges of whatever of the
//! background is in sight.
//!
//! Points at strong edges, one a cell of a grid, are looked for in the frame: a descent over whole pixels on the mean of
//! truncated absolute differences, which what moves in front of them hardly disturbs, then one step of least squares on the
//! gradients for the fraction of a pixel (Lucas and Kanade 1981).

use super::difference::Channels;
use super::{BACKGROUND, BackgroundModel};
use crate::Result;
use multiversion::multiversion;
use pursuit_imaging::{Image, ImageView};

/// Cells across the longer side.
const CELLS: usize = 40;
/// Sum of the differences across and down, in codes over two pixels, that makes an edge.
const EDGE: f32 = 24.0;
/// Fewer points than this tell nothing.
const FEWEST: usize = 24;
/// Differences count up to this many codes.
const MOST: f32 = 24.0;
/// A shift must make the mean difference smaller than this share of what it is without …
const GAIN: f32 = 0.85;
/// … and a step of the descent smaller by this share.
const STEP: f32 = 0.98;
/// Shifts smaller than this, in pixels, are none.
const SMALLEST: f32 = 0.3;
/// The background is taken anew after so many frames.
const REFRESH: u32 = 25;
/// After a shift the camera counts as unsteady for so many frames.
const UNSTEADY: u32 = 75;
/// How far a value may lie outside of what the background's nearest pixels span, in codes.
const SLACK: u8 = 10;

/// A place of the background that is easily found again.
#[derive(Debug, Clone, Copy)]
struct Point {
    x: usize,
    y: usize,
    value: f32,
    across: f32,
    down: f32,
}

/// Where frames lie on the background.
#[derive(Debug, Clone)]
pub(super) struct Registration<P> {
    /// Greatest shift, in pixels.
    reach: isize,
    reference: Image<P>,
    points: Vec<Point>,
    /// Those that nothing covers.
    open: Vec<Point>,
    /// Frames since the reference was taken.
    age: u32,
    /// Frames since the last shift, at most [`UNSTEADY`].
    still: u32,
    /// Frame(x + shift) = background(x).
    shift: (f32, f32),
    /// The mean difference that remains, as a rule.
    usual: f32,
}

impl<P: Channels> Registration<P> {
    pub fn new() -> Result<Self> {
        Ok(Self {
            reach: 0,
            reference: Image::filled(1, 1, P::default())?,
            points: Vec::new(),
            open: Vec::new(),
            age: REFRESH,
            still: UNSTEADY,
            shift: (0.0, 0.0),
            usual: 2.0,
        })
    }

    /// How far the last frame was shifted: what is at `p` of the background is at `p + shift` of the frame.
    pub const fn shift(&self) -> (f32, f32) {
        self.shift
    }

    /// Whether the last frame was shifted at all.
    pub fn shifted(&self) -> bool {
        self.shift != (0.0, 0.0)
    }

    /// Whether the camera has moved lately.
    pub const fn unsteady(&self) -> bool {
        self.still < UNSTEADY
    }

    /// The background was learnt anew.
    pub fn forget(&mut self) {
        self.age = REFRESH;
    }

    /// Measures the shift of `frame` against `model`, outside of `protect`; `light` is the gain and offset of the frame's
    /// brightness, and shifts reach up to `share` of the longer side.
    pub fn measure<M: BackgroundModel<P>>(
        &mut self,
        frame: ImageView<'_, P>,
        model: &M,
        protect: Option<ImageView<'_, u8>>,
        light: (f32, f32),
        share: f64,
    ) -> Result<()> {
        self.reach = (share * frame.width().max(frame.height()) as f64).round().clamp(0.0, 64.0) as isize;
        self.age = self.age.saturating_add(1);
        if self.age > REFRESH {
            if self.reach < 1 || !model.background(&mut self.reference)? {
                self.shift = (0.0, 0.0);
                return Ok(());
            }
            self.age = 1;
            self.pick();
        }
        let open = |p: &&Point| protect.as_ref().is_none_or(|held| held.row(p.y)[p.x] == 0);
        self.open.clear();
        self.open.extend(self.points.iter().filter(open).map(|p| Point {
            value: light.0 * p.value + light.1,
            across: light.0 * p.across,
            down: light.0 * p.down,
            ..*p
        }));
        let before = self.shift;
        self.shift = if self.open.len() < FEWEST { (0.0, 0.0) } else { self.found(frame, before) };
        let moved = self.shifted() || (self.shift.0 - before.0).abs().max((self.shift.1 - before.1).abs()) > 0.0;
        self.still = if moved { 0 } else { (self.still + 1).min(UNSTEADY) };
        Ok(())
    }

    /// Takes the strongest edge of every cell.
    fn pick(&mut self) {
        let image = self.reference.view();
        let (width, height) = (image.width(), image.height());
        let cell = (width.max(height) / CELLS).max(6);
        let margin = self.reach as usize + 2;
        self.points.clear();
        for top in (margin..height.saturating_sub(margin)).step_by(cell) {
            for left in (margin..width.saturating_sub(margin)).step_by(cell) {
                let (bottom, right) = ((top + cell).min(height - margin), (left + cell).min(width - margin));
                let mut best: Option<Point> = None;
                for y in (top..bottom).step_by(2) {
                    for x in (left..right).step_by(2) {
                        let at = |x: usize, y: usize| brightness(image.row(y)[x]);
                        let (across, down) = (at(x + 1, y) - at(x - 1, y), at(x, y + 1) - at(x, y - 1));
                        let strength = |p: &Point| p.across.abs() + p.down.abs();
                        let point = Point { x, y, value: at(x, y), across: 0.5 * across, down: 0.5 * down };
                        if 2.0 * strength(&point) >= EDGE && best.is_none_or(|b| strength(&point) > strength(&b)) {
                            best = Some(point);
                        }
                    }
                }
                self.points.extend(best);
            }
        }
    }

    /// The mean truncated difference at a shift by whole pixels.
    fn cost(&self, frame: ImageView<'_, P>, (dx, dy): (isize, isize)) -> f32 {
        let sum: f32 = self.open.iter().map(|p| p.off(frame, (dx, dy)).abs().min(MOST)).sum();
        sum / self.open.len().max(1) as f32
    }

    fn found(&mut self, frame: ImageView<'_, P>, before: (f32, f32)) -> (f32, f32) {
        let none = ((0, 0), self.cost(frame, (0, 0)));
        let whole = |v: f32| (v.round() as isize).clamp(-self.reach, self.reach);
        let known = (whole(before.0), whole(before.1));
        let known = (known, self.cost(frame, known));
        let mut best = self.descended(frame, if known.1 < STEP * none.1 { known } else { none });
        // A descent ends in front of the next edge: it sets out from all around as well.
        for from in [(-3, 0), (3, 0), (0, -3), (0, 3), (-3, -3), (3, -3), (-3, 3), (3, 3)] {
            let from: (isize, isize) = from;
            if best.0 != (0, 0) || best.1 > 1.1 * self.usual {
                let at = (from.0.clamp(-self.reach, self.reach), from.1.clamp(-self.reach, self.reach));
                let other = self.descended(frame, (at, self.cost(frame, at)));
                best = if other.1 < STEP * best.1 { other } else { best };
            }
        }
        if best.1 > 1.3 * self.usual + 1.0 {
            // Too far for a descent: edges are narrow.
            for dy in (-self.reach..=self.reach).step_by(2) {
                for dx in (-self.reach..=self.reach).step_by(2) {
                    let cost = self.cost(frame, (dx, dy));
                    if cost < STEP * best.1 {
                        best = ((dx, dy), cost);
                    }
                }
            }
            best = self.descended(frame, best);
        }
        if best.0 != (0, 0) && best.1 > GAIN * none.1 {
            best = none;
        }
        self.usual += 0.1 * (best.1 - self.usual);
        let (fx, fy) = self.fraction(frame, best.0);
        let shift = (best.0.0 as f32 + fx, best.0.1 as f32 + fy);
        if shift.0.abs().max(shift.1.abs()) < SMALLEST { (0.0, 0.0) } else { shift }
    }

    /// Goes down from neighbour to neighbour.
    fn descended(&self, frame: ImageView<'_, P>, from: ((isize, isize), f32)) -> ((isize, isize), f32) {
        let mut best = from;
        for _ in 0..2 * self.reach {
            let ((x, y), _) = best;
            let mut next = best;
            for (dx, dy) in [(-1, 0), (1, 0), (0, -1), (0, 1), (-1, -1), (1, -1), (-1, 1), (1, 1)] {
                let at = (x + dx, y + dy);
                if at.0.abs() <= self.reach && at.1.abs() <= self.reach {
                    let cost = self.cost(frame, at);
                    if cost < STEP * next.1 {
                        next = (at, cost);
                    }
                }
            }
            if next.0 == best.0 {
                break;
            }
            best = next;
        }
        best
    }

    /// What is left of the shift: least squares on the gradients, of the points that agree.
    fn fraction(&self, frame: ImageView<'_, P>, whole: (isize, isize)) -> (f32, f32) {
        let (mut xx, mut xy, mut yy, mut xr, mut yr) = (0.0f32, 0.0f32, 0.0f32, 0.0f32, 0.0f32);
        for p in &self.open {
            let off = p.off(frame, whole);
            if off.abs() < MOST {
                (xx, xy, yy) = (xx + p.across * p.across, xy + p.across * p.down, yy + p.down * p.down);
                (xr, yr) = (xr + p.across * off, yr + p.down * off);
            }
        }
        let (det, trace) = (xx * yy - xy * xy, xx + yy);
        if det <= 0.01 * trace * trace {
            return (0.0, 0.0);
        }
        let most = |v: f32| v.clamp(-0.75, 0.75);
        (most((xy * yr - yy * xr) / det), most((xy * xr - xx * yr) / det))
    }

    /// Writes the frame as it lies on the background; what the frame does not show is as the background is.
    pub fn register(&self, frame: ImageView<'_, P>, to: &mut Image<P>) -> Result<()> {
        let (width, height) = (frame.width(), frame.height());
        to.resize_for_overwrite(frame.size(), P::default())?;
        let split = |v: f32| (v.floor() as isize, ((v - v.floor()) * 16.0).round() as u16);
        let ((dx, fx), (dy, fy)) = (split(self.shift.0), split(self.shift.1));
        for y in 0..height {
            let (row, out) = (y as isize + dy, to.row_mut(y));
            let behind = self.reference.row(y.min(self.reference.height() - 1));
            if let Some(behind) = behind.get(..width) {
                out.copy_from_slice(behind);
            }
            if row < 0 || row + 1 >= height as isize {
                continue;
            }
            // Columns whose sources x + dx and x + dx + 1 lie in the frame.
            let first = (-dx).max(0) as usize;
            let last = (width as isize - 1 - dx).clamp(0, width as isize) as usize;
            if first >= last {
                continue;
            }
            let from = (first as isize + dx) as usize;
            let (upper, lower) = (frame.row(row as usize), frame.row(row as usize + 1));
            let n = last - first;
            let (upper, lower) = (P::channels(&upper[from..=from + n]), P::channels(&lower[from..=from + n]));
            mix(P::COUNT, upper, lower, (fx, fy), P::channels_mut(&mut out[first..last]));
        }
        Ok(())
    }

    /// Takes back what the nearest pixels of the background explain: edges are never registered exactly.
    pub fn admit_neighbours(&self, frame: ImageView<'_, P>, mask: &mut Image<u8>) {
        let (width, height) = (frame.width(), frame.height());
        if self.reference.size() != frame.size() {
            return;
        }
        for y in 0..height {
            let row = frame.row(y);
            let (top, bottom) = (y.saturating_sub(1), (y + 1).min(height - 1));
            for (x, told) in mask.row_mut(y).iter_mut().enumerate().filter(|(_, told)| **told != BACKGROUND) {
                let columns = x.saturating_sub(1)..(x + 2).min(width);
                let (mut least, mut most) = ([255u8; 3], [0u8; 3]);
                for near in (top..=bottom).flat_map(|y| &self.reference.row(y)[columns.clone()]) {
                    for (c, v) in P::channels(std::slice::from_ref(near)).iter().enumerate() {
                        (least[c], most[c]) = (least[c].min(*v), most[c].max(*v));
                    }
                }
                let own = [row[x]];
                let mut own = P::channels(&own).iter().enumerate();
                let near =
                    own.all(|(c, v)| *v >= least[c].saturating_sub(SLACK) && *v <= most[c].saturating_add(SLACK));
                if near {
                    *told = BACKGROUND;
                }
            }
        }
    }
}

impl Point {
    /// How much brighter the frame is at a shift than it should be.
    fn off<P: Channels>(&self, frame: ImageView<'_, P>, (dx, dy): (isize, isize)) -> f32 {
        // Points keep away from the border by the greatest shift.
        let (x, y) = (self.x.wrapping_add_signed(dx), self.y.wrapping_add_signed(dy));
        frame.row(y).get(x).map_or(0.0, |pixel| brightness(*pixel) - self.value)
    }
}

/// Mean of the channels.
fn brightness<P: Channels>(pixel: P) -> f32 {
    let pixel = [pixel];
    let channels = P::channels(&pixel);
    channels.iter().map(|&v| f32::from(v)).sum::<f32>() / P::COUNT as f32
}

/// Bilinear mixture of four neighbours, of channels that lie `step` apart; weights in sixteenths.
#[multiversion(targets("x86_64+avx2", "x86_64+sse4.1", "aarch64+neon"))]
fn mix(step: usize, upper: &[u8], lower: &[u8], (fx, fy): (u16, u16), out: &mut [u8]) {
    let n = out.len();
    let (a, b) = (&upper[..n], &upper[step..step + n]);
    let (c, d) = (&lower[..n], &lower[step..step + n]);
    let (gx, gy) = (16 - fx, 16 - fy);
    let (wa, wb, wc, wd) = (gx * gy, fx * gy, gx * fy, fx * fy);
    for i in 0..n {
        let sum = wa * u16::from(a[i]) + wb * u16::from(b[i]) + wc * u16::from(c[i]) + wd * u16::from(d[i]);
        out[i] = ((sum + 128) >> 8) as u8;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::background::{FixedBackground, Learning};
    use pursuit_testkit::{lattice, value_noise};

    /// A scene with structure, seen `(dx, dy)` pixels farther right and down, in another light.
    fn seen(dx: f64, dy: f64, gain: f64) -> Image<[u8; 3]> {
        Image::from_fn(160, 120, |x, y| {
            let (x, y) = (x as f64 - dx, y as f64 - dy);
            let v = 38.0 + 180.0 * value_noise((x, y), 7.0, |t| t * t * (3.0 - 2.0 * t), |i, j| lattice(i, j, 3));
            [v, 0.8 * v, 0.9 * v].map(|v| (gain * v).clamp(0.0, 255.0) as u8)
        })
        .unwrap()
    }

    fn model() -> FixedBackground<[u8; 3]> {
        let mut model = FixedBackground::from_first_frame(20);
        let mut mask = Image::filled(1, 1, 0).unwrap();
        model.apply(seen(0.0, 0.0, 1.0).view(), &Learning::default(), &mut mask).unwrap();
        model
    }

    #[test]
    fn shifts_are_measured_to_a_fraction_of_a_pixel() {
        for (dx, dy) in [(0.0, 0.0), (2.0, -1.0), (-3.0, 3.0), (0.5, 0.0), (1.4, -2.6), (5.0, 6.0)] {
            let mut registration = Registration::new().unwrap();
            registration.measure(seen(dx, dy, 1.0).view(), &model(), None, (1.0, 0.0), 0.05).unwrap();
            let (x, y) = registration.shift();
            assert!((f64::from(x) - dx).abs() < 0.2 && (f64::from(y) - dy).abs() < 0.2, "{dx},{dy}: {x},{y}");
        }
    }

    #[test]
    fn a_registered_frame_is_the_background_again() {
        let (mut registration, mut lies) = (Registration::new().unwrap(), Image::filled(1, 1, [0; 3]).unwrap());
        registration.measure(seen(3.0, -2.0, 1.0).view(), &model(), None, (1.0, 0.0), 0.05).unwrap();
        registration.register(seen(3.0, -2.0, 1.0).view(), &mut lies).unwrap();
        let (was, mut most) = (seen(0.0, 0.0, 1.0), 0);
        for (a, b) in lies.as_slice().iter().zip(was.as_slice()) {
            most = most.max(a.iter().zip(b).map(|(a, b)| a.abs_diff(*b)).max().unwrap());
        }
        assert!(most <= 12, "{most}");
    }

    #[test]
    fn what_moves_in_front_is_no_shift() {
        let mut frame = seen(0.0, 0.0, 1.0);
        for y in 20..100 {
            frame.row_mut(y)[60..110].iter_mut().enumerate().for_each(|(x, v)| *v = [(x * 5) as u8, 9, 200]);
        }
        let mut registration = Registration::new().unwrap();
        registration.measure(frame.view(), &model(), None, (1.0, 0.0), 0.05).unwrap();
        assert_eq!(registration.shift(), (0.0, 0.0));
        // A picture without edges tells nothing, and another scene is no shift.
        let flat = Image::filled(160, 120, [90; 3]).unwrap();
        registration.measure(flat.view(), &model(), None, (1.0, 0.0), 0.05).unwrap();
        assert!(registration.shift().0.abs() <= 8.0);
    }

    #[test]
    fn the_light_may_be_another() {
        let mut registration = Registration::new().unwrap();
        registration.measure(seen(2.0, 1.0, 0.6).view(), &model(), None, (0.6, 0.0), 0.05).unwrap();
        let (x, y) = registration.shift();
        assert!((x - 2.0).abs() < 0.25 && (y - 1.0).abs() < 0.25, "{x},{y}");
    }

    #[test]
    fn edges_that_lie_a_pixel_off_are_background() {
        let mut registration = Registration::new().unwrap();
        registration.measure(seen(0.0, 0.0, 1.0).view(), &model(), None, (1.0, 0.0), 0.05).unwrap();
        let mut mask = Image::filled(160, 120, 255u8).unwrap();
        registration.admit_neighbours(seen(0.7, 0.7, 1.0).view(), &mut mask);
        let left = mask.as_slice().iter().filter(|v| **v != 0).count();
        assert!(left < 160 * 120 / 50, "{left}");
        let mut mask = Image::filled(160, 120, 255u8).unwrap();
        registration.admit_neighbours(Image::filled(160, 120, [0, 255, 0]).unwrap().view(), &mut mask);
        assert!(mask.as_slice().iter().all(|v| *v == 255), "what is of another colour stays");
    }
}
