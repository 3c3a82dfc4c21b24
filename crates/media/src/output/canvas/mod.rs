mod coverage;

use super::text;
use coverage::Clip;
use pursuit_geometry::{BBox, Point};
use pursuit_imaging::{Image, Rgb8};

/// Draws on an image that it owns. Everything is anti-aliased, placed to a fraction of a pixel and clipped: coordinates may
/// be anything, also far outside or NaN; what cannot be placed is not drawn.
#[derive(Debug, Clone)]
pub struct Canvas {
    image: Image<Rgb8>,
}

/// How a line is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stroke {
    /// Its colour.
    pub color: Rgb8,
    /// Its thickness in pixels.
    pub width_px: f64,
    /// How much it covers what lies beneath, in `[0, 1]`.
    pub opacity: f64,
    /// Lengths of dashes and of gaps between them, in pixels; `None` for a continuous line.
    pub dash_px: Option<(f64, f64)>,
}

impl Stroke {
    /// A continuous, opaque line.
    pub const fn new(color: Rgb8, width_px: f64) -> Self {
        Self { color, width_px, opacity: 1.0, dash_px: None }
    }

    /// The same line in dashes.
    #[must_use]
    pub const fn dashed(mut self, dash_px: f64, gap_px: f64) -> Self {
        self.dash_px = Some((dash_px, gap_px));
        self
    }

    /// The same line, letting through what lies beneath.
    #[must_use]
    pub const fn with_opacity(mut self, opacity: f64) -> Self {
        self.opacity = opacity;
        self
    }
}

impl Canvas {
    /// A canvas on `image`.
    pub const fn new(image: Image<Rgb8>) -> Self {
        Self { image }
    }

    /// What has been drawn so far.
    pub const fn image(&self) -> &Image<Rgb8> {
        &self.image
    }

    /// The finished picture.
    pub fn into_image(self) -> Image<Rgb8> {
        self.image
    }

    /// By what line widths should be multiplied to look alike in small and large pictures: 1 at 640 × 480, 0.7 at
    /// 320 × 240, 2.25 at 1920 × 1080.
    pub fn scale(&self) -> f64 {
        (self.image.height() as f64 / 480.0).min(self.image.width() as f64 / 640.0).clamp(0.7, 8.0)
    }

    /// A text height in pixels that is readable in this picture.
    pub fn text_height_px(&self) -> f64 {
        text::readable_height_px(self.image.width(), self.image.height())
    }

    /// The outline of `bbox`, the line centred on its edges. Corners are square.
    pub fn rectangle(&mut self, bbox: &BBox, stroke: &Stroke) {
        let half = stroke.width_px / 2.0;
        if !bbox.is_finite() || !half.is_finite() || half <= 0.0 {
            return;
        }
        let (outer, inner) = (bbox.expanded(half), bbox.expanded(-half));
        let (l, t, r, b) = (outer.left(), outer.top(), outer.right(), outer.bottom());
        if inner.is_empty() {
            self.fill(&outer, stroke.color, stroke.opacity);
            return;
        }
        let (inner_top, inner_bottom) = (inner.top(), inner.bottom());
        self.band(BBox::from_ltrb(l, t, r, inner_top), stroke, true);
        self.band(BBox::from_ltrb(l, inner_bottom, r, b), stroke, true);
        self.band(BBox::from_ltrb(l, inner_top, inner.left(), inner_bottom), stroke, false);
        self.band(BBox::from_ltrb(inner.right(), inner_top, r, inner_bottom), stroke, false);
    }

    /// One side of a rectangle, in dashes where the stroke says so.
    fn band(&mut self, bbox: BBox, stroke: &Stroke, horizontal: bool) {
        // A period under a pixel would be a grey line anyway, and endless work on a long one.
        let Some((dash, gap)) = stroke.dash_px.filter(|(d, g)| *d > 0.0 && *g > 0.0 && d + g >= 1.0) else {
            self.fill(&bbox, stroke.color, stroke.opacity);
            return;
        };
        let size = self.image.size();
        let (begin, end, limit) = if horizontal {
            (bbox.left(), bbox.right(), size.width as f64)
        } else {
            (bbox.top(), bbox.bottom(), size.height as f64)
        };
        // Start at the first dash that can be seen, in phase with the whole line.
        let period = dash + gap;
        let mut at = begin + (-begin / period).floor().max(0.0) * period;
        while at < end.min(limit) {
            let to = (at + dash).min(end);
            let piece = if horizontal {
                BBox::from_ltrb(at, bbox.top(), to, bbox.bottom())
            } else {
                BBox::from_ltrb(bbox.left(), at, bbox.right(), to)
            };
            self.fill(&piece, stroke.color, stroke.opacity);
            at += period;
        }
    }

    /// Fills `bbox`; with an opacity below 1, a translucent panel.
    pub fn fill(&mut self, bbox: &BBox, color: Rgb8, opacity: f64) {
        let Some(clip) = Clip::of(bbox, self.image.size()) else { return };
        for y in clip.rows() {
            let vertical = coverage::overlap(bbox.top(), bbox.bottom(), y) * opacity;
            let row = &mut self.image.row_mut(y)[clip.columns()];
            for (x, pixel) in clip.columns().zip(row) {
                blend(pixel, color, vertical * coverage::overlap(bbox.left(), bbox.right(), x));
            }
        }
    }

    /// A straight line with round ends.
    pub fn line(&mut self, from: Point, to: Point, stroke: &Stroke) {
        let half = stroke.width_px / 2.0;
        if !(half > 0.0 && half.is_finite()) {
            return;
        }
        // Only the part near the picture matters; that also tames coordinates of any size.
        let near = self.image.size().bounds().expanded(half + 2.0);
        let Some((from, to)) = coverage::clipped(from, to, &near) else { return };
        let length = from.distance(to);
        let along =
            |at: f64| Point::new(from.x + (to.x - from.x) * at / length, from.y + (to.y - from.y) * at / length);
        match stroke.dash_px.filter(|(d, g)| *d > 0.0 && *g > 0.0 && d + g >= 1.0) {
            Some((dash, gap)) if length > 0.0 => {
                let mut at = 0.0;
                while at < length {
                    self.solid_line(along(at), along((at + dash).min(length)), half, stroke);
                    at += dash + gap;
                }
            }
            _ => self.solid_line(from, to, half, stroke),
        }
    }

    fn solid_line(&mut self, from: Point, to: Point, half: f64, stroke: &Stroke) {
        let around = BBox::from_ltrb(from.x.min(to.x), from.y.min(to.y), from.x.max(to.x), from.y.max(to.y));
        let Some(clip) = Clip::of(&around.expanded(half + 1.0), self.image.size()) else { return };
        for y in clip.rows() {
            let columns = coverage::columns_near(from, to, half + 1.0, y, &clip);
            let row = &mut self.image.row_mut(y)[columns.clone()];
            for (x, pixel) in columns.zip(row) {
                let distance = coverage::distance(Point::new(x as f64 + 0.5, y as f64 + 0.5), from, to);
                blend(pixel, stroke.color, stroke.opacity * (half - distance + 0.5).clamp(0.0, (2.0 * half).min(1.0)));
            }
        }
    }

    /// A filled circle.
    pub fn dot(&mut self, center: Point, radius_px: f64, color: Rgb8, opacity: f64) {
        self.line(center, center, &Stroke::new(color, 2.0 * radius_px).with_opacity(opacity));
    }

    /// An upright cross with arms of `arm_px`.
    pub fn cross(&mut self, center: Point, arm_px: f64, stroke: &Stroke) {
        let (x, y) = (center.x, center.y);
        self.line(Point::new(x - arm_px, y), Point::new(x + arm_px, y), stroke);
        self.line(Point::new(x, y - arm_px), Point::new(x, y + arm_px), stroke);
    }

    /// Where something has been, oldest point first: a line that fades towards its beginning. `None` interrupts it.
    pub fn trail(&mut self, points: &[Option<Point>], stroke: &Stroke) {
        let count = points.len().max(2) as f64 - 1.0;
        for (k, pair) in points.windows(2).enumerate() {
            let [Some(from), Some(to)] = pair else { continue };
            let fade = (k as f64 + 1.0) / count;
            self.line(*from, *to, &stroke.with_opacity(stroke.opacity * fade));
        }
    }

    /// Width and height of `text` at a height of `height_px`, in pixels.
    pub fn text_size(text: &str, height_px: f64) -> (f64, f64) {
        text::size(text, height_px)
    }

    /// Text with its top left corner at `at`. Sizes come in steps (10, 13, 15, 20 pixels and multiples of 20); the largest
    /// that does not exceed `height_px` is taken. Western European letters; others appear as `?`.
    pub fn text(&mut self, at: Point, text: &str, height_px: f64, color: Rgb8) {
        text::draw(&mut self.image, at, text, height_px, |pixel| blend(pixel, color, 1.0));
    }

    /// Text on a dark translucent panel above `bbox`, below it where there is no room, moved inside the picture.
    pub fn label(&mut self, bbox: &BBox, text: &str, color: Rgb8) {
        let height = self.text_height_px();
        let pad = (height / 5.0).round();
        let (width, height) =
            (Self::text_size(text, height).0 + 2.0 * pad, Self::text_size(text, height).1 + 2.0 * pad);
        let size = self.image.size();
        let gap = 2.0 * self.scale();
        let above = bbox.top() - gap - height;
        let top = if above >= 0.0 { above } else { bbox.bottom() + gap };
        let inside = |v: f64, room: f64| v.min(room).max(0.0).round();
        let (left, top) = (inside(bbox.left(), size.width as f64 - width), inside(top, size.height as f64 - height));
        if !bbox.is_finite() {
            return;
        }
        self.fill(&BBox::from_ltwh(left, top, width, height), [12, 14, 18], 0.66);
        self.text(Point::new(left + pad, top + pad), text, self.text_height_px(), color);
    }
}

/// Lays `color` over `pixel`.
fn blend(pixel: &mut Rgb8, color: Rgb8, opacity: f64) {
    let weight = (opacity.clamp(0.0, 1.0) * 256.0) as i32;
    for (under, over) in pixel.iter_mut().zip(color) {
        let difference = i32::from(over) - i32::from(*under);
        *under = (i32::from(*under) + ((difference * weight + 128) >> 8)) as u8;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn canvas(width: usize, height: usize) -> Canvas {
        Canvas::new(Image::filled(width, height, [0; 3]).unwrap())
    }

    /// The sum of the red channel in units of a fully covered pixel.
    fn ink(canvas: &Canvas) -> f64 {
        canvas.image.as_slice().iter().map(|p| f64::from(p[0]) / 255.0).sum()
    }

    #[test]
    fn filled_area_is_the_box_area_at_any_fraction_of_a_pixel() {
        for (left, top, width, height) in [(3.0, 4.0, 5.0, 6.0), (3.3, 4.7, 5.2, 6.1), (2.4, 2.4, 0.3, 0.2)] {
            let mut c = canvas(20, 20);
            c.fill(&BBox::from_ltwh(left, top, width, height), [255; 3], 1.0);
            assert!((ink(&c) - width * height).abs() < 0.1, "{left} {top}: {}", ink(&c));
        }
    }

    #[test]
    fn a_rectangle_on_whole_pixels_is_crisp() {
        let mut c = canvas(20, 20);
        c.rectangle(&BBox::from_ltwh(5.0, 5.0, 8.0, 6.0), &Stroke::new([255; 3], 2.0));
        assert!(c.image.as_slice().iter().all(|p| p[0] == 0 || p[0] == 255));
        assert_eq!(ink(&c), 10.0 * 8.0 - 6.0 * 4.0);
        assert_eq!(c.image.row(4)[4], [255; 3]);
        assert_eq!(c.image.row(8)[8], [0; 3]);
    }

    #[test]
    fn dashes_leave_gaps() {
        let mut c = canvas(100, 100);
        c.rectangle(&BBox::from_ltwh(10.0, 10.0, 80.0, 80.0), &Stroke::new([255; 3], 2.0).dashed(6.0, 4.0));
        let share = ink(&c) / (82.0 * 82.0 - 78.0 * 78.0);
        assert!((share - 0.6).abs() < 0.04, "{share}");
    }

    #[test]
    fn lines_have_the_ink_of_their_length_and_width() {
        let mut c = canvas(100, 100);
        c.line(Point::new(10.0, 12.0), Point::new(70.5, 83.25), &Stroke::new([255; 3], 3.0));
        let expected = 3.0 * (60.5f64).hypot(71.25) + std::f64::consts::PI * 1.5 * 1.5;
        assert!((ink(&c) / expected - 1.0).abs() < 0.02, "{} {expected}", ink(&c));
        let mut c = canvas(40, 40);
        c.dot(Point::new(20.2, 19.9), 8.0, [255; 3], 1.0);
        assert!((ink(&c) / (64.0 * std::f64::consts::PI) - 1.0).abs() < 0.02);
    }

    #[test]
    fn a_trail_fades_and_is_interrupted() {
        let mut c = canvas(60, 20);
        let at = |x: f64| Some(Point::new(x, 10.0));
        c.trail(&[at(5.0), at(20.0), None, at(35.0), at(55.0)], &Stroke::new([255; 3], 2.0));
        let red = |x: usize| c.image.row(10)[x][0];
        assert!(red(12) > 20 && red(12) < 100 && red(28) == 0 && red(45) > 240, "{} {} {}", red(12), red(28), red(45));
    }

    #[test]
    fn labels_stay_inside() {
        for (x, y) in [(0.0, 0.0), (300.0, 2.0), (-50.0, 230.0), (1e9, -1e9), (150.0, 100.0)] {
            let mut c = canvas(320, 240);
            c.label(&BBox::from_ltwh(x, y, 30.0, 30.0), "tracking 0.97", [255; 3]);
            let lit = c.image.as_slice().iter().filter(|p| p[0] == 255).count();
            assert!(lit > 100, "{x} {y}: {lit}");
        }
    }

    fn any_number() -> impl Strategy<Value = f64> {
        prop_oneof![
            -50.0..120.0f64,
            any::<f64>(),
            Just(f64::NAN),
            Just(f64::INFINITY),
            Just(f64::NEG_INFINITY),
            Just(1e300),
            Just(-1e18),
        ]
    }

    proptest! {
        #[test]
        fn no_coordinate_is_too_strange(v in proptest::array::uniform8(any_number())) {
            let mut c = canvas(64, 48);
            let (a, b) = (Point::new(v[0], v[1]), Point::new(v[2], v[3]));
            let stroke = Stroke { color: [255; 3], width_px: v[4], opacity: v[5], dash_px: Some((v[6], v[7])) };
            let bbox = BBox::from_ltwh(v[0], v[1], v[2], v[3]);
            c.rectangle(&bbox, &stroke);
            c.rectangle(&bbox, &Stroke { dash_px: None, ..stroke });
            c.fill(&bbox, [9; 3], v[5]);
            c.line(a, b, &stroke);
            c.line(a, b, &Stroke::new([255; 3], 3.0).dashed(3.0, 2.0));
            c.cross(a, v[4], &stroke);
            c.dot(a, v[4], [1; 3], v[5]);
            c.trail(&[Some(a), Some(b), None, Some(a)], &stroke);
            c.text(a, "lost é 漢", v[4], [255; 3]);
            c.label(&bbox, "x", [255; 3]);
        }
    }
}
