use crate::TargetTruth;
use pursuit_geometry::{BBox, Point, Size};
use pursuit_imaging::{CameraPose, Direction, Lens};

/// Where the camera looks, how wide, and how large its pictures are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// Pan, tilt and zoom. Its time is that of the pose and does not matter here: a scene is asked for the time to render.
    pub camera: CameraPose,
    /// Width and height of the picture; sides below 1 or above 8192 pixels count as that.
    pub size: Size,
}

impl View {
    /// Straight ahead, `horizontal_rad` wide; the scenes' own constants make sense, anything else becomes 1 rad.
    pub(crate) fn ahead(horizontal_rad: f64, size: Size) -> Self {
        // What is no number stays none when it is clamped.
        let horizontal_rad = if horizontal_rad.is_nan() { 1.0 } else { horizontal_rad.clamp(0.01, 3.0) };
        let lens = Lens::field_of_view(horizontal_rad);
        let camera = lens.and_then(|lens| CameraPose::new(0.0, 0.0, 0.0, lens));
        Self { camera: camera.unwrap_or_else(|_| unreachable!("a clamped field of view is one")), size }
    }

    /// The same lens and size, turned to `pan_rad` to the right and `tilt_rad` upwards; `None` for angles no camera has.
    #[must_use]
    pub fn aimed(&self, pan_rad: f64, tilt_rad: f64) -> Option<Self> {
        let camera = CameraPose::new(self.camera.time_s(), pan_rad, tilt_rad, *self.camera.lens()).ok()?;
        Some(Self { camera, ..*self })
    }

    /// The same direction and size, zoomed so that the picture is `horizontal_rad` wide; `None` for what no lens can do.
    #[must_use]
    pub fn zoomed(&self, horizontal_rad: f64) -> Option<Self> {
        let lens = Lens::field_of_view(horizontal_rad).ok()?;
        let (pan, tilt) = (self.camera.pan_rad(), self.camera.tilt_rad());
        Some(Self { camera: CameraPose::new(self.camera.time_s(), pan, tilt, lens).ok()?, ..*self })
    }

    /// The direction that appears at a point of the picture.
    pub fn direction_of(&self, point: Point) -> Direction {
        self.camera.direction_of(point, self.size)
    }

    /// Where a direction appears, also outside of the picture; `None` behind the camera.
    pub fn point_of(&self, direction: Direction) -> Option<Point> {
        self.camera.point_of(direction, self.size)
    }

    /// Whether both show the same, whatever the time of their poses.
    pub(crate) fn shows_the_same(&self, other: &Self) -> bool {
        let sight = |v: &Self| (v.camera.pan_rad(), v.camera.tilt_rad(), v.camera.lens().pinhole_px(v.size), v.size);
        sight(self) == sight(other)
    }

    /// The truth of a flat scene, given in the picture of `home`, as this view shows it.
    ///
    /// The extent is the box around the turned outline; of what could be seen at home, the part inside this picture can be
    /// seen.
    pub(crate) fn truth_from(&self, home: &Self, truth: &TargetTruth) -> TargetTruth {
        let turned = |bbox: &BBox| bounds(outline(bbox).map(|p| self.point_of(home.direction_of(p))));
        let Some(extent) = truth.extent.as_ref().and_then(turned) else { return TargetTruth::ABSENT };
        let seen_at_home = truth.extent.and_then(|b| b.clipped_to(home.size)).as_ref().and_then(turned);
        let inside = seen_at_home.map_or(0.0, |b| b.fraction_inside(&self.size.bounds()));
        TargetTruth { extent: Some(extent), visible_fraction: truth.visible_fraction * inside }
    }
}

/// The longest side of a picture, in pixels.
const LONGEST_SIDE: usize = 8192;

/// A size that a picture can have.
pub(crate) fn possible(size: Size) -> Size {
    Size::new(size.width.clamp(1, LONGEST_SIDE), size.height.clamp(1, LONGEST_SIDE))
}

/// The smallest box around points; `None` when one of them cannot be seen, or there is none.
pub(crate) fn bounds(points: impl Iterator<Item = Option<Point>>) -> Option<BBox> {
    let mut found: Option<[f64; 4]> = None;
    for point in points {
        let Point { x, y } = point?;
        let [l, t, r, b] = found.unwrap_or([x, y, x, y]);
        found = Some([l.min(x), t.min(y), r.max(x), b.max(y)]);
    }
    found.map(|[l, t, r, b]| BBox::from_ltrb(l, t, r, b))
}

/// Points along the edges of a box, close enough together for edges that perspective bends or slants.
fn outline(bbox: &BBox) -> impl Iterator<Item = Point> + use<> {
    const STEPS: u32 = 8;
    let (left, top, right, bottom) = (bbox.left(), bbox.top(), bbox.right(), bbox.bottom());
    let between = |a: f64, b: f64, k: u32| a + (b - a) * f64::from(k) / f64::from(STEPS);
    (0..=STEPS).flat_map(move |k| {
        let (x, y) = (between(left, right, k), between(top, bottom, k));
        [Point::new(x, top), Point::new(x, bottom), Point::new(left, y), Point::new(right, y)]
    })
}
