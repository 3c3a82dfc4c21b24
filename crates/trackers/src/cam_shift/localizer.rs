use super::back_projection::{Channel, Shares, bin, coefficient, for_each, measure, probabilities, stride};
use super::{CamShiftParams, Moments, SizeModel};
use pursuit_estimation::sigmoid;
use pursuit_geometry::{BBox, Point};
use pursuit_imaging::{Frame, ImageView, Rgb8};
use pursuit_parameters::Parameters;
use pursuit_tracking::{Figure, Figures, Localizer, Look, Measurement, Result, Search, ViewSize};
use serde::{Deserialize, Serialize};

/// Windows and boxes are no smaller than this, so that one pixel at least lies in them.
const LEAST_SIDE_PX: f64 = 2.0;
/// Side of the part of a box that is its middle.
const MIDDLE: f64 = 0.7;
/// The most a box's side grows or shrinks in a frame.
const MOST_GROWTH: f64 = 2.0;

/// Where the target is, by continuously adaptive mean shift.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(remote = "CamShift")]
pub struct CamShift {
    params: CamShiftParams,
    channel: Channel,
    /// How the hues are distributed in the target and around it.
    target: Shares,
    around: Shares,
    /// The sum of the probabilities in the first window, as a share of the box's area.
    filled: f64,
    /// How much each hue belongs to the target; made of both.
    #[serde(skip)]
    probabilities: Vec<f32>,
    #[serde(skip)]
    shares: Shares,
}

pursuit_estimation::checked!(CamShift);

impl CamShift {
    fn restored(mut self) -> Result<Self, &'static str> {
        let sound = |shares: &Shares| {
            shares.len() == self.params.bins + 1
                && shares.iter().all(|v| (0.0..=1.0).contains(v))
                && shares.iter().sum::<f32>() <= 1.001
        };
        let filled = self.filled.is_finite() && self.filled > 0.0;
        if self.params.check_all().is_err() || !sound(&self.target) || !sound(&self.around) || !filled {
            return Err("its histograms of hues do not sum to one, or its parameters are out of range");
        }
        self.project();
        Ok(self)
    }
}

pursuit_tracking::figures! {
    /// What continuously adaptive mean shift says of a place.
    struct CamShiftFigures {
        /// The Bhattacharyya coefficient of the hues in the box and the target's, 0 to 1.
        similarity;
        /// The same of the hues around the box.
        around;
        /// Standard deviation of the distribution along its longer axis.
        length in "px";
        /// The same across it.
        width in "px";
        /// Angle of the longer axis from the x axis towards y.
        angle in "rad";
    }
}

/// What a look saw.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CamShiftFinding {
    /// The zeroth moment, in pixels.
    mass: f64,
}

impl CamShift {
    /// Starts on the target at `bbox`.
    pub(super) fn new(params: &CamShiftParams, frame: &Frame, bbox: BBox) -> Self {
        let mut made = Self {
            params: params.clone(),
            channel: Channel::Hue,
            target: Shares::new(),
            around: Shares::new(),
            filled: 1.0,
            probabilities: Vec::new(),
            shares: Shares::new(),
        };
        let color = frame.color();
        // The corners of a box are most often the ground's: what the target is like is seen in the middle.
        measure(color, (&bbox.scaled(MIDDLE), None), Channel::Hue, params, &mut made.shares);
        let hued: f32 = made.shares.iter().take(params.bins).sum();
        let mut mass = 0.0;
        if f64::from(hued) >= params.least_hued {
            mass = made.learn(color, &bbox);
        }
        if mass == 0.0 {
            made.channel = Channel::Value;
            mass = made.learn(color, &bbox);
        }
        // Where nothing is the target's own, its box counts as full.
        let filled = mass / bbox.area();
        made.filled = if filled.is_finite() && filled > 0.0 { filled } else { 1.0 };
        made
    }

    /// Learns the first frame by its channel; the sum of the probabilities in the first window.
    fn learn(&mut self, color: ImageView<'_, Rgb8>, bbox: &BBox) -> f64 {
        let (p, outer) = (&self.params, bbox.scaled(self.params.surroundings_area.sqrt()));
        measure(color, (bbox, None), self.channel, p, &mut self.target);
        measure(color, (&outer, Some(bbox)), self.channel, p, &mut self.around);
        self.project();
        self.moments(color, &self.window(bbox)).mass()
    }

    /// Makes the probabilities of the histograms.
    fn project(&mut self) {
        probabilities(&self.target, &self.around, self.params.projection, &mut self.probabilities);
    }

    /// The window for a box.
    fn window(&self, bbox: &BBox) -> BBox {
        let scale = match self.params.size.model {
            SizeModel::Paper => 1.0,
            SizeModel::Calibrated | SizeModel::Fixed => self.params.size.window,
        };
        let side = |v: f64| (v * scale).max(LEAST_SIDE_PX);
        BBox::from_center_size(bbox.center(), side(bbox.width()), side(bbox.height()))
    }

    /// The moments of the probabilities under `window` about its middle, in pixels.
    fn moments(&self, color: ImageView<'_, Rgb8>, window: &BBox) -> Moments {
        let (p, middle) = (&self.params, window.center());
        let share = (stride(window, p.most_pixels) as f64).powi(2);
        let mut moments = Moments::default();
        for_each(color, window, p.most_pixels, |pixel, (x, y)| {
            if let Some(bin) = bin(pixel, self.channel, p) {
                moments.add(share * f64::from(self.probabilities[bin]), (x - middle.x, y - middle.y));
            }
        });
        moments
    }

    /// Moves the window to the mean of the probabilities under it until it stands; and the moments there. `None` where there is no
    /// probability.
    fn climb(&self, color: ImageView<'_, Rgb8>, window: &BBox) -> Option<(Point, Moments)> {
        let mut window = *window;
        for _ in 0..self.params.most_steps {
            let moments = self.moments(color, &window);
            let (from, step) = (window.center(), moments.mean()?);
            window = window.translated(step.x, step.y);
            if step.x.hypot(step.y) < self.params.least_step_px {
                return Some((Point::new(from.x + step.x, from.y + step.y), moments));
            }
        }
        Some((window.center(), self.moments(color, &window)))
    }

    /// How alike the hues in `bbox`, and those around it, are to the target's.
    fn similarities(&mut self, color: ImageView<'_, Rgb8>, bbox: &BBox) -> (f64, f64) {
        let (p, shares) = (&self.params, &mut self.shares);
        measure(color, (bbox, None), self.channel, p, shares);
        let inside = coefficient(shares, &self.target);
        measure(color, (&bbox.scaled(p.surroundings_area.sqrt()), Some(bbox)), self.channel, p, shares);
        (inside, coefficient(shares, &self.target))
    }
}

impl Localizer for CamShift {
    type Finding = CamShiftFinding;

    const FIGURES: &[&[Figure]] = &[CamShiftFigures::ALL];

    fn locate(&mut self, frame: &Frame, search: &Search) -> Result<Option<(Measurement, CamShiftFinding)>> {
        let color = frame.color();
        let found = self.climb(color, &self.window(&search.expected));
        let Some((center, moments)) = found else { return Ok(None) };
        let Some(spread) = moments.spread() else { return Ok(None) };
        let bbox = search.expected.centered_at(center);
        let (similarity, around) = self.similarities(color, &bbox);
        let score = &self.params.score;
        let confidence = sigmoid(score.bias + score.similarity * similarity + score.around * around);
        let diagnostics =
            CamShiftFigures { similarity, around, length: spread.length, width: spread.width, angle: spread.angle }
                .into();
        let measurement = Measurement { diagnostics, ..Measurement::new(bbox, confidence) };
        Ok(Some((measurement, CamShiftFinding { mass: moments.mass() })))
    }

    fn refine(
        &mut self,
        _: &Frame,
        search: &Search,
        measurement: &mut Measurement,
        finding: &mut CamShiftFinding,
    ) -> Result<()> {
        if search.look == Look::Sweep {
            return Ok(());
        }
        let area = match self.params.size.model {
            SizeModel::Fixed => return Ok(()),
            SizeModel::Paper => 4.0 * finding.mass,
            SizeModel::Calibrated => finding.mass / self.filled,
        };
        let bbox = measurement.bbox;
        let least = LEAST_SIDE_PX * LEAST_SIDE_PX;
        let growth = (area.max(least) / bbox.area().max(1e-9)).sqrt().clamp(1.0 / MOST_GROWTH, MOST_GROWTH);
        measurement.bbox = bbox.scaled(growth.powf(self.params.size.rate));
        Ok(())
    }

    fn adapt(&mut self, frame: &Frame, bbox: BBox, _: &CamShiftFinding) -> Result<()> {
        let rate = self.params.learning_rate as f32;
        if rate > 0.0 && measure(frame.color(), (&bbox, None), self.channel, &self.params, &mut self.shares) {
            self.target.iter_mut().zip(&self.shares).for_each(|(a, b)| *a += rate * (b - *a));
            self.project();
        }
        Ok(())
    }

    fn restart(&mut self, frame: &Frame, bbox: BBox) -> Result<()> {
        *self = Self::new(&self.params, frame, bbox);
        Ok(())
    }

    fn view(&self, expected: &BBox) -> Option<ViewSize> {
        let window = self.window(expected);
        Some(ViewSize { width: window.width(), height: window.height() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cam_shift::{Projection, SizeParams};
    use pursuit_imaging::Image;
    use pursuit_vision::color::rgb_to_hsv;

    /// An orange and purple target of 24 × 20 pixels at (left, 20) on a ground of greens and some orange.
    fn frame(left: usize) -> Frame {
        let image = Image::from_fn(90, 60, |x, y| match (x, y) {
            (x, y) if (left..left + 24).contains(&x) && (20..40).contains(&y) => {
                if x % 3 == 0 {
                    [120, 40, 160]
                } else {
                    [230, 120, 30]
                }
            }
            (x, y) if (x + 3 * y) % 11 == 0 => [230, 120, 30],
            (x, y) => [30, (90 + x) as u8, (40 + y) as u8],
        });
        Frame::new(0, 0.0, image.unwrap())
    }

    fn target() -> BBox {
        BBox::from_ltwh(30.0, 20.0, 24.0, 20.0)
    }

    fn tracker(params: &CamShiftParams) -> CamShift {
        CamShift::new(params, &frame(30), target())
    }

    /// The back-projection of one pixel by the histograms of the first frame, counted pixel by pixel.
    fn slow_probability(pixel: Rgb8, projection: Projection) -> f64 {
        let hue = |p: Rgb8| usize::from(rgb_to_hsv(p)[0]) * 16 / 180;
        let (mut inside, mut around, mut n) = ([0.0; 16], [0.0; 16], (0.0, 0.0));
        let first = frame(30);
        for y in 10..50 {
            for x in 18..66 {
                let of = hue(first.color().row(y)[x]);
                if (30..54).contains(&x) && (20..40).contains(&y) {
                    inside[of] += 1.0;
                    n.0 += 1.0;
                } else {
                    around[of] += 1.0;
                    n.1 += 1.0;
                }
            }
        }
        let (t, a) = (inside[hue(pixel)] / n.0, around[hue(pixel)] / n.1);
        let highest = inside.iter().copied().fold(0.0, f64::max) / n.0;
        match projection {
            Projection::Paper => t / highest,
            Projection::Surroundings if t > 0.0 => t / (t + a),
            Projection::Excess if t > a => (t - a) / (t + a),
            Projection::Surroundings | Projection::Excess => 0.0,
        }
    }

    #[test]
    fn moments_are_sums_over_the_back_projection() {
        for projection in [Projection::Paper, Projection::Surroundings, Projection::Excess] {
            let tracker = tracker(&CamShiftParams { projection, ..CamShiftParams::default() });
            let (now, window) = (frame(33), BBox::from_ltwh(27.2, 16.9, 30.0, 26.0));
            let (mut mass, mut x1, mut y1) = (0.0, 0.0, 0.0);
            for y in 17..43 {
                for x in 27..57 {
                    let p = slow_probability(now.color().row(y)[x], projection);
                    mass += p;
                    x1 += p * (x as f64 + 0.5);
                    y1 += p * (y as f64 + 0.5);
                }
            }
            let moments = tracker.moments(now.color(), &window);
            let (mean, middle) = (moments.mean().unwrap(), window.center());
            assert!((moments.mass() - mass).abs() < 1e-3, "{projection:?}: {} is not {mass}", moments.mass());
            assert!((mean.x + middle.x - x1 / mass).abs() < 1e-4 && (mean.y + middle.y - y1 / mass).abs() < 1e-4);
        }
    }

    #[test]
    fn the_window_moves_until_it_stands_on_the_target() {
        let tracker = tracker(&CamShiftParams::default());
        let (center, moments) = tracker.climb(frame(41).color(), &tracker.window(&target())).unwrap();
        assert!((center.x - 53.0).abs() < 1.0 && (center.y - 30.0).abs() < 1.0, "{center:?}");
        // Nothing but the target's own hues counts: the mass is what it was.
        assert!((moments.mass() / (tracker.filled * 480.0) - 1.0).abs() < 0.1, "{}", moments.mass());
        let blue = Image::filled(90, 60, [10, 10, 240]).unwrap();
        assert!(tracker.climb(blue.view(), &target()).is_none());
        assert!(tracker.climb(frame(41).color(), &target().translated(900.0, 0.0)).is_none());
    }

    #[test]
    fn sizes_follow_the_zeroth_moment_as_their_model_says() {
        let side = |model, mass| {
            let size = SizeParams { model, rate: 1.0, ..Default::default() };
            let mut tracker = tracker(&CamShiftParams { size, ..CamShiftParams::default() });
            let search =
                Search { expected: target(), region: target(), gate: None, look: Look::Near, keep_inside: false };
            let mut measurement = Measurement::new(target(), 1.0);
            let mass = if mass > 0.0 { mass } else { 1.21 * 480.0 * tracker.filled };
            tracker.refine(&frame(30), &search, &mut measurement, &mut CamShiftFinding { mass }).unwrap();
            measurement.bbox.area().sqrt()
        };
        assert!((side(SizeModel::Paper, 144.0) - 2.0 * 12.0).abs() < 1e-9);
        assert!((side(SizeModel::Calibrated, 0.0) - 1.1 * 480.0_f64.sqrt()).abs() < 1e-9);
        assert!((side(SizeModel::Fixed, 144.0) - 480.0_f64.sqrt()).abs() < 1e-9);
        assert!((side(SizeModel::Paper, 1e9) - 2.0 * 480.0_f64.sqrt()).abs() < 1e-9, "no more than twice in a frame");
    }

    #[test]
    fn states_that_cannot_be_are_refused() {
        let back = |t: &CamShift| postcard::from_bytes::<CamShift>(&postcard::to_stdvec(t).unwrap());
        let whole = tracker(&CamShiftParams::default());
        assert_eq!(back(&whole).unwrap().probabilities, whole.probabilities);
        assert!(back(&CamShift { filled: 0.0, ..whole.clone() }).is_err());
        assert!(back(&CamShift { target: vec![0.1; 3], ..whole.clone() }).is_err());
        assert!(back(&CamShift { around: vec![1.0; 17], ..whole }).is_err());
    }
}
