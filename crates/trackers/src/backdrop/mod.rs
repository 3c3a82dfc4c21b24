//! What is known of the background, pixel by pixel: a selective running average that knows where it knows nothing yet. Where
//! frames say how their camera stands, it turns with the camera.

mod canvas;
mod marks;
mod turning;

use canvas::{Canvas, UNIT};
use pursuit_geometry::{BBox, Point, Size};
use pursuit_imaging::Frame;
use pursuit_vision::PixelWindow;
use serde::{Deserialize, Serialize};
use turning::Turning;

pursuit_parameters::parameters! {
    /// The background of the person tracker.
    pub struct BackdropParams {
        /// Time constant of the running average.
        pub history_s: f64 = 10.0, in above(0.0), unit "s", source "ours";
        /// A pixel stands out when a channel differs from the background by more.
        pub threshold: usize = 30, in 1..=254, unit "codes", source "ours";
        /// The target and this much about it, at each side, is not learnt.
        pub margin: f64 = 0.12, in 0.0..=2.0, unit "target sizes", source "ours";
        /// How far about the expected box to look for the person's outline.
        pub reach: f64 = 0.25, in 0.0..=2.0, unit "target sizes", source "ours";
        /// Least share of the expected box whose background must be known for it to count.
        pub least_known: f64 = 0.5, in 0.0..=1.0, source "ours";
        /// When more than this share of what surrounds the expected box stands out, the camera moves, or a crowd does: the background
        /// does not count.
        pub most_around: f64 = 0.35, in 0.0..=1.0, source "ours";
        /// Log-odds that a box full of what stands out adds, and an empty one takes away.
        pub weight: f64 = 3.0, in 0.0..=20.0, source "ours";
        /// Share of a box that stands out at which nothing is added or taken away. People fill about a half of their boxes.
        pub even: f64 = 0.25, in above(0.0).below(1.0), source "ours";
        /// How far the box goes from the appearance's to the outline's.
        pub outline: f64 = 0.6, in 0.0..=1.0, source "ours";
        /// Regions smaller than this share of the expected box are noise.
        pub speck: f64 = 0.02, in 0.0..=1.0, source "ours";
        /// So are those of fewer pixels than this.
        pub speck_px: f64 = 4.0, in 0.0..=1e6, unit "px", source "ours";
        /// A region belongs to the person when this share of it lies in the expected box.
        pub inside: f64 = 0.5, in 0.0..=1.0, source "ours";
        /// Every how many pixels, both ways, brightness is compared.
        pub light_step: usize = 4, in 1..=256, unit "px", source "ours";
        /// A pixel whose brightness, of all channels together, has changed by more than this factor and `light_offset` shows something
        /// else, not another light.
        pub light_factor: f64 = 2.0, in 1.0..=100.0, source "ours";
        /// See `light_factor`.
        pub light_offset: f64 = 30.0, in 0.0..=765.0, unit "codes", source "ours";
        /// How far a picture may lie from where the pose of its camera says, for the edges of the background to put it right; 0: the
        /// pose is taken at its word.
        pub turn_error: f64 = 0.06, in 0.0..=0.5, unit "of the picture's width", source "ours";
        /// Least overlap (IoU) of the outline's box with the appearance's for it to be the same person.
        pub agree: f64 = 0.3, in 0.0..=1.0, source "ours";
    }
}

/// The background as a camera sees it.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(remote = "Backdrop")]
pub(crate) struct Backdrop {
    /// Width and height of the pictures.
    picture: (usize, usize),
    canvas: Canvas,
    /// `None`: the camera stands still, and the canvas is the picture.
    turning: Option<Turning>,
}

pursuit_estimation::checked!(Backdrop);

impl Backdrop {
    fn restored(self) -> Result<Self, &'static str> {
        let (width, height) = self.picture;
        let size = Size::new(width, height);
        let wanted = self.turning.as_ref().map_or(size, |_| Turning::canvas(size));
        if width > 0 && height > 0 && self.canvas.is_sound(wanted) {
            Ok(self)
        } else {
            Err("its background has no size")
        }
    }
}

impl Backdrop {
    pub fn new(frame: &Frame) -> Self {
        let size = frame.size();
        let turning = frame.camera().map(|pose| Turning::new(*pose, size));
        let canvas = if turning.is_some() { Turning::canvas(size) } else { size };
        let channels = if frame.has_color() { 3 } else { 1 };
        Self { picture: (size.width, size.height), canvas: Canvas::new(canvas, channels), turning }
    }

    /// The same, of which a place is known only once it was seen alike in several frames: what passes by is no background.
    pub fn steady(self) -> Self {
        Self { canvas: self.canvas.steady(), ..self }
    }

    /// Whether it is the background of such frames.
    pub fn fits(&self, frame: &Frame) -> bool {
        frame.size() == self.size()
            && (self.canvas.channels() == 1 || frame.has_color())
            && frame.camera().is_some() == self.turning.is_some()
    }

    /// Whether its camera turns: it says how it stands.
    pub const fn turns(&self) -> bool {
        self.turning.is_some()
    }

    fn size(&self) -> Size {
        Size::new(self.picture.0, self.picture.1)
    }

    /// Says where the frame lies on the background of a camera that turns, by the camera's pose and by what is seen outside of
    /// `keep`. Before anything else is asked of a frame; of a camera that stands still it needs not be said.
    pub fn place(&mut self, params: &BackdropParams, frame: &Frame, keep: &BBox) {
        if let (Some(turning), Some(pose)) = (&mut self.turning, frame.camera()) {
            turning.place(params, (frame, *pose), keep, &mut self.canvas);
        }
    }

    /// How far the frame placed last lies from where its pose says, pixels to the right and down; 0 of a camera that stands still.
    pub fn off(&self) -> (f64, f64) {
        self.turning.as_ref().map_or((0.0, 0.0), Turning::off)
    }

    /// By how many codes the edges of the background differ where the frame placed last lies: little where it lies right. 0 of a camera
    /// that stands still, and where there are too few of them to say.
    pub fn difference(&self) -> f64 {
        self.turning.as_ref().map_or(0.0, Turning::difference)
    }

    /// Of a camera that turns: learns what is not `kept`, which is told places in the picture, with weight `rate`.
    pub fn learn_where(&mut self, frame: &Frame, kept: impl Fn(Point) -> bool, rate: f64) {
        if let Some(turning) = &mut self.turning {
            turning.learn(frame, kept, rate, &mut self.canvas);
        }
    }

    /// Learns everything but the target at `bbox` and `margin` about it, with weight `rate`; what was never seen is taken as it is.
    pub fn learn(&mut self, params: &BackdropParams, frame: &Frame, bbox: &BBox, rate: f64) {
        let window = PixelWindow::of(&about(bbox, params.margin), frame.size());
        if self.turns() {
            let within = |at: Point| {
                window.is_some_and(|w| {
                    let (x, y) = (at.x - w.x as f64, at.y - w.y as f64);
                    x >= 0.0 && y >= 0.0 && x <= w.width as f64 && y <= w.height as f64
                })
            };
            return self.learn_where(frame, within, rate);
        }
        let Size { width, height } = self.size();
        for y in 0..height {
            let kept =
                window.filter(|w| (w.y..w.y + w.height).contains(&y)).map_or(width..width, |w| w.x..w.x + w.width);
            for part in [0..kept.start, kept.end..width] {
                self.canvas.learn_row(row(frame, y, self.canvas.channels()), y, part, rate);
            }
        }
    }

    /// How much brighter the frame is than the background, outside of `keep`: a ratio of sums over a grid of pixels that did not
    /// change much. 1 where nothing is known.
    pub fn gain(&self, params: &BackdropParams, frame: &Frame, keep: &BBox) -> f64 {
        let window = PixelWindow::of(keep, frame.size());
        let channels = self.canvas.channels();
        let (mut now, mut was) = (1.0, 1.0);
        for y in (0..self.picture.1).step_by(params.light_step) {
            let pixels = row(frame, y, channels);
            for x in (0..self.picture.0).step_by(params.light_step) {
                let kept =
                    window.is_some_and(|w| (w.x..w.x + w.width).contains(&x) && (w.y..w.y + w.height).contains(&y));
                let Some(mean) = self.nearest(x, y).filter(|_| !kept).and_then(|at| self.canvas.known(at)) else {
                    continue;
                };
                let value: f64 = pixels[x * channels..(x + 1) * channels].iter().map(|v| f64::from(*v)).sum();
                let mean = mean.iter().map(|v| f64::from(*v)).sum::<f64>() / f64::from(UNIT);
                let most = |v: f64| params.light_factor * v + params.light_offset;
                if value < most(mean) && mean < most(value) {
                    now += value;
                    was += mean;
                }
            }
        }
        now / was
    }

    /// The number of the canvas's pixel at the picture's.
    fn nearest(&self, x: usize, y: usize) -> Option<usize> {
        match &self.turning {
            None => Some(y * self.picture.0 + x),
            Some(turning) => turning.nearest(Point::new(x as f64 + 0.5, y as f64 + 0.5), &self.canvas),
        }
    }

    /// What a pixel is: `None` where nothing is known, else whether it stands out of the background times `gain`, in 256ths. Of a
    /// camera that turns, it stands out of all that the background's nearest pixels span.
    pub fn stands_out(&self, pixels: &[u8], x: usize, y: usize, gain: i32, threshold: i32) -> Option<bool> {
        let channels = self.canvas.channels();
        let pixel = &pixels[x * channels..(x + 1) * channels];
        let lit = |mean: u16| (i32::from(mean) * gain) >> 8;
        let Some(turning) = &self.turning else {
            let mean = self.canvas.known(y * self.picture.0 + x)?;
            let off = pixel.iter().zip(mean).map(|(v, m)| (i32::from(*v) * UNIT - lit(*m)).abs()).max();
            return Some(off.unwrap_or(0) > threshold * UNIT);
        };
        let span = turning.span(Point::new(x as f64 + 0.5, y as f64 + 0.5), &self.canvas)?;
        let far = |(value, [least, most]): (&u8, &[u16; 2])| {
            let value = i32::from(*value) * UNIT;
            lit(*least) - value > threshold * UNIT || value - lit(*most) > threshold * UNIT
        };
        Some(pixel.iter().zip(&span).any(far))
    }

    pub fn row<'a>(&self, frame: &'a Frame, y: usize) -> &'a [u8] {
        row(frame, y, self.canvas.channels())
    }
}

/// `bbox` and a share of its sides about it.
pub(crate) fn about(bbox: &BBox, share: f64) -> BBox {
    let (dx, dy) = (share * bbox.width(), share * bbox.height());
    BBox::from_ltrb(bbox.left() - dx, bbox.top() - dy, bbox.right() + dx, bbox.bottom() + dy)
}

/// The pixels of a frame, channel after channel.
fn row(frame: &Frame, y: usize, channels: usize) -> &[u8] {
    if channels == 1 { frame.gray().row(y) } else { frame.color().row(y).as_flattened() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_imaging::{Image, Pixels};

    fn frame(light: f64, person: Option<usize>) -> Frame {
        let image = Image::from_fn(40, 30, |x, y| {
            let base = [60.0 + x as f64, 90.0, 50.0 + 2.0 * y as f64];
            let inside = person.is_some_and(|left| (left..left + 6).contains(&x) && (8..24).contains(&y));
            if inside { [200, 30, 30] } else { base.map(|v| (v * light) as u8) }
        });
        Frame::new(0, 0.0, Pixels::Rgb8(image.unwrap().into()))
    }

    fn usual() -> BackdropParams {
        BackdropParams { margin: 0.0, ..BackdropParams::default() }
    }

    fn told(backdrop: &Backdrop, frame: &Frame, x: usize, y: usize, gain: f64) -> Option<bool> {
        backdrop.stands_out(backdrop.row(frame, y), x, y, (gain * 256.0) as i32, 30)
    }

    #[test]
    fn only_what_was_seen_is_known() {
        let here = BBox::from_ltwh(9.0, 7.0, 8.0, 18.0);
        let mut backdrop = Backdrop::new(&frame(1.0, None));
        backdrop.learn(&usual(), &frame(1.0, Some(10)), &here, 0.1);
        assert_eq!(told(&backdrop, &frame(1.0, Some(10)), 12, 12, 1.0), None);
        assert_eq!(told(&backdrop, &frame(1.0, Some(20)), 22, 12, 1.0), Some(true));
        assert_eq!(told(&backdrop, &frame(1.0, Some(20)), 30, 12, 1.0), Some(false));
        // What the person leaves is taken as it is.
        backdrop.learn(&usual(), &frame(1.0, Some(20)), &here.translated(10.0, 0.0), 0.1);
        assert_eq!(told(&backdrop, &frame(1.0, None), 12, 12, 1.0), Some(false));
        assert_eq!(told(&backdrop, &frame(1.0, Some(10)), 12, 12, 1.0), Some(true));
        // What stays is learnt at the rate told: 107 codes of red, 80, 60, 45, 34, 25.
        let free = BBox::from_ltwh(0.0, 0.0, 0.5, 0.5);
        for (expected, _) in [(true, 0), (true, 1), (true, 2), (true, 3), (true, 4), (false, 5)] {
            assert_eq!(told(&backdrop, &frame(1.0, Some(30)), 33, 12, 1.0), Some(expected));
            backdrop.learn(&usual(), &frame(1.0, Some(30)), &free, 0.25);
        }
    }

    #[test]
    fn the_light_is_measured_beside_the_target() {
        let here = BBox::from_ltwh(9.0, 7.0, 8.0, 18.0);
        let mut backdrop = Backdrop::new(&frame(1.0, None));
        assert_eq!(backdrop.gain(&BackdropParams::default(), &frame(1.0, None), &here), 1.0);
        backdrop.learn(&usual(), &frame(1.0, Some(10)), &here, 0.1);
        let dark = frame(0.6, Some(10));
        let gain = backdrop.gain(&BackdropParams::default(), &dark, &here);
        assert!((gain - 0.6).abs() < 0.02, "{gain}");
        assert_eq!(told(&backdrop, &dark, 30, 12, gain), Some(false));
        assert_eq!(told(&backdrop, &dark, 39, 29, 1.0), Some(true));
    }

    #[test]
    fn what_is_restored_has_a_size() {
        let mut backdrop = Backdrop::new(&frame(1.0, None));
        backdrop.learn(&usual(), &frame(1.0, None), &BBox::from_ltwh(0.0, 0.0, 2.0, 2.0), 0.5);
        let written = serde_json::to_value(&backdrop).unwrap();
        let read: Backdrop = serde_json::from_value(written.clone()).unwrap();
        assert_eq!(read.canvas, backdrop.canvas);
        for (key, value) in [("width", 41), ("channels", 1), ("channels", 2), ("height", 0)] {
            let mut bad = written.clone();
            bad["canvas"][key] = value.into();
            assert!(serde_json::from_value::<Backdrop>(bad).is_err(), "{key}");
        }
    }
}
