use super::scratch::Scratch;
use crate::correlation::{FirstView, Likeness, PeakQuality, ResponseFilter, Seen, Template};
use crate::regularised::{RegularisedFilter, SolverSettings};
use crate::scale::{ScaleFilter, ScaleSettings};
use crate::staple::ColorModel;
use crate::{Diagnostics, Localizer, Measurement, Result, Search};
use pursuit_geometry::{BBox, Point};
use pursuit_imaging::Frame;
use pursuit_vision::fourier::{newton_peak, signed_shift};
use serde::{Deserialize, Serialize};

/// How the localizer of `pursuit` searches, learns and judges itself; see [`PursuitParams`](super::PursuitParams).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PursuitSettings {
    /// Whether colour is used.
    pub color: bool,
    /// Side of the window as a multiple of the target's.
    pub search: f64,
    /// Cells along a side of the window.
    pub cells: usize,
    /// Side of a cell in patch pixels.
    pub cell_px: usize,
    /// Standard deviation of the label as a share of the target's side.
    pub label_sigma: f64,
    /// Share of the new sample per frame.
    pub learning_rate: f64,
    /// The filter's solver.
    pub solver: SolverSettings,
    /// The scale filter.
    pub scale: ScaleSettings,
    /// Sides, in pixels, of targets whose changes of size are not believed at all and of those where they are in full.
    pub size_trust_px: (f64, f64),
    /// Peaks of a response that are looked at.
    pub candidates: usize,
    /// Least height of a further peak as a share of the highest.
    pub runner_up: f64,
    /// Share of the box left out on each side when its colours are learned.
    pub color_inner_margin: f64,
    /// Share of the new colours per frame.
    pub color_learning_rate: f64,
    /// Windows looked at per frame while searching all over.
    pub wide_windows: usize,
    /// Windows looked at elsewhere per frame while unsure of what is followed.
    pub side_windows: usize,
    /// From this probability on it is sure.
    pub sure_from: f64,
    /// How far the prediction moves the search, as a share.
    pub lead: f64,
    /// Logistic regression of success.
    pub judgement: Judgement,
}

impl PursuitSettings {
    /// How much of a change of size is believed, `[0, 1]`: of a target of a few pixels, a step of the scale filter is a small
    /// part of one.
    fn size_trust(&self, bbox: &BBox) -> f64 {
        let (none, all) = self.size_trust_px;
        ((bbox.area().sqrt() - none) / (all - none)).clamp(0.0, 1.0)
    }
}

/// Weights of the logistic regression that makes the score of what is seen.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Judgement {
    /// Constant.
    pub bias: f64,
    /// Of ln of the response's peak, which is 1 at most for a filter that fits.
    pub peak: f64,
    /// Of the likeness to the first view.
    pub likeness: f64,
    /// Of ln of the mean likelihood of the colours in the box.
    pub color: f64,
}

/// Finds the target by a background-aware filter and a scale filter, and remembers how it looked.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct PursuitLocalizer {
    settings: PursuitSettings,
    template: Template,
    filter: RegularisedFilter,
    scale: ScaleFilter,
    colors: ColorModel,
    first: FirstView,
    last: BBox,
    /// ln of p / (1 − p) of what was seen last.
    latest: f64,
    wide_cursor: usize,
    #[serde(skip)]
    scratch: Option<Box<Scratch>>,
}

fn ln(v: f64) -> f64 {
    v.max(1e-6).ln()
}

fn log_odds(probability: f64) -> f64 {
    ln(probability) - ln(1.0 - probability)
}

/// What one window gave.
#[derive(Debug, Clone, Copy)]
struct Candidate {
    center: Point,
    quality: PeakQuality,
    likeness: f64,
    color: f64,
    /// ln of p / (1 − p) of the probability p that this is the target.
    log_odds: f64,
}

impl Judgement {
    fn log_odds(&self, seen: &Candidate) -> f64 {
        self.bias + self.peak * ln(seen.quality.peak) + self.likeness * seen.likeness + self.color * ln(seen.color)
    }
}

impl PursuitLocalizer {
    /// Starts on the target at `bbox`.
    pub fn new(settings: PursuitSettings, frame: &Frame, bbox: &BBox) -> Self {
        let template = Template::square(bbox, settings.search, settings.cell_px, settings.cells);
        let mut scratch = Scratch::new(settings.cell_px, settings.color, template.patch());
        scratch.extract(frame, &template.window(bbox.center(), template.scale_of(bbox)));
        let (width, height) = template.target_in_patch();
        let (width, height) = (width / settings.cell_px as f64, height / settings.cell_px as f64);
        let sigma = settings.label_sigma * (width * height).sqrt();
        let (grid, channels) = (scratch.grid(), scratch.channels());
        let filter = RegularisedFilter::new(settings.solver, grid, channels, (width, height), sigma);
        let mut localizer = Self {
            first: FirstView::new(
                filter.support(),
                &scratch.plain,
                scratch.features.gradient_channels(),
                Likeness::Cosine,
            ),
            scale: ScaleFilter::new(settings.scale, bbox),
            colors: ColorModel::new(template.target_in_patch(), settings.color_inner_margin),
            settings,
            template,
            filter,
            last: *bbox,
            latest: f64::INFINITY,
            wide_cursor: 0,
            scratch: Some(Box::new(scratch)),
        };
        localizer.learn(frame, bbox, 1.0);
        localizer
    }

    /// Makes plans and scratch anew after a saved state has been read.
    ///
    /// # Errors
    /// What does not hold together in the state.
    pub fn revive(&mut self) -> Result<(), String> {
        let s = &self.settings;
        let sensible = (2..=16).contains(&s.cell_px) && self.template.is_sensible() && self.last.is_finite();
        if !sensible || self.template.patch().area() > 1 << 20 {
            return Err("its template has a size that cannot be".into());
        }
        let scratch = Scratch::new(s.cell_px, s.color, self.template.patch());
        self.filter.revive(scratch.grid(), scratch.channels())?;
        self.first.check(self.filter.support(), scratch.features.gradient_channels())?;
        if !self.colors.is_consistent() {
            return Err("its colour histograms do not have the right size".into());
        }
        self.scale.revive()?;
        self.scratch = Some(Box::new(scratch));
        Ok(())
    }

    /// The filter's answer in the window about `center`.
    fn respond(&mut self, frame: &Frame, center: Point, scale: f64) -> Option<Candidate> {
        let Self { settings, template, filter, colors, first, scratch, .. } = self;
        let scratch =
            scratch.get_or_insert_with(|| Box::new(Scratch::new(settings.cell_px, settings.color, template.patch())));
        scratch.extract(frame, &template.window(center, scale));
        let Scratch { features, plain, windowed, response, peaks, .. } = &mut **scratch;
        let size = plain.size();
        // The filter is made for a label whose energy does not depend on the grid.
        let unit = (size.area() as f64).sqrt();
        let cell = template.step(scale) * settings.cell_px as f64;
        let judgement = &settings.judgement;
        filter.respond_with(windowed, response, |response, plan, spectrum| {
            let quality = PeakQuality::of(response, size.width);
            let mut best: Option<Candidate> = None;
            for (x, y, value) in peaks.find(response, size.width, settings.candidates, settings.runner_up) {
                let fine = newton_peak(plan, spectrum, x as f64, y as f64, NEWTON_STEPS);
                let (dx, dy) = (signed_shift(x, size.width), signed_shift(y, size.height));
                let moved = |whole: isize, fine: f64, at: usize| (whole as f64 + fine - at as f64) * cell;
                let pixels = |cells: isize| (cells * settings.cell_px as isize) as f64;
                let mut found = Candidate {
                    center: Point::new(center.x + moved(dx, fine.x, x), center.y + moved(dy, fine.y, y)),
                    quality: PeakQuality { peak: f64::from(value) * unit, ..quality },
                    likeness: first.likeness(plain, dx, dy),
                    color: colors.likelihood(features.patch(), (pixels(dx), pixels(dy))),
                    log_odds: f64::NEG_INFINITY,
                };
                found.log_odds = judgement.log_odds(&found);
                if best.is_none_or(|b| found.log_odds > b.log_odds) {
                    best = Some(found);
                }
            }
            best
        })
    }

    /// Looks at `windows` windows over `region`, going on where the last call stopped, and again at the best.
    fn respond_wide(&mut self, frame: &Frame, region: &BBox, scale: f64, windows: usize) -> Option<Candidate> {
        let window = self.template.window(region.center(), scale).region();
        // Windows overlap by half: what lies near the edge of one is weakened by the Hann window.
        let count = |whole: f64, part: f64| ((2.0 * whole / part).ceil() as usize).clamp(1, 64);
        let (columns, rows) = (count(region.width(), window.width()), count(region.height(), window.height()));
        let mut best: Option<Candidate> = None;
        for _ in 0..windows.min(columns * rows) {
            self.wide_cursor = (self.wide_cursor + 1) % (columns * rows);
            let share = |i: usize, n: usize| (i as f64 + 0.5) / n as f64;
            let center = Point::new(
                region.left() + share(self.wide_cursor % columns, columns) * region.width(),
                region.top() + share(self.wide_cursor / columns, rows) * region.height(),
            );
            if let Some(found) = self.respond(frame, center, scale)
                && best.is_none_or(|b| found.log_odds > b.log_odds)
            {
                best = Some(found);
            }
        }
        let rough = best?;
        self.respond(frame, rough.center, scale)
    }

    /// Looks near the last place; while it is not sure of what it follows, elsewhere as well, and believes that only if sure.
    fn respond_near(&mut self, frame: &Frame, center: Point, scale: f64) -> Option<Candidate> {
        let near = self.respond(frame, center, scale)?;
        let sure = log_odds(self.settings.sure_from);
        let unsure = near.log_odds < sure && self.latest < sure;
        self.latest = near.log_odds;
        if unsure
            && let Some(far) = self.respond_wide(frame, &frame.size().bounds(), scale, self.settings.side_windows)
            && far.log_odds >= sure
        {
            self.latest = far.log_odds;
            return Some(far);
        }
        Some(near)
    }

    fn learn(&mut self, frame: &Frame, bbox: &BBox, color_rate: f64) {
        let Self { settings, template, filter, scale, colors, scratch, .. } = self;
        let scratch =
            scratch.get_or_insert_with(|| Box::new(Scratch::new(settings.cell_px, settings.color, template.patch())));
        scratch.extract(frame, &template.window(bbox.center(), template.scale_of(bbox)));
        filter.learn(Seen { features: &scratch.windowed, patch: None }, settings.learning_rate);
        colors.learn(scratch.features.patch(), color_rate as f32);
        scale.learn(frame, bbox);
    }
}

/// Newton steps towards the peak between the cells, at most (danelljan2017eco: 5).
const NEWTON_STEPS: usize = 3;

impl Localizer for PursuitLocalizer {
    fn locate(&mut self, frame: &Frame, search: &Search) -> Result<Option<Measurement>> {
        let scale = self.template.scale_of(&search.expected);
        let found = if search.wide {
            self.respond_wide(frame, &search.region, scale, self.settings.wide_windows)
        } else {
            let (last, expected) = (self.last.center(), search.expected.center());
            let lead = self.settings.lead;
            let center = Point::new(last.x + lead * (expected.x - last.x), last.y + lead * (expected.y - last.y));
            self.respond_near(frame, center, scale)
        };
        let Some(found) = found else { return Ok(None) };
        let bounds = frame.size().bounds();
        let center = Point::new(found.center.x.clamp(0.0, bounds.right()), found.center.y.clamp(0.0, bounds.bottom()));
        let bbox = self.template.bbox(center, scale);
        let growth = self.scale.locate(frame, &bbox).powf(self.settings.size_trust(&bbox));
        let bbox = self.template.bbox(center, self.template.scale_of(&bbox.scaled(growth)));
        self.last = bbox;
        Ok(Some(Measurement {
            bbox,
            confidence: 1.0 / (1.0 + (-found.log_odds).exp()),
            sigma_px: None,
            diagnostics: Diagnostics::default()
                .with("peak", found.quality.peak)
                .with("psr", found.quality.psr)
                .with("apce", found.quality.apce)
                .with("likeness", found.likeness)
                .with("color", found.color),
        }))
    }

    fn adapt(&mut self, frame: &Frame, bbox: BBox) -> Result<()> {
        self.last = bbox;
        self.learn(frame, &bbox, self.settings.color_learning_rate);
        Ok(())
    }

    fn restart(&mut self, frame: &Frame, bbox: BBox) -> Result<()> {
        *self = Self::new(PursuitSettings { color: frame.has_color(), ..self.settings.clone() }, frame, &bbox);
        Ok(())
    }
}
