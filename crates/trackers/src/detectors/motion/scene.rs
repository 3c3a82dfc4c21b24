//! The background of one camera, and the regions that stand out of it.

use super::colors::colors;
use super::found::{Found, admits, join};
use super::ghost::ghostliness;
use super::groups::{Part, divide};
use super::held::Held;
use super::params::{BackgroundKind, MotionDetectorParams};
use super::shade::Shade;
use super::surroundings::Surroundings;
use pursuit_geometry::{BBox, Point};
use pursuit_imaging::{Image, ImageView};
use pursuit_vision::background::{
    BACKGROUND, BackgroundModel, Channels, FOREGROUND, FixedBackground, Learning, LightingStep, Mog2, RunningAverage,
    TemporalMedian, ThreeFrame, Watched, learning_rate, protect_foreground,
};
use pursuit_vision::morphology::{MorphologyScratch, dilate, erode};
use pursuit_vision::region_features::RegionFeatures;
use pursuit_vision::regions::RegionFinder;
use pursuit_vision::{PixelWindow, VisionError};
use std::sync::Arc;

type Model<P> = Box<dyn BackgroundModel<P> + Send>;

fn model<P: Channels>(params: &MotionDetectorParams) -> Result<Model<P>, VisionError> {
    Ok(match params.background {
        BackgroundKind::Mog2 => Box::new(Mog2::new(params.mog2())?),
        BackgroundKind::Median => Box::new(TemporalMedian::new(params.median())?),
        BackgroundKind::RunningAverage => Box::new(RunningAverage::new(params.average())?),
        BackgroundKind::Fixed => Box::new(FixedBackground::from_first_frame(params.codes())),
        BackgroundKind::ThreeFrame => Box::new(ThreeFrame::new(params.codes())),
    })
}

/// What a frame showed besides the regions.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Sight {
    /// Share of the picture that differs from the background.
    pub changed: f64,
    /// A step of the light, or of the whole scene.
    pub step: Option<LightingStep>,
    /// Ghosts learnt.
    pub ghosts: usize,
}

/// A background of pixels `P`.
pub(super) struct Scene<P> {
    model: Watched<Model<P>, P>,
    /// Frames looked at, and the times of the last and of the last sample of the median.
    frames: usize,
    time_s: f64,
    sampled_s: f64,
    /// What stood out of the last frame, cleaned.
    mask: Image<u8>,
    /// The same, for others to see.
    shown: Arc<Image<u8>>,
    protect: Image<u8>,
    /// The background about what stands out of it.
    background: Image<P>,
    surroundings: Surroundings,
    /// Whether the background is one.
    known: bool,
    shade: Shade,
    held: Held,
    /// How long it has been looked at.
    seen_s: f64,
    boxes: Vec<BBox>,
    parts: Vec<Part>,
    finder: RegionFinder,
    morphology: MorphologyScratch,
    outline: Vec<(usize, usize)>,
    found: Vec<Found>,
    /// What each of them wears.
    colors: Vec<Option<Arc<[f32]>>>,
    /// The frame before, and the frame looked at, in the exposure of the background.
    last: Image<P>,
    now: Option<Image<P>>,
    /// The last frame that was another than the frame looked at.
    before: Image<P>,
    ghosts: Vec<BBox>,
}

impl<P: Channels> Scene<P> {
    pub fn new(params: &MotionDetectorParams) -> Result<Self, VisionError> {
        let blank = || Image::filled(1, 1, 0);
        Ok(Self {
            model: Watched::new(model(params)?, params.lighting())?,
            frames: 0,
            time_s: f64::NEG_INFINITY,
            sampled_s: f64::NEG_INFINITY,
            mask: blank()?,
            shown: Arc::new(blank()?),
            protect: blank()?,
            background: Image::filled(1, 1, P::default())?,
            surroundings: Surroundings::default(),
            known: false,
            shade: Shade::default(),
            held: Held::default(),
            seen_s: 0.0,
            boxes: Vec::new(),
            parts: Vec::new(),
            finder: RegionFinder::default(),
            morphology: MorphologyScratch::default(),
            outline: Vec::new(),
            found: Vec::new(),
            colors: Vec::new(),
            last: Image::filled(1, 1, P::default())?,
            now: None,
            before: Image::filled(1, 1, P::default())?,
            ghosts: Vec::new(),
        })
    }

    /// The regions found last that the matching rule admits.
    pub fn found(&self) -> &[Found] {
        &self.found
    }

    /// What each of them wears, where that can be said.
    pub fn colors(&self) -> &[Option<Arc<[f32]>>] {
        &self.colors
    }

    /// Share of `bbox` that stood out of the background in the last frame; `None` before it has settled, and outside of the picture.
    pub fn standing_out(&self, bbox: &BBox, params: &MotionDetectorParams) -> Option<f64> {
        let (dx, dy) = self.model.shift();
        let bbox = bbox.translated(-dx, -dy);
        let window = PixelWindow::of(&bbox, self.mask.size()).filter(|_| self.frames > params.settled_frames)?;
        let columns = window.x..window.x + window.width;
        let row = |y: usize| self.mask.row(y)[columns.clone()].iter().filter(|v| **v != 0).count();
        let out: usize = (window.y..window.y + window.height).map(row).sum();
        Some(out as f64 / (window.width * window.height).max(1) as f64)
    }

    /// What stood out of the background in the last frame; `None` before it has settled. Made anew only where somebody keeps the last.
    pub fn foreground(&mut self, params: &MotionDetectorParams) -> Option<Arc<Image<u8>>> {
        if self.frames <= params.settled_frames {
            return None;
        }
        match Arc::get_mut(&mut self.shown) {
            Some(shown) => shift(&self.mask, self.model.shift(), shown).ok()?,
            None => {
                let mut shown = self.mask.clone();
                shift(&self.mask, self.model.shift(), &mut shown).ok()?;
                self.shown = Arc::new(shown);
            }
        }
        Some(self.shown.clone())
    }

    /// The camera looked elsewhere until now: what the scene was like meanwhile is not known.
    pub const fn wait(&mut self, time_s: f64) {
        self.time_s = time_s;
    }

    /// Looks at the next frame, of this time and shown once more or not; the foreground of the last frame inside the boxes `followed` is not learnt.
    pub fn look(
        &mut self,
        frame: ImageView<'_, P>,
        (time_s, is_again): (f64, bool),
        followed: impl Iterator<Item = BBox>,
        params: &MotionDetectorParams,
    ) -> Result<Sight, VisionError> {
        let dt_s = if self.time_s.is_finite() { (time_s - self.time_s).max(0.0) } else { 0.0 };
        let rate = self.rate(time_s, params);
        // Everything here is in pixels of the background; a camera that shakes shifts the frame against it.
        let (dx, dy) = self.model.shift();
        self.boxes.clear();
        self.boxes.extend(followed.map(|b| b.translated(-dx, -dy)));
        let protects = self.mask.size() == frame.size();
        if protects {
            protect_foreground(self.mask.view(), &self.boxes, &mut self.protect)?;
            // At first it is not known which of two is the background: what was there first, or what stands out of it.
            if self.seen_s > params.learn_s {
                self.held.protect(&self.mask, params.hold_s, &mut self.protect);
            }
        }
        let learning = Learning { rate, protect: protects.then(|| self.protect.view()) };
        let report = self.model.apply(frame, &learning, &mut self.mask)?;
        self.frames += 1;
        let out = self.mask.as_slice().iter().filter(|v| **v != BACKGROUND).count();
        let changed = out as f64 / self.mask.size().area().max(1) as f64;
        self.find_background(params)?;
        let lit = self.model.relit().unwrap_or(frame);
        if self.known {
            let background = (self.background.view(), self.model.fineness_px());
            self.shade.remove(&params.shade, lit, background, &mut self.mask);
        }
        clean(&mut self.mask, params, &mut self.morphology)?;
        self.held.count(&self.mask, dt_s);
        self.seen_s += dt_s;
        self.found.clear();
        self.colors.clear();
        self.ghosts.clear();
        // What follows compares the frame with the background and with the frame before, all in one exposure.
        let lit = self.model.relit().unwrap_or(frame);
        let now = match self.now.take() {
            Some(mut now) => copy(lit, &mut now).map(|()| now)?,
            None => lit.to_image(),
        };
        if !is_again {
            std::mem::swap(&mut self.before, &mut self.last);
        }
        let judged = if self.frames > params.settled_frames { self.judge(now.view(), params) } else { Ok(()) };
        self.now = Some(std::mem::replace(&mut self.last, now));
        judged?;
        let (dx, dy) = self.model.shift();
        for found in self.found.iter_mut().filter(|_| (dx, dy) != (0.0, 0.0)) {
            found.features.bounds = found.features.bounds.translated(dx, dy);
            found.features.centroid = Point::new(found.features.centroid.x + dx, found.features.centroid.y + dy);
        }
        Ok(Sight { changed, step: report.step, ghosts: self.ghosts.len() })
    }

    /// The weight of a frame: that of a mean over all frames at first, then what the time constant says.
    fn rate(&mut self, time_s: f64, params: &MotionDetectorParams) -> Option<f64> {
        let dt_s = if self.time_s.is_finite() { time_s - self.time_s } else { 0.0 };
        if time_s.is_finite() {
            self.time_s = time_s;
        }
        if params.background == BackgroundKind::Median {
            // The samples are taken by the clock, the first few at once.
            let due = self.frames < params.settled_frames || time_s - self.sampled_s >= params.sample_s();
            if due {
                self.sampled_s = time_s;
            }
            return Some(f64::from(u8::from(due)));
        }
        let settling = 1.0 / (2 * self.frames.max(1)) as f64;
        Some(learning_rate(dt_s, params.history_s).max(settling))
    }

    /// Fetches the background, where there is one and anything stands out of it.
    fn find_background(&mut self, params: &MotionDetectorParams) -> Result<(), VisionError> {
        self.known = false;
        if params.background != BackgroundKind::ThreeFrame {
            // It is looked at about what stands out alone.
            let windows = self.surroundings.windows(&self.mask, params.reach_px(self.mask.height()));
            self.known = !windows.is_empty() && self.model.model().background_in(windows, &mut self.background)?;
        }
        Ok(())
    }

    /// Keeps what the matching rule admits, and learns ghosts.
    fn judge(&mut self, frame: ImageView<'_, P>, params: &MotionDetectorParams) -> Result<(), VisionError> {
        let ranges = params.rule.ranges(frame.size());
        let least = *ranges.area_px.start() / params.parts;
        self.ghosts.clear();
        for region in self.finder.find(self.mask.view(), least.max(1.0) as usize) {
            let features = RegionFeatures::of(region, self.mask.view(), &mut self.outline);
            let stirred = stirred(&features.bounds, &self.mask, frame, self.before.view(), params.codes());
            let edges = (self.outline.as_slice(), self.mask.view(), features.centroid);
            let uncovered =
                self.known && ghostliness(&params.ghost, edges, frame, self.background.view()) > params.ghost.ratio;
            // What moves is not learnt: it may be somebody before a part of the background that has more edges.
            if uncovered && stirred < params.stirred {
                self.ghosts.push(features.bounds);
            } else {
                self.found.push(Found { features, stirred, uncovered, part: false });
            }
        }
        join(&mut self.found, frame.size(), params);
        divide(&mut self.found, (&self.mask, &self.boxes), &params.grouping, &mut self.parts);
        self.found.retain(|f| f.part || admits(&ranges, &f.features, frame.size()));
        // The part that one has in a region shows colours of the others too.
        let worn = |f: &Found| colors(&params.colors, &f.features.bounds, &self.mask, frame);
        self.colors.extend(self.found.iter().map(|f| if f.part { None } else { worn(f) }));
        if !self.ghosts.is_empty() {
            // Everything but the ghosts is kept.
            protect_foreground(self.mask.view(), &self.ghosts, &mut self.protect)?;
            self.protect.as_mut_slice().iter_mut().for_each(|v| *v = !*v);
            self.model.model_mut().relearn(frame, 1.0, Some(self.protect.view()))?;
        }
        Ok(())
    }
}

/// Drops shadows and noise of a mask, joins what belongs together.
pub(super) fn clean(
    mask: &mut Image<u8>,
    params: &MotionDetectorParams,
    morphology: &mut MorphologyScratch,
) -> Result<(), VisionError> {
    let (open, close) = params.radii(mask.height());
    // Every pixel is written, which is quicker than to choose.
    mask.as_mut_slice().iter_mut().for_each(|v| *v = if *v == FOREGROUND { FOREGROUND } else { 0 });
    erode(mask, open, morphology)?;
    dilate(mask, open + close, morphology)?;
    erode(mask, close, morphology)?;
    Ok(())
}

/// Copies `from` to `to`, which becomes as large.
fn copy<P: Channels>(from: ImageView<'_, P>, to: &mut Image<P>) -> Result<(), VisionError> {
    to.resize_for_overwrite(from.size(), P::default())?;
    from.rows().enumerate().for_each(|(y, row)| to.row_mut(y).copy_from_slice(row));
    Ok(())
}

/// Copies a mask to where the frame shows it, to whole pixels.
fn shift(mask: &Image<u8>, (dx, dy): (f64, f64), to: &mut Image<u8>) -> Result<(), VisionError> {
    if (dx, dy) == (0.0, 0.0) {
        return copy(mask.view(), to);
    }
    let (dx, dy) = (dx.round() as isize, dy.round() as isize);
    to.resize_for_overwrite(mask.size(), 0)?;
    to.as_mut_slice().fill(0);
    for y in 0..mask.height() {
        let Some(from) = y.checked_add_signed(-dy).filter(|y| *y < mask.height()) else { continue };
        let n = mask.width().saturating_sub(dx.unsigned_abs());
        let (left, right) = (dx.max(0) as usize, (-dx).max(0) as usize);
        to.row_mut(y)[left..left + n].copy_from_slice(&mask.row(from)[right..right + n]);
    }
    Ok(())
}

/// Share of the mask's pixels inside `bounds` that differ from a frame before.
pub(super) fn stirred<P: Channels>(
    bounds: &BBox,
    mask: &Image<u8>,
    frame: ImageView<'_, P>,
    last: ImageView<'_, P>,
    threshold: u8,
) -> f64 {
    let Some(window) = PixelWindow::of(bounds, frame.size()).filter(|_| last.size() == frame.size()) else {
        return 0.0;
    };
    let (mut all, mut changed) = (0usize, 0usize);
    for y in window.y..window.y + window.height {
        let columns = window.x..window.x + window.width;
        let (now, before) = (P::channels(&frame.row(y)[columns.clone()]), P::channels(&last.row(y)[columns.clone()]));
        let pixels = now.chunks_exact(P::COUNT).zip(before.chunks_exact(P::COUNT)).zip(&mask.row(y)[columns]);
        for ((now, before), _) in pixels.filter(|(_, mask)| **mask != 0) {
            all += 1;
            changed += usize::from(now.iter().zip(before).any(|(a, b)| a.abs_diff(*b) > threshold));
        }
    }
    changed as f64 / all.max(1) as f64
}
