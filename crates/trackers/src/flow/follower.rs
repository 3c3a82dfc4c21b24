use super::FlowParams;
use pursuit_geometry::{BBox, Size};
use pursuit_imaging::{Frame, Image, ImageView};
use pursuit_parameters::Parameters;
use pursuit_tracking::{Result, TrackingError};
use pursuit_vision::flow::{BoxMotion, MedianFlow, Pyramid, Start};
use pursuit_vision::{PixelWindow, VisionError};
use serde::{Deserialize, Serialize};

/// Follows a box from the frame it was kept in to any later one, by median flow (kalal2010).
///
/// Of a frame only the neighbourhood of the box is kept, so that time and memory go by the target, not by the picture.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(try_from = "Raw", into = "Raw")]
pub struct Follower {
    params: FlowParams,
    bbox: BBox,
    /// Which pixels are kept.
    window: PixelWindow,
    kept: Pyramid,
    frame: Size,
    flow: MedianFlow,
    /// The same pixels of the frame followed to; scratch.
    now: Pyramid,
}

/// What is stored.
#[derive(Clone, Serialize, Deserialize)]
struct Raw {
    params: FlowParams,
    bbox: BBox,
    window: [usize; 4],
    frame: (usize, usize),
    pixels: Vec<u8>,
}

impl From<Follower> for Raw {
    fn from(it: Follower) -> Self {
        let PixelWindow { x, y, width, height } = it.window;
        let pixels = it.kept.level(0).map(|level| level.to_image().into_vec()).unwrap_or_default();
        let frame = (it.frame.width, it.frame.height);
        Self { params: it.params, bbox: it.bbox, window: [x, y, width, height], frame, pixels }
    }
}

impl TryFrom<Raw> for Follower {
    type Error = String;

    fn try_from(raw: Raw) -> Result<Self, Self::Error> {
        raw.params.check_all().map_err(|(name, problem)| format!("`{name}` {problem}"))?;
        let [x, y, width, height] = raw.window;
        let frame = Size::new(raw.frame.0, raw.frame.1);
        let fits = |from: usize, side: usize, all: usize| from.checked_add(side).is_some_and(|end| end <= all);
        if !fits(x, width, frame.width) || !fits(y, height, frame.height) || !raw.bbox.is_finite() {
            return Err("what it keeps lies outside of the frame".to_owned());
        }
        let kept = Image::from_vec(raw.pixels, width, height).map_err(|e| e.to_string())?;
        let kept = Pyramid::of(kept.view(), raw.params.levels).map_err(|e| e.to_string())?;
        let flow = raw.params.estimator().map_err(|e| e.to_string())?;
        let window = PixelWindow { x, y, width, height };
        Ok(Self { params: raw.params, bbox: raw.bbox, window, now: kept.clone(), kept, frame, flow })
    }
}

impl Follower {
    /// A follower of the box `bbox` of `frame`.
    ///
    /// # Errors
    /// When a parameter is out of range.
    pub fn new(params: FlowParams, frame: &Frame, bbox: BBox) -> Result<Self> {
        let flow = params.estimator()?;
        let window = neighbourhood(&params, &bbox, frame.size());
        let view = cut(frame.gray(), &window);
        let kept = Pyramid::of(view, params.levels).map_err(failed(frame))?;
        Ok(Self { params, bbox, window, now: kept.clone(), kept, frame: frame.size(), flow })
    }

    /// Its parameters.
    pub const fn params(&self) -> &FlowParams {
        &self.params
    }

    /// The box followed, in the frame kept.
    pub const fn bbox(&self) -> &BBox {
        &self.bbox
    }

    /// Where the box, predicted at `expected`, is in `frame`; `None` when its points do not agree on that. Changes nothing but
    /// scratch.
    ///
    /// # Errors
    /// When the frame has another size than the one kept.
    pub fn follow(&mut self, frame: &Frame, expected: &BBox) -> Result<Option<BoxMotion>> {
        if frame.size() != self.frame {
            let (index, expected, actual) = (frame.index(), self.frame, frame.size());
            return Err(TrackingError::FrameSize { index, expected, actual });
        }
        self.now.build(cut(frame.gray(), &self.window), self.params.levels).map_err(failed(frame))?;
        let (dx, dy) = (self.window.x as f64, self.window.y as f64);
        let cover = self.params.cover;
        let inner = self.bbox.translated(-dx, -dy).scaled(cover);
        let motion = match self.guided(expected, &inner).map_err(failed(frame))? {
            Some(motion) => Some(motion),
            None => self.flow.estimate(&self.kept, &self.now, &inner).map_err(failed(frame))?.ok(),
        };
        let moved = motion.map(|m| BoxMotion { bbox: m.bbox.translated(dx, dy).scaled(1.0 / cover), ..m });
        Ok(moved.filter(|m| m.bbox.clipped_to(frame.size()).is_some()))
    }

    /// Where the points of `inner` went, looked for about the prediction alone, if they came back well enough.
    fn guided(&mut self, expected: &BBox, inner: &BBox) -> std::result::Result<Option<BoxMotion>, VisionError> {
        let levels = self.params.guided_levels;
        if levels == 0 {
            return Ok(None);
        }
        let (was, is) = (self.bbox.center(), expected.center());
        let start = Start { shift: (is.x - was.x, is.y - was.y), levels };
        let motion = self.flow.estimate_from(&self.kept, &self.now, inner, start)?;
        Ok(motion.ok().filter(|m| m.forward_backward_px <= self.params.guided_error_px))
    }

    /// Keeps `frame`, in which the box is `bbox`, to follow it from there.
    ///
    /// # Errors
    /// When the neighbourhood of the box cannot be kept.
    pub fn keep(&mut self, frame: &Frame, bbox: BBox) -> Result<()> {
        self.window = neighbourhood(&self.params, &bbox, frame.size());
        self.kept.build(cut(frame.gray(), &self.window), self.params.levels).map_err(failed(frame))?;
        (self.bbox, self.frame) = (bbox, frame.size());
        Ok(())
    }
}

/// The pixels about the box within which its points may move.
fn neighbourhood(params: &FlowParams, bbox: &BBox, frame: Size) -> PixelWindow {
    let margin = (params.margin * bbox.width().max(bbox.height())).max(params.least_margin_px);
    PixelWindow::of(&bbox.expanded(margin), frame).unwrap_or(PixelWindow::full(frame))
}

fn cut<'a>(gray: ImageView<'a, u8>, window: &PixelWindow) -> ImageView<'a, u8> {
    gray.crop(window.x, window.y, window.width, window.height).unwrap_or(gray)
}

pub(super) fn failed(frame: &Frame) -> impl FnOnce(VisionError) -> TrackingError {
    let index = frame.index();
    move |e| TrackingError::Computation { tracker: "flow".to_owned(), index, source: Box::new(e) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Smooth noise in cells of `cell` pixels.
    fn noise(x: i32, y: i32, cell: i32) -> f64 {
        let (i, j) = (x.div_euclid(cell), y.div_euclid(cell));
        let share = |v: i32| f64::from(v.rem_euclid(cell)) / f64::from(cell);
        let at = |i: i32, j: i32| {
            let mut seed = ((i + 1000) * 4000 + j + 1000 + cell) as u64;
            (crate::appearance::draw(&mut seed) >> 56) as f64
        };
        let row = |j: i32| at(i, j) + share(x) * (at(i + 1, j) - at(i, j));
        row(j) + share(y) * (row(j + 1) - row(j))
    }

    /// A texture, moved by (`dx`, `dy`) pixels.
    fn frame(dx: i32, dy: i32) -> Frame {
        let at = |x: usize, y: usize| (x as i32 - dx, y as i32 - dy);
        let image = Image::from_fn(200, 160, |x, y| {
            let (x, y) = at(x, y);
            ((noise(x, y, 6) + 2.0 * noise(x, y, 15)) / 3.0) as u8
        });
        Frame::new(0, 0.0, image.unwrap())
    }

    fn followed(guided_levels: usize, bbox: BBox, expected: BBox, to: &Frame) -> BoxMotion {
        let params = FlowParams { guided_levels, ..FlowParams::eight_px() };
        Follower::new(params, &frame(0, 0), bbox).unwrap().follow(to, &expected).unwrap().unwrap()
    }

    #[test]
    fn wrong_predictions_leave_points_as_without_one() {
        let bbox = BBox::from_ltwh(70.0, 50.0, 44.0, 36.0);
        let (to, moved) = (frame(12, -9), bbox.translated(12.0, -9.0));
        // One level alone does not see 15 pixels far: what is found there, is by the prediction.
        let near = followed(1, bbox, moved.translated(0.7, -0.4), &to);
        assert!(near.bbox.iou(&moved) > 0.97 && near.forward_backward_px < 0.1, "{near:?}");
        let plain = followed(0, bbox, moved, &to);
        assert!(plain.bbox.iou(&moved) > 0.97 && plain != near);
        for wrong in [bbox, bbox.translated(-13.0, 19.0), bbox.translated(400.0, 0.0), bbox.translated(f64::NAN, 0.0)] {
            assert_eq!(followed(1, bbox, wrong, &to), plain, "{wrong}");
        }
    }
}
