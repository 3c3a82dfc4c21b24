//! Finds a ball nobody has pointed at: the paper's detection stage at several strictnesses, and a judgement of shape.

use super::color_blobs::{Candidate, ColorBlobFinder};
use super::palette::{BallColor, SATURATED};
use super::params::BallDetectorParams;
use pursuit_geometry::{BBox, Size};
use pursuit_imaging::Frame;
use pursuit_tracking::{Detection, Detector, DetectorRecipe, Followed, Needs, Result, TrackingError};
use pursuit_vision::PixelWindow;

/// As much is made of one pixel at most.
pub(super) const MOST_STEP: usize = 16;
/// Distance in RGB codes between the ball and its surroundings at which the border is plain.
const PLAIN_STEP: f64 = 40.0;
/// 4π area / perimeter² of a disk of pixels, outline through their centres.
const DISK_CIRCULARITY: f64 = 0.89;

impl DetectorRecipe for BallDetectorParams {
    const NEEDS: Needs = Needs { color: true, file: false };

    fn detector(&self) -> Result<Box<dyn Detector>> {
        Ok(Box::new(BallDetector { params: self.clone(), blobs: ColorBlobFinder::default(), before: Vec::new() }))
    }
}

/// Looks for balls all over the frame.
struct BallDetector {
    params: BallDetectorParams,
    blobs: ColorBlobFinder,
    /// What looked half like a ball in the frame before.
    before: Vec<Detection>,
}

impl Detector for BallDetector {
    fn detect(&mut self, frame: &Frame, _: &[Followed]) -> Result<Vec<Detection>> {
        if !frame.has_color() {
            return Err(TrackingError::MissingPlane {
                tracker: "ball".to_owned(),
                needed: "colour",
                index: frame.index(),
            });
        }
        self.blobs.look(frame, PixelWindow::full(frame.size()), self.step(frame.size()))?;
        let colors: &[BallColor] = if self.params.color == BallColor::Auto { &SATURATED } else { &[self.params.color] };
        let mut found: Vec<Detection> = Vec::new();
        // Each colour to its end: what convinces in one may stand still while the ball moves in another.
        for color in colors {
            self.search(frame, *color, &mut found)?;
        }
        found.sort_by(|a, b| b.confidence.total_cmp(&a.confidence));
        let mut believed: Vec<Detection> = Vec::new();
        for detection in &found {
            let again = self.before.iter().any(|b| goes_on(b, detection, &self.params));
            let enough = detection.confidence >= self.params.min_likeness || again;
            if enough && believed.iter().all(|b| b.bbox.iou(&detection.bbox) < self.params.same) {
                believed.push(detection.clone());
            }
        }
        self.before = found;
        Ok(believed)
    }
}

impl BallDetector {
    /// How many pixels each way may be taken for one, so that the smallest ball sought has as many as it takes to be known.
    fn step(&self, size: Size) -> usize {
        let smallest = (self.params.min_area * size.area() as f64 * 4.0 / std::f64::consts::PI).sqrt();
        ((smallest / self.params.pixels_across) as usize).clamp(1, MOST_STEP)
    }

    /// Adds what looks at least half like a ball of that colour, up to the first strictness and opening at which one convinces.
    fn search(&mut self, frame: &Frame, color: BallColor, found: &mut Vec<Detection>) -> Result<()> {
        let pixels = frame.size().area() as f64;
        let side = frame.size().width.min(frame.size().height) as f64;
        for range in color.ladder() {
            let mut last_radius = 0;
            for (step, fraction) in
                [self.params.opening, self.params.wider_opening, self.params.widest_opening].into_iter().enumerate()
            {
                let radius = ((fraction * side).round() as usize).max(1);
                if radius == last_radius {
                    continue;
                }
                last_radius = radius;
                // An opening makes squares of clutter; what is not much larger than it has no shape of its own.
                let smallest = self.params.shape_over_opening * (2 * radius + 1) as f64;
                let least_area = self.params.min_area * pixels;
                let params = &self.params;
                let keep = |b: &BBox| {
                    let ratio = b.width() / b.height();
                    ratio.min(1.0 / ratio) >= params.min_squareness
                        && b.width().min(b.height()) >= smallest
                        && b.area() <= params.max_area * pixels * 4.0 / std::f64::consts::PI
                };
                // Half as large ones are counted too, as rivals.
                if step == 0 {
                    self.blobs.find(frame, &range, radius, least_area / 2.0, keep)?;
                } else {
                    self.blobs.find_opened(frame, radius, least_area / 2.0, keep)?;
                }
                if self.blobs.count_of_at_least(0.0) == 0 {
                    // Stricter ranges and wider openings leave less still.
                    if step == 0 {
                        return Ok(());
                    }
                    break;
                }
                let mut convinced = false;
                for candidate in self.blobs.candidates().iter().filter(|c| c.area >= least_area) {
                    let inside = candidate.bbox.expanded(1.0).fraction_inside(&frame.size().bounds()) == 1.0;
                    let likeness = ball_likeness(&self.blobs, candidate)
                        * uniqueness(&self.blobs, candidate, self.params.chance)
                        * if inside { 1.0 } else { self.params.cut_worth };
                    if likeness >= self.params.min_likeness_again.min(self.params.min_likeness) {
                        found.push(Detection::new(candidate.bbox, likeness));
                    }
                    convinced |= likeness >= self.params.convincing;
                }
                if convinced {
                    return Ok(());
                }
            }
        }
        Ok(())
    }
}

/// Among many regions of like size one is round by chance: foliage, texture, noise.
fn uniqueness(blobs: &ColorBlobFinder, candidate: &Candidate, chance: f64) -> f64 {
    let others = blobs.count_of_at_least(0.5 * candidate.area).saturating_sub(1);
    1.0 / (1.0 + chance * others as f64)
}

/// How much a region looks like a ball, in `[0, 1]`: as round as a disk, as full, and set off from its surroundings.
pub(super) fn ball_likeness(blobs: &ColorBlobFinder, candidate: &Candidate) -> f64 {
    let roundness = (candidate.circularity / DISK_CIRCULARITY).min(1.0);
    let disk = std::f64::consts::FRAC_PI_4 * candidate.bbox.area();
    // A box or a triangle is too full or too empty for a disk by a quarter and more.
    let fullness = 1.0 - ((candidate.area / disk - 1.0).abs() / 0.25).powi(2).min(1.0);
    let inside = blobs.coverage(&candidate.bbox, 0.0..0.8);
    let outside = blobs.coverage(&candidate.bbox, 1.25..1.6);
    let contrast = ((inside - outside) / 0.8).clamp(0.0, 1.0);
    // A border where the colour range happens to end in a smooth shade is no border.
    let (own, around) = (blobs.mean_color(&candidate.bbox, 0.0..0.8), blobs.mean_color(&candidate.bbox, 1.2..1.6));
    let step = own.iter().zip(around).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt();
    let step = (step / PLAIN_STEP).min(1.0);
    (roundness * candidate.solidity * contrast).cbrt() * fullness * step
}

/// Whether `now` may be `before` one frame later.
fn goes_on(before: &Detection, now: &Detection, params: &BallDetectorParams) -> bool {
    let side = |b: &BBox| b.area().sqrt();
    let ratio = side(&now.bbox) / side(&before.bbox);
    ratio < params.again_ratio
        && ratio > 1.0 / params.again_ratio
        && before.bbox.center().distance(now.bbox.center()) < params.again_distance * side(&before.bbox)
}
