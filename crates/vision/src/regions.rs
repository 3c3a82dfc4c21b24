//! Connected regions of a mask.

use crate::window::PixelWindow;
use pursuit_geometry::Point;
use pursuit_imaging::ImageView;

/// A set of pixels that hang together (8-connected).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Region {
    /// Pixels.
    pub area: usize,
    /// The smallest rectangle of pixels that holds it.
    pub bounds: PixelWindow,
    /// Its centre of mass, in continuous pixels of the mask.
    pub centroid: Point,
    /// Variance of x, covariance of x and y, variance of y of its pixels, in square pixels.
    pub spread: [f64; 3],
    /// Column and row of its leftmost pixel in its topmost row, where [`trace`](crate::contour::trace) starts.
    pub first: (usize, usize),
}

impl Region {
    /// Standard deviations along its long and its short axis, in pixels. A uniform disk of diameter d has d/4 for both.
    pub fn axes(&self) -> (f64, f64) {
        let [xx, xy, yy] = self.spread;
        let mean = (xx + yy) / 2.0;
        let half = ((xx - yy) / 2.0).hypot(xy);
        ((mean + half).max(0.0).sqrt(), (mean - half).max(0.0).sqrt())
    }
}

/// A maximal run of set pixels in one row: columns `from..to`.
#[derive(Debug, Clone, Copy)]
struct Run {
    y: u32,
    from: u32,
    to: u32,
    label: u32,
}

#[derive(Debug, Clone, Copy)]
struct Sums {
    area: u64,
    x: u64,
    y: u64,
    xx: u64,
    xy: u64,
    yy: u64,
    left: u32,
    right: u32,
    top: u32,
    bottom: u32,
    first: u32,
}

/// Finds connected regions; owns its scratch, so nothing is allocated from frame to frame.
#[derive(Debug, Clone, Default)]
pub struct RegionFinder {
    runs: Vec<Run>,
    parents: Vec<u32>,
    sums: Vec<Option<Sums>>,
    regions: Vec<Region>,
}

impl RegionFinder {
    /// The 8-connected regions of non-zero pixels with at least `least_area` pixels, in the order of their first pixel
    /// (row by row).
    pub fn find(&mut self, mask: ImageView<'_, u8>, least_area: usize) -> &[Region] {
        self.collect_runs(mask);
        self.sum_up();
        self.regions.clear();
        let large = self.sums.iter().flatten().filter(|s| s.area >= least_area as u64);
        self.regions.extend(large.map(Sums::region));
        self.regions.sort_unstable_by_key(|r| (r.first.1, r.first.0));
        &self.regions
    }

    fn collect_runs(&mut self, mask: ImageView<'_, u8>) {
        self.runs.clear();
        self.parents.clear();
        let mut above = 0..0;
        for (y, row) in mask.rows().enumerate() {
            let start = self.runs.len();
            let mut candidate = above.start;
            let mut x = 0;
            while let Some((from, to)) = next_run(row, x) {
                x = to;
                let label = self.label_of(from as u32, to as u32, &mut candidate, above.end);
                self.runs.push(Run { y: y as u32, from: from as u32, to: to as u32, label });
            }
            above = start..self.runs.len();
        }
    }

    /// Joins the run with all it touches in the row above (`candidate..end`, sorted); a fresh label if there is none.
    fn label_of(&mut self, from: u32, to: u32, candidate: &mut usize, end: usize) -> u32 {
        // Diagonal neighbours count, hence `<` and `<=` where 4-connectivity would have one more column between.
        while *candidate < end && self.runs[*candidate].to < from {
            *candidate += 1;
        }
        let mut label = None;
        let mut at = *candidate;
        while at < end && self.runs[at].from <= to {
            let other = self.root(self.runs[at].label);
            label = Some(match label {
                None => other,
                Some(mine) => self.join(mine, other),
            });
            at += 1;
        }
        label.unwrap_or_else(|| {
            self.parents.push(self.parents.len() as u32);
            self.parents.len() as u32 - 1
        })
    }

    fn root(&mut self, mut label: u32) -> u32 {
        while self.parents[label as usize] != label {
            let grandparent = self.parents[self.parents[label as usize] as usize];
            self.parents[label as usize] = grandparent;
            label = grandparent;
        }
        label
    }

    fn join(&mut self, a: u32, b: u32) -> u32 {
        let (a, b) = (self.root(a), self.root(b));
        let (low, high) = (a.min(b), a.max(b));
        self.parents[high as usize] = low;
        low
    }

    fn sum_up(&mut self) {
        self.sums.clear();
        self.sums.resize(self.parents.len(), None);
        for i in 0..self.runs.len() {
            let run = self.runs[i];
            let root = self.root(run.label) as usize;
            let sums = Sums::of(run);
            self.sums[root] = Some(match self.sums[root] {
                None => sums,
                Some(have) => have.plus(&sums),
            });
        }
    }
}

/// The next run of non-zero pixels at or after column `x`: `from..to`.
fn next_run(row: &[u8], x: usize) -> Option<(usize, usize)> {
    let rest = &row[x..];
    // Whole words of zeros are skipped at once: masks are mostly empty.
    let skipped = rest.chunks_exact(16).take_while(|c| c.iter().fold(0, |a, b| a | b) == 0).count() * 16;
    let from = skipped + rest[skipped..].iter().position(|&v| v != 0)?;
    let length = rest[from..].iter().position(|&v| v == 0).unwrap_or(rest.len() - from);
    Some((x + from, x + from + length))
}

impl Sums {
    fn of(run: Run) -> Self {
        // Sums over the columns from..to, in closed form.
        let squares_below = |n: u64| if n == 0 { 0 } else { (n - 1) * n * (2 * n - 1) / 6 };
        let (from, to, y) = (u64::from(run.from), u64::from(run.to), u64::from(run.y));
        let n = to - from;
        let x = (from + to - 1) * n / 2;
        Self {
            area: n,
            x,
            y: y * n,
            xx: squares_below(to) - squares_below(from),
            xy: x * y,
            yy: y * y * n,
            left: run.from,
            right: run.to,
            top: run.y,
            bottom: run.y + 1,
            first: run.from,
        }
    }

    /// With the sums of a later run.
    fn plus(&self, later: &Self) -> Self {
        Self {
            area: self.area + later.area,
            x: self.x + later.x,
            y: self.y + later.y,
            xx: self.xx + later.xx,
            xy: self.xy + later.xy,
            yy: self.yy + later.yy,
            left: self.left.min(later.left),
            right: self.right.max(later.right),
            top: self.top,
            bottom: self.bottom.max(later.bottom),
            first: self.first,
        }
    }

    fn region(&self) -> Region {
        let n = self.area as f64;
        let (x, y) = (self.x as f64 / n, self.y as f64 / n);
        Region {
            area: self.area as usize,
            bounds: PixelWindow {
                x: self.left as usize,
                y: self.top as usize,
                width: (self.right - self.left) as usize,
                height: (self.bottom - self.top) as usize,
            },
            centroid: Point::new(x + 0.5, y + 0.5),
            spread: [self.xx as f64 / n - x * x, self.xy as f64 / n - x * y, self.yy as f64 / n - y * y],
            first: (self.first as usize, self.top as usize),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use pursuit_imaging::Image;
    use pursuit_testkit::Noise;

    /// The slow, obvious reference: flood fill from every pixel not yet seen.
    fn slow(mask: &Image<u8>) -> Vec<Vec<(usize, usize)>> {
        let (w, h) = (mask.width(), mask.height());
        let mut seen = vec![false; w * h];
        let mut regions = Vec::new();
        for start in 0..w * h {
            if seen[start] || mask.as_slice()[start] == 0 {
                continue;
            }
            seen[start] = true;
            let (mut stack, mut pixels) = (vec![(start % w, start / w)], Vec::new());
            while let Some((x, y)) = stack.pop() {
                pixels.push((x, y));
                for j in y.saturating_sub(1)..(y + 2).min(h) {
                    for i in x.saturating_sub(1)..(x + 2).min(w) {
                        if mask.row(j)[i] != 0 && !seen[j * w + i] {
                            seen[j * w + i] = true;
                            stack.push((i, j));
                        }
                    }
                }
            }
            regions.push(pixels);
        }
        regions
    }

    proptest! {
        #[test]
        fn regions_equal_flood_fill((w, h) in (1usize..60, 1usize..25), seed in any::<u32>(), dense in 1u32..9) {
            let mut noise = Noise::new(seed | 1);
            let mask = Image::from_fn(w, h, |_, _| u8::from((noise.draw() >> 16) % 9 < dense)).unwrap();
            let mut finder = RegionFinder::default();
            let regions = finder.find(mask.view(), 1).to_vec();
            let expected = slow(&mask);
            prop_assert_eq!(regions.len(), expected.len());
            for (region, pixels) in regions.iter().zip(&expected) {
                prop_assert_eq!(region.first, pixels[0]);
                prop_assert_eq!(region.area, pixels.len());
                let n = pixels.len() as f64;
                let mean = |f: &dyn Fn(f64, f64) -> f64| pixels.iter().map(|&(x, y)| f(x as f64 + 0.5, y as f64 + 0.5)).sum::<f64>() / n;
                let (x, y) = (mean(&|x, _| x), mean(&|_, y| y));
                prop_assert!((region.centroid.x - x).abs() < 1e-9 && (region.centroid.y - y).abs() < 1e-9);
                let spread = [mean(&|i, _| (i - x).powi(2)), mean(&|i, j| (i - x) * (j - y)), mean(&|_, j| (j - y).powi(2))];
                for (a, b) in region.spread.iter().zip(spread) {
                    prop_assert!((a - b).abs() < 1e-7, "{:?} {:?}", region.spread, spread);
                }
                let (l, r) = (pixels.iter().map(|p| p.0).min().unwrap(), pixels.iter().map(|p| p.0).max().unwrap());
                let (t, b) = (pixels.iter().map(|p| p.1).min().unwrap(), pixels.iter().map(|p| p.1).max().unwrap());
                prop_assert_eq!(region.bounds, PixelWindow { x: l, y: t, width: r - l + 1, height: b - t + 1 });
            }
            let large = finder.find(mask.view(), 5).len();
            prop_assert_eq!(large, expected.iter().filter(|p| p.len() >= 5).count());
        }
    }

    #[test]
    fn disks_spread_a_quarter_of_their_diameter() {
        let mask = Image::from_fn(100, 100, |x, y| u8::from((x as f64 - 49.5).hypot(y as f64 - 49.5) < 40.0)).unwrap();
        let region = RegionFinder::default().find(mask.view(), 1)[0];
        let (long, short) = region.axes();
        assert!((long - 20.0).abs() < 0.1 && (short - 20.0).abs() < 0.1, "{long} {short}");
    }
}
