use super::filters::Filter;
use super::guide::Guide;
use super::params::{Subpixel, SweepBy};
use super::peaks::{Peaks, ResponsePeak};
use super::scale::ScaleFilter;
use super::score::{CorrelationFigures, Evidence, PeakBaseline, peak_quality};
use super::search_window::SearchWindow;
use super::spec::{CorrelationSpec, FirstSamples, in_cells};
use crate::appearance::{ColorHistogram, FirstColors, InitialTemplate, Support};
use crate::correlation::Likeness;
use crate::features::FeatureSet;
use pursuit_estimation::sigmoid;
use pursuit_geometry::{BBox, Point};
use pursuit_imaging::Frame;
use pursuit_tracking::search::inside;
use pursuit_tracking::{Figure, Figures, Localizer, Look, Measurement, Result, Search, ViewSize};
use pursuit_vision::fourier::{HannEnds, hann_plane, newton_peak, parabola_peak, signed_shift};
use pursuit_vision::sampling::{Planes, Window};
use serde::{Deserialize, Serialize};

/// Finds the target by correlation: features of a window, weighted by a Hann window, answered by a filter.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(try_from = "Raw")]
pub struct CorrelationLocalizer {
    pub(super) spec: CorrelationSpec,
    pub(super) window: SearchWindow,
    pub(super) filter: Filter,
    scale: Option<ScaleFilter>,
    colors: Option<ColorHistogram>,
    initial: InitialTemplate,
    /// Where they are part of the score.
    first_colors: Option<FirstColors>,
    baseline: PeakBaseline,
    /// The mask that says what the filter learns, where there is one.
    pub(super) guide: Option<Box<Guide>>,
    #[serde(skip)]
    pub(super) scratch: Scratch,
}

/// What is stored, before it is checked.
#[derive(Deserialize)]
struct Raw {
    spec: CorrelationSpec,
    window: SearchWindow,
    filter: Filter,
    scale: Option<ScaleFilter>,
    colors: Option<ColorHistogram>,
    initial: InitialTemplate,
    first_colors: Option<FirstColors>,
    baseline: PeakBaseline,
    guide: Option<Box<Guide>>,
}

impl TryFrom<Raw> for CorrelationLocalizer {
    type Error = &'static str;

    fn try_from(raw: Raw) -> Result<Self, Self::Error> {
        let Raw { spec, window, filter, scale, colors, initial, first_colors, baseline, guide } = raw;
        if !spec.is_sensible() {
            return Err("its settings are out of range");
        }
        let features = spec.make_features();
        if filter.shape() != (features.grid(window.patch()), features.channels()) {
            return Err("its filter is not made for its window");
        }
        if !initial.fits(support(&window, &features), template_channels(&spec, &features)) {
            return Err("its initial template does not fit its window");
        }
        if spec.color.is_some() != colors.is_some() || (colors.is_some() && features.patch().is_none()) {
            return Err("its colours do not fit its features");
        }
        if !spec.score.fits(first_colors.as_ref()) {
            return Err("its first colours do not fit its score");
        }
        let scratch = Scratch::new(features, &window);
        Ok(Self { spec, window, filter, scale, colors, initial, first_colors, baseline, guide, scratch })
    }
}

/// Not state: made from the spec, and overwritten at every use.
#[derive(Debug, Clone)]
pub(super) struct Scratch {
    pub(super) features: FeatureSet,
    hann: Vec<f32>,
    /// Features as they are.
    plain: Planes,
    /// Features under the Hann window.
    pub(super) windowed: Planes,
    response: Vec<f32>,
    peaks: Peaks,
}

impl Scratch {
    fn new(features: FeatureSet, window: &SearchWindow) -> Self {
        let grid = features.grid(window.patch());
        Self {
            // No cell is left out at the border.
            hann: hann_plane(grid.width, grid.height, HannEnds::HalfSample),
            plain: Planes::new(grid, features.channels()),
            windowed: Planes::new(grid, features.channels()),
            response: vec![0.0; grid.area()],
            peaks: Peaks::default(),
            features,
        }
    }

    /// Features of the window.
    pub(super) fn extract(&mut self, frame: &Frame, window: &Window) {
        self.features.extract(frame, window, &mut self.plain);
        for (plain, windowed) in self.plain.planes().zip(self.windowed.planes_mut()) {
            for ((out, v), h) in windowed.iter_mut().zip(plain).zip(&self.hann) {
                *out = v * h;
            }
        }
    }
}

/// The filter before it has learnt anything.
pub(super) fn untaught(spec: &CorrelationSpec, window: &SearchWindow, features: &FeatureSet) -> Filter {
    let target = in_cells(window.target_in_patch(), features.cell_px());
    spec.filter.make(features.grid(window.patch()), features.channels(), target, spec.label_sigma(target))
}

/// The target's cells.
fn support(window: &SearchWindow, features: &FeatureSet) -> Support {
    Support::middle(in_cells(window.target_in_patch(), features.cell_px()), features.grid(window.patch()))
}

/// The channels that the initial template is made of.
fn template_channels(spec: &CorrelationSpec, features: &FeatureSet) -> usize {
    match spec.score.likeness_by {
        Likeness::Cosine => features.gradient_channels(),
        Likeness::Correlation => features.channels(),
    }
}

/// The `k`-th first sample's window: 0 as it is, the others turned and resized by low-discrepancy amounts, which fill the
/// range more evenly than random ones and are the same in every run.
fn perturbed(window: Window, samples: &FirstSamples, k: usize) -> Window {
    if k == 0 {
        return window;
    }
    // Additive recurrences with the golden ratio and √2, in [−1, 1).
    let spread = |irrational: f64| 2.0 * (k as f64 * irrational).fract() - 1.0;
    let (turn, size) = (samples.turn_rad * spread(0.618_033_988_75), samples.resize * spread(std::f64::consts::SQRT_2));
    Window { step_x: window.step_x * (1.0 + size), step_y: window.step_y * (1.0 + size), ..window }.turned(turn)
}

impl CorrelationLocalizer {
    /// Starts on the target at `bbox`.
    pub fn new(spec: CorrelationSpec, frame: &Frame, bbox: &BBox) -> Self {
        let features = spec.make_features();
        let window = SearchWindow::new(bbox, &spec.window, features.cell_px());
        let (support, channels) = (support(&window, &features), template_channels(&spec, &features));
        let mut filter = untaught(&spec, &window, &features);
        let mut scratch = Scratch::new(features, &window);
        let first = window.window(bbox.center(), 1.0);
        for k in 0..spec.first_samples.count.max(1) {
            scratch.extract(frame, &perturbed(first, &spec.first_samples, k));
            // Running mean of all samples.
            filter.learn(&scratch.windowed, 1.0 / (k + 1) as f64);
        }
        if spec.first_samples.count > 1 {
            scratch.extract(frame, &first);
        }
        let mut colors = spec.color.clone().map(|params| ColorHistogram::new(window.target_in_patch(), params));
        if let (Some(colors), Some(patch)) = (&mut colors, scratch.features.patch()) {
            colors.learn(patch, true);
        }
        let scale = spec.scale.clone().filter(|s| s.scales > 1).map(|params| {
            let mut filter = ScaleFilter::new(params, bbox);
            filter.learn(frame, bbox);
            filter
        });
        let initial = InitialTemplate::new(support, &scratch.plain, channels, spec.score.likeness_by);
        let first_colors = spec.score.first_colors(frame, bbox);
        let baseline = PeakBaseline::default();
        Self { spec, window, filter, scale, colors, initial, first_colors, baseline, guide: None, scratch }
    }

    /// The window searched.
    pub const fn window(&self) -> &SearchWindow {
        &self.window
    }

    /// The filter.
    pub const fn filter(&self) -> &Filter {
        &self.filter
    }

    /// The filter's answer in the window about `center`: the likeliest of its peaks.
    fn respond(&mut self, frame: &Frame, center: Point, scale: f64) -> Option<ResponsePeak> {
        let Self { spec, window, filter, colors, initial, baseline, scratch, .. } = self;
        scratch.extract(frame, &window.window(center, scale));
        let Scratch { features, plain, windowed, response, peaks, .. } = scratch;
        filter.respond(windowed, response);
        let (size, cell_px) = (plain.size(), features.cell_px());
        if let (Some(colors), Some(patch)) = (&mut *colors, features.patch())
            && colors.params().share > 0.0
        {
            colors.blend_response(patch, cell_px, size, response);
        }
        let quality = peak_quality(response, size.width, spec.peaks.sidelobe_share);
        let cell = window.step(scale) * cell_px as f64;
        let mut best: Option<ResponsePeak> = None;
        for (x, y, height) in peaks.find(response, size.width, &spec.peaks) {
            let (right, down) = (signed_shift(x, size.width), signed_shift(y, size.height));
            let (dx, dy) = match spec.peaks.subpixel {
                Subpixel::Parabola => {
                    let fine = parabola_peak(response, size.width, x, y);
                    (right as f64 + fine.x - x as f64, down as f64 + fine.y - y as f64)
                }
                Subpixel::Series => {
                    let (plan, series) = filter.series();
                    let fine = newton_peak(plan, series, right as f64, down as f64, spec.peaks.newton_steps);
                    (fine.x, fine.y)
                }
            };
            let (right, down) = (dx.round() as isize, dy.round() as isize);
            let pixels = |cells: isize| (cells * cell_px as isize) as f64;
            let seen_colors = colors.as_ref().filter(|_| spec.score.color != 0.0).zip(features.patch());
            let peak = f64::from(height) * filter.peak_unit();
            let evidence = Evidence {
                peak,
                psr: quality.psr,
                peak_ratio: baseline.ratio(peak),
                likeness: initial.likeness(plain, right, down),
                color: seen_colors.map_or(0.5, |(c, patch)| c.likelihood(patch, (pixels(right), pixels(down)))),
            };
            let log_odds = spec.score.log_odds(&evidence);
            if best.is_none_or(|b| log_odds > b.log_odds) {
                let center = Point::new(center.x + dx * cell, center.y + dy * cell);
                let height = f64::from(height);
                best = Some(ResponsePeak { center, scale, height, apce: quality.apce, evidence, log_odds });
            }
        }
        best
    }

    /// What speaks for the target being inside `bbox`: the best of the response within a quarter of its side of the middle.
    pub fn evidence_at(&mut self, frame: &Frame, bbox: &BBox) -> Evidence {
        let Self { spec, window, filter, colors, initial, baseline, scratch, .. } = self;
        scratch.extract(frame, &window.window(bbox.center(), window.scale_of(bbox)));
        let Scratch { features, plain, windowed, response, .. } = scratch;
        filter.respond(windowed, response);
        let (size, cell_px) = (plain.size(), features.cell_px());
        let (wide, high) = in_cells(window.target_in_patch(), cell_px);
        let reach =
            ((0.25 * (wide * high).sqrt()).round() as isize).clamp(1, size.width.min(size.height) as isize / 2 - 1);
        let (mut dx, mut dy, mut highest) = (0, 0, f32::NEG_INFINITY);
        for y in -reach..=reach {
            let row = y.rem_euclid(size.height as isize) as usize * size.width;
            for x in -reach..=reach {
                let value = response[row + x.rem_euclid(size.width as isize) as usize];
                if value > highest {
                    (dx, dy, highest) = (x, y, value);
                }
            }
        }
        let pixels = |cells: isize| (cells * cell_px as isize) as f64;
        let seen_colors = colors.as_mut().filter(|_| spec.score.color != 0.0).zip(features.patch());
        let peak = f64::from(highest) * filter.peak_unit();
        Evidence {
            peak,
            psr: peak_quality(response, size.width, spec.peaks.sidelobe_share).psr,
            peak_ratio: baseline.ratio(peak),
            likeness: initial.likeness(plain, dx, dy),
            color: seen_colors.map_or(0.5, |(c, patch)| c.likelihood(patch, (pixels(dx), pixels(dy)))),
        }
    }

    /// The likeliest place near the target that was at `expected`, at its size.
    pub fn sight(&mut self, frame: &Frame, expected: &BBox) -> Option<ResponsePeak> {
        let (center, scale) = (expected.center(), self.window.scale_of(expected));
        self.respond(frame, center, scale)
    }

    /// The scale at `center`, measured by the filter along scale and by the mask, where there are any.
    ///
    /// # Errors
    /// When the mask that guides it cannot be made.
    pub fn scale_at(&mut self, frame: &Frame, center: Point, scale: f64) -> Result<f64> {
        let scale = self.scale.as_mut().map_or(scale, |filter| {
            self.window.within_bounds(scale * filter.locate(frame, &self.window.bbox(center, scale)))
        });
        self.guided_scale(frame, center, scale)
    }

    /// The best of all sizes tried at one place.
    fn respond_at_sizes(&mut self, frame: &Frame, center: Point, scale: f64) -> Option<ResponsePeak> {
        let mut best: Option<(f64, ResponsePeak)> = None;
        for k in 0..self.spec.ladder.count() {
            let Some((factor, penalty)) = self.spec.ladder.sizes().nth(k) else { break };
            let Some(found) = self.respond(frame, center, scale * factor) else { continue };
            let value = penalty * found.height;
            if best.as_ref().is_none_or(|(v, _)| value > *v) {
                best = Some((value, found));
            }
        }
        best.map(|(_, found)| found)
    }
}

impl CorrelationLocalizer {
    /// Learns what the target looks like at `bbox`, where the response's peak was `peak` high.
    ///
    /// # Errors
    /// When the mask that guides it cannot be made.
    pub fn learn(&mut self, frame: &Frame, bbox: &BBox, peak: f64) -> Result<()> {
        self.confine(frame, bbox)?;
        let Self { spec, window, filter, scale, colors, scratch, .. } = self;
        let (center, size) = (bbox.center(), window.scale_of(bbox));
        scratch.extract(frame, &window.window(center, size));
        filter.learn(&scratch.windowed, spec.learning_rate);
        if let (Some(colors), Some(patch)) = (colors, scratch.features.patch()) {
            colors.learn(patch, false);
        }
        if let Some(filter) = scale {
            filter.learn(frame, &window.bbox(center, size));
        }
        self.baseline.believe(peak, spec.score.usual_rate);
        Ok(())
    }

    /// The middle of what `search` found at this `peak`: exact, unless it was moved into the frame.
    pub fn middle(&self, frame: &Frame, search: &Search, peak: &ResponsePeak) -> Point {
        if search.keep_inside {
            inside(self.window.bbox(peak.center, peak.scale).center(), frame.size())
        } else {
            peak.center
        }
    }
}

impl Localizer for CorrelationLocalizer {
    type Finding = ResponsePeak;

    const FIGURES: &[&[Figure]] = &[CorrelationFigures::ALL];

    fn locate(&mut self, frame: &Frame, search: &Search) -> Result<Option<(Measurement, ResponsePeak)>> {
        let (center, scale) = (search.expected.center(), self.window.scale_of(&search.expected));
        let found = match search.look {
            Look::Near => self.respond_at_sizes(frame, center, scale),
            Look::Sweep | Look::Centred => self.respond(frame, center, scale),
        };
        let Some(mut found) = found else { return Ok(None) };
        let bbox = self.window.bbox(found.center, found.scale);
        let first_colors = self.first_colors.as_mut().map_or(0.0, |known| known.likeness(frame, &bbox));
        found.log_odds += self.spec.score.first_colors * first_colors;
        let Evidence { peak, psr, peak_ratio, likeness, color } = found.evidence;
        let apce = found.apce;
        let measurement = Measurement {
            strength: match self.spec.score.sweep_by {
                SweepBy::Height => found.height,
                SweepBy::Score => found.log_odds,
            },
            psr: Some(psr),
            diagnostics: CorrelationFigures { peak, psr, apce, peak_ratio, likeness, color, first_colors }.into(),
            ..Measurement::new(bbox, sigmoid(found.log_odds))
        };
        Ok(Some((measurement, found)))
    }

    /// Measures the size by the filter along scale, and by the mask.
    fn refine(
        &mut self,
        frame: &Frame,
        search: &Search,
        measurement: &mut Measurement,
        finding: &mut ResponsePeak,
    ) -> Result<()> {
        let near = search.look == Look::Near;
        let by_mask = near && self.guide.as_ref().is_some_and(|guide| guide.sizes());
        if by_mask || self.spec.scale.as_ref().is_some_and(|params| near || params.on_return) {
            finding.center = self.middle(frame, search, finding);
            finding.scale = self.scale_at(frame, finding.center, finding.scale)?;
            measurement.bbox = self.window.bbox(finding.center, finding.scale);
        }
        Ok(())
    }

    fn adapt(&mut self, frame: &Frame, bbox: BBox, finding: &ResponsePeak) -> Result<()> {
        self.learn(frame, &bbox, finding.evidence.peak)
    }

    fn restart(&mut self, frame: &Frame, bbox: BBox) -> Result<()> {
        let mut spec = self.spec.clone();
        spec.features = spec.features.on(frame);
        let guide = self.guide.take();
        *self = Self::new(spec, frame, &bbox);
        guide.map_or(Ok(()), |guide| self.restart_guide(*guide, frame, bbox))
    }

    fn view(&self, expected: &BBox) -> Option<ViewSize> {
        let region = self.window.window(expected.center(), self.window.scale_of(expected)).region();
        Some(ViewSize { width: region.width(), height: region.height() })
    }
}
