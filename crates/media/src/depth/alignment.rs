//! Where depth that was not registered to its picture belongs in it, found out from the images: outlines in depth are
//! outlines in the picture.

use super::Registration;
use crate::Result;
use pursuit_geometry::Size;
use pursuit_imaging::{ImageView, Lens};

/// Pairs of images that are looked at: every other one decides, the rest must agree.
pub(super) const PAIRS: usize = 8;

/// Outline points taken of one depth image.
const POINTS: usize = 600;
/// A depth image of fewer outline points tells nothing.
const LEAST_POINTS: usize = 100;
/// Neighbours at depths that differ by this share, and by this many millimetres, are an outline.
const JUMP: (f64, f64) = (0.06, 80.0);
/// Ratios of the focal lengths, that of the picture's camera over that of the depth camera.
const RATIOS: (f64, f64) = (0.80, 1.26);
/// Farthest that the two cameras may stand apart, side by side, in millimetres.
const APART_MM: f64 = 80.0;
/// Focal length in picture widths by which that is turned into pixels: that of a camera that sees 62 degrees.
const FOCAL: f64 = 0.82;
/// What an outline must find on average in the frames that did not decide, in standard deviations of the picture's
/// gradient, and how much more than where it lies.
const LEAST: f64 = 0.5;
const LEAST_GAIN: f64 = 0.4;

/// Moves depth into the picture: pixel `(u, v)` at `z` millimetres goes to `center + ratio · ((u, v) − center) + shift`, and
/// to the right by `disparity / z`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Alignment {
    ratio: f64,
    /// Pixels times millimetres.
    disparity: f64,
    /// Pixels.
    shift: [f64; 2],
}

/// A pair of images, made ready.
struct Pair {
    size: Size,
    /// Gradient of the picture, less its mean, over its standard deviation.
    gradient: Vec<f32>,
    /// Outlines in depth: pixels and millimetres.
    outline: Vec<[f64; 3]>,
}

impl Alignment {
    const NONE: Self = Self { ratio: 1.0, disparity: 0.0, shift: [0.0; 2] };

    /// How depth is to be moved so that it lies on the picture, if it evidently does not; `None` also where the images tell
    /// nothing. Of pictures and depths in millimetres of one size each.
    pub(super) fn find<'a>(images: impl Iterator<Item = (ImageView<'a, u8>, ImageView<'a, u16>)>) -> Option<Self> {
        let pairs: Vec<Pair> = images.filter_map(|(gray, depth)| Pair::new(gray, depth)).collect();
        let (mut decide, mut confirm) = (Vec::new(), Vec::new());
        pairs.iter().enumerate().for_each(|(k, pair)| if k % 2 == 0 { decide.push(pair) } else { confirm.push(pair) });
        if confirm.is_empty() {
            return None;
        }
        let found = Self::climb(Self::coarse(&decide), &decide);
        let (there, here) = (found.fit(&confirm), Self::NONE.fit(&confirm));
        tracing::debug!(there, here, ?found, "outlines of depth in the picture");
        (there >= LEAST && there >= here + LEAST_GAIN).then_some(found)
    }

    /// The same as a registration, of images of `size`.
    pub(super) fn registration(&self, size: Size) -> Result<Registration> {
        let (f, cx, cy) = (FOCAL * size.width as f64, size.width as f64 / 2.0, size.height as f64 / 2.0);
        let lens = |f: f64, [dx, dy]: [f64; 2]| {
            Lens::intrinsics(f, f, cx + dx, cy + dy)
                .map_err(|e| crate::MediaError::unreadable("the alignment of depth", e.to_string()))
        };
        Registration::new(lens(f / self.ratio, [0.0; 2])?, lens(f, self.shift)?, [self.disparity / f, 0.0, 0.0])
    }

    /// Mean gradient of the pictures where the outlines go; those that leave the picture count nothing.
    fn fit(&self, pairs: &[&Pair]) -> f64 {
        let (mut sum, mut count) = (0.0, 0);
        for pair in pairs {
            let Size { width, height } = pair.size;
            let (cx, cy) = (width as f64 / 2.0, height as f64 / 2.0);
            for &[u, v, z] in &pair.outline {
                let x = cx + self.ratio * (u - cx) + self.disparity / z + self.shift[0];
                let y = cy + self.ratio * (v - cy) + self.shift[1];
                if x >= 0.0 && y >= 0.0 && x < width as f64 && y < height as f64 {
                    sum += f64::from(pair.gradient[y as usize * width + x as usize]);
                }
            }
            count += pair.outline.len();
        }
        sum / count.max(1) as f64
    }

    /// As [`fit`](Self::fit), less a little for a shift, which two cameras side by side hardly have.
    fn worth(&self, pairs: &[&Pair]) -> f64 {
        let side = pairs.first().map_or(1.0, |p| p.size.width as f64) / 80.0;
        self.fit(pairs) - 0.05 * (self.shift[0].powi(2) + self.shift[1].powi(2)) / side.powi(2)
    }

    /// The best of a grid.
    fn coarse(pairs: &[&Pair]) -> Self {
        let width = pairs.first().map_or(640.0, |p| p.size.width as f64);
        let (near, apart) = (width / 80.0, FOCAL * width * APART_MM);
        let mut best = (f64::NEG_INFINITY, Self::NONE);
        let steps = ((RATIOS.1 - RATIOS.0) / 0.02).round() as usize;
        for step in 0..=steps {
            let ratio = RATIOS.0 + 0.02 * step as f64;
            for side in -10..=10 {
                for (dx, dy) in [-1.0, 0.0, 1.0].into_iter().flat_map(|dx| [-1.0, 0.0, 1.0].map(|dy| (dx, dy))) {
                    let tried =
                        Self { ratio, disparity: f64::from(side) / 10.0 * apart, shift: [near * dx, near * dy] };
                    let worth = tried.worth(pairs);
                    if worth > best.0 {
                        best = (worth, tried);
                    }
                }
            }
        }
        best.1
    }

    /// The best near `self` by steps that are halved.
    fn climb(mut self, pairs: &[&Pair]) -> Self {
        let width = pairs.first().map_or(640.0, |p| p.size.width as f64);
        let mut worth = self.worth(pairs);
        for halving in 0..4 {
            let size = 0.5_f64.powi(halving);
            let (ratio, side, shift) = (0.01 * size, FOCAL * width * 4.0 * size, width / 160.0 * size);
            // Each step gains, so that it ends; a bound for what rounding may do.
            for _ in 0..100 {
                let moved = [-1.0, 1.0].into_iter().flat_map(|sign| {
                    [
                        Self { ratio: self.ratio + sign * ratio, ..self },
                        Self { disparity: self.disparity + sign * side, ..self },
                        Self { shift: [self.shift[0] + sign * shift, self.shift[1]], ..self },
                        Self { shift: [self.shift[0], self.shift[1] + sign * shift], ..self },
                    ]
                });
                let best = moved.map(|m| (m.worth(pairs), m)).max_by(|a, b| a.0.total_cmp(&b.0));
                match best {
                    Some((better, m)) if better > worth => (worth, self) = (better, m),
                    _ => break,
                }
            }
        }
        self
    }
}

impl Pair {
    fn new(gray: ImageView<'_, u8>, depth: ImageView<'_, u16>) -> Option<Self> {
        let size = gray.size();
        if depth.size() != size || size.width < 32 || size.height < 32 {
            return None;
        }
        let all = outline(depth);
        let outline: Vec<_> = all.iter().step_by((all.len() / POINTS).max(1)).copied().collect();
        (outline.len() >= LEAST_POINTS).then(|| Self { size, gradient: gradient(gray), outline })
    }
}

/// Where depth jumps: the pixel of the nearer side, which is the one that hides the other.
fn outline(depth: ImageView<'_, u16>) -> Vec<[f64; 3]> {
    let Size { width, height } = depth.size();
    let mut points = Vec::new();
    let mut look = |(x, y): (usize, usize), (dx, dy): (usize, usize)| {
        let (a, b) = (f64::from(depth.row(y)[x]), f64::from(depth.row(y + dy)[x + dx]));
        let (near, jump) = (a.min(b), (a - b).abs());
        if near > 0.0 && jump > JUMP.0 * near && jump > JUMP.1 {
            // Half a pixel within the nearer side.
            let share = if a < b { 0.25 } else { 0.75 };
            points.push([x as f64 + 0.5 + share * dx as f64, y as f64 + 0.5 + share * dy as f64, near]);
        }
    };
    for y in 0..height - 2 {
        for x in 0..width - 2 {
            look((x, y), (2, 0));
            look((x, y), (0, 2));
        }
    }
    points
}

/// The picture's gradient, smoothed before and after, cut off at its twentieth part, less its mean, over its deviation.
fn gradient(gray: ImageView<'_, u8>) -> Vec<f32> {
    let Size { width, height } = gray.size();
    let mut smooth: Vec<f32> = (0..height).flat_map(|y| gray.row(y).iter().map(|v| f32::from(*v))).collect();
    let mut line = Vec::new();
    (0..3).for_each(|_| binomial(&mut smooth, width, &mut line));
    let at = |x: usize, y: usize| smooth[y * width + x];
    let mut out = vec![0.0; width * height];
    for y in 1..height - 1 {
        for x in 1..width - 1 {
            out[y * width + x] = (at(x + 1, y) - at(x - 1, y)).hypot(at(x, y + 1) - at(x, y - 1));
        }
    }
    let mut sorted = out.clone();
    let most = *sorted.select_nth_unstable_by(out.len() * 19 / 20, f32::total_cmp).1;
    out.iter_mut().for_each(|v| *v = v.min(most));
    (0..2).for_each(|_| binomial(&mut out, width, &mut line));
    let mean = out.iter().sum::<f32>() / out.len() as f32;
    let deviation = (out.iter().map(|v| (v - mean).powi(2)).sum::<f32>() / out.len() as f32).sqrt();
    out.iter_mut().for_each(|v| *v = (*v - mean) / deviation.max(1e-6));
    out
}

/// Smooths by ¼, ½, ¼ across and down; the border stays.
fn binomial(image: &mut [f32], width: usize, line: &mut Vec<f32>) {
    for row in image.chunks_exact_mut(width) {
        line.clear();
        line.extend_from_slice(row);
        for (out, w) in row[1..].iter_mut().zip(line.windows(3)) {
            *out = 0.25 * (w[0] + w[2]) + 0.5 * w[1];
        }
    }
    for x in 0..width {
        line.clear();
        line.extend(image.iter().skip(x).step_by(width));
        for (y, w) in line.windows(3).enumerate() {
            image[(y + 1) * width + x] = 0.25 * (w[0] + w[2]) + 0.5 * w[1];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_imaging::Image;

    /// A picture of boxes at several depths, and their depth as another camera sees it.
    fn scene(seed: u64, truth: &Alignment) -> (Image<u8>, Image<u16>) {
        let mut random = seed;
        let mut draw = move |n: u64| {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (random >> 33) % n
        };
        let boxes: Vec<[f64; 6]> = (0..9)
            .map(|k| {
                let z = 3200.0 - 280.0 * k as f64;
                [
                    draw(280) as f64,
                    draw(200) as f64,
                    (30 + draw(60)) as f64,
                    (30 + draw(60)) as f64,
                    z,
                    draw(200) as f64,
                ]
            })
            .collect();
        let seen = |u: f64, v: f64, moved: bool| {
            let hit = boxes.iter().rev().find(|[x, y, w, h, z, _]| {
                let (u, v) = if moved {
                    let u = 160.0 + truth.ratio * (u - 160.0) + truth.disparity / z + truth.shift[0];
                    (u, 120.0 + truth.ratio * (v - 120.0) + truth.shift[1])
                } else {
                    (u, v)
                };
                (*x..x + w).contains(&u) && (*y..y + h).contains(&v)
            });
            hit.map_or((3900.0, 90.0), |b| (b[4], b[5]))
        };
        let noise = |x: usize, y: usize| ((x * 31 + y * 17 + x * y * 7) % 23) as f64;
        let gray = Image::from_fn(320, 240, |x, y| {
            (seen(x as f64 + 0.5, y as f64 + 0.5, false).1 + noise(x, y)).min(255.0) as u8
        });
        let depth = Image::from_fn(320, 240, |x, y| {
            let hole = (x / 7 + y / 5) % 19 == 0;
            if hole { 0 } else { seen(x as f64 + 0.5, y as f64 + 0.5, true).0 as u16 }
        });
        (gray.unwrap(), depth.unwrap())
    }

    fn find(scenes: &[(Image<u8>, Image<u16>)]) -> Option<Alignment> {
        Alignment::find(scenes.iter().map(|(gray, depth)| (gray.view(), depth.view())))
    }

    #[test]
    fn another_cameras_depth_is_brought_to_the_picture() {
        for truth in [
            Alignment { ratio: 0.9, disparity: -6500.0, shift: [0.0, -1.0] },
            Alignment { ratio: 1.1, disparity: 9000.0, shift: [2.0, 0.0] },
        ] {
            let scenes: Vec<_> = (1..=6).map(|seed| scene(seed, &truth)).collect();
            let found = find(&scenes).unwrap();
            let farthest = [900.0, 2000.0, 3500.0].into_iter().flat_map(|z| {
                let place = |a: &Alignment, u: f64, v: f64| {
                    let x = a.ratio * (u - 160.0) + a.disparity / z + a.shift[0];
                    (x, a.ratio * (v - 120.0) + a.shift[1])
                };
                [(20.0, 20.0), (300.0, 20.0), (160.0, 120.0), (20.0, 220.0)].map(|(u, v)| {
                    let ((x, y), (p, q)) = (place(&found, u, v), place(&truth, u, v));
                    (x - p).hypot(y - q)
                })
            });
            let farthest = farthest.fold(0.0, f64::max);
            assert!(farthest < 3.0, "{farthest:.1} px: {found:?}");
            let registered = found.registration(Size::new(320, 240)).unwrap();
            let moved = registered.apply(scenes[0].1.view(), Size::new(320, 240)).unwrap();
            let again: Vec<_> = vec![(scenes[0].0.clone(), moved)];
            assert_eq!(find(&again), None, "what lies well is left alone");
        }
    }

    #[test]
    fn depth_that_lies_well_or_tells_nothing_is_left_alone() {
        let scenes: Vec<_> = (1..=6).map(|seed| scene(seed, &Alignment::NONE)).collect();
        assert_eq!(find(&scenes), None);
        assert_eq!(find(&[]), None);
        let other = Alignment { ratio: 0.9, disparity: -6500.0, shift: [0.0; 2] };
        // One pair alone has nothing to be confirmed by; flat depth has no outlines; other pictures do not fit.
        assert_eq!(find(&[scene(1, &other)]), None);
        let flat = Image::filled(320, 240, 1500_u16).unwrap();
        let blind: Vec<_> = (1..=6).map(|seed| (scene(seed, &other).0, flat.clone())).collect();
        assert_eq!(find(&blind), None);
        let strangers: Vec<_> = (1..=6).map(|seed| (scene(seed, &other).0, scene(seed + 50, &other).1)).collect();
        assert_eq!(find(&strangers), None);
        let black: Vec<_> =
            (1..=6).map(|seed| (Image::filled(320, 240, 0_u8).unwrap(), scene(seed, &other).1)).collect();
        assert_eq!(find(&black), None);
    }
}
