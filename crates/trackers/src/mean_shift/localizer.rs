use super::{MeanShiftParams, SizeModel, Surroundings};
use crate::appearance::{Kernel, KernelHistogram, bin};
use pursuit_estimation::sigmoid;
use pursuit_geometry::{BBox, Point};
use pursuit_imaging::{Frame, ImageView, Rgb8};
use pursuit_parameters::Parameters;
use pursuit_tracking::{Figure, Figures, Localizer, Look, Measurement, Result, Search, ViewSize};
use serde::{Deserialize, Serialize};

/// Where the target is, by mean shift.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(remote = "MeanShift")]
pub struct MeanShift {
    params: MeanShiftParams,
    /// The target's colours q̂, and those of its surroundings ô.
    target: KernelHistogram,
    around: KernelHistogram,
    /// Made of both.
    #[serde(skip)]
    model: Model,
    #[serde(skip)]
    buffers: Buffers,
}

pursuit_estimation::checked!(MeanShift);

impl MeanShift {
    fn restored(mut self) -> Result<Self, &'static str> {
        let bins = self.params.bins;
        if self.params.check_all().is_err() || !self.target.is_sound(bins) || !self.around.is_sound(bins) {
            return Err("its colour histograms do not sum to one, or its parameters are out of range");
        }
        self.model.make(&self.params, &self.target, &self.around);
        Ok(self)
    }
}

/// What candidates are compared with.
#[derive(Debug, Clone, Default)]
struct Model {
    colors: KernelHistogram,
    /// What the shares of candidates are multiplied by; empty: nothing.
    factors: Vec<f32>,
}

impl Model {
    fn make(&mut self, params: &MeanShiftParams, target: &KernelHistogram, around: &KernelHistogram) {
        match params.surroundings {
            Surroundings::None => {
                self.factors.clear();
                self.colors.clone_from(target);
            }
            Surroundings::Paper | Surroundings::Corrected => {
                around.rarities(&mut self.factors);
                self.colors.weigh(target, &self.factors);
                if params.surroundings == Surroundings::Corrected {
                    self.factors.clear();
                }
            }
        }
    }
}

/// Overwritten at every use.
#[derive(Debug, Clone, Default)]
struct Buffers {
    candidate: KernelHistogram,
    weighed: KernelHistogram,
    /// √(q̂ᵤ / p̂ᵤ) of each bin.
    weights: Vec<f32>,
}

pursuit_tracking::figures! {
    /// What mean shift says of a place.
    struct MeanShiftFigures {
        /// The Bhattacharyya coefficient of the colours in the box and the target's, 0 to 1.
        similarity;
        /// The same of the colours around the box.
        around;
        /// Steps of the climb.
        steps;
    }
}

/// Where a climb ended.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Summit {
    center: Point,
    coefficient: f64,
    steps: usize,
}

/// What a look saw.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeanShiftFinding {
    /// The coefficient that was climbed.
    coefficient: f64,
    /// How alike the colours in the box, and those around it, are to the target's.
    similarity: f64,
    around: f64,
}

impl MeanShiftFinding {
    /// By what sizes are compared.
    const fn worth(&self, model: SizeModel) -> f64 {
        match model {
            SizeModel::Paper | SizeModel::Fixed => self.coefficient,
            SizeModel::Contrast => self.similarity - self.around,
        }
    }
}

impl MeanShift {
    /// Starts on the target at `bbox`.
    pub(super) fn new(params: &MeanShiftParams, frame: &Frame, bbox: BBox) -> Self {
        let (mut target, mut around) = (KernelHistogram::empty(params.bins), KernelHistogram::empty(params.bins));
        target.measure(frame.color(), &Kernel::new(&bbox, params.most_pixels), params.bins);
        let outer = bbox.scaled(params.surroundings_area.sqrt());
        around.measure_around(frame.color(), (&bbox, &outer), params.most_pixels, params.bins);
        let mut model = Model::default();
        model.make(params, &target, &around);
        Self { params: params.clone(), target, around, model, buffers: Buffers::default() }
    }

    /// The coefficient under `kernel`; `None` outside of the picture.
    fn coefficient(&mut self, color: ImageView<'_, Rgb8>, kernel: &Kernel) -> Option<f64> {
        let Buffers { candidate, weighed, .. } = &mut self.buffers;
        if !candidate.measure(color, kernel, self.params.bins) {
            return None;
        }
        if !self.model.factors.is_empty() {
            weighed.weigh(candidate, &self.model.factors);
            std::mem::swap(candidate, weighed);
        }
        Some(candidate.coefficient(&self.model.colors))
    }

    /// Where the kernel's mean shift leads from where the candidate was measured last: ŷ₁ = Σ xᵢ wᵢ / Σ wᵢ with
    /// wᵢ = √(q̂ᵤ / p̂ᵤ(ŷ₀)) of the bin u of xᵢ (comaniciu2003, eqs. 10 and 11; −k′ of this kernel is the same everywhere).
    fn shifted(&mut self, color: ImageView<'_, Rgb8>, kernel: &Kernel) -> Option<Point> {
        let Buffers { candidate, weights, .. } = &mut self.buffers;
        weights.clear();
        let ratio = |(q, p): (&f32, &f32)| if *p > 0.0 { (q / p).sqrt() } else { 0.0 };
        weights.extend(self.model.colors.shares().iter().zip(candidate.shares()).map(ratio));
        let (mut sum, mut x, mut y) = (0.0, 0.0, 0.0);
        kernel.for_each(color, |pixel, (dx, dy), _| {
            let w = weights[bin(pixel, self.params.bins)];
            sum += w;
            x += w * dx;
            y += w * dy;
        });
        let c = kernel.center();
        (sum > 0.0).then(|| Point::new(c.x + f64::from(x / sum), c.y + f64::from(y / sum)))
    }

    /// Climbs from the middle of `bbox` (comaniciu2003, section 4.2). `None` where no colour of the target is under the kernel.
    fn climb(&mut self, color: ImageView<'_, Rgb8>, bbox: &BBox) -> Option<Summit> {
        let mut kernel = Kernel::new(bbox, self.params.most_pixels);
        let mut coefficient = self.coefficient(color, &kernel)?;
        for step in 1..=self.params.most_steps {
            let from = kernel.center();
            let mut to = self.shifted(color, &kernel)?;
            let mut reached = self.coefficient(color, &kernel.at(to))?;
            while reached < coefficient && from.distance(to) >= self.params.least_step_px {
                to = Point::new(0.5 * (from.x + to.x), 0.5 * (from.y + to.y));
                reached = self.coefficient(color, &kernel.at(to))?;
            }
            (kernel, coefficient) = (kernel.at(to), reached);
            if from.distance(to) < self.params.least_step_px {
                return Some(Summit { center: to, coefficient, steps: step });
            }
        }
        Some(Summit { center: kernel.center(), coefficient, steps: self.params.most_steps })
    }

    /// How alike the colours in `bbox`, and those around it, are to the target's.
    fn similarities(&mut self, color: ImageView<'_, Rgb8>, bbox: &BBox) -> (f64, f64) {
        let p = &self.params;
        let candidate = &mut self.buffers.candidate;
        candidate.measure(color, &Kernel::new(bbox, p.most_pixels), p.bins);
        let inside = candidate.coefficient(&self.target);
        let outer = bbox.scaled(p.surroundings_area.sqrt());
        candidate.measure_around(color, (bbox, &outer), p.most_pixels, p.bins);
        (inside, candidate.coefficient(&self.target))
    }
}

impl Localizer for MeanShift {
    type Finding = MeanShiftFinding;

    const FIGURES: &[&[Figure]] = &[MeanShiftFigures::ALL];

    fn locate(&mut self, frame: &Frame, search: &Search) -> Result<Option<(Measurement, MeanShiftFinding)>> {
        let color = frame.color();
        let Some(Summit { center, coefficient, steps }) = self.climb(color, &search.expected) else { return Ok(None) };
        let bbox = search.expected.centered_at(center);
        let (similarity, around) = self.similarities(color, &bbox);
        let score = &self.params.score;
        let confidence = sigmoid(score.bias + score.similarity * similarity + score.around * around);
        let diagnostics = MeanShiftFigures { similarity, around, steps: steps as f64 }.into();
        let measurement = Measurement { diagnostics, ..Measurement::new(bbox, confidence) };
        Ok(Some((measurement, MeanShiftFinding { coefficient, similarity, around })))
    }

    fn refine(
        &mut self,
        frame: &Frame,
        search: &Search,
        measurement: &mut Measurement,
        finding: &mut MeanShiftFinding,
    ) -> Result<()> {
        let super::KernelSizeParams { model, step, rate } = self.params.size;
        if model == SizeModel::Fixed || search.look == Look::Sweep {
            return Ok(());
        }
        // The climbs with other kernels start where the first ended: they end where those from the beginning do, and sooner.
        let (color, start) = (frame.color(), measurement.bbox);
        let mut best = (1.0, finding.worth(model), start.center());
        for factor in [1.0 - step, 1.0 + step] {
            let bbox = start.scaled(factor);
            if let Some(summit) = self.climb(color, &bbox) {
                let (similarity, around) = self.similarities(color, &bbox.centered_at(summit.center));
                let worth = MeanShiftFinding { coefficient: summit.coefficient, similarity, around }.worth(model);
                if worth > best.1 {
                    best = (factor, worth, summit.center);
                }
            }
        }
        measurement.bbox = start.scaled(rate * best.0 + (1.0 - rate)).centered_at(best.2);
        Ok(())
    }

    fn adapt(&mut self, frame: &Frame, bbox: BBox, _: &MeanShiftFinding) -> Result<()> {
        let p = &self.params;
        if p.learning_rate == 0.0 && p.surroundings_rate == 0.0 {
            return Ok(());
        }
        let (color, now) = (frame.color(), &mut self.buffers.candidate);
        if p.learning_rate > 0.0 && now.measure(color, &Kernel::new(&bbox, p.most_pixels), p.bins) {
            self.target.blend(now, p.learning_rate);
        }
        let outer = bbox.scaled(p.surroundings_area.sqrt());
        if p.surroundings_rate > 0.0 && now.measure_around(color, (&bbox, &outer), p.most_pixels, p.bins) {
            self.around.blend(now, p.surroundings_rate);
        }
        self.model.make(p, &self.target, &self.around);
        Ok(())
    }

    fn restart(&mut self, frame: &Frame, bbox: BBox) -> Result<()> {
        *self = Self::new(&self.params, frame, bbox);
        Ok(())
    }

    fn view(&self, expected: &BBox) -> Option<ViewSize> {
        Some(ViewSize { width: expected.width(), height: expected.height() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_imaging::Image;
    use pursuit_tracking::LocalizerRecipe;

    /// A target of three colours, one of which the ground has too, moved by `dx`.
    fn frame(dx: usize) -> Frame {
        let image = Image::from_fn(80, 60, |x, y| match (x, y) {
            (x, y) if (20 + dx..44 + dx).contains(&x) && (18..40).contains(&y) => match (x + y) % 3 {
                0 => [200, 30, 30],
                1 => [220, 180, 40],
                _ => [60, 70, 60],
            },
            (x, y) if (x * 7 + y * 3) % 5 == 0 => [200, 30, 30],
            (x, y) => [40 + (x % 16) as u8, 70, (50 + y) as u8],
        });
        Frame::new(0, 0.0, image.unwrap())
    }

    fn target() -> BBox {
        BBox::from_ltwh(20.0, 18.0, 24.0, 22.0)
    }

    /// One step from `center` by the equations, with every sum written out.
    fn slow_step(q: &[f64], frame: &Frame, center: Point, bins: usize) -> Point {
        let color = frame.color();
        let mut under = Vec::new();
        for (y, row) in color.rows().enumerate() {
            for (x, pixel) in row.iter().enumerate() {
                let (px, py) = (x as f64 + 0.5, y as f64 + 0.5);
                let r = ((px - center.x) / 12.0).powi(2) + ((py - center.y) / 11.0).powi(2);
                if r < 1.0 {
                    under.push((px, py, 1.0 - r, bin(*pixel, bins)));
                }
            }
        }
        let total: f64 = under.iter().map(|u| u.2).sum();
        let p = |bin: usize| under.iter().filter(|u| u.3 == bin).map(|u| u.2).sum::<f64>() / total;
        let weights: Vec<f64> = under.iter().map(|u| (q[u.3] / p(u.3)).sqrt()).collect();
        let sum: f64 = weights.iter().sum();
        let weighted = || under.iter().zip(&weights);
        let (x, y) = (weighted().map(|(u, w)| w * u.0).sum::<f64>(), weighted().map(|(u, w)| w * u.1).sum::<f64>());
        Point::new(x / sum, y / sum)
    }

    #[test]
    fn steps_are_those_of_the_equations() {
        for surroundings in [Surroundings::None, Surroundings::Corrected] {
            let params = MeanShiftParams { surroundings, ..MeanShiftParams::default() };
            let mut tracker = MeanShift::new(&params, &frame(0), target());
            let q: Vec<f64> = tracker.model.colors.shares().iter().map(|v| f64::from(*v)).collect();
            let moved = frame(5);
            let kernel = Kernel::new(&target().translated(1.3, 0.4), params.most_pixels);
            tracker.coefficient(moved.color(), &kernel).unwrap();
            let got = tracker.shifted(moved.color(), &kernel).unwrap();
            let want = slow_step(&q, &moved, kernel.center(), params.bins);
            assert!(got.distance(want) < 1e-3, "{surroundings:?}: {got:?} is not {want:?}");
            assert!(got.x > kernel.center().x + 0.2, "it leads to the target: {got:?}");
        }
    }

    #[test]
    fn printed_background_weights_change_no_step() {
        let step = |surroundings| {
            let params = MeanShiftParams { surroundings, ..MeanShiftParams::default() };
            let mut tracker = MeanShift::new(&params, &frame(0), target());
            let kernel = Kernel::new(&target(), params.most_pixels);
            tracker.coefficient(frame(4).color(), &kernel).unwrap();
            tracker.shifted(frame(4).color(), &kernel).unwrap()
        };
        let (none, paper) = (step(Surroundings::None), step(Surroundings::Paper));
        assert!(none.distance(paper) < 1e-3, "{none:?} {paper:?}");
        assert!(none.distance(step(Surroundings::Corrected)) > 0.05);
    }

    #[test]
    fn climbs_end_higher_than_they_begin() {
        let mut tracker = MeanShift::new(&MeanShiftParams::default(), &frame(0), target());
        let moved = frame(7);
        let before = tracker.coefficient(moved.color(), &Kernel::new(&target(), 4096)).unwrap();
        let summit = tracker.climb(moved.color(), &target()).unwrap();
        assert!(summit.coefficient > before && summit.steps > 1);
        assert!((summit.center.x - 39.0).abs() < 1.5 && (summit.center.y - 29.0).abs() < 1.5, "{summit:?}");
    }

    #[test]
    fn where_nothing_of_the_target_is_nothing_is_found() {
        let mut tracker = MeanShiftParams::default().localizer(&frame(0), target()).unwrap();
        let blue = Frame::new(1, 0.04, Image::filled(80, 60, [10, 10, 240]).unwrap());
        assert_eq!(tracker.climb(blue.color(), &target()), None);
        assert_eq!(tracker.climb(frame(0).color(), &target().translated(900.0, 0.0)), None);
    }

    #[test]
    fn histograms_that_cannot_be_are_refused() {
        let back = |m: &MeanShift| postcard::from_bytes::<MeanShift>(&postcard::to_stdvec(m).unwrap());
        let whole = MeanShift::new(&MeanShiftParams::default(), &frame(0), target());
        assert_eq!(back(&whole).unwrap().model.colors, whole.model.colors);
        let mut other = whole.clone();
        other.params.bins = 8;
        assert!(back(&other).is_err());
        let mut other = whole;
        other.params.size.rate = 7.0;
        assert!(back(&other).is_err());
    }
}
