//! What is looked at: from a frame to regions of a colour (the paper's detection stage).

use pursuit_geometry::{BBox, Point, Size};
use pursuit_imaging::{Frame, Image, ImagingError, Pixels, Rgb8};
use pursuit_tracking::{Result, TrackingError};
use pursuit_vision::PixelWindow;
use pursuit_vision::color::{Hsv8, HsvRange, rgb_to_hsv};
use pursuit_vision::contour::{enclosed_area, perimeter, pixel_hull, polygon_area, trace};
use pursuit_vision::enclosing::{RotatedRectangle, smallest_rectangle};
use pursuit_vision::morphology::{MorphologyScratch, dilate, erode};
use pursuit_vision::regions::{Region, RegionFinder};
use pursuit_vision::segmentation::in_range;
use pursuit_vision::smoothing::SmoothedColor;
use std::ops::Range;

/// Pixels on either side that smoothing takes in.
const SMOOTHING_REACH: usize = 2;
/// Half axes of a disk in its bounding box are sampled at this many directions.
const DIRECTIONS: usize = 48;

/// A region of the ball's colour.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Candidate {
    /// Bounding rectangle, in the frame.
    pub bbox: BBox,
    /// Centre of mass, in the frame.
    pub centroid: Point,
    /// Pixels inside the outline, holes (highlights) included.
    pub area: f64,
    /// Length of the outline, in pixels.
    pub perimeter: f64,
    /// Area over that of its convex hull, in `[0, 1]`.
    pub solidity: f64,
    /// 4π area / perimeter² through the border pixels' centres; near 0.89 for a disk of pixels.
    pub circularity: f64,
    /// The smallest rectangle around it, at any angle, in the frame.
    pub rectangle: RotatedRectangle,
}

/// Looks at a part of a frame for regions of a colour; owns its scratch, so nothing is allocated from frame to frame.
#[derive(Debug, Clone)]
pub(super) struct ColorBlobFinder {
    smoothed: SmoothedColor,
    /// The part looked at, in the frame, and how many of its pixels each way are one of those looked at.
    window: PixelWindow,
    step: usize,
    /// The picture of that part, where it was not looked at as it is.
    reduced: Image<Rgb8>,
    /// Pixels in the colour range, before the opening.
    raw: Image<u8>,
    opened: Image<u8>,
    morphology: MorphologyScratch,
    finder: RegionFinder,
    outline: Vec<(usize, usize)>,
    hull: Vec<Point>,
    points: Vec<Point>,
    candidates: Vec<Candidate>,
    areas: Vec<f64>,
}

impl Default for ColorBlobFinder {
    fn default() -> Self {
        let empty = || Image::filled(1, 1, 0u8).unwrap_or_else(|_| unreachable!("one pixel is a valid size"));
        Self {
            smoothed: SmoothedColor::new(),
            window: PixelWindow { x: 0, y: 0, width: 1, height: 1 },
            step: 1,
            reduced: Image::filled(1, 1, [0; 3]).unwrap_or_else(|_| unreachable!("one pixel is a valid size")),
            raw: empty(),
            opened: empty(),
            morphology: MorphologyScratch::default(),
            finder: RegionFinder::default(),
            outline: Vec::new(),
            hull: Vec::new(),
            points: Vec::new(),
            candidates: Vec::new(),
            areas: Vec::new(),
        }
    }
}

impl ColorBlobFinder {
    /// Smooths the part `window` of the frame, every `step` × `step` pixels taken for one.
    pub fn look(&mut self, frame: &Frame, window: PixelWindow, step: usize) -> Result<()> {
        let mut window = window.intersection(&PixelWindow::full(frame.size())).unwrap_or(window);
        if step > 1 {
            // From where a sample of chroma begins, or blocks would share samples.
            (window.width, window.height) = (window.width + window.x % 2, window.height + window.y % 2);
            (window.x, window.y) = (window.x - window.x % 2, window.y - window.y % 2);
        }
        (self.window, self.step) = (window, step.max(1));
        // Of large video that is looked at in part, the rest need not be converted to colour.
        let part = matches!(frame.pixels(), Pixels::Yuv420(_)) && 4 * window.size().area() < frame.size().area();
        if self.step == 1 && !part {
            return self.smoothed.smooth(frame.color(), window).map_err(|e| failed(frame, e));
        }
        // As the smoothing of the part alone would see it, as far as there is something beyond it.
        let around = self.around(frame.size());
        let PixelWindow { x, y, width, height } = around;
        let step = self.step;
        if !frame.reduced_color([x, y, width, height], step, &mut self.reduced).map_err(|e| failed(frame, e))? {
            return Err(failed(frame, ImagingError::Size { width, height }));
        }
        let inner = PixelWindow {
            x: (window.x - x) / step,
            y: (window.y - y) / step,
            width: (window.width / step).max(1),
            height: (window.height / step).max(1),
        };
        self.smoothed.smooth(self.reduced.view(), inner).map_err(|e| failed(frame, e))
    }

    /// The part looked at and what smoothing sees about it.
    fn around(&self, frame: Size) -> PixelWindow {
        let (window, margin) = (self.window, SMOOTHING_REACH * self.step);
        let before = |from: usize| from.min(margin) / self.step * self.step;
        let (left, top) = (before(window.x), before(window.y));
        let after = |end: usize, whole: usize| (whole - end).min(margin);
        let right = after(window.x + window.width, frame.width);
        let bottom = after(window.y + window.height, frame.height);
        PixelWindow {
            x: window.x - left,
            y: window.y - top,
            width: window.width + left + right,
            height: window.height + top + bottom,
        }
    }

    /// Finds regions of at least `least_area` pixels in the part looked at, whose bounding rectangle `keep` accepts:
    /// colour range, erosion and dilation by `radius` pixels, regions with their outlines.
    pub fn find(
        &mut self,
        frame: &Frame,
        range: &HsvRange,
        radius: usize,
        least_area: f64,
        keep: impl Fn(&BBox) -> bool,
    ) -> Result<&[Candidate]> {
        in_range(&self.smoothed, range, &mut self.raw).map_err(|e| failed(frame, e))?;
        self.find_opened(frame, radius, least_area, keep)
    }

    /// [`find`](Self::find) with the colour range of last time and another radius.
    pub fn find_opened(
        &mut self,
        frame: &Frame,
        radius: usize,
        least_area: f64,
        keep: impl Fn(&BBox) -> bool,
    ) -> Result<&[Candidate]> {
        self.opened.resize_for_overwrite(self.raw.size(), 0).map_err(|e| failed(frame, e))?;
        self.opened.as_mut_slice().copy_from_slice(self.raw.as_slice());
        // At least one pixel of those looked at, unless none was asked for.
        let radius = (radius as f64 / self.step as f64).round().max(radius.min(1) as f64) as usize;
        let (step, block) = (self.step as f64, (self.step * self.step) as f64);
        erode(&mut self.opened, radius, &mut self.morphology).map_err(|e| failed(frame, e))?;
        dilate(&mut self.opened, radius, &mut self.morphology).map_err(|e| failed(frame, e))?;

        self.candidates.clear();
        self.areas.clear();
        let offset = (self.window.x as f64, self.window.y as f64);
        for region in self.finder.find(self.opened.view(), (least_area / block).max(1.0) as usize) {
            self.areas.push(region.area as f64 * block);
            if keep(&enlarged(&region.bounds.to_bbox(), step)) {
                trace(self.opened.view(), region.first, &mut self.outline);
                pixel_hull(&self.outline, &mut self.hull, &mut self.points);
                self.candidates.push(candidate(region, &self.outline, &self.hull, offset, step));
            }
        }
        Ok(&self.candidates)
    }

    /// How many regions found last, kept or not, have at least `area` pixels.
    pub fn count_of_at_least(&self, area: f64) -> usize {
        self.areas.iter().filter(|a| **a >= area).count()
    }

    /// Mean smoothed red, green and blue of a part of the ellipse as in [`sample`](Self::sample).
    pub fn mean_color(&self, bbox: &BBox, radii: Range<f64>) -> [f64; 3] {
        let (mut sum, mut count) = ([0.0; 3], 0.0);
        self.polar(bbox, radii, |x, y| {
            count += 1.0;
            for (sum, c) in sum.iter_mut().zip(self.smoothed.pixel(x, y)) {
                *sum += f64::from(c);
            }
        });
        sum.map(|s| if count > 0.0 { s / count } else { 0.0 })
    }

    /// What was found last.
    pub fn candidates(&self) -> &[Candidate] {
        &self.candidates
    }

    /// Calls `with` for smoothed colours in the part of the ellipse inscribed in `bbox` between `radii` (1 = its border),
    /// spread evenly; what lies outside the part looked at is left out.
    pub fn sample(&self, bbox: &BBox, radii: Range<f64>, mut with: impl FnMut(Hsv8)) {
        self.polar(bbox, radii, |x, y| with(rgb_to_hsv(self.smoothed.pixel(x, y))));
    }

    /// The fraction of that part that has the ball's colour, before the opening; 0 where nothing of it was looked at.
    pub fn coverage(&self, bbox: &BBox, radii: Range<f64>) -> f64 {
        let (mut inside, mut all) = (0u32, 0u32);
        self.polar(bbox, radii, |x, y| {
            all += 1;
            inside += u32::from(self.raw.view().get(x, y).is_some_and(|&v| v != 0));
        });
        if all == 0 { 0.0 } else { f64::from(inside) / f64::from(all) }
    }

    fn polar(&self, bbox: &BBox, radii: Range<f64>, mut with: impl FnMut(usize, usize)) {
        const RINGS: usize = 10;
        let (window, step) = (self.smoothed.window(), self.step as f64);
        let center = bbox.center();
        for ring in 0..RINGS {
            // Equal areas: uniform in the squared radius.
            let t = (ring as f64 + 0.5) / RINGS as f64;
            let radius = (radii.start * radii.start * (1.0 - t) + radii.end * radii.end * t).sqrt();
            for direction in 0..DIRECTIONS {
                let angle = (direction as f64 + 0.5 * (ring % 2) as f64) * std::f64::consts::TAU / DIRECTIONS as f64;
                let x = (center.x + radius * bbox.width() / 2.0 * angle.cos() - self.window.x as f64) / step;
                let y = (center.y + radius * bbox.height() / 2.0 * angle.sin() - self.window.y as f64) / step;
                if x >= 0.0 && y >= 0.0 && x < window.width as f64 && y < window.height as f64 {
                    with(x as usize, y as usize);
                }
            }
        }
    }
}

/// A box of the pixels looked at in those of the frame, from the same corner.
fn enlarged(bbox: &BBox, step: f64) -> BBox {
    BBox::from_ltwh(step * bbox.left(), step * bbox.top(), step * bbox.width(), step * bbox.height())
}

/// A region of the pixels looked at, each as large as `step` × `step` of the frame, in whose part at `(dx, dy)` they lie.
fn candidate(
    region: &Region,
    outline: &[(usize, usize)],
    hull: &[Point],
    (dx, dy): (f64, f64),
    step: f64,
) -> Candidate {
    let place = |p: Point| Point::new(step * p.x + dx, step * p.y + dy);
    let perimeter = perimeter(outline);
    let through_centres = enclosed_area(outline);
    // Pick's theorem: pixels inside the outline, its own ones included.
    let area = (through_centres + outline.len() as f64 / 2.0 + 1.0).max(region.area as f64);
    let rectangle = smallest_rectangle(hull).unwrap_or(RotatedRectangle {
        center: region.centroid,
        width: 0.0,
        height: 0.0,
        angle_rad: 0.0,
    });
    Candidate {
        bbox: enlarged(&region.bounds.to_bbox(), step).translated(dx, dy),
        centroid: place(region.centroid),
        area: area * step * step,
        perimeter: perimeter * step,
        solidity: (area / polygon_area(hull).max(1.0)).min(1.0),
        circularity: if perimeter > 0.0 {
            4.0 * std::f64::consts::PI * through_centres / (perimeter * perimeter)
        } else {
            0.0
        },
        rectangle: RotatedRectangle {
            center: place(rectangle.center),
            width: step * rectangle.width,
            height: step * rectangle.height,
            ..rectangle
        },
    }
}

fn failed(frame: &Frame, source: pursuit_imaging::ImagingError) -> TrackingError {
    TrackingError::Computation { tracker: "ball".to_owned(), index: frame.index(), source: Box::new(source) }
}
