use super::FlowParams;
use pursuit_geometry::{BBox, Size};
use pursuit_imaging::{Frame, Image, ImageView};
use pursuit_tracking::parameters::Parameters;
use pursuit_tracking::{Result, TrackingError};
use pursuit_vision::flow::{BoxMotion, MedianFlow, Pyramid};
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

    /// Where the box is in `frame`; `None` when its points do not agree on that. Changes nothing but scratch.
    ///
    /// # Errors
    /// When the frame has another size than the one kept.
    pub fn follow(&mut self, frame: &Frame) -> Result<Option<BoxMotion>> {
        if frame.size() != self.frame {
            let (index, expected, actual) = (frame.index(), self.frame, frame.size());
            return Err(TrackingError::FrameSize { index, expected, actual });
        }
        self.now.build(cut(frame.gray(), &self.window), self.params.levels).map_err(failed(frame))?;
        let (dx, dy) = (self.window.x as f64, self.window.y as f64);
        let cover = self.params.cover;
        let inner = self.bbox.translated(-dx, -dy).scaled(cover);
        let motion = self.flow.estimate(&self.kept, &self.now, &inner).map_err(failed(frame))?;
        let moved = motion.ok().map(|m| BoxMotion { bbox: m.bbox.translated(dx, dy).scaled(1.0 / cover), ..m });
        Ok(moved.filter(|m| m.bbox.clipped_to(frame.size()).is_some()))
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

fn failed(frame: &Frame) -> impl FnOnce(VisionError) -> TrackingError {
    let index = frame.index();
    move |e| TrackingError::Computation { tracker: "flow".to_owned(), index, source: Box::new(e) }
}
