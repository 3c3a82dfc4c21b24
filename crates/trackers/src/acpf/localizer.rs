use super::{AcpfParams, QuarterColors};
use crate::depth::DepthHistogram;
use nalgebra::SVector;
use pursuit_estimation::EstimationError;
use pursuit_estimation::particle::{ParticleFilter, ParticleOptions};
use pursuit_geometry::{BBox, Point};
use pursuit_imaging::Frame;
use pursuit_tracking::parameters::Parameters;
use pursuit_tracking::{
    Diagnostics, Localizer, Measurement, Outcome, Prior, Result, Search, TrackState, TrackingError,
};
use rand_core::Rng;
use serde::{Deserialize, Serialize};

/// Seed of the particles.
const SEED: u64 = 2016;

/// Centre x, centre y, size relative to that at the start, and whether the target is hidden (1) or not (0).
type State = SVector<f64, 4>;

/// Where the target is, by particles.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(try_from = "Raw")]
pub struct AcpfLocalizer {
    params: AcpfParams,
    first_px: (f64, f64),
    particles: ParticleFilter<4>,
    colors: QuarterColors,
    depths: Option<DepthHistogram>,
    /// The target was hidden in the frame before.
    hidden: bool,
    #[serde(skip)]
    ahead: Ahead,
}

/// What is stored, before it is checked.
#[derive(Deserialize)]
struct Raw {
    params: AcpfParams,
    first_px: (f64, f64),
    particles: ParticleFilter<4>,
    colors: QuarterColors,
    depths: Option<DepthHistogram>,
    hidden: bool,
}

impl TryFrom<Raw> for AcpfLocalizer {
    type Error = &'static str;

    fn try_from(raw: Raw) -> Result<Self, Self::Error> {
        let Raw { params, first_px, particles, colors, depths, hidden } = raw;
        let sound = [first_px.0, first_px.1].iter().all(|v| v.is_finite() && *v > 0.0);
        if !sound || params.check_all().is_err() {
            return Err("its target has no size, or its parameters are out of range");
        }
        if colors.bins() != params.bins {
            return Err("its colour histograms have another number of bins than its parameters say");
        }
        Ok(Self { params, first_px, particles, colors, depths, hidden, ahead: Ahead::default() })
    }
}

/// The particles in the frame being looked at; not state until that frame has been judged.
#[derive(Debug, Clone, Default)]
struct Ahead {
    particles: Option<ParticleFilter<4>>,
    likelihoods: Vec<f64>,
    scratch: Option<QuarterColors>,
    fresh: bool,
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
        Ok(Self { params: params.clone(), first_px, particles, colors, depths, hidden: false, ahead: Ahead::default() })
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
        let mut ahead = std::mem::take(&mut self.ahead);
        ahead.fresh = false;
        let mut particles = match ahead.particles.take() {
            Some(mut copy) => {
                copy.clone_from(&self.particles);
                copy
            }
            None => self.particles.clone(),
        };
        self.step(&mut particles, shift)?;
        let scratch = ahead.scratch.get_or_insert_with(|| QuarterColors::empty(self.params.bins));
        ahead.likelihoods.clear();
        for state in particles.states() {
            let (seen, hidden, _) = self.likelihood(frame, &self.bbox(state), scratch);
            ahead.likelihoods.push(if state[3] > 0.5 { hidden } else { seen });
        }
        particles.weigh(&ahead.likelihoods)?;
        (ahead.particles, ahead.fresh) = (Some(particles), true);
        self.ahead = ahead;
        Ok(())
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
    fn locate(&mut self, frame: &Frame, _: &Search) -> Result<Option<Measurement>> {
        let found = self.ahead.particles.as_ref().filter(|_| self.ahead.fresh).and_then(Self::seen);
        let Some((state, weight)) = found else { return Ok(None) };
        let bbox = self.bbox(&state);
        let mut scratch = self.ahead.scratch.take().unwrap_or_else(|| QuarterColors::empty(self.params.bins));
        let (_, _, similarity) = self.likelihood(frame, &bbox, &mut scratch);
        self.ahead.scratch = Some(scratch);
        // Both have to agree: most particles see it, and what they see is alike.
        let alike = 1.0 / (1.0 + (-(similarity - self.params.hidden_similarity) / self.params.softness).exp());
        let diagnostics = Diagnostics::default().with("similarity", similarity).with("seen", weight);
        Ok(Some(Measurement { diagnostics, ..Measurement::new(bbox, weight.min(1.0).sqrt() * alike) }))
    }

    fn adapt(&mut self, frame: &Frame, bbox: BBox, _: &Measurement) -> Result<()> {
        let mut now = self.ahead.scratch.take().unwrap_or_else(|| QuarterColors::empty(self.params.bins));
        now.measure(frame.color(), &bbox, self.params.side);
        self.colors.blend(&now, self.params.learning_rate);
        self.ahead.scratch = Some(now);
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

    fn observe(&mut self, frame: &Frame, outcome: &Outcome<'_>) -> Result<()> {
        self.hidden = outcome.state != TrackState::Tracking;
        if let Some(ahead) = self.ahead.particles.as_mut().filter(|_| self.ahead.fresh) {
            std::mem::swap(&mut self.particles, ahead);
            self.ahead.fresh = false;
        }
        self.particles.resample_if_needed().map(drop).map_err(failed(frame))
    }

    fn restart(&mut self, frame: &Frame, bbox: BBox) -> Result<()> {
        *self = Self::new(&self.params, frame, bbox)?;
        Ok(())
    }
}
