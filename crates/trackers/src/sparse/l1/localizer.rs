use super::L1Params;
use super::apg::Coder;
use super::patches::{REACH, State, View, bbox, state, walk};
use super::templates::Templates;
use crate::ahead::Ahead;
use crate::appearance::FirstColors;
use pursuit_estimation::EstimationError;
use pursuit_estimation::particle::{ParticleFilter, ParticleOptions};
use pursuit_estimation::sigmoid;
use pursuit_geometry::BBox;
use pursuit_imaging::{Frame, ImageView};
use pursuit_parameters::Parameters;
use pursuit_tracking::search::inside;
use pursuit_tracking::{
    Figure, Figures, Localizer, Look, Measurement, Outcome, Prior, Result, Search, TrackState, TrackingError, ViewSize,
};
use pursuit_vision::patch::dot;
use pursuit_vision::regions::RegionFinder;
use serde::{Deserialize, Serialize};

/// Seed of the samples.
const SEED: u64 = 2012;
/// Places that are looked at to each side of the middle, where no samples are.
const LATTICE: i32 = 12;
/// Templates of the first frame are this many pixels of the frame apart (mei2011, section 3.3).
const APART_PX: f64 = 1.0;

/// Where the target is, by ℓ₁ minimisation.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(remote = "L1Tracker")]
pub struct L1Tracker {
    params: L1Params,
    first_px: (f64, f64),
    samples: ParticleFilter<6>,
    templates: Templates,
    colors: FirstColors,
    /// For so many frames templates stay and μ is 0.
    hold: usize,
    /// The samples in the frame being looked at.
    #[serde(skip)]
    ahead: Ahead<ParticleFilter<6>>,
    #[serde(skip)]
    buffers: Buffers,
}

pursuit_estimation::checked!(L1Tracker);

impl L1Tracker {
    fn restored(mut self) -> Result<Self, &'static str> {
        let sound = [self.first_px.0, self.first_px.1].iter().all(|v| v.is_finite() && *v > 0.0);
        if !sound
            || !self.colors.is_sound()
            || self.params.check_all().is_err()
            || self.hold > self.params.update.hold_frames
        {
            return Err("its target has no size or no colours, or its parameters are out of range");
        }
        let L1Params { samples, templates, columns, rows, .. } = self.params;
        if self.samples.states().len() != samples {
            return Err("it has other samples than its parameters say");
        }
        if self.templates.count() != templates || self.templates.pixels() != columns * rows {
            return Err("it has other templates than its parameters say");
        }
        self.buffers = Buffers::new(&self.params);
        Ok(self)
    }
}

/// Overwritten at every use.
#[derive(Debug, Clone, Default)]
struct Buffers {
    view: View,
    coder: Coder,
    patch: Vec<f32>,
    /// Patches of all samples, one after the other; errors of least squares with whose they are; and likelihoods.
    patches: Vec<f32>,
    bounds: Vec<(f64, usize)>,
    likelihoods: Vec<f64>,
    covered: Vec<u8>,
    regions: RegionFinder,
}

impl Buffers {
    fn new(params: &L1Params) -> Self {
        let (samples, pixels) = (params.samples, params.columns * params.rows);
        Self {
            patch: Vec::with_capacity(pixels),
            patches: Vec::with_capacity(samples * pixels),
            bounds: Vec::with_capacity(samples),
            likelihoods: Vec::with_capacity(samples),
            covered: Vec::with_capacity(pixels),
            ..Self::default()
        }
    }
}

pursuit_tracking::figures! {
    /// What the code of a patch says.
    struct L1Figures {
        /// What the templates do not explain of the box, 0 to 1.
        error;
        /// Share of the largest region that something covers.
        covered;
        /// Correlation of the box with the first frame's, -1 to 1.
        likeness;
        /// How alike its colours are to the first frame's, 0 to 1.
        colors;
    }
}

/// What a look saw.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct L1Finding {
    by_samples: bool,
    state: State,
    is_covered: bool,
}

impl L1Finding {
    /// Whether something covers the target.
    pub const fn is_covered(&self) -> bool {
        self.is_covered
    }
}

fn failed(frame: &Frame) -> impl FnOnce(EstimationError) -> TrackingError {
    let index = frame.index();
    move |e| TrackingError::Computation { tracker: "l1".to_owned(), index, source: Box::new(e) }
}

/// Samples of a target in one state, all alike: the random walk parts them.
fn samples(params: &L1Params, start: State) -> Result<ParticleFilter<6>, EstimationError> {
    // Drawn anew in every frame: the effective number of samples is never above them all.
    let options = ParticleOptions { threshold: 1.0, ..ParticleOptions::default() };
    ParticleFilter::from_states(vec![start; params.samples], options, SEED)
}

impl L1Tracker {
    /// Starts on the target at `bbox`.
    pub(super) fn new(params: &L1Params, frame: &Frame, bbox: BBox) -> Result<Self> {
        let first_px = (bbox.width(), bbox.height());
        let start = state(&bbox, first_px, &params.moves);
        let mut buffers = Buffers::new(params);
        buffers.view.look(frame, &bbox, params);
        let mut rows = Vec::with_capacity(params.templates * params.columns * params.rows);
        for k in 0..params.templates {
            // The first as it is, the others around it, further out with each turn.
            let (turn, out) = (k as f64 * std::f64::consts::FRAC_PI_4, APART_PX * (1.0 + ((k.max(1) - 1) / 8) as f64));
            let out = if k == 0 { 0.0 } else { out };
            let moved = start + State::from([out * turn.cos(), out * turn.sin(), 0.0, 0.0, 0.0, 0.0]);
            buffers.view.take(&moved, first_px, params, &mut buffers.patch);
            rows.extend_from_slice(&buffers.patch);
        }
        let templates = Templates::new(rows, params.columns * params.rows);
        let samples = samples(params, start).map_err(failed(frame))?;
        let (colors, ahead) = (FirstColors::new(frame, &bbox), Ahead::default());
        Ok(Self { params: params.clone(), first_px, samples, templates, colors, hold: 0, ahead, buffers })
    }

    /// The energy control of today.
    const fn mu(&self) -> f64 {
        if self.hold > 0 { 0.0 } else { self.params.code.mu }
    }

    /// Draws, moves and weighs copies of the samples.
    fn look_ahead(&mut self, frame: &Frame, dt_s: f64) -> Result<(), EstimationError> {
        let (mut ahead, mut buffers) = (std::mem::take(&mut self.ahead), std::mem::take(&mut self.buffers));
        let carried = ahead.carry(&self.samples, |samples| {
            samples.resample()?;
            samples.predict_with(|state, generator| walk(state, self.first_px, &self.params.moves, dt_s, generator))?;
            buffers.view.look(frame, &bbox(&samples.mean(), self.first_px), &self.params);
            self.rate(samples.states(), &mut buffers);
            samples.weigh(&buffers.likelihoods).map(drop)
        });
        (self.ahead, self.buffers) = (ahead, buffers);
        carried
    }

    /// The logarithms of the likelihoods of states in the view; −∞ of those that are left out.
    fn rate(&self, states: &[State], buffers: &mut Buffers) {
        let (params, pixels) = (&self.params, self.templates.pixels());
        let Buffers { view, coder, patch, patches, bounds, likelihoods, .. } = buffers;
        patches.clear();
        bounds.clear();
        likelihoods.clear();
        likelihoods.resize(states.len(), f64::NEG_INFINITY);
        for (k, state) in states.iter().enumerate() {
            // Of a patch of one value nothing is explained.
            let seen = view.take(state, self.first_px, params, patch);
            patches.extend_from_slice(patch);
            bounds.push((if seen { self.templates.least_error(patch) } else { 1.0 }, k));
        }
        bounds.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let (sharpness, mu) = (params.code.sharpness, self.mu());
        let mut sum = 0.0;
        for (bound, k) in bounds.iter() {
            // Whatever its code, a sample is no likelier than this; and of those that weigh less than half of one's share none is
            // drawn again (mei2011, section 4).
            let most = (-sharpness * bound).exp();
            if params.code.bounded && most < sum / (2.0 * states.len() as f64) {
                break;
            }
            let y = &patches[k * pixels..(k + 1) * pixels];
            coder.code(&self.templates, y, &params.code, mu);
            let error = coder.error(&self.templates, y).max(*bound);
            likelihoods[*k] = -sharpness * error;
            sum += likelihoods[*k].exp();
        }
    }

    /// The state whose patch sums of templates explain best, of places about `expected`.
    fn scan(&mut self, frame: &Frame, expected: &BBox) -> State {
        let start = state(expected, self.first_px, &self.params.moves);
        let Buffers { view, patch, .. } = &mut self.buffers;
        view.look(frame, &bbox(&start, self.first_px), &self.params);
        let mut best = (f64::INFINITY, start);
        let share = |k: i32| REACH * f64::from(k) / f64::from(LATTICE);
        for (j, i) in (-LATTICE..=LATTICE).flat_map(|j| (-LATTICE..=LATTICE).map(move |i| (j, i))) {
            let (dx, dy) = (share(i) * expected.width(), share(j) * expected.height());
            let there = start + State::from([dx, dy, 0.0, 0.0, 0.0, 0.0]);
            if view.take(&there, self.first_px, &self.params, patch) {
                let error = self.templates.least_error(patch);
                if error < best.0 {
                    best = (error, there);
                }
            }
        }
        best.1
    }

    /// What the code of a state's patch says: its error, the share of the largest region that is covered, and how like the first frame it
    /// is. `None` of a patch of one value.
    fn judge(&mut self, frame: &Frame, state: &State) -> Option<L1Figures> {
        let (params, mu) = (&self.params, self.mu());
        let Buffers { view, coder, patch, covered, regions, .. } = &mut self.buffers;
        let found = bbox(state, self.first_px);
        view.look(frame, &found, params);
        if !view.take(state, self.first_px, params, patch) {
            return None;
        }
        coder.code(&self.templates, patch, &params.code, mu);
        let error = coder.error(&self.templates, patch);
        // Without energy control: what is covered shows in full.
        let (_, pixels) = coder.code(&self.templates, patch, &params.code, 0.0);
        let least = (params.update.covered_above / (patch.len() as f64).sqrt()) as f32;
        covered.clear();
        covered.extend(pixels.iter().map(|e| u8::from(e.abs() > least)));
        let area = match ImageView::new(covered, params.columns, params.rows, params.columns) {
            Ok(mask) => regions.find(mask, 1).iter().map(|r| r.area).max().unwrap_or(0),
            Err(_) => 0,
        };
        let likeness = self.templates.rows().next().map_or(0.0, |first| f64::from(dot(first, patch)));
        let colors = self.colors.likeness(frame, &found);
        Some(L1Figures { error, covered: area as f64 / patch.len() as f64, likeness, colors })
    }
}

impl Localizer for L1Tracker {
    type Finding = L1Finding;

    const FIGURES: &[&[Figure]] = &[L1Figures::ALL];

    fn locate(&mut self, frame: &Frame, search: &Search) -> Result<Option<(Measurement, L1Finding)>> {
        let by_samples = search.look == Look::Near;
        let state = match self.ahead.get() {
            Some(samples) if by_samples => samples.mean(),
            None if by_samples => return Ok(None),
            _ => self.scan(frame, &search.expected),
        };
        let Some(figures) = self.judge(frame, &state) else { return Ok(None) };
        let mut found = bbox(&state, self.first_px);
        if search.keep_inside {
            found = found.centered_at(inside(found.center(), frame.size()));
        }
        let s = &self.params.score;
        let odds = s.bias
            + s.error * figures.error
            + s.covered * figures.covered
            + s.likeness * figures.likeness
            + s.colors * figures.colors;
        let is_covered = figures.covered > self.params.update.covered_share;
        let measurement = Measurement { diagnostics: figures.into(), ..Measurement::new(found, sigmoid(odds)) };
        Ok(Some((measurement, L1Finding { by_samples, state, is_covered })))
    }

    fn adapt(&mut self, frame: &Frame, bbox: BBox, finding: &L1Finding) -> Result<()> {
        if self.hold > 0 || finding.is_covered {
            return Ok(());
        }
        let center = bbox.center();
        let mut state = finding.state;
        (state[0], state[1]) = (center.x, center.y);
        let mu = self.mu();
        let Buffers { view, coder, patch, .. } = &mut self.buffers;
        view.look(frame, &bbox, &self.params);
        if view.take(&state, self.first_px, &self.params, patch) {
            let (code, _) = coder.code(&self.templates, patch, &self.params.code, mu);
            self.templates.update(patch, code, &self.params.update);
        }
        Ok(())
    }

    fn suggest(&mut self, frame: &Frame, prior: &Prior, _: TrackState, _: &mut Vec<BBox>) -> Result<()> {
        self.look_ahead(frame, prior.dt_s).map_err(failed(frame))
    }

    fn observe(&mut self, frame: &Frame, outcome: &Outcome<'_, L1Finding>) -> Result<()> {
        self.ahead.settle(&mut self.samples);
        self.hold = match outcome.found {
            Some((_, finding)) if finding.is_covered => self.params.update.hold_frames,
            _ => self.hold.saturating_sub(1),
        };
        // What was found elsewhere is where the samples begin anew.
        if let (Some((_, finding)), Some(bbox)) = (outcome.found, outcome.followed)
            && !finding.by_samples
        {
            let start = state(&bbox, self.first_px, &self.params.moves);
            self.samples = samples(&self.params, start).map_err(failed(frame))?;
        }
        Ok(())
    }

    fn restart(&mut self, frame: &Frame, bbox: BBox) -> Result<()> {
        *self = Self::new(&self.params, frame, bbox)?;
        Ok(())
    }

    fn view(&self, expected: &BBox) -> Option<ViewSize> {
        let wide = 1.0 + 2.0 * REACH;
        Some(ViewSize { width: wide * expected.width(), height: wide * expected.height() })
    }
}

#[cfg(test)]
mod tests;
