use super::PersonParams;
use crate::backdrop::{Backdrop, BackdropParams, about};
use crate::correlation::{CorrelationFigures, CorrelationLocalizer, ResponsePeak};
use pursuit_estimation::{logit, sigmoid};
use pursuit_geometry::BBox;
use pursuit_imaging::{Frame, Image, ImageView};
use pursuit_tracking::{Figure, Figures, Localizer, LocalizerRecipe, Measurement, Outcome, Result, Search, ViewSize};
use pursuit_vision::PixelWindow;
use pursuit_vision::background::learning_rate;
use pursuit_vision::regions::RegionFinder;
use serde::{Deserialize, Serialize};

/// Correlation, put right by what stands out of the background.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct PersonLocalizer {
    params: BackdropParams,
    appearance: CorrelationLocalizer,
    /// What it knows of the background where nobody shows it what stands out ([`Frame::foreground`]).
    backdrop: Option<Backdrop>,
    /// Whether the person stood out of a background that somebody else knows.
    stood_out: bool,
    /// Time of the last frame, seconds.
    time_s: f64,
    #[serde(skip)]
    scratch: Scratch,
}

/// Not state: overwritten at every use.
#[derive(Debug, Clone, Default)]
struct Scratch {
    mask: Option<Image<u8>>,
    finder: RegionFinder,
}

/// What stands out about an expected box.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Outline {
    /// The rectangle about it; `None` when nothing does.
    bbox: Option<BBox>,
    /// Share of the expected box that stands out.
    fill: f64,
}

pursuit_tracking::figures! {
    /// What the background says of a box.
    struct BackdropFigures {
        /// Share of the box that stands out of the background.
        fill;
    }
}

/// Mask codes: nothing is known there, it stands out.
const UNKNOWN: u8 = 128;
const OUT: u8 = 255;

impl PersonLocalizer {
    /// Starts on the person at `bbox`.
    ///
    /// # Errors
    /// When the frame lacks what the method needs.
    pub fn new(params: &PersonParams, frame: &Frame, bbox: BBox) -> Result<Self> {
        let mut new = Self {
            params: params.backdrop.clone(),
            appearance: params.appearance.localizer(frame, bbox)?,
            backdrop: None,
            stood_out: false,
            time_s: frame.time_s(),
            scratch: Scratch::default(),
        };
        new.learn_scene(frame, &bbox, 1.0);
        Ok(new)
    }

    /// Learns a background where nobody else knows one; `rate` is the weight of this frame.
    fn learn_scene(&mut self, frame: &Frame, bbox: &BBox, rate: f64) {
        if let Some(mask) = frame.foreground() {
            self.backdrop = None;
            self.stood_out |= share(mask, bbox).is_some_and(|fill| fill >= self.params.even);
            return;
        }
        match &mut self.backdrop {
            Some(backdrop) if backdrop.fits(frame) => {
                backdrop.place(&self.params, frame, &about(bbox, self.params.reach));
                backdrop.learn(&self.params, frame, bbox, rate);
            }
            Some(backdrop) if backdrop.turns() || frame.camera().is_none() => {}
            other => other.insert(Backdrop::new(frame)).learn(&self.params, frame, bbox, 1.0),
        }
    }

    /// What stands out about `expected`; `None` where the background is not known well enough, or moves.
    fn outline(&mut self, frame: &Frame, expected: &BBox) -> Option<Outline> {
        let params = &self.params;
        let around = about(expected, params.reach);
        if let Some(backdrop) = self.backdrop.as_mut().filter(|b| b.fits(frame)) {
            backdrop.place(params, frame, &around);
        }
        let window = PixelWindow::of(&around, frame.size())?;
        let inner = PixelWindow::of(expected, frame.size())?;
        let mask = match &mut self.scratch.mask {
            Some(mask) => mask,
            none => none.insert(Image::filled(1, 1, 0).ok()?),
        };
        mask.resize_for_overwrite(window.size(), 0).ok()?;
        match (frame.foreground(), &self.backdrop) {
            (Some(told), _) => (0..window.height).for_each(|y| {
                mask.row_mut(y).copy_from_slice(&told.row(window.y + y)[window.x..window.x + window.width]);
            }),
            (None, Some(backdrop)) if backdrop.fits(frame) => {
                let gain = (backdrop.gain(params, frame, &around) * 256.0).round().clamp(1.0, 4096.0) as i32;
                mark(backdrop, frame, &window, gain, params.threshold as i32, mask);
            }
            (None, _) => return None,
        }
        let (mut inside, mut outside) = (Tally::default(), Tally::default());
        for y in 0..window.height {
            let within_rows = (inner.y..inner.y + inner.height).contains(&(window.y + y));
            for (x, code) in mask.row_mut(y).iter_mut().enumerate() {
                if within_rows && (inner.x..inner.x + inner.width).contains(&(window.x + x)) {
                    inside.count(*code);
                } else {
                    outside.count(*code);
                    // What nobody knows belongs to the person only where the person is expected.
                    *code = if *code == UNKNOWN { 0 } else { *code };
                }
            }
        }
        let told = inside.known() >= params.least_known && outside.out() <= params.most_around;
        let fill = inside.out();
        // Who stood there when the scene was learnt does not stand out of it.
        let hidden = frame.foreground().is_some() && !self.stood_out && fill < params.even;
        (told && !hidden).then(|| Outline { bbox: self.rectangle(expected, &window), fill })
    }

    /// The rectangle about the regions of the mask that belong to `expected`: those that lie in it by half.
    fn rectangle(&mut self, expected: &BBox, window: &PixelWindow) -> Option<BBox> {
        let Scratch { mask, finder, .. } = &mut self.scratch;
        let params = &self.params;
        let least = (params.speck * expected.area()).max(params.speck_px) as usize;
        let boxes = finder.find(mask.as_ref()?.view(), least).iter().map(|r| {
            let b = r.bounds.to_bbox();
            b.translated(window.x as f64, window.y as f64)
        });
        boxes.filter(|b| b.fraction_inside(expected) >= params.inside).reduce(|a, b| a.union(&b))
    }
}

/// The box of the appearance's centre and area, and of the expected shape: correlation knows the first shape only.
fn shaped(found: &BBox, expected: &BBox) -> BBox {
    if expected.area() > 0.0 {
        expected.scaled((found.area() / expected.area()).sqrt()).centered_at(found.center())
    } else {
        *found
    }
}

/// How many pixels there are, of how many the background is known, and how many of those stand out of it.
#[derive(Debug, Clone, Copy, Default)]
struct Tally {
    all: usize,
    known: usize,
    out: usize,
}

impl Tally {
    fn count(&mut self, code: u8) {
        self.all += 1;
        self.known += usize::from(code != UNKNOWN);
        self.out += usize::from(code == OUT);
    }

    fn known(&self) -> f64 {
        self.known as f64 / self.all.max(1) as f64
    }

    fn out(&self) -> f64 {
        self.out as f64 / self.known.max(1) as f64
    }
}

/// Writes what stands out of `backdrop` times `gain` (in 256ths) inside `window`.
fn mark(backdrop: &Backdrop, frame: &Frame, window: &PixelWindow, gain: i32, threshold: i32, mask: &mut Image<u8>) {
    for y in 0..window.height {
        let row = backdrop.row(frame, window.y + y);
        for (x, code) in mask.row_mut(y).iter_mut().enumerate() {
            let out = backdrop.stands_out(row, window.x + x, window.y + y, gain, threshold);
            *code = out.map_or(UNKNOWN, |out| if out { OUT } else { 0 });
        }
    }
}

/// Share of `bbox` that stands out in `mask`; `None` outside of the picture.
fn share(mask: ImageView<'_, u8>, bbox: &BBox) -> Option<f64> {
    let window = PixelWindow::of(bbox, mask.size())?;
    let row = |y: usize| mask.row(y)[window.x..window.x + window.width].iter().filter(|v| **v == OUT).count();
    let out: usize = (window.y..window.y + window.height).map(row).sum();
    Some(out as f64 / (window.width * window.height).max(1) as f64)
}

/// Evidence in [−1, 1] from the share of a box that stands out.
fn evidence(fill: f64, even: f64) -> f64 {
    let spread = if fill >= even { even.min(1.0 - even) } else { even };
    ((fill - even) / spread).clamp(-1.0, 1.0)
}

/// `confidence` with `added` log-odds.
fn with_odds(confidence: f64, added: f64) -> f64 {
    let kept = confidence.clamp(1e-6, 1.0 - 1e-6);
    sigmoid(added + logit(kept))
}

/// A share `part` of the way from `a` to `b`.
fn between(a: &BBox, b: &BBox, part: f64) -> BBox {
    let mix = |a: f64, b: f64| a + part * (b - a);
    BBox::from_ltrb(
        mix(a.left(), b.left()),
        mix(a.top(), b.top()),
        mix(a.right(), b.right()),
        mix(a.bottom(), b.bottom()),
    )
}

impl Localizer for PersonLocalizer {
    type Finding = ResponsePeak;

    const FIGURES: &[&[Figure]] = &[CorrelationFigures::ALL, BackdropFigures::ALL];

    fn locate(&mut self, frame: &Frame, search: &Search) -> Result<Option<(Measurement, ResponsePeak)>> {
        self.appearance.locate(frame, search)
    }

    fn refine(
        &mut self,
        frame: &Frame,
        search: &Search,
        measurement: &mut Measurement,
        finding: &mut ResponsePeak,
    ) -> Result<()> {
        self.appearance.refine(frame, search, measurement, finding)?;
        measurement.bbox = shaped(&measurement.bbox, &search.expected);
        let Some(outline) = self.outline(frame, &measurement.bbox) else { return Ok(()) };
        let evidence = evidence(outline.fill, self.params.even);
        measurement.confidence = with_odds(measurement.confidence, self.params.weight * evidence);
        BackdropFigures { fill: outline.fill }.report(&mut measurement.diagnostics);
        let same = outline.bbox.filter(|b| evidence > 0.0 && b.iou(&measurement.bbox) >= self.params.agree);
        if let Some(outline) = same {
            measurement.bbox = between(&measurement.bbox, &outline, self.params.outline);
        }
        Ok(())
    }

    fn adapt(&mut self, frame: &Frame, bbox: BBox, finding: &ResponsePeak) -> Result<()> {
        self.appearance.adapt(frame, bbox, finding)
    }

    fn observe(&mut self, frame: &Frame, outcome: &Outcome<'_, ResponsePeak>) -> Result<()> {
        let dt_s = frame.time_s() - self.time_s;
        if frame.time_s().is_finite() {
            self.time_s = frame.time_s();
        }
        self.learn_scene(frame, &outcome.bbox, learning_rate(dt_s, self.params.history_s));
        Ok(())
    }

    fn restart(&mut self, frame: &Frame, bbox: BBox) -> Result<()> {
        self.appearance.restart(frame, bbox)?;
        (self.backdrop, self.stood_out) = (None, false);
        self.learn_scene(frame, &bbox, 1.0);
        self.time_s = frame.time_s();
        Ok(())
    }

    fn view(&self, expected: &BBox) -> Option<ViewSize> {
        self.appearance.view(expected)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_full_box_speaks_for_a_person() {
        for (fill, expected) in [(0.0, -1.0), (0.125, -0.5), (0.25, 0.0), (0.375, 0.5), (0.5, 1.0), (0.9, 1.0)] {
            assert!((evidence(fill, 0.25) - expected).abs() < 1e-12, "{fill}");
        }
        assert!((evidence(0.9, 0.8) - 0.5).abs() < 1e-12);
        assert!((with_odds(0.5, 0.0) - 0.5).abs() < 1e-12);
        assert!((with_odds(0.5, 2.0) - 1.0 / (1.0 + (-2.0f64).exp())).abs() < 1e-12);
        assert!((with_odds(0.9, -(9.0f64.ln())) - 0.5).abs() < 1e-9);
        assert!(with_odds(0.0, 3.0) < 1e-3 && with_odds(1.0, -3.0) > 0.999);
    }

    /// A frame in which somebody else says what stands out: a rectangle from `left` on, if any.
    fn told(left: Option<usize>) -> Frame {
        let inside = |x: usize, y: usize| left.is_some_and(|l| (l..l + 10).contains(&x) && (10..40).contains(&y));
        let image = Image::from_fn(80, 60, |x, y| if inside(x, y) { [200, 40, 40] } else { [(3 * x) as u8, 90, 70] });
        let mask = Image::from_fn(80, 60, |x, y| if inside(x, y) { OUT } else { 0 }).unwrap();
        Frame::new(0, 0.0, image.unwrap()).with_foreground(std::sync::Arc::new(mask)).unwrap()
    }

    #[test]
    fn what_others_say_stands_out_is_the_outline() {
        let here = BBox::from_ltwh(30.0, 10.0, 10.0, 30.0);
        let mut person = PersonLocalizer::new(&PersonParams::default(), &told(Some(30)), here).unwrap();
        assert!(person.backdrop.is_none(), "one background is enough");
        let about = BBox::from_ltwh(28.0, 8.0, 12.0, 34.0);
        let seen = person.outline(&told(Some(30)), &about).unwrap();
        assert_eq!(seen, Outline { bbox: Some(here), fill: 300.0 / 408.0 });
        let gone = person.outline(&told(None), &about).unwrap();
        assert_eq!(gone, Outline { bbox: None, fill: 0.0 });
    }

    #[test]
    fn who_was_there_first_is_not_denied() {
        let here = BBox::from_ltwh(30.0, 10.0, 10.0, 30.0);
        // The scene was learnt with the person in it: nothing stands out, which says nothing.
        let mut person = PersonLocalizer::new(&PersonParams::default(), &told(None), here).unwrap();
        assert_eq!(person.outline(&told(None), &here), None);
        // Until the person has moved.
        person.learn_scene(&told(Some(33)), &here.translated(3.0, 0.0), 0.1);
        assert_eq!(person.outline(&told(None), &here).unwrap().fill, 0.0);
    }

    #[test]
    fn a_background_of_its_own_begins_where_nobody_says() {
        let here = BBox::from_ltwh(30.0, 10.0, 10.0, 30.0);
        let silent = |left| Frame::new(0, 0.0, told(left).color().to_image());
        let mut person = PersonLocalizer::new(&PersonParams::default(), &silent(Some(30)), here).unwrap();
        assert!(person.backdrop.is_some());
        person.learn_scene(&told(Some(30)), &here, 0.1);
        assert!(person.backdrop.is_none());
        person.learn_scene(&silent(Some(30)), &here, 0.1);
        assert_eq!(person.outline(&silent(Some(45)), &here.translated(15.0, 0.0)).unwrap().fill, 1.0);
    }

    #[test]
    fn boxes_are_widened_and_mixed_side_by_side() {
        let b = BBox::from_ltwh(10.0, 20.0, 20.0, 40.0);
        assert_eq!(about(&b, 0.25), BBox::from_ltrb(5.0, 10.0, 35.0, 70.0));
        let other = BBox::from_ltrb(14.0, 20.0, 34.0, 68.0);
        assert_eq!(between(&b, &other, 0.25), BBox::from_ltrb(11.0, 20.0, 31.0, 62.0));
        assert_eq!((between(&b, &other, 0.0), between(&b, &other, 1.0)), (b, other));
    }

    #[test]
    fn shares_are_of_what_is_known() {
        let mut tally = Tally::default();
        assert_eq!((tally.known(), tally.out()), (0.0, 0.0));
        [OUT, 0, 0, OUT, UNKNOWN].into_iter().for_each(|v| tally.count(v));
        assert_eq!((tally.known(), tally.out()), (0.8, 0.5));
    }
}
