use super::blocks::len;
use super::coefficients::frequencies;
use super::factorised::{self, FirstSample, principal_components};
use super::interpolation::label;
use super::model::{Learning, Model, shift};
use super::objective::Objective;
use super::params::{CompressionModel, ContinuousParams};
use super::spatial::SpatialWeight;
use super::view::{View, raw_blocks, sample_blocks};
use crate::appearance::{FirstColors, InitialTemplate, Support};
use crate::correlation::scale::ScaleFilter;
use crate::correlation::{CorrelationFigures, Evidence, Likeness, PeakBaseline, SearchWindow, SweepBy, peak_quality};
use pursuit_estimation::sigmoid;
use pursuit_geometry::{BBox, Point, Size};
use pursuit_imaging::Frame;
use pursuit_parameters::Parameters;
use pursuit_tracking::search::inside;
use pursuit_tracking::{Figure, Figures, Localizer, Look, Measurement, Result, Search, ViewSize};
use pursuit_vision::fourier::{Complex32, FftScratch, RealFft2, highest, newton_peak, signed_shift};
use serde::{Deserialize, Serialize};

/// Half the side of the square about the peak that is no sidelobe, as a share of the response's side (bolme2010, section
/// 3.5: 11 of 64).
const SIDELOBE_SHARE: f64 = 11.0 / 128.0;

/// Finds the target by a continuous convolution of features, compressed or as they are.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(try_from = "Raw")]
pub struct ContinuousLocalizer {
    params: ContinuousParams,
    /// Whether there are colour names: whether the first frame had colour.
    names: bool,
    window: SearchWindow,
    model: Model,
    scale: Option<ScaleFilter>,
    initial: InitialTemplate,
    /// Where they are part of the score.
    first_colors: Option<FirstColors>,
    baseline: PeakBaseline,
    #[serde(skip)]
    scratch: Box<Scratch>,
}

/// What is stored, before it is checked.
#[derive(Deserialize)]
struct Raw {
    params: ContinuousParams,
    names: bool,
    window: SearchWindow,
    model: Model,
    scale: Option<ScaleFilter>,
    initial: InitialTemplate,
    first_colors: Option<FirstColors>,
    baseline: PeakBaseline,
}

impl TryFrom<Raw> for ContinuousLocalizer {
    type Error = &'static str;

    fn try_from(raw: Raw) -> Result<Self, Self::Error> {
        let Raw { params, names, window, model, scale, initial, first_colors, baseline } = raw;
        if params.check_all().is_err() {
            return Err("its settings are out of range");
        }
        let Size { width: side, height } = window.patch();
        if side != height || !side.is_multiple_of(params.window.unit_px()) {
            return Err("its window is no square of whole cells");
        }
        let (all, blocks) = (raw_blocks(&params, names, side), sample_blocks(&params, names, side));
        let entries = match params.compression.model {
            CompressionModel::Learned => all.iter().zip(&blocks).map(|(a, b)| a.channels * b.channels).sum(),
            CompressionModel::None => 0,
        };
        // What is stored must have the size of the grid before anything of that size is made.
        if !model.is_sound(&params, &blocks, entries) {
            return Err("its filter does not fit its window");
        }
        if !initial.fits(support(&params, &window), all[0].channels) {
            return Err("its initial template does not fit its window");
        }
        if !params.score.fits(first_colors.as_ref()) {
            return Err("its first colours do not fit its score");
        }
        let scratch = Box::new(Scratch::new(&params, names, &window));
        Ok(Self { params, names, window, model, scale, initial, first_colors, baseline, scratch })
    }
}

/// The target's cells of gradients.
fn support(params: &ContinuousParams, window: &SearchWindow) -> Support {
    let (width, height) = window.target_in_patch();
    let cell = params.window.cell_px.max(1);
    let cells = window.patch().width / cell;
    Support::middle((width / cell as f64, height / cell as f64), Size::new(cells, cells))
}

/// Not state: made from the parameters, and overwritten at every use.
#[derive(Debug, Clone)]
struct Scratch {
    view: View,
    at: Vec<(usize, isize)>,
    objective: Objective,
    learning: Learning,
    /// The sample of a window: coefficients.
    sample: Vec<Complex32>,
    /// Where that was: middle and scale.
    seen: Option<(Point, f64)>,
    /// The sample of the best of several sizes.
    best: Vec<Complex32>,
    turns: Vec<Complex32>,
    response: Response,
}

/// The response on a grid as fine as its finest coefficient needs.
#[derive(Debug, Clone)]
struct Response {
    coefficients: Vec<Complex32>,
    plan: RealFft2,
    fft: FftScratch,
    bins: Vec<Complex32>,
    plane: Vec<f32>,
}

impl Response {
    fn new(side: usize, coefficients: usize) -> Self {
        let plan = RealFft2::new(side, side);
        Self {
            coefficients: vec![Complex32::default(); coefficients],
            bins: vec![Complex32::default(); plan.spectrum_len()],
            plane: vec![0.0; side * side],
            fft: FftScratch::default(),
            plan,
        }
    }

    /// The values on the grid of the function whose coefficients are given.
    fn evaluate(&mut self, at: &[(usize, isize)]) {
        let (n, area) = (self.plan.size().width, self.plan.size().area() as f32);
        self.bins.fill(Complex32::default());
        for (&(u, v), c) in at.iter().zip(&self.coefficients) {
            self.bins[u * n + v.rem_euclid(n as isize) as usize] = c * area;
            if u == 0 && v != 0 {
                self.bins[(-v).rem_euclid(n as isize) as usize] = c.conj() * area;
            }
        }
        self.plan.inverse(&self.bins, &mut self.plane, &mut self.fft);
    }
}

impl Scratch {
    fn new(params: &ContinuousParams, names: bool, window: &SearchWindow) -> Self {
        let (side, target) = (window.patch().width, window.target_in_patch());
        let blocks = sample_blocks(params, names, side);
        let at = frequencies(&blocks.map(|b| b.order));
        let sigma = params.label_sigma * (target.0 * target.1).sqrt() / side as f64;
        let weight = SpatialWeight::new(&params.spatial_weight, target, side);
        let objective = Objective::new(blocks, &at, label(sigma, &at), &weight);
        let finest = params.window.cell_px.min(params.window.color_cell_px).max(1);
        Self {
            view: View::new(params, names, side, &at),
            learning: Learning::new(objective.len()),
            sample: vec![Complex32::default(); objective.len()],
            seen: None,
            best: vec![Complex32::default(); if params.ladder.levels > 0 { objective.len() } else { 0 }],
            turns: Vec::with_capacity(at.len()),
            response: Response::new(side / finest, at.len()),
            objective,
            at,
        }
    }
}

/// The peak of the response in which a look saw the target.
#[derive(Debug, Clone, Copy)]
pub struct ContinuousPeak {
    /// Where, in pixels.
    center: Point,
    /// How many times larger than at the start the target was taken to be.
    scale: f64,
    /// Height of the response's peak.
    height: f64,
    /// Middle and scale of the window looked at.
    window: (Point, f64),
}

impl ContinuousLocalizer {
    /// Starts on the target at `bbox`.
    pub fn new(params: &ContinuousParams, frame: &Frame, bbox: &BBox) -> Self {
        let names = frame.has_color();
        let window = SearchWindow::new(bbox, &params.window.shared(), params.window.unit_px());
        let mut scratch = Box::new(Scratch::new(params, names, &window));
        let first = window.window(bbox.center(), 1.0);
        let Scratch { view, objective, sample, learning, .. } = &mut *scratch;
        view.look(frame, &first);
        let mut model = Model::new(params, Vec::new(), objective.len());
        if params.compression.model == CompressionModel::Learned {
            let blocks = raw_blocks(params, names, window.patch().width);
            let mut raw = vec![Complex32::default(); len(&blocks)];
            view.raw(&blocks, &mut raw);
            let start = view.features().iter().zip(&objective.blocks);
            model.matrix = start.flat_map(|(planes, block)| principal_components(planes, block.channels)).collect();
            let (first, settings) =
                (FirstSample { blocks: &blocks, sample: &raw }, (&params.compression, &params.solver));
            factorised::learn(objective, &first, settings, &mut model.matrix, &mut model.filter.filter.0);
        }
        view.sample(&objective.blocks, &model.matrix, sample);
        model.learn(objective, params, sample, learning);
        let scale = (params.scale.scales > 1).then(|| {
            let mut filter = ScaleFilter::new(params.scale.clone(), bbox);
            filter.learn(frame, bbox);
            filter
        });
        let gradients = view.gradients();
        let initial =
            InitialTemplate::new(support(params, &window), gradients, gradients.channels(), Likeness::Correlation);
        let (first_colors, baseline) = (params.score.first_colors(frame, bbox), PeakBaseline::default());
        Self { params: params.clone(), names, window, model, scale, initial, first_colors, baseline, scratch }
    }

    /// Takes the sample of a window.
    fn take(&mut self, frame: &Frame, center: Point, scale: f64) {
        let Scratch { view, objective, sample, seen, .. } = &mut *self.scratch;
        view.look(frame, &self.window.window(center, scale));
        view.sample(&objective.blocks, &self.model.matrix, sample);
        *seen = Some((center, scale));
    }

    /// The filter's answer in the window about `center`, and what speaks for it.
    fn respond(&mut self, frame: &Frame, center: Point, scale: f64) -> Option<(ContinuousPeak, Evidence, f64)> {
        self.take(frame, center, scale);
        let Scratch { view, at, objective, sample, response, .. } = &mut *self.scratch;
        objective.respond(sample, &self.model.filter.filter.0, &mut response.coefficients);
        response.evaluate(at);
        let side = response.plan.size().width;
        let (x, y, height) = highest(&response.plane, side);
        if !height.is_finite() {
            return None;
        }
        let (right, down) = (signed_shift(x, side) as f64, signed_shift(y, side) as f64);
        let fine = newton_peak(&response.plan, &response.bins, right, down, self.params.newton_steps);
        let quality = peak_quality(&response.plane, side, SIDELOBE_SHARE);
        // In patch pixels, then in cells of gradients.
        let patch_px = self.window.patch().width as f64 / side as f64;
        let cell_px = self.params.window.cell_px.max(1) as f64;
        let cells = |steps: f64| (steps * patch_px / cell_px).round() as isize;
        let evidence = Evidence {
            peak: f64::from(height),
            psr: quality.psr,
            peak_ratio: self.baseline.ratio(f64::from(height)),
            likeness: self.initial.likeness(view.gradients(), cells(fine.x), cells(fine.y)),
            color: 0.5,
        };
        let px = patch_px * self.window.step(scale);
        let peak = ContinuousPeak {
            center: Point::new(center.x + fine.x * px, center.y + fine.y * px),
            scale,
            height: f64::from(height),
            window: (center, scale),
        };
        Some((peak, evidence, quality.apce))
    }

    /// The best answer of all sizes tried about `center`; what was seen then is the sample of that size.
    fn respond_at_sizes(
        &mut self,
        frame: &Frame,
        center: Point,
        scale: f64,
    ) -> Option<(ContinuousPeak, Evidence, f64)> {
        let (count, mut best, mut highest) = (self.params.ladder.count(), None, f64::NEG_INFINITY);
        for k in 0..count {
            let Some((factor, penalty)) = self.params.ladder.sizes().nth(k) else { break };
            let Some(found) = self.respond(frame, center, self.window.within_bounds(scale * factor)) else { continue };
            if penalty * found.0.height > highest {
                highest = penalty * found.0.height;
                best = Some(found);
                if count > 1 {
                    std::mem::swap(&mut self.scratch.sample, &mut self.scratch.best);
                }
            }
        }
        if count > 1 {
            std::mem::swap(&mut self.scratch.sample, &mut self.scratch.best);
            self.scratch.seen = best.as_ref().map(|(peak, ..)| peak.window);
        }
        best
    }

    /// Learns what the target looks like at `bbox`, which was seen in the window about a point at a scale.
    fn learn(&mut self, frame: &Frame, bbox: &BBox, (center, scale): (Point, f64)) {
        let side = self.window.patch().width as f64 * self.window.step(scale);
        let moved = ((bbox.center().x - center.x) / side, (bbox.center().y - center.y) / side);
        // The sample that found the target is moved rather than taken anew, as far as it shows it.
        let shown = moved.0.abs() < 0.5 && moved.1.abs() < 0.5;
        let (center, scale, moved) =
            if shown { (center, scale, moved) } else { (bbox.center(), self.window.scale_of(bbox), (0.0, 0.0)) };
        if self.scratch.seen != Some((center, scale)) {
            self.take(frame, center, scale);
        }
        let Scratch { at, objective, learning, sample, seen, turns, .. } = &mut *self.scratch;
        *seen = None;
        shift(&objective.blocks, at, moved, sample, turns);
        self.model.learn(objective, &self.params, sample, learning);
        if let Some(filter) = &mut self.scale {
            filter.learn(frame, &self.window.bbox(bbox.center(), self.window.scale_of(bbox)));
        }
    }
}

impl Localizer for ContinuousLocalizer {
    type Finding = ContinuousPeak;

    const FIGURES: &[&[Figure]] = &[CorrelationFigures::ALL];

    fn locate(&mut self, frame: &Frame, search: &Search) -> Result<Option<(Measurement, ContinuousPeak)>> {
        let (center, scale) = (search.expected.center(), self.window.scale_of(&search.expected));
        let found = self.respond_at_sizes(frame, center, scale);
        let Some((found, evidence, apce)) = found else { return Ok(None) };
        let (score, bbox) = (&self.params.score, self.window.bbox(found.center, found.scale));
        let first_colors = self.first_colors.as_mut().map_or(0.0, |known| known.likeness(frame, &bbox));
        let log_odds = score.log_odds(&evidence) + score.first_colors * first_colors;
        let Evidence { peak, psr, peak_ratio, likeness, color } = evidence;
        let measurement = Measurement {
            strength: match score.sweep_by {
                SweepBy::Height => found.height,
                SweepBy::Score => log_odds,
            },
            psr: Some(psr),
            diagnostics: CorrelationFigures { peak, psr, apce, peak_ratio, likeness, color, first_colors }.into(),
            ..Measurement::new(bbox, sigmoid(log_odds))
        };
        Ok(Some((measurement, found)))
    }

    /// Measures the size by the filter along scale.
    fn refine(
        &mut self,
        frame: &Frame,
        search: &Search,
        measurement: &mut Measurement,
        finding: &mut ContinuousPeak,
    ) -> Result<()> {
        let Self { params, scale: filter, window, .. } = self;
        if let Some(filter) = filter
            && (search.look == Look::Near || params.scale.on_return)
        {
            if search.keep_inside {
                finding.center = inside(window.bbox(finding.center, finding.scale).center(), frame.size());
            }
            let bbox = window.bbox(finding.center, finding.scale);
            finding.scale = window.within_bounds(finding.scale * filter.locate(frame, &bbox));
            measurement.bbox = window.bbox(finding.center, finding.scale);
        }
        Ok(())
    }

    fn adapt(&mut self, frame: &Frame, bbox: BBox, finding: &ContinuousPeak) -> Result<()> {
        self.learn(frame, &bbox, finding.window);
        self.baseline.believe(finding.height, self.params.score.usual_rate);
        Ok(())
    }

    fn restart(&mut self, frame: &Frame, bbox: BBox) -> Result<()> {
        *self = Self::new(&self.params.clone(), frame, &bbox);
        Ok(())
    }

    fn view(&self, expected: &BBox) -> Option<ViewSize> {
        let region = self.window.window(expected.center(), self.window.scale_of(expected)).region();
        Some(ViewSize { width: region.width(), height: region.height() })
    }
}
