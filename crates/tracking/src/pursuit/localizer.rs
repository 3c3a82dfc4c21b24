use super::Memory;
use super::scratch::Scratch;
use crate::correlation::{PeakQuality, ResponseFilter, Seen, Template};
use crate::regularised::{RegularisedFilter, SolverSettings};
use crate::scale::{ScaleFilter, ScaleSettings};
use crate::{Diagnostics, Localizer, Measurement, Result, Search};
use pursuit_geometry::{BBox, Point};
use pursuit_imaging::Frame;
use pursuit_vision::fourier::{highest, newton_peak, signed_shift};
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
    /// Views remembered.
    pub views: usize,
    /// Frames learned from one remembered view to the next.
    pub view_every: usize,
    /// Windows looked at per frame while searching all over.
    pub wide_windows: usize,
    /// How far the prediction moves the search, as a share.
    pub lead: f64,
    /// Logistic regression of success on: constant, ln of the peak and ln of the PSR relative to what is usual, similarity
    /// with the best and with the first view.
    pub calibration: [f64; 5],
}

/// Finds the target by a background-aware filter and a scale filter, and remembers how it looked.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct PursuitLocalizer {
    settings: PursuitSettings,
    template: Template,
    filter: RegularisedFilter,
    scale: ScaleFilter,
    memory: Memory,
    last: BBox,
    learned: usize,
    usual: Usual,
    latest: Option<(f64, f64)>,
    wide_cursor: usize,
    #[serde(skip)]
    scratch: Option<Box<Scratch>>,
}

/// What responses to the target are usually like: how high peaks are depends on target and background.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
struct Usual {
    ln_peak: f64,
    ln_psr: f64,
    count: usize,
}

/// Share of a new response in what is usual, once it has been averaged over as many as that takes.
const USUAL_RATE: f64 = 0.03;

fn ln(v: f64) -> f64 {
    v.max(1e-6).ln()
}

impl Usual {
    fn add(&mut self, (ln_peak, ln_psr): (f64, f64)) {
        self.count += 1;
        let rate = (1.0 / self.count as f64).max(USUAL_RATE);
        self.ln_peak += rate * (ln_peak - self.ln_peak);
        self.ln_psr += rate * (ln_psr - self.ln_psr);
    }

    /// ln of peak and PSR relative to what is usual.
    fn relative(&self, quality: &PeakQuality) -> (f64, f64) {
        if self.count == 0 { (0.0, 0.0) } else { (ln(quality.peak) - self.ln_peak, ln(quality.psr) - self.ln_psr) }
    }
}

/// What one window gave.
#[derive(Debug, Clone, Copy)]
struct Candidate {
    center: Point,
    quality: PeakQuality,
    likeness: (f64, f64),
}

impl PursuitLocalizer {
    /// Starts on the target at `bbox`.
    pub fn new(settings: PursuitSettings, frame: &Frame, bbox: &BBox) -> Self {
        let template = Template::square(bbox, settings.search, settings.cell_px, settings.cells);
        let scratch = Scratch::new(settings.cell_px, settings.color, template.patch());
        let (width, height) = template.target_in_patch();
        let (width, height) = (width / settings.cell_px as f64, height / settings.cell_px as f64);
        let sigma = settings.label_sigma * (width * height).sqrt();
        let (grid, channels) = (scratch.grid(), scratch.channels());
        let filter = RegularisedFilter::new(settings.solver, grid, channels, (width, height), sigma);
        let mut localizer = Self {
            memory: Memory::new(filter.support(), grid, channels, settings.views),
            scale: ScaleFilter::new(settings.scale, bbox),
            settings,
            template,
            filter,
            last: *bbox,
            learned: 0,
            usual: Usual::default(),
            latest: None,
            wide_cursor: 0,
            scratch: Some(Box::new(scratch)),
        };
        localizer.learn(frame, bbox);
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
        self.memory.check(scratch.grid(), scratch.channels(), self.filter.support())?;
        self.scale.revive()?;
        self.scratch = Some(Box::new(scratch));
        Ok(())
    }

    /// The filter's answer in the window about `center`.
    fn respond(&mut self, frame: &Frame, center: Point, scale: f64) -> Option<Candidate> {
        let Self { settings, template, filter, memory, scratch, .. } = self;
        let scratch =
            scratch.get_or_insert_with(|| Box::new(Scratch::new(settings.cell_px, settings.color, template.patch())));
        scratch.extract(frame, &template.window(center, scale));
        let Scratch { plain, windowed, response, .. } = &mut **scratch;
        let size = plain.size();
        let (x, y, peak) = filter.respond_with(windowed, response, |response, plan, spectrum| {
            let (x, y, value) = highest(response, size.width);
            ((x, y), newton_peak(plan, spectrum, x as f64, y as f64, NEWTON_STEPS), value)
        });
        if !peak.is_finite() {
            return None;
        }
        let ((x, y), fine) = (x, y);
        let (dx, dy) = (signed_shift(x, size.width), signed_shift(y, size.height));
        let cell = template.step(scale) * settings.cell_px as f64;
        let moved = |whole: isize, fine: f64, cell_at: usize| (whole as f64 + fine - cell_at as f64) * cell;
        Some(Candidate {
            center: Point::new(center.x + moved(dx, fine.x, x), center.y + moved(dy, fine.y, y)),
            quality: PeakQuality::of(response, size.width),
            likeness: memory.similarity(plain, dx, dy),
        })
    }

    /// Looks at some windows over `region`, going on where the last call stopped, and again at the best.
    fn respond_wide(&mut self, frame: &Frame, region: &BBox, scale: f64) -> Option<Candidate> {
        let window = self.template.window(region.center(), scale).region();
        // Windows overlap by half: what lies near the edge of one is weakened by the Hann window.
        let count = |whole: f64, part: f64| ((2.0 * whole / part).ceil() as usize).clamp(1, 64);
        let (columns, rows) = (count(region.width(), window.width()), count(region.height(), window.height()));
        let mut best: Option<Candidate> = None;
        for _ in 0..self.settings.wide_windows.min(columns * rows) {
            self.wide_cursor = (self.wide_cursor + 1) % (columns * rows);
            let share = |i: usize, n: usize| (i as f64 + 0.5) / n as f64;
            let center = Point::new(
                region.left() + share(self.wide_cursor % columns, columns) * region.width(),
                region.top() + share(self.wide_cursor / columns, rows) * region.height(),
            );
            if let Some(found) = self.respond(frame, center, scale)
                && best.is_none_or(|b| found.quality.peak > b.quality.peak)
            {
                best = Some(found);
            }
        }
        let rough = best?;
        self.respond(frame, rough.center, scale)
    }

    fn confidence(&self, found: &Candidate) -> f64 {
        let [bias, peak, psr, best, first] = self.settings.calibration;
        let (ln_peak, ln_psr) = self.usual.relative(&found.quality);
        let z = bias + peak * ln_peak + psr * ln_psr + best * found.likeness.0 + first * found.likeness.1;
        1.0 / (1.0 + (-z).exp())
    }

    fn learn(&mut self, frame: &Frame, bbox: &BBox) {
        let Self { settings, template, filter, scale, memory, scratch, learned, .. } = self;
        let scratch =
            scratch.get_or_insert_with(|| Box::new(Scratch::new(settings.cell_px, settings.color, template.patch())));
        scratch.extract(frame, &template.window(bbox.center(), template.scale_of(bbox)));
        filter.learn(Seen { features: &scratch.windowed, patch: None }, settings.learning_rate);
        if learned.is_multiple_of(settings.view_every.max(1)) {
            memory.remember(&scratch.plain);
        }
        *learned += 1;
        scale.learn(frame, bbox);
    }
}

/// Newton steps towards the peak between the cells (danelljan2017eco: 5 at most; two suffice for a hundredth of a cell).
const NEWTON_STEPS: usize = 3;

impl Localizer for PursuitLocalizer {
    fn locate(&mut self, frame: &Frame, search: &Search) -> Result<Option<Measurement>> {
        let scale = self.template.scale_of(&search.expected);
        let found = if search.wide {
            self.respond_wide(frame, &search.region, scale)
        } else {
            let (last, expected) = (self.last.center(), search.expected.center());
            let lead = self.settings.lead;
            let center = Point::new(last.x + lead * (expected.x - last.x), last.y + lead * (expected.y - last.y));
            self.respond(frame, center, scale)
        };
        let Some(found) = found else { return Ok(None) };
        let bounds = frame.size().bounds();
        let center = Point::new(found.center.x.clamp(0.0, bounds.right()), found.center.y.clamp(0.0, bounds.bottom()));
        let bbox = self.template.bbox(center, scale);
        let growth = self.scale.locate(frame, &bbox);
        let bbox = self.template.bbox(center, self.template.scale_of(&bbox.scaled(growth)));
        self.last = bbox;
        self.latest = Some((ln(found.quality.peak), ln(found.quality.psr)));
        let (ln_peak, ln_psr) = self.usual.relative(&found.quality);
        Ok(Some(Measurement {
            bbox,
            confidence: self.confidence(&found),
            sigma_px: None,
            diagnostics: Diagnostics::default()
                .with("peak", found.quality.peak)
                .with("psr", found.quality.psr)
                .with("apce", found.quality.apce)
                .with("relative_peak", ln_peak.exp())
                .with("relative_psr", ln_psr.exp())
                .with("likeness", found.likeness.0)
                .with("first_likeness", found.likeness.1),
        }))
    }

    fn adapt(&mut self, frame: &Frame, bbox: BBox) -> Result<()> {
        self.last = bbox;
        if let Some(quality) = self.latest.take() {
            self.usual.add(quality);
        }
        self.learn(frame, &bbox);
        Ok(())
    }

    fn restart(&mut self, frame: &Frame, bbox: BBox) -> Result<()> {
        *self = Self::new(PursuitSettings { color: frame.has_color(), ..self.settings.clone() }, frame, &bbox);
        Ok(())
    }
}
