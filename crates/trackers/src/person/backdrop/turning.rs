//! A background that turns with its camera: a canvas larger than the picture, on which each picture lies where the pose of its
//! camera says and where the edges of the background put it right.

use super::canvas::{Canvas, UNIT};
use super::{BackdropParams, row};
use pursuit_geometry::{BBox, Point, Size};
use pursuit_imaging::{CameraPose, Frame};
use pursuit_vision::PixelWindow;
use serde::{Deserialize, Serialize};

/// Of the picture's sides, beyond each of its edges.
const MARGIN: f64 = 0.25;
/// Pixels learnt from one frame, about: of a larger picture every second or third row of the canvas, others each time.
const LEARNT: usize = 100_000;
/// Points by which a picture is put in its place, about, and the fewest that tell anything.
const POINTS: usize = 600;
const FEWEST: usize = 24;
/// So many beside the target are enough.
const PLENTY: usize = 150;
/// Sum of the differences of brightness across and down, in codes over two pixels, that makes an edge.
const EDGE: f64 = 24.0;
/// Differences of brightness count up to this many codes: what moves before the background hardly disturbs.
const MOST: f64 = 24.0;
/// A place nearer than this to the middle of a pixel, in pixels, is that pixel's.
const EXACT: f64 = 0.02;

type Map = [[f64; 3]; 3];

/// How pictures lie on the canvas.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Turning {
    /// The pose whose picture lies in the middle of the canvas.
    middle: CameraPose,
    /// The pose of the last frame, and how far its picture lay from where that says, in pixels right and down.
    pose: CameraPose,
    off: (f64, f64),
    /// Frames learnt.
    learnt: usize,
    /// Made from the poses; `None` after it was restored, until the next frame.
    #[serde(skip)]
    maps: Option<Maps>,
    /// The number of the frame that was put in its place last.
    #[serde(skip)]
    placed: Option<u64>,
}

/// From the picture, where the pose puts it, to the canvas, and back.
#[derive(Debug, Clone, Copy)]
struct Maps {
    forth: Map,
    back: Map,
}

impl Maps {
    fn new(middle: CameraPose, pose: CameraPose, picture: Size) -> Self {
        let (dx, dy) = margins(picture);
        let (dx, dy) = (dx as f64, dy as f64);
        let ([x, y, w], back) = (pose.map_to(&middle, picture), middle.map_to(&pose, picture));
        let moved = |row: [f64; 3], by: f64| std::array::from_fn(|j| row[j] + by * w[j]);
        let forth = [moved(x, dx), moved(y, dy), w];
        Self { forth, back: back.map(|row| [row[0], row[1], row[2] - row[0] * dx - row[1] * dy]) }
    }
}

/// A place of the background that is easily found again: where the pose puts it in the picture, and how bright it is.
#[derive(Debug, Clone, Copy)]
struct Mark {
    at: Point,
    brightness: f64,
}

impl Turning {
    pub fn new(pose: CameraPose, picture: Size) -> Self {
        let maps = Some(Maps::new(pose, pose, picture));
        Self { middle: pose, pose, off: (0.0, 0.0), learnt: 0, maps, placed: None }
    }

    /// The size of the canvas for pictures of this size.
    pub fn canvas(picture: Size) -> Size {
        let (dx, dy) = margins(picture);
        Size::new(picture.width.saturating_add(2 * dx), picture.height.saturating_add(2 * dy))
    }

    /// Puts a frame in its place. A head begins to turn before its pose says so: the edges are asked of every frame.
    pub fn place(
        &mut self,
        params: &BackdropParams,
        (frame, pose): (&Frame, CameraPose),
        keep: &BBox,
        canvas: &mut Canvas,
    ) {
        if self.placed.replace(frame.index()) == Some(frame.index()) && self.maps.is_some() {
            return;
        }
        let picture = frame.size();
        self.pose = pose;
        let mut maps = Maps::new(self.middle, pose, picture);
        if !holds(&maps, picture, canvas) {
            *canvas = carried(&maps, picture, canvas);
            (self.middle, self.off) = (pose, (0.0, 0.0));
            maps = Maps::new(pose, pose, picture);
        }
        self.maps = Some(maps);
        let reach = params.turn_error * picture.width as f64;
        let all = if reach > 0.0 { marks(&maps, picture, canvas) } else { Vec::new() };
        // Beside a target that fills the picture there is nothing; what it does not hide of the background is in its box.
        let (inside, beside): (Vec<Mark>, Vec<Mark>) = all.into_iter().partition(|mark| keep.contains(mark.at));
        let marks = if beside.len() < PLENTY { [beside, inside].concat() } else { beside };
        self.off = if marks.len() < FEWEST { (0.0, 0.0) } else { descend(&marks, frame, self.off, reach) };
    }

    /// Learns with weight `rate` what of the frame lies outside of `kept`.
    pub fn learn(&mut self, frame: &Frame, kept: Option<PixelWindow>, rate: f64, canvas: &mut Canvas) {
        let Some(Maps { back, .. }) = self.maps else { return };
        let shares = frame.size().area().div_ceil(LEARNT).max(1);
        let due = self.learnt % shares;
        self.learnt = self.learnt.wrapping_add(1);
        let rate = rate * shares as f64;
        let mut value = [0_u16; 3];
        let value = &mut value[..canvas.channels()];
        let Size { width, height } = canvas.size();
        for y in 0..height {
            // What nobody has seen yet is not put off.
            let put_off = y % shares != due;
            for x in 0..width {
                let number = y * width + x;
                if put_off && canvas.known(number).is_some() {
                    continue;
                }
                let at = mapped(&back, Point::new(x as f64 + 0.5, y as f64 + 0.5));
                let Some(at) = at.map(|p| Point::new(p.x + self.off.0, p.y + self.off.1)) else { continue };
                let within = |w: PixelWindow| {
                    let (x, y) = (at.x - w.x as f64, at.y - w.y as f64);
                    x >= 0.0 && y >= 0.0 && x <= w.width as f64 && y <= w.height as f64
                };
                if !kept.is_some_and(within) && sample(frame, at, value) {
                    canvas.learn(number, value, rate);
                }
            }
        }
    }

    /// Where a point of the picture lies on the canvas.
    fn on_canvas(&self, at: Point) -> Option<Point> {
        mapped(&self.maps?.forth, Point::new(at.x - self.off.0, at.y - self.off.1))
    }

    /// The number of the canvas's pixel at a point of the picture.
    pub fn nearest(&self, at: Point, canvas: &Canvas) -> Option<usize> {
        let (at, Size { width, height }) = (self.on_canvas(at)?, canvas.size());
        let inside = at.x >= 0.0 && at.y >= 0.0 && at.x < width as f64 && at.y < height as f64;
        inside.then(|| at.y as usize * width + at.x as usize)
    }

    /// The least and the greatest mean of each channel about a point of the picture, in 256ths; `None` where one is not known.
    pub fn span(&self, at: Point, canvas: &Canvas) -> Option<[[u16; 2]; 3]> {
        let mut span = [[u16::MAX, 0]; 3];
        for (number, _) in around(canvas.size(), self.on_canvas(at)?)? {
            for (of, value) in span.iter_mut().zip(canvas.known(number)?) {
                *of = [of[0].min(*value), of[1].max(*value)];
            }
        }
        Some(span)
    }
}

/// Whole pixels, left and right, above and below.
fn margins(picture: Size) -> (usize, usize) {
    let of = |side: usize| ((MARGIN * side as f64).round() as usize).min(usize::MAX / 4);
    (of(picture.width), of(picture.height))
}

/// `None` for what is not before the camera.
fn mapped(map: &Map, at: Point) -> Option<Point> {
    let [x, y, w] = map.map(|row| row[0] * at.x + row[1] * at.y + row[2]);
    (w > 1e-9).then(|| Point::new(x / w, y / w))
}

/// Whether the whole picture lies on the canvas.
fn holds(maps: &Maps, picture: Size, canvas: &Canvas) -> bool {
    let (width, height) = (picture.width as f64, picture.height as f64);
    let on = BBox::from_ltwh(0.0, 0.0, canvas.size().width as f64, canvas.size().height as f64);
    let inside = |(x, y)| mapped(&maps.forth, Point::new(x, y)).is_some_and(|p| on.contains(p));
    [(0.0, 0.0), (width, 0.0), (0.0, height), (width, height)].into_iter().all(inside)
}

/// What the canvas knows, on one in whose middle this picture lies.
fn carried(maps: &Maps, picture: Size, canvas: &Canvas) -> Canvas {
    let (dx, dy) = margins(picture);
    let size = canvas.size();
    let mut carried = Canvas::new(size, canvas.channels());
    for (y, x) in (0..size.height).flat_map(|y| (0..size.width).map(move |x| (y, x))) {
        let at = Point::new(x as f64 + 0.5 - dx as f64, y as f64 + 0.5 - dy as f64);
        let from = mapped(&maps.forth, at).and_then(|from| around(size, from));
        if let Some(value) = from.and_then(|around| canvas.between(&around)) {
            carried.learn(y * size.width + x, &value[..canvas.channels()], 1.0);
        }
    }
    carried
}

/// The numbers of the four pixels about a point, and their weights between them (bilinear); `None` beyond the outer ones.
fn around(size: Size, at: Point) -> Option<[(usize, f64); 4]> {
    let axis = |at: f64, length: usize| {
        let (whole, part) = ((at - 0.5).floor(), (at - 0.5).rem_euclid(1.0));
        let (whole, part) = match part {
            part if part < EXACT => (whole, 0.0),
            part if part > 1.0 - EXACT => (whole + 1.0, 0.0),
            part => (whole, part),
        };
        let next = if part > 0.0 { whole + 1.0 } else { whole };
        (whole >= 0.0 && next < length as f64).then_some((whole as usize, next as usize, part))
    };
    let ((left, right, x), (top, bottom, y)) = (axis(at.x, size.width)?, axis(at.y, size.height)?);
    let number = |x: usize, y: usize| y * size.width + x;
    Some([
        (number(left, top), (1.0 - x) * (1.0 - y)),
        (number(right, top), x * (1.0 - y)),
        (number(left, bottom), (1.0 - x) * y),
        (number(right, bottom), x * y),
    ])
}

/// The value of a frame between its pixels, in 256ths of a code; false outside of the picture.
fn sample(frame: &Frame, at: Point, value: &mut [u16]) -> bool {
    let (size, channels) = (frame.size(), value.len());
    let Some([(first, a), (second, b), (third, c), (fourth, d)]) = around(size, at) else { return false };
    let upper = row(frame, first / size.width, channels);
    let lower = row(frame, third / size.width, channels);
    let (left, right) = (first % size.width * channels, second % size.width * channels);
    debug_assert_eq!((third % size.width, fourth % size.width), (first % size.width, second % size.width));
    for (k, value) in value.iter_mut().enumerate() {
        let of = |row: &[u8], x: usize| f64::from(row[x + k]);
        let mean = a * of(upper, left) + b * of(upper, right) + c * of(lower, left) + d * of(lower, right);
        *value = (mean * f64::from(UNIT)).round() as u16;
    }
    true
}

/// The mean of the channels, in codes.
fn brightness(value: &[u16]) -> f64 {
    value.iter().map(|v| f64::from(*v)).sum::<f64>() / (value.len().max(1) as f64 * f64::from(UNIT))
}

/// Edges of the background that lie in the picture: the strongest of each cell of a grid.
fn marks(maps: &Maps, picture: Size, canvas: &Canvas) -> Vec<Mark> {
    let cell = ((picture.area() as f64 / POINTS as f64).sqrt().ceil() as usize).max(4);
    let Size { width, height } = canvas.size();
    let edge = |x: usize, y: usize| {
        let at = |x: usize, y: usize| canvas.known(y * width + x).map(brightness);
        Some((at(x - 1, y)? - at(x + 1, y)?).abs() + (at(x, y - 1)? - at(x, y + 1)?).abs())
    };
    let seen = BBox::from_ltwh(0.0, 0.0, picture.width as f64, picture.height as f64);
    let place = |x: usize, y: usize| {
        let at = mapped(&maps.back, Point::new(x as f64 + 0.5, y as f64 + 0.5))?;
        seen.contains(at).then_some(at)
    };
    let mut marks = Vec::new();
    for top in (1..height.saturating_sub(1)).step_by(cell) {
        for left in (1..width.saturating_sub(1)).step_by(cell) {
            let rows = (top..(top + cell).min(height - 1)).step_by(2);
            let pixels = rows.flat_map(|y| (left..(left + cell).min(width - 1)).step_by(2).map(move |x| (x, y)));
            let edges = pixels.filter_map(|(x, y)| edge(x, y).filter(|e| *e > EDGE).map(|e| (e, x, y)));
            let Some((_, x, y)) = edges.max_by(|a, b| a.0.total_cmp(&b.0)) else { continue };
            let Some(mean) = canvas.known(y * width + x) else { continue };
            marks.extend(place(x, y).map(|at| Mark { at, brightness: brightness(mean) }));
        }
    }
    marks
}

/// How far the picture lies from where the pose puts it, in pixels, up to `reach` each way: the shift under which the marks are as
/// bright as on the canvas, by steps that become smaller, from where it lay last and from where it should.
fn descend(marks: &[Mark], frame: &Frame, last: (f64, f64), reach: f64) -> (f64, f64) {
    let channels = if frame.has_color() { 3 } else { 1 };
    let mut value = [0_u16; 3];
    let mut cost = |(dx, dy): (f64, f64)| {
        let (mut sum, mut count) = (0.0, 0);
        for mark in marks {
            if sample(frame, Point::new(mark.at.x + dx, mark.at.y + dy), &mut value[..channels]) {
                sum += (brightness(&value[..channels]) - mark.brightness).abs().min(MOST);
                count += 1;
            }
        }
        if count < FEWEST { f64::INFINITY } else { sum / count as f64 }
    };
    let mut best = (cost((0.0, 0.0)), (0.0, 0.0));
    for start in [(0.0, 0.0), last] {
        let mut own = (cost(start), start);
        let mut step = reach.min(8.0);
        while step >= 0.2 {
            let about = [(-1, -1), (0, -1), (1, -1), (-1, 0), (1, 0), (-1, 1), (0, 1), (1, 1)];
            let (_, (x, y)) = own;
            let tried = about.map(|(i, j)| (x + f64::from(i) * step, y + f64::from(j) * step));
            let within = tried.into_iter().filter(|(x, y)| x.abs() <= reach && y.abs() <= reach);
            let found = within.map(|at| (cost(at), at)).min_by(|a, b| a.0.total_cmp(&b.0));
            match found.filter(|found| found.0 < own.0) {
                Some(found) => own = found,
                None => step /= 2.0,
            }
        }
        if own.0 < best.0 {
            best = own;
        }
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::super::Backdrop;
    use super::*;
    use pursuit_imaging::{Image, Lens, Pixels};

    const SIZE: Size = Size::new(96, 72);

    fn pose(pan_rad: f64, tilt_rad: f64) -> CameraPose {
        CameraPose::new(0.0, pan_rad, tilt_rad, Lens::field_of_view(0.6).unwrap()).unwrap()
    }

    /// What a camera sees of a wall with patches, and of somebody red where `person` is; it says that it stands as `told`.
    fn frame(at: CameraPose, told: CameraPose, person: Option<&BBox>) -> Frame {
        let image = Image::from_fn(SIZE.width, SIZE.height, |x, y| {
            let point = Point::new(x as f64 + 0.5, y as f64 + 0.5);
            if person.is_some_and(|b| b.contains(point)) {
                return [230, 20, 20];
            }
            let seen = at.direction_of(point, SIZE);
            let (a, b) = (40.0 * seen.pan_rad, 40.0 * seen.tilt_rad);
            let wave =
                |phase: f64| (118.0 + 40.0 * (a + phase).sin() * (0.7 * b).cos() + 30.0 * (0.31 * a + b).sin()) as u8;
            [wave(0.0), wave(0.4), wave(0.8)]
        });
        // Frames are told apart by their numbers.
        let index = ((at.pan_rad() + 9.0) * 1e6 + told.pan_rad() * 1e3 + f64::from(u8::from(person.is_some()))) as u64;
        Frame::new(index, 0.0, Pixels::Rgb8(image.unwrap().into())).with_camera(told)
    }

    /// Shares of the picture that are known, and of those that stand out.
    fn told(backdrop: &Backdrop, frame: &Frame, within: &BBox) -> (f64, f64) {
        let (mut all, mut known, mut out) = (0, 0, 0);
        for (y, x) in (0..SIZE.height).flat_map(|y| (0..SIZE.width).map(move |x| (y, x))) {
            if within.contains(Point::new(x as f64 + 0.5, y as f64 + 0.5)) {
                let stands_out = backdrop.stands_out(backdrop.row(frame, y), x, y, 256, 25);
                all += 1;
                known += usize::from(stands_out.is_some());
                out += usize::from(stands_out == Some(true));
            }
        }
        (known as f64 / f64::from(all), out as f64 / (known as f64).max(1.0))
    }

    fn everywhere() -> BBox {
        BBox::from_ltwh(0.0, 0.0, SIZE.width as f64, SIZE.height as f64)
    }

    fn nobody() -> BBox {
        BBox::from_ltwh(-9.0, -9.0, 1.0, 1.0)
    }

    /// Of a camera that turns to the right by a fifth of the picture in all, and is off by `wrong_rad` in what it says.
    fn turned(wrong_rad: f64, params: &BackdropParams) -> (Backdrop, Frame) {
        let first = frame(pose(0.0, 0.0), pose(0.0, 0.0), None);
        let mut backdrop = Backdrop::new(&first);
        backdrop.learn(params, &first, &nobody(), 1.0);
        let mut last = first;
        for k in 1..=12 {
            let (pan, tilt) = (0.01 * f64::from(k), 0.003 * f64::from(k));
            last = frame(pose(pan, tilt), pose(pan + wrong_rad, tilt - wrong_rad), None);
            backdrop.place(params, &last, &nobody());
            backdrop.learn(params, &last, &nobody(), 0.05);
        }
        (backdrop, last)
    }

    #[test]
    fn the_background_stays_where_it_is_while_the_camera_turns() {
        let exact = BackdropParams { turn_error: 0.0, ..BackdropParams::default() };
        let (mut backdrop, last) = turned(0.0, &exact);
        let (known, out) = told(&backdrop, &last, &everywhere());
        assert!(known > 0.95 && out == 0.0, "{known} {out}");
        let person = BBox::from_ltwh(40.0, 20.0, 14.0, 40.0);
        let now = pose(0.125, 0.036);
        let seen = frame(now, now, Some(&person));
        backdrop.place(&exact, &seen, &person);
        assert!(told(&backdrop, &seen, &person).1 > 0.95);
        let before = frame(now, now, None);
        assert_eq!(told(&backdrop, &before, &everywhere()).1, 0.0);
    }

    #[test]
    fn what_the_pose_gets_wrong_the_edges_put_right() {
        // Two thirds of a degree are 1.9 pixels, each way.
        let wrong_rad = 0.012;
        let (backdrop, last) = turned(wrong_rad, &BackdropParams::default());
        assert!(told(&backdrop, &last, &everywhere()).1 < 0.01);
        let Turning { off, .. } = backdrop.turning.clone().unwrap();
        let focal_px = SIZE.width as f64 / 2.0 / 0.3_f64.tan();
        let wanted = focal_px * wrong_rad;
        assert!((off.0 - wanted).abs() < 0.5 && (off.1 - wanted).abs() < 0.5, "{off:?} for {wanted}");
    }

    #[test]
    fn what_went_out_of_the_picture_is_known_when_the_camera_comes_back() {
        let params = BackdropParams { turn_error: 0.0, ..BackdropParams::default() };
        let mut backdrop = Backdrop::new(&frame(pose(0.0, 0.0), pose(0.0, 0.0), None));
        // To the right by more than the canvas holds, so that it is carried along, and back by half of the picture.
        let to_and_fro = (0..=20).chain((10..20).rev()).map(|k| 0.02 * f64::from(k));
        for pan in to_and_fro {
            let seen = frame(pose(pan, 0.0), pose(pan, 0.0), None);
            backdrop.place(&params, &seen, &nobody());
            if pan > 0.28 || backdrop.turning.as_ref().unwrap().learnt < 15 {
                backdrop.learn(&params, &seen, &nobody(), 0.05);
            } else {
                let (known, out) = told(&backdrop, &seen, &everywhere());
                assert!(known > 0.7 && out < 0.01, "{pan}: {known} {out}");
            }
        }
    }

    #[test]
    fn it_is_restored_and_goes_on_with_the_next_frame() {
        let params = BackdropParams::default();
        let (backdrop, last) = turned(0.0, &params);
        let text = serde_json::to_string(&backdrop).unwrap();
        let mut restored: Backdrop = serde_json::from_str(&text).unwrap();
        assert_eq!(told(&restored, &last, &everywhere()).0, 0.0, "not placed yet");
        restored.place(&params, &last, &nobody());
        assert_eq!(told(&restored, &last, &everywhere()), told(&backdrop, &last, &everywhere()));
        let mut bad: serde_json::Value = serde_json::from_str(&text).unwrap();
        bad["turning"] = serde_json::Value::Null;
        assert!(serde_json::from_value::<Backdrop>(bad).is_err(), "the canvas of a camera that stands is the picture");
    }

    #[test]
    fn places_between_pixels_are_weighed() {
        let size = Size::new(4, 3);
        assert_eq!(
            around(size, Point::new(1.5, 0.5)).unwrap().map(|(n, w)| (n, w)),
            [(1, 1.0), (1, 0.0), (1, 0.0), (1, 0.0)]
        );
        let quarter = around(size, Point::new(1.75, 1.0)).unwrap();
        assert_eq!(quarter.map(|(n, _)| n), [1, 2, 5, 6]);
        assert!(quarter.iter().zip([0.375, 0.125, 0.375, 0.125]).all(|((_, w), wanted)| (w - wanted).abs() < 1e-12));
        for outside in [(0.2, 1.0), (3.8, 1.0), (1.0, 2.7), (f64::NAN, 1.0)] {
            assert!(around(size, Point::new(outside.0, outside.1)).is_none(), "{outside:?}");
        }
    }
}
