use super::{
    Calibration, Evidence, Features, FirstView, Likeness, PeakQuality, ResponsePeak, Support, Template, UsualPeak,
};
use crate::scale::{ScaleFilter, ScaleSettings};
use crate::{Diagnostics, Localizer, Measurement, Search};
use pursuit_geometry::{BBox, Point, Size};
use pursuit_imaging::Frame;
use pursuit_vision::sampling::{Planes, Window};
use serde::{Deserialize, Serialize};

/// What a filter is shown of a window.
#[derive(Debug, Clone, Copy)]
pub struct Seen<'a> {
    /// Features, weighted by the Hann window.
    pub features: &'a Planes,
    /// The pixels they were made of, values 0–255, where the features keep them.
    pub patch: Option<&'a Planes>,
}

/// A filter that answers a window's features with a plane whose peak is the target's displacement.
pub trait ResponseFilter: Clone + Send {
    /// The response to what is seen; `response` has one entry for each cell, the first one means no displacement.
    fn respond(&mut self, seen: Seen<'_>, response: &mut [f32]);

    /// Learns what is seen, centred on the target, `rate` (0–1) new and the rest as before; 1 forgets everything.
    fn learn(&mut self, seen: Seen<'_>, rate: f64);

    /// The peak of the last response between the cells, where the filter can tell better than the parabola through them.
    fn refine(&self, peak: ResponsePeak) -> ResponsePeak {
        peak
    }

    /// Makes plans and scratch anew after a saved state has been read.
    ///
    /// # Errors
    /// What does not fit a grid of `grid` cells and `channels` channels.
    fn revive(&mut self, grid: Size, channels: usize) -> Result<(), String>;
}

/// What a correlation tracker is made of: a small value, saved with the tracker.
pub trait Assembly: Clone + Send {
    /// Features of a window.
    type Features: Features;
    /// The filter on them.
    type Filter: ResponseFilter;

    /// The template for a target that starts as large as `bbox`.
    fn template(&self, bbox: &BBox) -> Template;

    /// The features.
    fn features(&self) -> Self::Features;

    /// An untaught filter for the grid of `template`'s patch.
    fn filter(&self, template: &Template, grid: Size) -> Self::Filter;

    /// The filter along scale, where sizes are not simply tried.
    fn scale_filter(&self) -> Option<ScaleSettings> {
        None
    }

    /// How to search and learn.
    fn settings(&self) -> &SearchSettings;
}

/// How a correlation localizer searches and learns.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SearchSettings {
    /// Sizes tried relative to the last one; 1 first.
    pub scale_factors: Vec<f64>,
    /// What the responses of all sizes but the last one are multiplied by.
    pub scale_penalty: f64,
    /// How much of a change of size is believed, 0–1.
    pub scale_gain: f64,
    /// Share of the new appearance in the model, per update.
    pub learning_rate: f64,
    /// Windows looked at per frame while searching all over.
    pub wide_windows: usize,
    /// First samples: the target as it is, and turned and resized a little at random (bolme2010, section 3.3). At least 1.
    pub first_samples: usize,
    /// How figures of the response become a probability.
    pub calibration: Calibration,
}

impl SearchSettings {
    /// The last size first, then `levels` sizes on either side of it, each `step` times the next smaller.
    pub fn scale_ladder(step: f64, levels: usize) -> Vec<f64> {
        let exponents = std::iter::once(0).chain((1..=levels as i32).flat_map(|k| [-k, k]));
        exponents.map(|k| step.powi(k)).collect()
    }
}

/// Finds the target by correlation: features of a window, weighted by a Hann window, answered by a filter, over a few sizes.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(bound(
    serialize = "A: Serialize, A::Filter: Serialize",
    deserialize = "A: Deserialize<'de>, A::Filter: Deserialize<'de>"
))]
pub struct CorrelationLocalizer<A: Assembly> {
    assembly: A,
    template: Template,
    filter: A::Filter,
    scale_filter: Option<ScaleFilter>,
    /// Where the search all over goes on.
    wide_cursor: usize,
    first_view: FirstView,
    usual_peak: UsualPeak,
    #[serde(skip)]
    scratch: Option<Scratch<A::Features>>,
}

/// Not state: made from the assembly, and overwritten at every use.
#[derive(Debug, Clone)]
struct Scratch<F> {
    features: F,
    hann: Vec<f32>,
    /// Features as they are.
    plain: Planes,
    /// Features under the Hann window.
    windowed: Planes,
    response: Vec<f32>,
}

impl<F: Features> Scratch<F> {
    fn new(features: F, patch: Size) -> Self {
        let grid = features.grid(patch);
        let sine = |i: usize, n: usize| (std::f64::consts::PI * (i as f64 + 0.5) / n as f64).sin();
        let hann = |y, x| (sine(y, grid.height) * sine(x, grid.width)).powi(2) as f32;
        Self {
            hann: (0..grid.height).flat_map(|y| (0..grid.width).map(move |x| hann(y, x))).collect(),
            plain: Planes::new(grid, features.channels()),
            windowed: Planes::new(grid, features.channels()),
            response: vec![0.0; grid.area()],
            features,
        }
    }

    /// What was extracted last.
    fn seen(&self) -> Seen<'_> {
        Seen { features: &self.windowed, patch: self.features.patch() }
    }

    /// Features of the window.
    fn extract(&mut self, frame: &Frame, window: &Window) {
        self.features.extract(frame, window, &mut self.plain);
        for (plain, windowed) in self.plain.planes().zip(self.windowed.planes_mut()) {
            let weighted = plain.iter().zip(&self.hann).map(|(v, h)| v * h);
            windowed.iter_mut().zip(weighted).for_each(|(out, v)| *out = v);
        }
    }
}

#[derive(Debug, Clone, Copy)]
struct Candidate {
    center: Point,
    scale: f64,
    value: f64,
    quality: PeakQuality,
    /// Likeness to the first view.
    likeness: f64,
}

/// The target's cells.
fn support(template: &Template, features: &impl Features) -> Support {
    let ((width, height), cell) = (template.target_in_patch(), features.cell_px() as f64);
    Support::middle((width / cell, height / cell), features.grid(template.patch()))
}

/// Largest turn, radians, and change of size of a first sample.
const WARP: (f64, f64) = (0.1, 0.1);

/// The `k`-th first sample's window: 0 as it is, the others turned and resized by low-discrepancy amounts, which fill the
/// range more evenly than random ones and are the same in every run.
fn perturbed(window: Window, k: usize) -> Window {
    if k == 0 {
        return window;
    }
    // Additive recurrences with the golden ratio and √2, in [−1, 1).
    let spread = |irrational: f64| 2.0 * (k as f64 * irrational).fract() - 1.0;
    let (turn, size) = (WARP.0 * spread(0.618_033_988_75), WARP.1 * spread(std::f64::consts::SQRT_2));
    Window { step_x: window.step_x * (1.0 + size), step_y: window.step_y * (1.0 + size), ..window }.turned(turn)
}

impl<A: Assembly> CorrelationLocalizer<A> {
    /// Starts on the target at `bbox`.
    pub fn new(assembly: A, frame: &Frame, bbox: &BBox) -> Self {
        let template = assembly.template(bbox);
        let mut scratch = Scratch::new(assembly.features(), template.patch());
        let mut filter = assembly.filter(&template, scratch.plain.size());
        let window = template.window(bbox.center(), 1.0);
        for k in 0..assembly.settings().first_samples.max(1) {
            scratch.extract(frame, &perturbed(window, k));
            // Running mean of all samples.
            filter.learn(scratch.seen(), 1.0 / (k + 1) as f64);
        }
        scratch.extract(frame, &window);
        let first_view = FirstView::new(
            support(&template, &scratch.features),
            &scratch.plain,
            scratch.plain.channels(),
            Likeness::Correlation,
        );
        let scale_filter = assembly.scale_filter().map(|settings| {
            let mut filter = ScaleFilter::new(settings, bbox);
            filter.learn(frame, bbox);
            filter
        });
        Self {
            assembly,
            template,
            filter,
            scale_filter,
            wide_cursor: 0,
            first_view,
            usual_peak: UsualPeak::default(),
            scratch: Some(scratch),
        }
    }

    /// The template.
    pub const fn template(&self) -> &Template {
        &self.template
    }

    /// The filter.
    pub const fn filter(&self) -> &A::Filter {
        &self.filter
    }

    /// Makes plans and scratch anew after a saved state has been read.
    ///
    /// # Errors
    /// What does not hold together in the state.
    pub fn revive(&mut self) -> Result<(), String> {
        if !self.template.is_sensible() {
            return Err("its template has a size that cannot be".into());
        }
        let features = self.assembly.features();
        if let Some(scale_filter) = &mut self.scale_filter {
            scale_filter.revive()?;
        }
        self.first_view.check(support(&self.template, &features), features.channels())?;
        self.filter.revive(features.grid(self.template.patch()), features.channels())?;
        self.scratch = Some(Scratch::new(features, self.template.patch()));
        Ok(())
    }

    fn respond(&mut self, frame: &Frame, center: Point, scale: f64) -> Option<Candidate> {
        let Self { assembly, template, filter, first_view, scratch, .. } = self;
        let scratch = scratch.get_or_insert_with(|| Scratch::new(assembly.features(), template.patch()));
        scratch.extract(frame, &template.window(center, scale));
        let Scratch { features, plain, windowed, response, .. } = &mut *scratch;
        filter.respond(Seen { features: windowed, patch: features.patch() }, response);
        let width = plain.size().width;
        let peak = filter.refine(ResponsePeak::of(response, width)?);
        let cell = template.step(scale) * features.cell_px() as f64;
        Some(Candidate {
            center: Point::new(center.x + peak.dx * cell, center.y + peak.dy * cell),
            scale,
            value: peak.value,
            quality: PeakQuality::of(response, width),
            likeness: first_view.likeness(plain, peak.dx.round() as isize, peak.dy.round() as isize),
        })
    }

    fn learn(&mut self, frame: &Frame, bbox: &BBox, rate: f64) {
        let Self { assembly, template, filter, scale_filter, scratch, .. } = self;
        let scratch = scratch.get_or_insert_with(|| Scratch::new(assembly.features(), template.patch()));
        let scale = template.scale_of(bbox);
        scratch.extract(frame, &template.window(bbox.center(), scale));
        filter.learn(scratch.seen(), rate);
        if let Some(filter) = scale_filter {
            filter.learn(frame, &template.bbox(bbox.center(), scale));
        }
    }

    /// The best of all sizes at one place.
    fn search_near(&mut self, frame: &Frame, center: Point, scale: f64) -> Option<Candidate> {
        let mut best: Option<(f64, Candidate)> = None;
        for k in 0..self.assembly.settings().scale_factors.len() {
            let settings = self.assembly.settings();
            let (factor, penalty) = (settings.scale_factors[k], settings.scale_penalty);
            let penalty = if factor == 1.0 { 1.0 } else { penalty };
            let Some(found) = self.respond(frame, center, scale * factor) else { continue };
            let value = penalty * found.value;
            if best.as_ref().is_none_or(|(v, _)| value > *v) {
                best = Some((value, found));
            }
        }
        let (_, mut found) = best?;
        found.scale = scale * (found.scale / scale).powf(self.assembly.settings().scale_gain);
        if let Some(filter) = &mut self.scale_filter {
            found.scale *= filter.locate(frame, &self.template.bbox(found.center, found.scale));
        }
        Some(found)
    }

    /// The best of some windows over `region`, going on where the last call stopped.
    fn search_wide(&mut self, frame: &Frame, region: &BBox, scale: f64) -> Option<Candidate> {
        let window = self.template.window(region.center(), scale).region();
        let count = |whole: f64, part: f64| ((2.0 * whole / part).ceil() as usize).clamp(1, 256);
        let (columns, rows) = (count(region.width(), window.width()), count(region.height(), window.height()));
        let mut best: Option<Candidate> = None;
        for _ in 0..self.assembly.settings().wide_windows.min(columns * rows) {
            self.wide_cursor = (self.wide_cursor + 1) % (columns * rows);
            let (i, j) = (self.wide_cursor / columns, self.wide_cursor % columns);
            let center = Point::new(
                region.left() + (j as f64 + 0.5) / columns as f64 * region.width(),
                region.top() + (i as f64 + 0.5) / rows as f64 * region.height(),
            );
            if let Some(found) = self.respond(frame, center, scale)
                && best.is_none_or(|b| found.value > b.value)
            {
                best = Some(found);
            }
        }
        // A second look, centred: what lies at a window's edge is weakened by the Hann window.
        let rough = best?;
        self.respond(frame, rough.center, scale)
    }
}

impl<A: Assembly> Localizer for CorrelationLocalizer<A> {
    fn locate(&mut self, frame: &Frame, search: &Search) -> crate::Result<Option<Measurement>> {
        let scale = self.template.scale_of(&search.expected);
        let found = if search.wide {
            self.search_wide(frame, &search.region, scale)
        } else {
            self.search_near(frame, search.expected.center(), scale)
        };
        Ok(found.map(|Candidate { center, scale, quality, likeness, .. }| {
            let peak_ratio = self.usual_peak.ratio(quality.peak);
            let evidence = Evidence { quality, peak_ratio, first_view: likeness };
            Measurement {
                bbox: self.template.bbox(center, scale),
                confidence: self.assembly.settings().calibration.probability(&evidence),
                sigma_px: None,
                diagnostics: Diagnostics::default()
                    .with("peak", quality.peak)
                    .with("psr", quality.psr)
                    .with("apce", quality.apce)
                    .with("peak_ratio", peak_ratio)
                    .with("first_likeness", likeness),
            }
        }))
    }

    fn adapt(&mut self, frame: &Frame, bbox: BBox) -> crate::Result<()> {
        self.learn(frame, &bbox, self.assembly.settings().learning_rate);
        self.usual_peak.believe();
        Ok(())
    }

    fn restart(&mut self, frame: &Frame, bbox: BBox) -> crate::Result<()> {
        *self = Self::new(self.assembly.clone(), frame, &bbox);
        Ok(())
    }
}
