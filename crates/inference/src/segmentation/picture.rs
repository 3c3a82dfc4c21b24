//! What goes into a network: a part of the frame, resampled, where it lies in the network's picture, and how that is stored.

use super::{SegmentationConfig, misfit};
use crate::detection::Placing;
use crate::onnx::Declared;
use crate::resample::{Resampler, Window};
use crate::siamese::ChannelOrder;
use crate::{Network, Port, Result};
use pursuit_geometry::{BBox, Size};
use pursuit_imaging::{ImageView, Rgb8};

/// Width and height of a picture that neither file nor description tells.
const USUAL_PX: usize = 1024;

/// How a picture is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Order {
    /// Plane after plane.
    Planes,
    /// Pixel after pixel.
    Pixels,
}

/// The picture that a network takes.
#[derive(Debug, Clone)]
pub(super) struct Picture {
    order: Order,
    pub width: usize,
    pub height: usize,
    /// Whether grey levels go in as they are: the network subtracts and divides itself.
    pub is_raw: bool,
    resampler: Resampler,
    /// What the rest of the picture was filled for.
    filled: Option<Shown>,
}

/// A part of the frame in a network's picture: pixel edges of the frame lie at `(x − left) · across + at.0`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Shown {
    /// The part, whole pixels of the frame; it may reach beyond.
    pub window: Window,
    /// Pixels of the picture for one of the frame.
    pub across: f64,
    pub down: f64,
    /// Left and top of the part in the picture, and the columns and rows that it takes.
    pub at: (usize, usize),
    pub size: (usize, usize),
}

impl Shown {
    /// The part `window` in a picture of `width` × `height`. In a corner, sides are rounded to the nearest pixel, as Segment Anything does
    /// (`segment_anything/utils/transforms.py`, `get_preprocess_shape`), and each side has the ratio that this leaves.
    pub fn new(window: Window, (width, height): (usize, usize), place: Placing) -> Self {
        let (from_width, from_height) = (window.width.max(1) as f64, window.height.max(1) as f64);
        let ratio = (width as f64 / from_width).min(height as f64 / from_height);
        let fit = |side: f64, most: usize| ((side * ratio + 0.5) as usize).clamp(1, most.max(1));
        let fitted = (fit(from_width, width), fit(from_height, height));
        let (size, at) = match place {
            Placing::Corner => (fitted, (0, 0)),
            Placing::Middle => (fitted, ((width - fitted.0) / 2, (height - fitted.1) / 2)),
            Placing::Stretched => ((width, height), (0, 0)),
        };
        Self { window, across: size.0 as f64 / from_width, down: size.1 as f64 / from_height, at, size }
    }

    /// A point of the frame in the picture.
    pub fn place(&self, x: f64, y: f64) -> (f64, f64) {
        let Window { left, top, .. } = self.window;
        ((x - left as f64) * self.across + self.at.0 as f64, (y - top as f64) * self.down + self.at.1 as f64)
    }
}

/// Whole pixels about `bbox` and `context` of its sides about it. It may reach beyond the frame, but by no more than the frame's own sides.
pub(super) fn about(bbox: &BBox, context: f64, frame: Size) -> Window {
    let along = |from: f64, side: f64, frame: usize| {
        let (least, most) = (-(frame as f64), 2.0 * frame as f64);
        let first = (from - context * side).floor().clamp(least, most - 1.0);
        let last = (from + side + context * side).ceil().clamp(first + 1.0, most);
        (first as i64, (last - first) as i64)
    };
    let ((left, width), (top, height)) =
        (along(bbox.left(), bbox.width(), frame.width), along(bbox.top(), bbox.height(), frame.height));
    Window { left, top, width, height }
}

/// That part of a window which is in the frame; all of the frame where none is.
pub(super) fn inside(window: Window, frame: Size) -> Window {
    let along = |from: i64, side: i64, frame: usize| {
        let frame = frame as i64;
        let (first, last) = (from.clamp(0, frame), (from + side).clamp(0, frame));
        if last > first { (first, last - first) } else { (0, frame) }
    };
    let ((left, width), (top, height)) =
        (along(window.left, window.width, frame.width), along(window.top, window.height, frame.height));
    Window { left, top, width, height }
}

impl Picture {
    /// The picture that is the one input of a file.
    ///
    /// # Errors
    /// What is no picture of three channels.
    pub fn shape_of(file: &str, inputs: &[Declared], config: &SegmentationConfig) -> Result<(String, Vec<usize>)> {
        let [input] = inputs else {
            return Err(misfit(file, format!("it has {} inputs, where a picture is wanted", inputs.len())));
        };
        let [width, height] = config.image_px.unwrap_or([USUAL_PX; 2]);
        let (width, height) = (Some(width), Some(height));
        // What the file leaves open is as said; what it names counts.
        let shape = match *input.shape.as_slice() {
            [n, Some(3), h, w] => [n.or(Some(1)), Some(3), h.or(height), w.or(width)].to_vec(),
            [n, h, w, Some(3)] => [n.or(Some(1)), h.or(height), w.or(width), Some(3)].to_vec(),
            [h, w, Some(3)] => [h.or(height), w.or(width), Some(3)].to_vec(),
            [n, None, h, w] => [n.or(Some(1)), Some(3), h.or(height), w.or(width)].to_vec(),
            _ => return Err(misfit(file, format!("its input `{}` is no picture of three channels", input.name))),
        };
        Ok((input.name.clone(), shape.into_iter().flatten().collect()))
    }

    /// The picture that a network takes.
    ///
    /// # Errors
    /// [`InferenceError::Model`](crate::InferenceError::Model) if it takes something else.
    pub fn of(network: &dyn Network) -> Result<Self> {
        let inputs: &[Port] = network.inputs();
        let [port] = inputs else {
            return Err(misfit(network.name(), format!("it has {} inputs, where a picture is wanted", inputs.len())));
        };
        let (order, width, height) = match *port.shape.as_slice() {
            [1, 3, height, width] => (Order::Planes, width, height),
            [1, height, width, 3] | [height, width, 3] => (Order::Pixels, width, height),
            _ => {
                let why = format!("its input `{}` is {:?}, no picture of three channels", port.name, port.shape);
                return Err(misfit(network.name(), why));
            }
        };
        if width == 0 || height == 0 {
            return Err(misfit(network.name(), "its picture has no pixel".into()));
        }
        // Exports that take pixels in rows and no batch have the normalisation inside.
        let is_raw = port.shape.len() == 3;
        Ok(Self { order, width, height, is_raw, resampler: Resampler::default(), filled: None })
    }

    /// Writes the part of `image` into `input`; what it leaves is the mean colour.
    pub fn write(&mut self, image: ImageView<'_, Rgb8>, shown: &Shown, config: &SegmentationConfig, input: &mut [f32]) {
        let Self { order, width, height, is_raw, resampler, filled } = self;
        let (width, height, order) = (*width, *height, *order);
        let (mean, deviation) = (config.mean, config.deviation);
        let normal = |value: f32, c: usize| if *is_raw { value } else { (value - mean[c]) / deviation[c] };
        let place = |x: usize, y: usize, c: usize| match order {
            Order::Planes => (c * height + y) * width + x,
            Order::Pixels => (y * width + x) * 3 + c,
        };
        if *filled != Some(*shown) {
            let fills = [0, 1, 2].map(|c| normal(mean[c], c));
            for (k, to) in input.iter_mut().enumerate() {
                *to = fills[match order {
                    Order::Planes => k / (width * height),
                    Order::Pixels => k % 3,
                }
                .min(2)];
            }
            *filled = Some(*shown);
        }
        let channels = match config.channels {
            ChannelOrder::Rgb => [0, 1, 2],
            ChannelOrder::Bgr => [2, 1, 0],
        };
        let mut fill: Rgb8 = [0; 3];
        for (c, channel) in channels.iter().enumerate() {
            fill[*channel] = mean[c].round().clamp(0.0, 255.0) as u8;
        }
        let (left, top) = shown.at;
        resampler.resample(image, shown.window, shown.size, fill, |y, planes| {
            for (c, channel) in channels.iter().enumerate() {
                for (x, pixel) in planes[*channel].iter().enumerate() {
                    if let Some(to) = input.get_mut(place(left + x, top + y, c)) {
                        *to = normal(*pixel, c);
                    }
                }
            }
        });
    }
}
