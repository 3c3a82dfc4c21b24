use super::Pyramid;
use super::kernel::{self, LANES, Patch};
use super::template::{Template, gather};
use crate::error::{VisionError, require_range, require_size};
use pursuit_geometry::{Point, Size};
use pursuit_imaging::Image;
use serde::{Deserialize, Serialize};

/// What the brightness of a window may do between two images.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Lighting {
    /// A point keeps its brightness (Bouguet 2001).
    #[default]
    Constant,
    /// The window's contrast and brightness may change; gain and bias are estimated with the displacement (as Jin,
    /// Favaro and Soatto 2001 do).
    GainAndBias,
}

/// Parameters of [`LucasKanade`]; the names of OpenCV's `calcOpticalFlowPyrLK` are given where there are such.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LucasKanadeParams {
    /// Columns and rows of the window around a point, each from 3 to 255 (`winSize`).
    pub window: Size,
    /// Levels of the pyramids to use, ≥ 1 (`maxLevel` + 1). Levels not larger than the window are never used.
    pub levels: usize,
    /// Most iterations on a level, ≥ 1.
    pub iterations: usize,
    /// A step shorter than this ends the iterations on a level, pixels of that level, ≥ 0.
    pub epsilon_px: f64,
    /// Least eigenvalue of the window's mean matrix of gradients, (grey codes per pixel)², for a point to be followed:
    /// 1024 times `minEigThreshold`.
    pub min_eigenvalue: f64,
    /// What the light may do.
    pub lighting: Lighting,
}

impl Default for LucasKanadeParams {
    /// OpenCV's: 21×21, four levels, 30 iterations, 0.01 pixels, 1e-4 · 1024.
    fn default() -> Self {
        Self {
            window: Size::new(21, 21),
            levels: 4,
            iterations: 30,
            epsilon_px: 0.01,
            min_eigenvalue: 0.1024,
            lighting: Lighting::Constant,
        }
    }
}

/// How following a point ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// It was found in the second image.
    Found,
    /// Its window has too little texture in some direction.
    Flat,
    /// It, or its window in the second image, left the image.
    Outside,
}

/// A point followed from one image to another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Track {
    /// Where it is in the second image, continuous pixels; the best guess when it was not found.
    pub point: Point,
    /// Whether it was found.
    pub outcome: Outcome,
    /// Mean absolute difference of the two windows at full resolution, grey codes (after gain and bias where these are
    /// estimated); 0 when the point was not found.
    pub residual: f32,
    /// Least eigenvalue of the window's mean matrix of gradients at full resolution; 0 when it was never computed.
    pub min_eigenvalue: f32,
}

impl Track {
    /// Whether the point was found.
    pub fn is_found(&self) -> bool {
        self.outcome == Outcome::Found
    }
}

/// A point followed to the second image and back.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RoundTrip {
    /// The way there.
    pub there: Track,
    /// How far from its start the way back ends, pixels (Kalal, Mikolajczyk and Matas 2010); infinite when either way
    /// failed.
    pub error_px: f64,
}

/// Where the points are looked for first in the second image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Start {
    /// How far from where they were, pixels along x and y; the way back starts as far the other way.
    pub shift: (f64, f64),
    /// Most levels of the pyramids that are used: the fewer, the nearer the points must be.
    pub levels: usize,
}

impl Default for Start {
    /// Where they were, on all levels.
    fn default() -> Self {
        Self { shift: (0.0, 0.0), levels: usize::MAX }
    }
}

/// Follows points by pyramidal Lucas-Kanade (Bouguet 2001, “Pyramidal implementation of the affine Lucas Kanade feature
/// tracker”, the translational form); owns its scratch, so nothing is allocated from frame to frame.
#[derive(Debug, Clone)]
pub struct LucasKanade {
    params: LucasKanadeParams,
    template: Template,
    /// Pixels of the second image where the window reaches over the border.
    gathered: Vec<u8>,
    line: Vec<f32>,
}

impl LucasKanade {
    /// A tracker of points.
    ///
    /// # Errors
    /// When a parameter is out of its range.
    pub fn new(params: LucasKanadeParams) -> Result<Self, VisionError> {
        for side in [params.window.width, params.window.height] {
            require_range("the side of the window", side as f64, (3.0, 255.0), "from 3 to 255 pixels")?;
        }
        require_range("the number of levels", params.levels as f64, (1.0, f64::INFINITY), "at least 1")?;
        require_range("the number of iterations", params.iterations as f64, (1.0, f64::INFINITY), "at least 1")?;
        require_range("epsilon_px", params.epsilon_px, (0.0, f64::MAX), "finite and not negative")?;
        require_range("min_eigenvalue", params.min_eigenvalue, (0.0, f64::MAX), "finite and not negative")?;
        let stride = params.window.width.next_multiple_of(LANES) + 1;
        Ok(Self {
            params,
            template: Template::new(params.window),
            gathered: vec![0; stride * (params.window.height + 1)],
            line: vec![0.0; stride],
        })
    }

    /// The parameters.
    pub const fn params(&self) -> &LucasKanadeParams {
        &self.params
    }

    /// Follows every point of `points` (continuous pixels of `from`) to `to`, and writes where it went to `tracks`, in
    /// the same order.
    ///
    /// # Errors
    /// When the two images are not equally large.
    pub fn track(
        &mut self,
        from: &Pyramid,
        to: &Pyramid,
        points: &[Point],
        tracks: &mut Vec<Track>,
    ) -> Result<(), VisionError> {
        require_size("the second pyramid", to.size(), from.size())?;
        tracks.clear();
        tracks.extend(points.iter().map(|&p| self.follow(from, to, p, p, usize::MAX)));
        Ok(())
    }

    /// As [`track`](Self::track), each point followed back as well.
    ///
    /// # Errors
    /// When the two images are not equally large.
    pub fn track_there_and_back(
        &mut self,
        from: &Pyramid,
        to: &Pyramid,
        points: &[Point],
        trips: &mut Vec<RoundTrip>,
    ) -> Result<(), VisionError> {
        self.track_there_and_back_from(from, to, points, Start::default(), trips)
    }

    /// As [`track_there_and_back`](Self::track_there_and_back), looking first where `start` says.
    ///
    /// # Errors
    /// When the two images are not equally large.
    pub fn track_there_and_back_from(
        &mut self,
        from: &Pyramid,
        to: &Pyramid,
        points: &[Point],
        Start { shift: (dx, dy), levels }: Start,
        trips: &mut Vec<RoundTrip>,
    ) -> Result<(), VisionError> {
        require_size("the second pyramid", to.size(), from.size())?;
        trips.clear();
        trips.extend(points.iter().map(|&p| {
            let there = self.follow(from, to, p, Point::new(p.x + dx, p.y + dy), levels);
            let home = Point::new(there.point.x - dx, there.point.y - dy);
            let back = there.is_found().then(|| self.follow(to, from, there.point, home, levels));
            let error_px = back.filter(Track::is_found).map_or(f64::INFINITY, |b| b.point.distance(p));
            RoundTrip { there, error_px }
        }));
        Ok(())
    }

    /// Follows one point, looking first at `guess` in the second image.
    ///
    /// # Errors
    /// When the two images are not equally large.
    pub fn track_point(
        &mut self,
        from: &Pyramid,
        to: &Pyramid,
        point: Point,
        guess: Point,
    ) -> Result<Track, VisionError> {
        require_size("the second pyramid", to.size(), from.size())?;
        Ok(self.follow(from, to, point, guess, usize::MAX))
    }

    fn follow(&mut self, from: &Pyramid, to: &Pyramid, point: Point, guess: Point, levels: usize) -> Track {
        let mut track = Track { point: guess, outcome: Outcome::Outside, residual: 0.0, min_eigenvalue: 0.0 };
        if ![point.x, point.y, guess.x, guess.y].iter().all(|v| v.is_finite()) {
            return track;
        }
        // Inside, whole numbers are centres of pixels, so that halving the image halves the numbers.
        let start = (point.x - 0.5, point.y - 0.5);
        let mut at = (guess.x - 0.5, guess.y - 0.5);
        let top = self.top_level(from).min(self.top_level(to)).min(levels.saturating_sub(1));
        let shrink = 0.5f64.powi(top as i32);
        at = (at.0 * shrink, at.1 * shrink);
        for level in (0..=top).rev() {
            let (Some(first), Some(second)) = (from.image(level), to.image(level)) else { return track };
            let shrink = 0.5f64.powi(level as i32);
            let outcome = self.refine(first, second, (start.0 * shrink, start.1 * shrink), &mut at, &mut track);
            if level == 0 {
                track.outcome = outcome;
            } else {
                at = (2.0 * at.0, 2.0 * at.1);
            }
        }
        track.point = Point::new(at.0 + 0.5, at.1 + 0.5);
        if track.outcome == Outcome::Found {
            match from.image(0).zip(to.image(0)).and_then(|(_, second)| self.residual(second, at)) {
                Some(residual) => track.residual = residual,
                None => track.outcome = Outcome::Outside,
            }
        }
        track
    }

    /// The smallest level used: all above the first are larger than the window.
    fn top_level(&self, pyramid: &Pyramid) -> usize {
        let window = self.params.window;
        let large = |l: usize| pyramid.image(l).is_some_and(|i| i.width() > window.width && i.height() > window.height);
        (1..self.params.levels.min(pyramid.levels())).take_while(|&l| large(l)).count()
    }

    /// Newton's iterations on one level: moves `at` to where the window about `start` of `first` lies in `second`.
    fn refine(
        &mut self,
        first: &Image<u8>,
        second: &Image<u8>,
        start: (f64, f64),
        at: &mut (f64, f64),
        track: &mut Track,
    ) -> Outcome {
        let Some((corner, across, down)) = self.corner(first, start) else { return Outcome::Outside };
        self.template.take(first, corner, across, down);
        let joint = self.params.lighting == Lighting::GainAndBias;
        if joint {
            self.template.disregard_lighting();
        }
        let matrix = self.template.gradient_matrix();
        let eigenvalue = matrix.least_eigenvalue() / self.params.window.area() as f32;
        track.min_eigenvalue = eigenvalue;
        // Not `<`: what is not a number is flat, too.
        if !(f64::from(eigenvalue) >= self.params.min_eigenvalue && eigenvalue > 0.0) {
            return Outcome::Flat;
        }
        let mut before = (0.0f64, 0.0f64);
        for iteration in 0..self.params.iterations {
            let Some((x, y)) = self.mismatch(second, *at, joint) else { return Outcome::Outside };
            let step = matrix.solve_negative(x, y);
            let step = (f64::from(step.0), f64::from(step.1));
            *at = (at.0 + step.0, at.1 + step.1);
            if step.0 * step.0 + step.1 * step.1 <= self.params.epsilon_px * self.params.epsilon_px {
                break;
            }
            // Two steps that undo each other: the minimum lies between.
            if iteration > 0 && (step.0 + before.0).abs() < 0.01 && (step.1 + before.1).abs() < 0.01 {
                *at = (at.0 - step.0 / 2.0, at.1 - step.1 / 2.0);
                break;
            }
            before = step;
        }
        Outcome::Found
    }

    /// Whole and fractional part of the window's first pixel; `None` when no pixel of it would be in the image.
    fn corner(&self, image: &Image<u8>, (x, y): (f64, f64)) -> Option<((isize, isize), f32, f32)> {
        let Size { width, height } = self.params.window;
        let (left, top) = (x - (width as f64 - 1.0) / 2.0, y - (height as f64 - 1.0) / 2.0);
        let (column, row) = (left.floor(), top.floor());
        let inside = column >= -(width as f64)
            && column < image.width() as f64
            && row >= -(height as f64)
            && row < image.height() as f64;
        inside.then_some(((column as isize, row as isize), (left - column) as f32, (top - row) as f32))
    }

    /// Σ d·∇I for the window of `second` centred at `at`, divided by the gain where that is estimated.
    fn mismatch(&mut self, second: &Image<u8>, at: (f64, f64), joint: bool) -> Option<(f32, f32)> {
        let patch = patch(self.corner(second, at)?, second, self.params.window, &mut self.gathered);
        if !joint {
            let sums = kernel::mismatch(patch, self.template.planes(), &mut self.line);
            return Some((sums.x, sums.y));
        }
        let mean = self.template.mean;
        let sums = kernel::mismatch_and_spread(patch, self.template.planes(), mean, &mut self.line);
        let (gain, _) = gain_and_bias(&self.template, self.params.window, sums);
        Some((sums.x * gain, sums.y * gain))
    }

    fn residual(&mut self, second: &Image<u8>, at: (f64, f64)) -> Option<f32> {
        let patch = patch(self.corner(second, at)?, second, self.params.window, &mut self.gathered);
        let light = match self.params.lighting {
            Lighting::Constant => (1.0, 0.0),
            Lighting::GainAndBias => {
                let mean = self.template.mean;
                let sums = kernel::mismatch_and_spread(patch, self.template.planes(), mean, &mut self.line);
                gain_and_bias(&self.template, self.params.window, sums)
            }
        };
        let width = self.params.window.width;
        Some(kernel::mean_difference(patch, self.template.planes(), width, light, &mut self.line))
    }
}

/// The gain and bias that give the second window the mean and the standard deviation of the first.
fn gain_and_bias(template: &Template, window: Size, sums: kernel::Sums) -> (f32, f32) {
    let n = window.area() as f32;
    let mean = sums.value / n;
    let variance = (sums.square / n - mean * mean).max(1e-3);
    let gain = (template.variance / variance).sqrt();
    (gain, template.mean - gain * (mean + template.mean))
}

/// The pixels under the window: straight from the image where they lie in it, else gathered.
fn patch<'a>(
    ((x, y), across, down): ((isize, isize), f32, f32),
    image: &'a Image<u8>,
    window: Size,
    gathered: &'a mut [u8],
) -> Patch<'a> {
    let row = window.width.next_multiple_of(LANES) + 1;
    let inside =
        x >= 0 && y >= 0 && x as usize + window.width < image.width() && y as usize + window.height < image.height();
    if inside {
        // The padding of a row may read on into the next one; only the last one has none.
        let from = y as usize * image.width() + x as usize;
        let pixels = &image.as_slice()[from..];
        if pixels.len() >= window.height * image.width() + row {
            return Patch { pixels, stride: image.width(), across, down };
        }
    }
    let size = Size::new(window.width + 1, window.height + 1);
    gather(image, (x, y), size, row, gathered);
    Patch { pixels: gathered, stride: row, across, down }
}
