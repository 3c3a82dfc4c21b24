use super::{AcpfParams, QuarterColors};
use crate::ahead::Ahead;
use crate::depth::DepthHistogram;
use nalgebra::SVector;
use pursuit_estimation::EstimationError;
use pursuit_estimation::particle::{ParticleFilter, ParticleOptions};
use pursuit_estimation::sigmoid;
use pursuit_geometry::{BBox, Point};
use pursuit_imaging::Frame;
use pursuit_parameters::Parameters;
use pursuit_tracking::{
    Figure, Figures, Localizer, Measurement, Outcome, Prior, Result, Search, TrackState, TrackingError,
};
use rand_core::Rng;
use serde::{Deserialize, Serialize};

/// Seed of the particles.
const SEED: u64 = 2016;

/// Centre x, centre y, size relative to that at the start, and whether the target is hidden (1) or not (0).
type State = SVector<f64, 4>;

/// Where the target is, by particles.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(remote = "AcpfLocalizer")]
pub struct AcpfLocalizer {
    params: AcpfParams,
    first_px: (f64, f64),
    particles: ParticleFilter<4>,
    colors: QuarterColors,
    depths: Option<DepthHistogram>,
    /// The target was hidden in the frame before.
    hidden: bool,
    /// The particles in the frame being looked at.
    #[serde(skip)]
    ahead: Ahead<ParticleFilter<4>>,
    #[serde(skip)]
    buffers: Buffers,
}

pursuit_estimation::checked!(AcpfLocalizer);

impl AcpfLocalizer {
    fn restored(self) -> Result<Self, &'static str> {
        let sound = [self.first_px.0, self.first_px.1].iter().all(|v| v.is_finite() && *v > 0.0);
        if !sound || self.params.check_all().is_err() {
            return Err("its target has no size, or its parameters are out of range");
        }
        if self.colors.bins() != self.params.bins {
            return Err("its colour histograms have another number of bins than its parameters say");
        }
        Ok(self)
    }
}

/// Overwritten at every use.
#[derive(Debug, Clone, Default)]
struct Buffers {
    likelihoods: Vec<f64>,
    colors: Option<QuarterColors>,
}

pursuit_tracking::figures! {
    /// What the particles say.
    struct AcpfFigures {
        /// How alike the colours, and the depths where there are any, are to the target's, 0 to 1.
        similarity;
        /// Share of the weight of the particles that see the target.
        seen;
    }
}

/// A number in `[0, 1)`.
fn uniform(generator: &mut impl Rng) -> f64 {
    (generator.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
}

/// A standard normal number (Box and Muller 1958).
fn normal(generator: &mut impl Rng) -> f64 {
    let (u, v) = (1.0 - uniform(generator), uniform(generator));
    (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
}

fn failed(frame: &Frame) -> impl FnOnce(EstimationError) -> TrackingError {
    let index = frame.index();
    move |e| TrackingError::Computation { tracker: "acpf".to_owned(), index, source: Box::new(e) }
}

impl AcpfLocalizer {
    /// Starts on the target at `bbox`.
    pub(super) fn new(params: &AcpfParams, frame: &Frame, bbox: BBox) -> Result<Self> {
        let mut colors = QuarterColors::empty(params.bins);
        colors.measure(frame.color(), &bbox, params.side);
        let center = bbox.center();
        let states = vec![State::from([center.x, center.y, 1.0, 0.0]); params.particles.max(1)];
        let options = ParticleOptions { threshold: params.resample_below, ..ParticleOptions::default() };
        let particles = ParticleFilter::from_states(states, options, SEED).map_err(failed(frame))?;
        let depths = frame.depth_mm().map(|depth| DepthHistogram::of(&params.histogram, depth, &bbox));
        let first_px = (bbox.width(), bbox.height());
        let (ahead, buffers) = (Ahead::default(), Buffers::default());
        Ok(Self { params: params.clone(), first_px, particles, colors, depths, hidden: false, ahead, buffers })
    }

    fn bbox(&self, state: &State) -> BBox {
        let size = state[2].clamp(self.params.least_size, self.params.most_size);
        BBox::from_center_size(Point::new(state[0], state[1]), self.first_px.0 * size, self.first_px.1 * size)
    }

    /// How alike the colours, and the depths where there are any, of `bbox` are to the target's: the logarithm of the
    /// likelihood, and that of a hidden target; and the similarity itself, `[0, 1]`.
    fn likelihood(&self, frame: &Frame, bbox: &BBox, scratch: &mut QuarterColors) -> (f64, f64, f64) {
        let p = &self.params;
        let log = |similarity: f64, sigma: f64| -(1.0 - similarity) / (2.0 * sigma * sigma);
        scratch.measure(frame.color(), bbox, p.side);
        let color = self.colors.similarity(scratch);
        let (mut seen, mut hidden) = (log(color, p.color_sigma), log(p.hidden_similarity, p.color_sigma));
        let mut similarity = color;
        if let (Some(target), Some(depth)) = (&self.depths, frame.depth_mm()) {
            let depth = target.similarity(&DepthHistogram::of(&p.histogram, depth, bbox));
            seen += log(depth, p.depth_sigma);
            hidden += log(p.hidden_similarity, p.depth_sigma);
            similarity = 0.5 * (color + depth);
        }
        (seen, hidden, similarity)
    }

    /// Moves the particles to this frame by `shift` pixels and their own steps.
    fn step(&self, particles: &mut ParticleFilter<4>, shift: (f64, f64)) -> Result<(), EstimationError> {
        let p = &self.params;
        let side = (self.first_px.0 * self.first_px.1).sqrt();
        let step = side * if self.hidden { p.hidden_step } else { p.step };
        particles.predict_with(|state, generator| {
            let flip = if state[3] > 0.5 { uniform(generator) < p.shows } else { uniform(generator) < p.hides };
            State::from([
                state[0] + shift.0 + step * normal(generator),
                state[1] + shift.1 + step * normal(generator),
                (state[2] * (p.size_step * normal(generator)).exp()).clamp(p.least_size, p.most_size),
                if flip { 1.0 - state[3] } else { state[3] },
            ])
        })
    }

    /// Moves and weighs copies of the particles.
    fn look_ahead(&mut self, frame: &Frame, shift: (f64, f64)) -> Result<(), EstimationError> {
        let (mut ahead, mut buffers) = (std::mem::take(&mut self.ahead), std::mem::take(&mut self.buffers));
        let carried = ahead.carry(&self.particles, |particles| {
            self.step(particles, shift)?;
            let colors = buffers.colors.get_or_insert_with(|| QuarterColors::empty(self.params.bins));
            buffers.likelihoods.clear();
            for state in particles.states() {
                let (seen, hidden, _) = self.likelihood(frame, &self.bbox(state), colors);
                buffers.likelihoods.push(if state[3] > 0.5 { hidden } else { seen });
            }
            particles.weigh(&buffers.likelihoods).map(drop)
        });
        (self.ahead, self.buffers) = (ahead, buffers);
        carried
    }

    /// The mean of the particles that see the target, and their share of all weight.
    fn seen(particles: &ParticleFilter<4>) -> Option<(State, f64)> {
        let seen = || particles.states().iter().zip(particles.weights()).filter(|(state, _)| state[3] <= 0.5);
        let weight: f64 = seen().map(|(_, w)| w).sum();
        let sum: State = seen().map(|(state, w)| state * *w).sum();
        (weight > 1e-12).then(|| (sum / weight, weight))
    }
}

impl Localizer for AcpfLocalizer {
    type Finding = ();

    const FIGURES: &[&[Figure]] = &[AcpfFigures::ALL];

    fn locate(&mut self, frame: &Frame, _: &Search) -> Result<Option<(Measurement, ())>> {
        let found = self.ahead.get().and_then(Self::seen);
        let Some((state, weight)) = found else { return Ok(None) };
        let bbox = self.bbox(&state);
        let mut scratch = self.buffers.colors.take().unwrap_or_else(|| QuarterColors::empty(self.params.bins));
        let (_, _, similarity) = self.likelihood(frame, &bbox, &mut scratch);
        self.buffers.colors = Some(scratch);
        // Both have to agree: most particles see it, and what they see is alike.
        let alike = sigmoid((similarity - self.params.hidden_similarity) / self.params.softness);
        let diagnostics = AcpfFigures { similarity, seen: weight }.into();
        Ok(Some((Measurement { diagnostics, ..Measurement::new(bbox, weight.min(1.0).sqrt() * alike) }, ())))
    }

    fn adapt(&mut self, frame: &Frame, bbox: BBox, (): &()) -> Result<()> {
        let mut now = self.buffers.colors.take().unwrap_or_else(|| QuarterColors::empty(self.params.bins));
        now.measure(frame.color(), &bbox, self.params.side);
        self.colors.blend(&now, self.params.learning_rate);
        self.buffers.colors = Some(now);
        if let Some(depth) = frame.depth_mm() {
            let now = DepthHistogram::of(&self.params.histogram, depth, &bbox);
            self.depths.get_or_insert(now).blend(&now, self.params.learning_rate);
        }
        Ok(())
    }

    fn suggest(&mut self, frame: &Frame, prior: &Prior, state: TrackState, _: &mut Vec<BBox>) -> Result<()> {
        // The particles go with the loop's motion while the target is in sight, and spread while it is not.
        let mean = self.particles.mean();
        let center = prior.bbox.center();
        let shift = if state == TrackState::Lost { (0.0, 0.0) } else { (center.x - mean[0], center.y - mean[1]) };
        self.look_ahead(frame, shift).map_err(failed(frame))
    }

    fn observe(&mut self, frame: &Frame, outcome: &Outcome<'_, ()>) -> Result<()> {
        self.hidden = outcome.state != TrackState::Tracking;
        self.ahead.settle(&mut self.particles);
        self.particles.resample_if_needed().map(drop).map_err(failed(frame))
    }

    fn restart(&mut self, frame: &Frame, bbox: BBox) -> Result<()> {
        *self = Self::new(&self.params, frame, bbox)?;
        Ok(())
    }
}
