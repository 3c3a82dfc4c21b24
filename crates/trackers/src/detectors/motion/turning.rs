//! A camera on a head: while it is turned away from where it waits, what stands out is told by a background that turns with it.

use super::found::{Found, admits, join};
use super::groups::{Part, divide};
use super::params::MotionDetectorParams;
use super::scene::{clean, stirred};
use super::stand::Stand;
use crate::backdrop::{Backdrop, BackdropParams, about};
use pursuit_geometry::{BBox, Point, Size};
use pursuit_imaging::{CameraPose, Frame, Image};
use pursuit_vision::background::{FOREGROUND, learning_rate};
use pursuit_vision::morphology::MorphologyScratch;
use pursuit_vision::region_features::RegionFeatures;
use pursuit_vision::regions::RegionFinder;
use pursuit_vision::{PixelWindow, VisionError};
use std::sync::Arc;

/// Pixels looked at, about: of a larger picture one of a square stands for all of it.
const LOOKED_AT: usize = 100_000;
/// Where more than this share of what is known stands out, the picture lies wrong on the background.
const ASTRAY: f64 = 0.6;
/// So it does where the edges of the background, the better half of them, differ by this many times as much as they do usually, and more than
/// this, in codes.
const WORSE: f64 = 1.5;
const LEAST_WORSE: f64 = 8.0;
/// Share of a frame in what is usual.
const USUAL_RATE: f64 = 0.05;
/// After so long of that the background begins anew, seconds.
const ASTRAY_S: f64 = 1.0;
/// A camera that moved by less than this since the frame before stands, pixels.
const STANDS_PX: f64 = 0.5;
/// Of one that moved by more than this share of the picture's width nothing is learnt: where a picture lies that was taken in a fast turn
/// is not known well enough.
const SWINGS: f64 = 0.01;
/// What is told of a box of which less than this share is known is nothing.
const LEAST_KNOWN: f64 = 0.5;
/// Nothing is known there.
const UNKNOWN: u8 = 128;

/// The background all about.
pub(super) struct Turning {
    params: BackdropParams,
    backdrop: Backdrop,
    /// Where it waits: there the scene is known best, by the detector's own model.
    home: Stand,
    was_away: bool,
    /// By how many codes the edges of the background differ while the picture lies right.
    usual_difference: Option<f64>,
    now: Stand,
    before: Stand,
    time_s: f64,
    dt_s: f64,
    /// For how long it has stood with nobody to follow, and for how long the picture has lain wrong, seconds.
    stood_s: f64,
    astray_s: f64,
    /// What is known of each pixel: it stands out, it does not, or nothing.
    codes: Image<u8>,
    /// What stands out, cleaned.
    mask: Image<u8>,
    shown: Arc<Image<u8>>,
    /// The frame before, and the last one that was another than the frame looked at.
    last: Option<Frame>,
    earlier: Option<Frame>,
    found: Vec<Found>,
    finder: RegionFinder,
    parts: Vec<Part>,
    outline: Vec<(usize, usize)>,
    morphology: MorphologyScratch,
}

impl Turning {
    /// A head that waits where it looks now.
    pub fn new(frame: &Frame, pose: CameraPose, params: &MotionDetectorParams) -> Result<Self, VisionError> {
        let stand = Stand { pose, off: (0.0, 0.0) };
        let blank = || Image::filled(frame.size().width, frame.size().height, 0);
        Ok(Self {
            params: BackdropParams { history_s: params.history_s, ..BackdropParams::default() },
            backdrop: Backdrop::new(frame).steady(),
            home: stand,
            was_away: false,
            usual_difference: None,
            now: stand,
            before: stand,
            time_s: frame.time_s(),
            dt_s: 0.0,
            stood_s: 0.0,
            astray_s: 0.0,
            codes: blank()?,
            mask: blank()?,
            shown: Arc::new(blank()?),
            last: None,
            earlier: None,
            found: Vec::new(),
            finder: RegionFinder::default(),
            parts: Vec::new(),
            outline: Vec::new(),
            morphology: MorphologyScratch::default(),
        })
    }

    /// Says how the camera stands. Before anything else is asked of a frame.
    pub fn place(&mut self, frame: &Frame, pose: CameraPose, followed: &[BBox]) {
        self.dt_s = (frame.time_s() - self.time_s).max(0.0);
        self.time_s = frame.time_s();
        self.backdrop.place(&self.params, frame, &about(&largest(followed), self.params.reach));
        self.before = self.now;
        self.now = Stand { pose, off: self.backdrop.off() };
        let waits = followed.is_empty() && self.stands(frame.size());
        self.stood_s = if waits { self.stood_s + self.dt_s } else { 0.0 };
    }

    /// The pose said last.
    pub const fn pose(&self) -> CameraPose {
        self.now.pose
    }

    fn stands(&self, picture: Size) -> bool {
        self.now.moved_px(&self.before, picture) < STANDS_PX
    }

    /// Whether it looks where it waits, or so near that a camera that shakes would be as far. A head that stands knows where; one that
    /// begins to turn does not at once.
    pub fn is_home(&self, picture: Size, params: &MotionDetectorParams) -> bool {
        let near_px = 0.5 * params.light.shake * picture.width.max(picture.height) as f64;
        let by_pose = |of: &Stand| Stand { off: (0.0, 0.0), ..*of };
        let at_rest = by_pose(&self.now).moved_px(&by_pose(&self.before), picture) < STANDS_PX;
        let at_home = by_pose(&self.now).moved_px(&by_pose(&self.home), picture) <= near_px;
        at_home && (at_rest && self.was_away || self.now.moved_px(&self.home, picture) <= near_px)
    }

    /// Whether it has stood elsewhere with nobody to follow for so long that it waits here from now on.
    pub fn stays(&mut self, params: &MotionDetectorParams) -> bool {
        let stays = self.stood_s > params.learn_s;
        if stays {
            self.home = self.now;
        }
        stays
    }

    /// At home: learns what does not stand out there, as the detector's own model says.
    pub fn learn(&mut self, frame: &Frame, foreground: Option<&Image<u8>>, followed: &[BBox]) {
        let mut rate = learning_rate(self.dt_s, self.params.history_s);
        if followed.is_empty() && std::mem::take(&mut self.was_away) {
            // Here it is known where the picture lies; what was learnt on the way may lie beside it.
            self.backdrop = Backdrop::new(frame).steady();
            self.now.off = (0.0, 0.0);
            rate = 1.0;
        }
        self.usual_difference = None;
        let kept = kept(&self.params, foreground, followed);
        self.backdrop.learn_where(frame, kept, rate);
        self.last = Some(frame.clone());
        self.astray_s = 0.0;
    }

    /// Away from home: finds what stands out, and learns the rest.
    pub fn look(
        &mut self,
        frame: &Frame,
        is_again: bool,
        followed: &[BBox],
        params: &MotionDetectorParams,
    ) -> Result<(), VisionError> {
        self.was_away = true;
        if !is_again {
            self.earlier = self.last.take();
        }
        self.found.clear();
        self.mark(frame, followed);
        let known = self.codes.as_slice().iter().filter(|v| **v != UNKNOWN).count();
        let out = self.codes.as_slice().iter().filter(|v| **v == FOREGROUND).count();
        let difference = self.backdrop.difference();
        let usual = self.usual_difference.get_or_insert(difference);
        let is_astray = out as f64 > ASTRAY * known as f64 || difference > LEAST_WORSE.max(WORSE * *usual);
        if !is_astray {
            *usual += USUAL_RATE * (difference - *usual);
        }
        self.astray_s = if is_astray { self.astray_s + self.dt_s } else { 0.0 };
        if is_astray {
            if self.astray_s > ASTRAY_S {
                self.backdrop = Backdrop::new(frame).steady();
                self.backdrop.learn_where(frame, kept(&self.params, None, followed), 1.0);
                (self.astray_s, self.usual_difference) = (0.0, None);
            }
        } else {
            self.mask.as_mut_slice().copy_from_slice(self.codes.as_slice());
            clean(&mut self.mask, params, &mut self.morphology)?;
            self.judge(frame, followed, params);
            if self.now.moved_px(&self.before, frame.size()) <= SWINGS * frame.size().width as f64 {
                let rate = learning_rate(self.dt_s, self.params.history_s);
                self.backdrop.learn_where(frame, kept(&self.params, None, followed), rate);
            }
        }
        self.last = Some(frame.clone());
        Ok(())
    }

    /// Marks what stands out.
    fn mark(&mut self, frame: &Frame, followed: &[BBox]) {
        let Size { width, height } = frame.size();
        let gain = self.backdrop.gain(&self.params, frame, &largest(followed));
        let gain = (gain * 256.0).round().clamp(1.0, 4096.0) as i32;
        let side = ((frame.size().area() as f64 / LOOKED_AT as f64).sqrt().ceil() as usize).max(1);
        for top in (0..height).step_by(side) {
            let y = (top + side / 2).min(height - 1);
            let pixels = self.backdrop.row(frame, y);
            let row = self.codes.row_mut(top);
            for left in (0..width).step_by(side) {
                let x = (left + side / 2).min(width - 1);
                let out = self.backdrop.stands_out(pixels, x, y, gain, self.params.threshold as i32);
                let code = out.map_or(UNKNOWN, |out| if out { FOREGROUND } else { 0 });
                row[left..(left + side).min(width)].fill(code);
            }
            for below in top + 1..(top + side).min(height) {
                self.codes.as_mut_slice().copy_within(top * width..(top + 1) * width, below * width);
            }
        }
    }

    /// Keeps what the matching rule admits.
    fn judge(&mut self, frame: &Frame, followed: &[BBox], params: &MotionDetectorParams) {
        let ranges = params.rule.ranges(frame.size());
        let least = *ranges.area_px.start() / params.parts;
        // While the picture moves all of it has changed: nobody new is told then.
        let last = self.earlier.clone().filter(|_| self.stands(frame.size()));
        for region in self.finder.find(self.mask.view(), least.max(1.0) as usize) {
            let features = RegionFeatures::of(region, self.mask.view(), &mut self.outline);
            let stirred = last.as_ref().map_or(0.0, |last| {
                if frame.has_color() && last.has_color() {
                    stirred(&features.bounds, &self.mask, frame.color(), last.color(), params.codes())
                } else {
                    stirred(&features.bounds, &self.mask, frame.gray(), last.gray(), params.codes())
                }
            });
            self.found.push(Found { features, stirred, uncovered: false, part: false });
        }
        join(&mut self.found, frame.size(), params);
        divide(&mut self.found, (&self.mask, followed), &params.grouping, &mut self.parts);
        self.found.retain(|f| f.part || admits(&ranges, &f.features, frame.size()));
    }

    /// The regions found last.
    pub fn found(&self) -> &[Found] {
        &self.found
    }

    /// Share of the picture that stood out in the last frame.
    pub fn changed(&self) -> f64 {
        let out = self.mask.as_slice().iter().filter(|v| **v != 0).count();
        if self.is_astray() { 0.0 } else { out as f64 / self.mask.size().area().max(1) as f64 }
    }

    fn is_astray(&self) -> bool {
        self.astray_s > 0.0
    }

    /// Share of `bbox` that stood out in the last frame; `None` where little is known of it, or where the picture lay wrong.
    pub fn standing_out(&self, bbox: &BBox) -> Option<f64> {
        let window = PixelWindow::of(bbox, self.codes.size()).filter(|_| !self.is_astray())?;
        let (mut known, mut out) = (0_usize, 0_usize);
        for y in window.y..window.y + window.height {
            let columns = window.x..window.x + window.width;
            let cleaned = &self.mask.row(y)[columns.clone()];
            for (code, cleaned) in self.codes.row(y)[columns].iter().zip(cleaned) {
                known += usize::from(*code != UNKNOWN);
                out += usize::from(*code != UNKNOWN && *cleaned != 0);
            }
        }
        let area = (window.width * window.height).max(1) as f64;
        (known as f64 >= LEAST_KNOWN * area).then(|| out as f64 / known as f64)
    }

    /// What stood out in the last frame; `None` where the picture lay wrong.
    pub fn foreground(&mut self) -> Option<Arc<Image<u8>>> {
        if self.is_astray() {
            return None;
        }
        match Arc::get_mut(&mut self.shown) {
            Some(shown) => shown.as_mut_slice().copy_from_slice(self.mask.as_slice()),
            None => self.shown = Arc::new(self.mask.clone()),
        }
        Some(self.shown.clone())
    }
}

/// The largest of the targets; a box beside the picture where there are none.
fn largest(followed: &[BBox]) -> BBox {
    let largest = followed.iter().copied().max_by(|a, b| a.area().total_cmp(&b.area()));
    largest.unwrap_or_else(|| BBox::from_ltwh(-9.0, -9.0, 1.0, 1.0))
}

/// What is not learnt: who is followed, and what the detector's own model says stands out.
fn kept<'a>(
    params: &BackdropParams,
    foreground: Option<&'a Image<u8>>,
    followed: &[BBox],
) -> impl Fn(Point) -> bool + 'a {
    let followed: Vec<BBox> = followed.iter().map(|bbox| about(bbox, params.margin)).collect();
    move |at: Point| {
        let out = |mask: &Image<u8>| mask.view().get(at.x as usize, at.y as usize).is_some_and(|v| *v != 0);
        foreground.is_some_and(out) || followed.iter().any(|bbox| bbox.contains(at))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_imaging::Lens;
    use pursuit_tracking::{Detection, DetectorRecipe, Followed};

    const SIZE: Size = Size::new(160, 120);

    fn pose(pan_rad: f64) -> CameraPose {
        CameraPose::new(0.0, pan_rad, 0.0, Lens::field_of_view(0.7).unwrap()).unwrap()
    }

    /// Where a camera that looks there sees somebody at a pan.
    fn person(at: CameraPose, pan_rad: f64) -> BBox {
        let edge = |pan: f64, tilt: f64| at.point_of(pursuit_imaging::Direction { pan_rad: pan, tilt_rad: tilt }, SIZE);
        let (first, last) = (edge(pan_rad - 0.05, 0.12).unwrap(), edge(pan_rad + 0.05, -0.18).unwrap());
        BBox::from_ltrb(first.x, first.y.min(last.y), last.x, first.y.max(last.y))
    }

    /// A wall with patches, and somebody red before it; the camera says that it stands as `told`.
    fn frame(k: u64, at: CameraPose, told: CameraPose, walker: Option<f64>) -> Frame {
        let bbox = walker.map(|pan| person(at, pan));
        let image = Image::from_fn(SIZE.width, SIZE.height, |x, y| {
            let point = Point::new(x as f64 + 0.5, y as f64 + 0.5);
            if bbox.is_some_and(|b| b.contains(point)) {
                return [230, 20, 20];
            }
            let seen = at.direction_of(point, SIZE);
            let (a, b) = (40.0 * seen.pan_rad, 40.0 * seen.tilt_rad);
            let wave =
                |phase: f64| (118.0 + 40.0 * (a + phase).sin() * (0.7 * b).cos() + 30.0 * (0.31 * a + b).sin()) as u8;
            [wave(0.0), wave(0.4), wave(0.8)]
        });
        Frame::new(k, k as f64 / 25.0, image.unwrap()).with_camera(told)
    }

    /// The head waits, follows somebody to the right by more than its picture holds, who leaves at once, and goes home.
    #[test]
    fn who_is_followed_by_a_head_stands_out_all_the_way_and_nobody_does_at_home() {
        let mut detector = MotionDetectorParams::default().detector().unwrap();
        let mut followed: Vec<Followed> = Vec::new();
        let (mut overlaps, mut away) = (Vec::new(), Vec::new());
        for k in 0..260_u64 {
            let since = k.saturating_sub(40) as f64;
            let walker = (40..160).contains(&k).then_some(-0.25 + 0.006 * since);
            // The head follows behind, and is wrong about where it stands while it turns.
            let pan = match k {
                0..60 => 0.0,
                60..160 => 0.0055 * (k - 60) as f64,
                _ => (0.55 - 0.02 * (k - 160) as f64).max(0.0),
            };
            let wrong = if (60..190).contains(&k) { 0.02 } else { 0.0 };
            let at = pose(pan);
            let seen = frame(k, at, pose(pan - wrong), walker);
            // Of one picture the head does not say how it stood.
            let seen = if k == 120 { Frame::new(k, seen.time_s(), seen.color().to_image()) } else { seen };
            let found: Vec<Detection> = detector.detect(&seen, &followed).unwrap();
            let truth = walker.map(|pan| person(at, pan));
            followed.clear();
            if let Some(truth) = truth {
                overlaps.push((k, found.iter().map(|d| d.bbox.iou(&truth)).fold(0.0, f64::max)));
                followed.push(Followed { bbox: truth, measured: true });
            } else if k >= 40 {
                away.push((k, found.iter().any(|d| d.confidence > 0.5)));
            }
            if k == 150 {
                let floor = detector.standing_out(&BBox::from_ltwh(4.0, 4.0, 30.0, 20.0));
                assert_eq!(floor, Some(0.0), "a wall does not stand out because the camera turns");
                assert!(detector.foreground().is_some());
            }
        }
        let late: Vec<f64> = overlaps.iter().filter(|o| o.0 >= 50).map(|o| o.1).collect();
        let well = late.iter().filter(|overlap| **overlap > 0.7).count();
        assert!(well * 10 >= late.len() * 9, "{overlaps:?}");
        assert!(away.iter().all(|(_, sure)| !sure), "{away:?}");
    }

    #[test]
    fn a_head_that_has_turned_for_good_waits_there() {
        let mut detector = MotionDetectorParams::default().detector().unwrap();
        let mut sure = 0;
        for k in 0..200_u64 {
            let pan = (0.02 * k.saturating_sub(30) as f64).min(0.9);
            let walker = (k >= 160).then_some(0.75 + 0.008 * (k.saturating_sub(160)) as f64);
            let found = detector.detect(&frame(k, pose(pan), pose(pan), walker), &[]).unwrap();
            assert!(walker.is_some() || found.iter().all(|d| d.confidence < 0.5), "{k}: {found:?}");
            sure += usize::from(found.iter().any(|d| d.confidence > 0.5));
        }
        assert!(sure > 30, "in {sure} of 40 pictures");
    }
}
