use super::dynamics::State;
use super::{CondensationParams, Dynamics, Outline};
use crate::acpf::QuarterColors;
use crate::ahead::Ahead;
use pursuit_estimation::EstimationError;
use pursuit_estimation::particle::{ParticleFilter, ParticleOptions};
use pursuit_estimation::sigmoid;
use pursuit_geometry::{BBox, Point};
use pursuit_imaging::Frame;
use pursuit_parameters::Parameters;
use pursuit_tracking::{
    Figure, Figures, Localizer, Look, Measurement, Outcome, Prior, Result, Search, TrackState, TrackingError, ViewSize,
};
use serde::{Deserialize, Serialize};

/// Seed of the samples.
const SEED: u64 = 1998;
/// How far apart samples usually are, in target sizes: what a look that is not theirs counts as.
const USUAL_SPREAD: f64 = 0.1;

/// Where the target is, by factored sampling.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(remote = "Condensation")]
pub struct Condensation {
    params: CondensationParams,
    first_px: (f64, f64),
    samples: ParticleFilter<6>,
    colors: QuarterColors,
    /// The samples in the frame being looked at.
    #[serde(skip)]
    ahead: Ahead<ParticleFilter<6>>,
    #[serde(skip)]
    buffers: Buffers,
}

pursuit_estimation::checked!(Condensation);

impl Condensation {
    fn restored(mut self) -> Result<Self, &'static str> {
        let sound = [self.first_px.0, self.first_px.1].iter().all(|v| v.is_finite() && *v > 0.0);
        if !sound || self.params.check_all().is_err() {
            return Err("its target has no size, or its parameters are out of range");
        }
        if self.colors.bins() != self.params.bins || self.samples.states().len() != self.params.samples {
            return Err("it has other samples or colour histograms than its parameters say");
        }
        self.buffers = Buffers::new(&self.params);
        Ok(self)
    }
}

/// Overwritten at every use, but for the outline's directions.
#[derive(Debug, Clone, Default)]
struct Buffers {
    likelihoods: Vec<f64>,
    colors: Option<QuarterColors>,
    outline: Outline,
}

impl Buffers {
    fn new(params: &CondensationParams) -> Self {
        Self {
            likelihoods: Vec::with_capacity(params.samples),
            colors: Some(QuarterColors::empty(params.bins)),
            outline: Outline::new(params.contour.normals),
        }
    }
}

pursuit_tracking::figures! {
    /// What the samples say.
    struct CondensationFigures {
        /// How alike the colours in the box are to the target's, 0 to 1.
        similarity;
        /// How well the box's outline lies on edges, 0 to 1.
        outline;
        /// Standard deviation of the samples' middles.
        spread in "target sizes";
    }
}

/// What a look saw: whether it was the samples' own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CondensationFinding {
    by_samples: bool,
}

fn failed(frame: &Frame) -> impl FnOnce(EstimationError) -> TrackingError {
    let index = frame.index();
    move |e| TrackingError::Computation { tracker: "condensation".to_owned(), index, source: Box::new(e) }
}

/// Samples of a target at `bbox`, all alike: the dynamics part them.
fn samples(
    params: &CondensationParams,
    first_px: (f64, f64),
    bbox: &BBox,
) -> Result<ParticleFilter<6>, EstimationError> {
    let (center, size) = (bbox.center(), (bbox.area() / (first_px.0 * first_px.1)).sqrt());
    let size = size.clamp(params.least_size, params.most_size);
    let state = State::from([center.x, center.y, size.ln(), 0.0, 0.0, 0.0]);
    // Drawn anew in every frame (isard1998): the effective number of samples is never above them all.
    let options = ParticleOptions { threshold: 1.0, ..ParticleOptions::default() };
    ParticleFilter::from_states(vec![state; params.samples], options, SEED)
}

impl Condensation {
    /// Starts on the target at `bbox`.
    pub(super) fn new(params: &CondensationParams, frame: &Frame, bbox: BBox) -> Result<Self> {
        let mut colors = QuarterColors::empty(params.bins);
        colors.measure(frame.color(), &bbox, params.side);
        let first_px = (bbox.width(), bbox.height());
        let samples = samples(params, first_px, &bbox).map_err(failed(frame))?;
        let (ahead, buffers) = (Ahead::default(), Buffers::new(params));
        Ok(Self { params: params.clone(), first_px, samples, colors, ahead, buffers })
    }

    fn bbox(&self, state: &State) -> BBox {
        let size = state[2].exp().clamp(self.params.least_size, self.params.most_size);
        BBox::from_center_size(Point::new(state[0], state[1]), self.first_px.0 * size, self.first_px.1 * size)
    }

    /// How alike the colours in `bbox` are to the target's, and how far its outline is from edges, both `[0, 1]`.
    fn seen(&self, frame: &Frame, bbox: &BBox, buffers: &mut Buffers) -> (f64, f64) {
        let colors = buffers.colors.get_or_insert_with(|| QuarterColors::empty(self.params.bins));
        colors.measure(frame.color(), bbox, self.params.side);
        (self.colors.similarity(colors), buffers.outline.distance(frame.gray(), bbox, &self.params.contour))
    }

    /// The logarithm of the likelihood of what was seen of a box.
    fn likelihood(&self, (similarity, distance): (f64, f64)) -> f64 {
        let p = &self.params;
        let color = -(1.0 - similarity) / (2.0 * p.color_sigma * p.color_sigma);
        let contour = -0.5 * distance * (p.contour.reach / p.contour.sigma).powi(2);
        (1.0 - p.contour_share) * color + p.contour_share * contour
    }

    /// Draws, moves and weighs copies of the samples.
    fn look_ahead(&mut self, frame: &Frame, dt_s: f64) -> Result<(), EstimationError> {
        let (mut ahead, mut buffers) = (std::mem::take(&mut self.ahead), std::mem::take(&mut self.buffers));
        let dynamics = Dynamics::over(&self.params.dynamics, dt_s);
        let carried = ahead.carry(&self.samples, |samples| {
            samples.resample()?;
            samples.predict_with(|state, generator| {
                let size_px = self.bbox(state).area().sqrt();
                let mut next = dynamics.step(state, size_px, generator);
                next[2] = next[2].clamp(self.params.least_size.ln(), self.params.most_size.ln());
                next
            })?;
            let mut likelihoods = std::mem::take(&mut buffers.likelihoods);
            likelihoods.clear();
            likelihoods.extend(
                samples.states().iter().map(|s| self.likelihood(self.seen(frame, &self.bbox(s), &mut buffers))),
            );
            let weighed = samples.weigh(&likelihoods).map(drop);
            buffers.likelihoods = likelihoods;
            weighed
        });
        (self.ahead, self.buffers) = (ahead, buffers);
        carried
    }

    /// The mean of the samples (isard1998, section 5: the moments of the density are weighted sums over the samples), and the
    /// standard deviation of their middles in target sizes.
    fn estimate(&self) -> Option<(BBox, f64)> {
        let samples = self.ahead.get()?;
        let mean = samples.mean();
        let away = |s: &State| (s[0] - mean[0]).powi(2) + (s[1] - mean[1]).powi(2);
        let variance: f64 = samples.states().iter().zip(samples.weights()).map(|(s, w)| w * away(s)).sum();
        let bbox = self.bbox(&mean);
        Some((bbox, (variance / 2.0 / bbox.area()).sqrt()))
    }
}

impl Localizer for Condensation {
    type Finding = CondensationFinding;

    const FIGURES: &[&[Figure]] = &[CondensationFigures::ALL];

    fn locate(&mut self, frame: &Frame, search: &Search) -> Result<Option<(Measurement, CondensationFinding)>> {
        let by_samples = search.look == Look::Near;
        let looked = if by_samples { self.estimate() } else { Some((search.expected, USUAL_SPREAD)) };
        let Some((bbox, spread)) = looked else { return Ok(None) };
        let mut buffers = std::mem::take(&mut self.buffers);
        let (similarity, distance) = self.seen(frame, &bbox, &mut buffers);
        self.buffers = buffers;
        let (outline, score) = (1.0 - distance, &self.params.score);
        let odds = score.bias + score.similarity * similarity + score.outline * outline + score.spread * spread;
        let diagnostics = CondensationFigures { similarity, outline, spread }.into();
        let measurement = Measurement { diagnostics, ..Measurement::new(bbox, sigmoid(odds)) };
        Ok(Some((measurement, CondensationFinding { by_samples })))
    }

    fn adapt(&mut self, frame: &Frame, bbox: BBox, _: &CondensationFinding) -> Result<()> {
        if self.params.learning_rate > 0.0 {
            let mut now = self.buffers.colors.take().unwrap_or_else(|| QuarterColors::empty(self.params.bins));
            now.measure(frame.color(), &bbox, self.params.side);
            self.colors.blend(&now, self.params.learning_rate);
            self.buffers.colors = Some(now);
        }
        Ok(())
    }

    fn suggest(&mut self, frame: &Frame, prior: &Prior, _: TrackState, _: &mut Vec<BBox>) -> Result<()> {
        self.look_ahead(frame, prior.dt_s).map_err(failed(frame))
    }

    fn observe(&mut self, frame: &Frame, outcome: &Outcome<'_, CondensationFinding>) -> Result<()> {
        self.ahead.settle(&mut self.samples);
        // What was found elsewhere is where the samples begin anew.
        if let (Some((_, finding)), Some(bbox)) = (outcome.found, outcome.followed)
            && !finding.by_samples
        {
            self.samples = samples(&self.params, self.first_px, &bbox).map_err(failed(frame))?;
        }
        Ok(())
    }

    fn restart(&mut self, frame: &Frame, bbox: BBox) -> Result<()> {
        *self = Self::new(&self.params, frame, bbox)?;
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

    fn target(k: u64) -> BBox {
        BBox::from_ltwh(40.0 + 2.0 * k as f64, 30.0 + k as f64, 30.0, 24.0)
    }

    fn frame(k: u64) -> Frame {
        let b = target(k);
        let image = Image::from_fn(160, 120, |x, y| {
            let (u, v) = (x as f64 + 0.5 - b.center().x, y as f64 + 0.5 - b.center().y);
            let inside = (u / 15.0).powi(2) + (v / 12.0).powi(2) < 1.0;
            if inside { [220, if v < 0.0 { 160 } else { 40 }, 30] } else { [70, 90 + (x % 20) as u8, 80] }
        });
        Frame::new(k, k as f64 / 30.0, image.unwrap())
    }

    /// One frame by the recursion, each sample on its own: weights are likelihoods over their sum, whatever the prior.
    #[test]
    fn weights_are_the_likelihoods_of_moved_samples() {
        let params = CondensationParams { samples: 50, ..CondensationParams::default() };
        let mut tracker = Condensation::new(&params, &frame(0), target(0)).unwrap();
        for k in 1..4 {
            tracker.look_ahead(&frame(k), 1.0 / 30.0).unwrap();
            let samples = tracker.ahead.get().unwrap().clone();
            let now = frame(k);
            let outline = Outline::new(params.contour.normals);
            let likelihoods: Vec<f64> = samples
                .states()
                .iter()
                .map(|s| {
                    let size = s[2].exp();
                    let bbox = BBox::from_center_size(Point::new(s[0], s[1]), 30.0 * size, 24.0 * size);
                    let mut colors = QuarterColors::empty(params.bins);
                    colors.measure(now.color(), &bbox, params.side);
                    let d = 1.0 - tracker.colors.similarity(&colors);
                    let miss = outline.distance(now.gray(), &bbox, &params.contour) * params.contour.reach.powi(2);
                    let color = (-d / (2.0 * params.color_sigma.powi(2))).exp();
                    let contour = (-miss / (2.0 * params.contour.sigma.powi(2))).exp();
                    color.powf(1.0 - params.contour_share) * contour.powf(params.contour_share)
                })
                .collect();
            let total: f64 = likelihoods.iter().sum();
            for (w, l) in samples.weights().iter().zip(&likelihoods) {
                assert!((w - l / total).abs() < 1e-9, "frame {k}: {w} is not {}", l / total);
            }
            let (bbox, spread) = tracker.estimate().unwrap();
            let x: f64 = samples.states().iter().zip(&likelihoods).map(|(s, l)| s[0] * l / total).sum();
            assert!((bbox.center().x - x).abs() < 1e-9 && spread > 0.0);
            tracker.ahead.settle(&mut tracker.samples);
        }
        assert!(tracker.estimate().is_none(), "samples are carried once a frame");
    }

    #[test]
    fn samples_begin_anew_where_the_target_was_found() {
        let mut tracker = Condensation::new(&CondensationParams::default(), &frame(0), target(0)).unwrap();
        let place = target(0).translated(60.0, 40.0);
        let finding = CondensationFinding { by_samples: false };
        let outcome = |found| Outcome {
            state: TrackState::Tracking,
            bbox: place,
            found: Some((place, found)),
            followed: Some(place),
            dt_s: 0.03,
        };
        tracker.observe(&frame(1), &outcome(&CondensationFinding { by_samples: true })).unwrap();
        assert!((tracker.samples.mean()[0] - 55.0).abs() < 1e-9, "its own samples stay where they are");
        tracker.observe(&frame(1), &outcome(&finding)).unwrap();
        assert!((tracker.samples.mean()[0] - 115.0).abs() < 1e-9);
    }

    #[test]
    fn states_that_cannot_be_are_refused() {
        let back = |t: &Condensation| postcard::from_bytes::<Condensation>(&postcard::to_stdvec(t).unwrap());
        let whole = Condensation::new(&CondensationParams::default(), &frame(0), target(0)).unwrap();
        assert!(back(&whole).is_ok());
        assert!(back(&Condensation { first_px: (0.0, 3.0), ..whole.clone() }).is_err());
        let mut other = whole;
        other.params.samples = 10;
        assert!(back(&other).is_err());
    }
}
