//! A background that turns with its camera: a canvas larger than the picture, on which each picture lies where the pose of its
//! camera says and where the edges of the background put it right.

use super::BackdropParams;
use super::canvas::{Canvas, around, sample};
use super::marks::{self, Mark};
use pursuit_geometry::{BBox, Point, Size};
use pursuit_imaging::{CameraPose, Frame};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Of the picture's sides, beyond each of its edges.
const MARGIN: f64 = 0.25;
/// Pixels learnt from one frame, about: of a larger picture every second or third row of the canvas, others each time.
const LEARNT: usize = 100_000;
pub(super) type Map = [[f64; 3]; 3];

/// How pictures lie on the canvas.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Turning {
    /// The pose whose picture lies in the middle of the canvas.
    middle: CameraPose,
    /// The pose of the last frame, and how far its picture lay from where that says, in pixels right and down.
    pose: CameraPose,
    off: (f64, f64),
    /// By how many codes the marks of the background differ there; 0 where there are too few to say.
    #[serde(skip)]
    difference: f64,
    /// Frames learnt.
    learnt: usize,
    /// Made from the poses; `None` after it was restored, until the next frame.
    #[serde(skip)]
    maps: Option<Maps>,
    /// The number of the frame that was put in its place last.
    #[serde(skip)]
    placed: Option<u64>,
    /// Scratch.
    #[serde(skip)]
    marks: Vec<Mark>,
}

/// From the picture, where the pose puts it, to the canvas, and back.
#[derive(Debug, Clone, Copy)]
pub(super) struct Maps {
    forth: Map,
    pub back: Map,
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

    /// Columns and rows of a canvas of `size` about a picture that lies `off` from where the pose puts it.
    pub fn in_sight(&self, picture: Size, off: (f64, f64), size: Size) -> (Range<usize>, Range<usize>) {
        let (width, height) = (picture.width as f64, picture.height as f64);
        let corner = |(x, y): (f64, f64)| mapped(&self.forth, Point::new(x - off.0, y - off.1));
        let corners = [(0.0, 0.0), (width, 0.0), (0.0, height), (width, height)].map(corner);
        let range = |of: fn(&Point) -> f64, most: usize| {
            let all = corners.iter().map(|corner| corner.as_ref().map(of));
            let ends =
                all.map(|v| v.map(|v| (v, v))).reduce(|a, b| a.zip(b).map(|(a, b)| (a.0.min(b.0), a.1.max(b.1))));
            // A corner behind the camera says nothing.
            let Some((first, last)) = ends.flatten() else { return 0..most };
            let last = (last.ceil().max(0.0) as usize).min(most);
            (first.floor().max(0.0) as usize).min(last)..last
        };
        (range(|p| p.x, size.width), range(|p| p.y, size.height))
    }
}

impl Turning {
    pub fn new(pose: CameraPose, picture: Size) -> Self {
        let maps = Some(Maps::new(pose, pose, picture));
        Self { middle: pose, pose, off: (0.0, 0.0), difference: 0.0, learnt: 0, maps, placed: None, marks: Vec::new() }
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
            let moved = carried(&maps, picture, canvas);
            *canvas = if canvas.is_steady() { moved.steady() } else { moved };
            (self.middle, self.off) = (pose, (0.0, 0.0));
            maps = Maps::new(pose, pose, picture);
        }
        self.maps = Some(maps);
        let reach = params.turn_error * picture.width as f64;
        marks::find(&mut self.marks, &maps, picture, keep, canvas);
        let lies = marks::descend(&self.marks, (frame, canvas.channels()), self.off, (reach, canvas.is_steady()));
        (self.difference, self.off) = lies.unwrap_or_default();
    }

    /// How far the frame placed last lies from where its pose says, pixels to the right and down.
    pub const fn off(&self) -> (f64, f64) {
        self.off
    }

    /// By how many codes the background's marks differ where the frame placed last lies.
    pub const fn difference(&self) -> f64 {
        self.difference
    }

    /// Learns with weight `rate` what of the frame is not `kept`, which is told places in the picture.
    pub fn learn(&mut self, frame: &Frame, kept: impl Fn(Point) -> bool, rate: f64, canvas: &mut Canvas) {
        let Some(maps) = self.maps else { return };
        let shares = frame.size().area().div_ceil(LEARNT).max(1);
        let due = self.learnt % shares;
        self.learnt = self.learnt.wrapping_add(1);
        let rate = rate * shares as f64;
        let mut value = [0_u16; 3];
        let value = &mut value[..canvas.channels()];
        let width = canvas.size().width;
        let (columns, rows) = maps.in_sight(frame.size(), self.off, canvas.size());
        for y in rows {
            // What nobody has seen yet is not put off.
            let put_off = y % shares != due;
            for x in columns.clone() {
                let number = y * width + x;
                if put_off && canvas.known(number).is_some() {
                    continue;
                }
                let at = mapped(&maps.back, Point::new(x as f64 + 0.5, y as f64 + 0.5));
                let Some(at) = at.map(|p| Point::new(p.x + self.off.0, p.y + self.off.1)) else { continue };
                if !kept(at) && sample(frame, at, value) {
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
pub(super) fn mapped(map: &Map, at: Point) -> Option<Point> {
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
        if let Some(value) = mapped(&maps.forth, at).and_then(|from| canvas.between(from)) {
            carried.learn(y * size.width + x, &value[..canvas.channels()], 1.0);
        }
    }
    carried
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
    fn who_covers_edges_does_not_make_the_picture_lie_wrong() {
        let params = BackdropParams::default();
        let now = pose(0.12, 0.036);
        let person = BBox::from_ltwh(20.0, 10.0, 36.0, 60.0);
        let difference = |told: CameraPose| {
            let (mut backdrop, _) = turned(0.0, &params);
            // Nobody is followed yet.
            backdrop.place(&params, &frame(now, told, Some(&person)), &nobody());
            backdrop.difference()
        };
        // Told to look 10° beside, farther than the edges are looked for.
        let (right, wrong) = (difference(now), difference(pose(0.3, 0.036)));
        assert!(right < 3.0 && wrong > 3.0 * right, "{right} {wrong}");
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
}
