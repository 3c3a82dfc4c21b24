//! The background of one camera, and the regions that stand out of it.

use super::ghost::ghostliness;
use super::groups::{Part, divide};
use super::held::Held;
use super::params::{BackgroundKind, GroupingParams, MotionDetectorParams};
use super::shade::Shade;
use pursuit_geometry::{BBox, Point, Size};
use pursuit_imaging::{Image, ImageView};
use pursuit_vision::background::{
    BACKGROUND, BackgroundModel, Channels, FOREGROUND, FixedBackground, Learning, LightingStep, Mog2, RunningAverage,
    TemporalMedian, ThreeFrame, Watched, learning_rate, protect_foreground,
};
use pursuit_vision::morphology::{MorphologyScratch, dilate, erode};
use pursuit_vision::region_features::{FeatureRanges, RegionFeatures};
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

/// A region that the matching rule admits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Found {
    /// Its features.
    pub features: RegionFeatures,
    /// Share of its pixels that have changed since the frame before.
    pub stirred: f64,
    /// Whether its outline is rather one of the background than of the frame: something has uncovered it.
    pub uncovered: bool,
    /// Whether it is the part that one target has in a region; the features but the place are those of the region.
    pub part: bool,
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
    background: Image<P>,
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
    /// The frame before, and the frame looked at, in the exposure of the background.
    last: Image<P>,
    now: Option<Image<P>>,
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
            last: Image::filled(1, 1, P::default())?,
            now: None,
            ghosts: Vec::new(),
        })
    }

    /// The regions found last that the matching rule admits.
    pub fn found(&self) -> &[Found] {
        &self.found
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

    /// Looks at the next frame; the foreground of the last frame inside the boxes `followed` is not learnt.
    pub fn look(
        &mut self,
        frame: ImageView<'_, P>,
        time_s: f64,
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
        self.clean(params)?;
        self.held.count(&self.mask, dt_s);
        self.seen_s += dt_s;
        self.found.clear();
        self.ghosts.clear();
        // What follows compares the frame with the background and with the frame before, all in one exposure.
        let lit = self.model.relit().unwrap_or(frame);
        let now = match self.now.take() {
            Some(mut now) => copy(lit, &mut now).map(|()| now)?,
            None => lit.to_image(),
        };
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

    /// Drops shadows and noise, joins what belongs together.
    fn clean(&mut self, params: &MotionDetectorParams) -> Result<(), VisionError> {
        let height = self.mask.height() as f64;
        let (open, close) = ((params.opening * height).round() as usize, (params.closing * height).round() as usize);
        self.mask.as_mut_slice().iter_mut().filter(|v| **v != FOREGROUND).for_each(|v| *v = 0);
        erode(&mut self.mask, open, &mut self.morphology)?;
        dilate(&mut self.mask, open + close, &mut self.morphology)?;
        erode(&mut self.mask, close, &mut self.morphology)?;
        Ok(())
    }

    /// Fetches the background, where there is one and anything stands out of it.
    fn find_background(&mut self, params: &MotionDetectorParams) -> Result<(), VisionError> {
        let wanted = params.background != BackgroundKind::ThreeFrame && self.mask.as_slice().contains(&FOREGROUND);
        self.known = wanted && self.model.model().background(&mut self.background)?;
        Ok(())
    }

    /// Keeps what the matching rule admits, and learns ghosts.
    fn judge(&mut self, frame: ImageView<'_, P>, params: &MotionDetectorParams) -> Result<(), VisionError> {
        let ranges = params.rule.ranges(frame.size());
        let least = *ranges.area_px.start() / params.parts;
        self.ghosts.clear();
        for region in self.finder.find(self.mask.view(), least.max(1.0) as usize) {
            let features = RegionFeatures::of(region, self.mask.view(), &mut self.outline);
            let stirred = stirred(&features.bounds, &self.mask, frame, &self.last, params.codes());
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
        self.divide(&params.grouping);
        self.found.retain(|f| f.part || admits(&ranges, &f.features, frame.size()));
        if !self.ghosts.is_empty() {
            // Everything but the ghosts is kept.
            protect_foreground(self.mask.view(), &self.ghosts, &mut self.protect)?;
            self.protect.as_mut_slice().iter_mut().for_each(|v| *v = !*v);
            self.model.model_mut().relearn(frame, 1.0, Some(self.protect.view()))?;
        }
        Ok(())
    }
}

impl<P: Channels> Scene<P> {
    /// Puts parts in the place of regions in which several targets are expected.
    fn divide(&mut self, params: &GroupingParams) {
        for i in 0..self.found.len() {
            let whole = self.found[i];
            divide(params, &whole.features.bounds, &self.mask, &self.boxes, &mut self.parts);
            let mut seen = self.parts.iter().filter_map(|part| part.bbox(params)).map(|bbox| {
                let features = RegionFeatures { bounds: bbox, centroid: bbox.center(), ..whole.features };
                Found { features, part: true, ..whole }
            });
            if let Some(first) = seen.next() {
                self.found[i] = first;
                self.found.extend(seen);
            }
        }
    }
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

/// Whether the left or the right border of the picture cuts a box, and whether the upper or the lower one does.
fn cut(bbox: &BBox, frame: Size) -> (bool, bool) {
    let beside = bbox.left() <= 0.0 || bbox.right() >= frame.width as f64;
    let above = bbox.top() <= 0.0 || bbox.bottom() >= frame.height as f64;
    (beside, above)
}

/// Whether the matching rule admits a region. What the picture's border cuts is wider, or higher, than is seen of it.
fn admits(ranges: &FeatureRanges, features: &RegionFeatures, frame: Size) -> bool {
    let (wider, higher) = cut(&features.bounds, frame);
    let least = if higher { 0.0 } else { *ranges.aspect_ratio.start() };
    let most = if wider { f64::MAX } else { *ranges.aspect_ratio.end() };
    FeatureRanges { aspect_ratio: least..=most, ..ranges.clone() }.admit(features)
}

/// Joins regions above one another that are near: a belt, or a wall of the colour of a coat, cuts a person in two; so does the
/// picture's border one who comes in by a foot and a hand.
fn join(parts: &mut Vec<Found>, frame: Size, params: &MotionDetectorParams) {
    let mut i = 0;
    while i < parts.len() {
        match (i + 1..parts.len()).find(|&j| belong([i, j].map(|k| &parts[k].features.bounds), frame, params)) {
            Some(j) => {
                let other = parts.swap_remove(j);
                parts[i] = parts[i].with(&other);
                // What is joined may reach others that were passed over.
                i = 0;
            }
            None => i += 1,
        }
    }
}

fn belong([a, b]: [&BBox; 2], frame: Size, params: &MotionDetectorParams) -> bool {
    let cut = cut(a, frame).0 && cut(b, frame).0;
    let join = if cut { params.join.max(params.join_cut) } else { params.join };
    let shared = a.right().min(b.right()) - a.left().max(b.left());
    let apart = a.top().max(b.top()) - a.bottom().min(b.bottom());
    apart <= join * a.union(b).height() && shared >= params.above * a.width().min(b.width())
}

impl Found {
    /// Two parts together.
    fn with(&self, other: &Self) -> Self {
        let (a, b) = (&self.features, &other.features);
        let bounds = a.bounds.union(&b.bounds);
        let (area_px, perimeter_px) = (a.area_px + b.area_px, a.perimeter_px + b.perimeter_px);
        let mean = |of_a: f64, of_b: f64| (of_a * a.area_px + of_b * b.area_px) / area_px;
        let features = RegionFeatures {
            area_px,
            perimeter_px,
            aspect_ratio: bounds.height() / bounds.width(),
            complexity: perimeter_px * perimeter_px / area_px,
            centroid: Point::new(mean(a.centroid.x, b.centroid.x), mean(a.centroid.y, b.centroid.y)),
            bounds,
        };
        let uncovered = if self.features.area_px < other.features.area_px { other.uncovered } else { self.uncovered };
        Self { features, stirred: mean(self.stirred, other.stirred), uncovered, part: false }
    }
}

/// Share of the mask's pixels inside `bounds` that differ from the frame before.
fn stirred<P: Channels>(
    bounds: &BBox,
    mask: &Image<u8>,
    frame: ImageView<'_, P>,
    last: &Image<P>,
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

#[cfg(test)]
mod tests {
    use super::*;

    const PICTURE: Size = Size { width: 160, height: 160 };

    fn part(left: f64, top: f64, width: f64, height: f64) -> Found {
        let (bounds, area_px, perimeter_px) =
            (BBox::from_ltwh(left, top, width, height), width * height, 2.0 * (width + height) - 4.0);
        let features = RegionFeatures {
            area_px,
            perimeter_px,
            aspect_ratio: height / width,
            complexity: perimeter_px * perimeter_px / area_px,
            centroid: bounds.center(),
            bounds,
        };
        Found { features, stirred: left / 100.0, uncovered: false, part: false }
    }

    #[test]
    fn stacked_parts_join_and_neighbours_do_not() {
        // Legs, someone beside them, a head far above, a trunk between.
        let mut parts = vec![
            part(10.0, 60.0, 20.0, 40.0),
            part(40.0, 60.0, 20.0, 40.0),
            part(15.0, 20.0, 10.0, 10.0),
            part(12.0, 34.0, 20.0, 22.0),
        ];
        join(&mut parts, PICTURE, &MotionDetectorParams { join: 0.1, ..MotionDetectorParams::default() });
        assert_eq!(parts.len(), 2);
        let whole = parts[0].features;
        assert!((parts[0].stirred - (0.1 * 800.0 + 0.15 * 100.0 + 0.12 * 440.0) / 1340.0).abs() < 1e-12);
        assert_eq!(whole.bounds, BBox::from_ltrb(10.0, 20.0, 32.0, 100.0));
        assert_eq!((whole.area_px, whole.perimeter_px), (1340.0, 116.0 + 36.0 + 80.0));
        assert_eq!(whole.aspect_ratio, 80.0 / 22.0);
        assert!((whole.complexity - 232.0f64.powi(2) / 1340.0).abs() < 1e-12);
        assert!((whole.centroid.y - (80.0 * 800.0 + 25.0 * 100.0 + 45.0 * 440.0) / 1340.0).abs() < 1e-12);
        assert_eq!(parts[1].features.bounds.left(), 40.0);
        // Too far, and hardly above one another.
        for (other, together) in [
            (part(10.0, 104.0, 20.0, 36.0), 1),
            (part(10.0, 104.1, 20.0, 36.0), 2),
            (part(20.0, 102.0, 20.0, 36.0), 1),
            (part(20.5, 102.0, 20.0, 36.0), 2),
        ] {
            let mut parts = vec![part(10.0, 60.0, 20.0, 40.0), other];
            join(&mut parts, PICTURE, &MotionDetectorParams { join: 0.05, ..MotionDetectorParams::default() });
            assert_eq!(parts.len(), together, "{other:?}");
        }
    }

    #[test]
    fn what_the_border_cuts_is_one_thing() {
        let joined = |left: f64| {
            let mut parts = vec![part(left, 120.0, 20.0, 35.0), part(left, 64.0, 10.0, 12.0)];
            join(&mut parts, PICTURE, &MotionDetectorParams::default());
            parts.len()
        };
        assert_eq!((joined(0.0), joined(5.0)), (1, 2), "a hand and a foot come in");
        let mut far = vec![part(0.0, 120.0, 20.0, 35.0), part(0.0, 20.0, 10.0, 12.0)];
        join(&mut far, PICTURE, &MotionDetectorParams::default());
        assert_eq!(far.len(), 2, "too far");
    }

    #[test]
    fn what_the_border_cuts_is_wider_or_higher_than_seen() {
        let ranges = MotionDetectorParams::default().rule.ranges(PICTURE);
        let admitted = |found: Found| admits(&ranges, &found.features, PICTURE);
        let sliver = |left: f64| admitted(part(left, 40.0, 10.0, 100.0));
        assert_eq!((sliver(0.0), sliver(40.0), sliver(150.0)), (true, false, true));
        let head = |top: f64| admitted(part(60.0, top, 60.0, 12.0));
        assert_eq!((head(0.0), head(40.0), head(148.0)), (true, false, true));
        assert!(!admitted(part(0.0, 40.0, 60.0, 12.0)), "too wide already");
    }
}
