use crate::{RunError, open_with};
use pursuit_geometry::{BBox, Point, Truth};
use pursuit_imaging::{Image, Rgb8};
use pursuit_media::{OpenOptions, Source};
use pursuit_ptz::geometry::{AngleFormula, Lens, direction_of};
use pursuit_ptz::simulation::{Rendered, WideClip, World};
use pursuit_ptz::{Direction, PtzError};
use pursuit_scenes::{Scene, View};
use std::ops::Range;
use std::sync::Arc;

/// A direction, and the tangents of width and height.
pub type KnownTarget = (Direction, f64, f64);

/// A world with a target whose place is known, for a simulated camera to look at: a scene, or the clip of a wide camera.
pub struct KnownWorld(Kind);

enum Kind {
    Scene { name: String, scene: Box<dyn Scene> },
    Clip(Box<Clip>),
}

/// A time in seconds, and where the target is then.
type TimedBox = (f64, Option<BBox>);

/// A clip of a wide camera that stands still, with its true boxes.
struct Clip {
    input: String,
    options: OpenOptions,
    lens: Lens,
    /// Times and boxes of what is looked at, seconds from where that starts; never empty.
    boxes: Vec<TimedBox>,
    /// When that is in the clip.
    starts_s: f64,
}

impl KnownWorld {
    /// A scene by its query, with or without `scene:` before it.
    ///
    /// # Errors
    /// [`RunError::Usage`] for a scene that there is not, or in which nobody is at the beginning.
    pub fn scene(query: &str) -> Result<Self, RunError> {
        let name = query.strip_prefix("scene:").unwrap_or(query);
        let scene = pursuit_scenes::open(&format!("scene:{name}")).map_err(|e| RunError::usage(e.to_string()))?;
        let world = Self(Kind::Scene { name: name.to_owned(), scene });
        let nobody = || RunError::usage(format!("nobody is in the scene `{name}` at its beginning"));
        world.target(0.0).ok_or_else(nobody)?;
        Ok(world)
    }

    /// A clip whose picture is `width_deg` wide, with true boxes, from where enough of the target is to be seen to where it is seen last;
    /// `options` say how it is opened.
    ///
    /// # Errors
    /// An input that cannot be read, [`RunError::Usage`] for one that does not say where its target is.
    pub fn clip(input: &str, width_deg: f64, options: OpenOptions) -> Result<Self, RunError> {
        let mut clip = Clip::read(input, width_deg, options)?;
        let first = start(&clip.boxes).unwrap_or_default();
        clip.starts_s = clip.boxes[first].0;
        let last = clip.boxes.iter().rposition(|b| b.1.is_some()).unwrap_or(first);
        clip.boxes = clip.boxes[first..=last].iter().map(|b| (b.0 - clip.starts_s, b.1)).collect();
        Ok(Self(Kind::Clip(Box::new(clip))))
    }

    /// A clip from its first frame to its last, whether anybody is to be seen there or not.
    ///
    /// # Errors
    /// As [`clip`](Self::clip).
    pub fn whole_clip(input: &str, width_deg: f64, options: OpenOptions) -> Result<Self, RunError> {
        Ok(Self(Kind::Clip(Box::new(Clip::read(input, width_deg, options)?))))
    }

    /// What it is called in a table.
    pub fn name(&self) -> &str {
        match &self.0 {
            Kind::Scene { name, .. } => name,
            Kind::Clip(clip) => &clip.input,
        }
    }

    /// How long there is something to look at, seconds.
    pub fn duration_s(&self) -> f64 {
        match &self.0 {
            Kind::Scene { scene, .. } => scene.duration_s(),
            Kind::Clip(clip) => clip.boxes.last().map_or(0.0, |b| b.0),
        }
    }

    /// When somebody is there, seconds from and to: from where enough of them is to be seen until they have left.
    pub fn visits(&self) -> Vec<Range<f64>> {
        match &self.0 {
            Kind::Scene { scene, .. } => vec![0.0..scene.duration_s()],
            Kind::Clip(clip) => visits(&clip.boxes),
        }
    }

    /// Where the target is at `time_s`; `None` where it is nowhere.
    pub fn target(&self, time_s: f64) -> Option<KnownTarget> {
        match &self.0 {
            Kind::Scene { scene, .. } => in_scene(&**scene, time_s),
            Kind::Clip(clip) => clip.target(time_s),
        }
    }

    /// The world, to be looked at once in the order of time.
    ///
    /// # Errors
    /// A clip that cannot be read again.
    pub fn world(&self) -> Result<Box<dyn World + '_>, RunError> {
        Ok(match &self.0 {
            Kind::Scene { scene, .. } => Box::new(Rendered(move |time_s: f64, lens: &Lens, pose: Direction| {
                let view = aimed(&**scene, lens, pose).ok_or(PtzError::Parameter {
                    name: "the camera's direction",
                    value: pose.pan_deg,
                    wanted: "one in which the scene can be looked at",
                })?;
                Ok(scene.render_view(time_s, &view).image)
            })),
            Kind::Clip(clip) => Box::new(WideClip::new(clip.lens, clip.pictures()?)),
        })
    }
}

/// The scene's view through `lens` towards `pose`.
fn aimed(scene: &dyn Scene, lens: &Lens, pose: Direction) -> Option<View> {
    let width_rad = 2.0 * lens.half_fov_deg().0.to_radians();
    let view = View { size: lens.size(), ..scene.home() };
    view.zoomed(width_rad)?.aimed(pose.pan_deg.to_radians(), pose.tilt_deg.to_radians())
}

/// Looked for ahead first and then all about; measured in the middle of a view, where perspective does not stretch it.
fn in_scene(scene: &dyn Scene, time_s: f64) -> Option<KnownTarget> {
    let home = scene.home();
    let extent = |view: &View| scene.targets_in_view(time_s, view).first().and_then(|t| t.extent);
    let tilt_rad = home.camera.tilt_rad();
    let about = [0.0, 0.5, -0.5, 1.0].map(|half_turns: f64| half_turns * std::f64::consts::PI);
    let mut at = about.iter().find_map(|turn| {
        let view = home.aimed(home.camera.pan_rad() + turn, tilt_rad)?;
        Some(view.direction_of(extent(&view)?.center()))
    })?;
    let (mut width, mut height) = (0.0, 0.0);
    for _ in 0..2 {
        let view = home.aimed(at.pan_rad, at.tilt_rad)?;
        let bbox = extent(&view)?;
        let [fx, fy, ..] = view.camera.lens().pinhole_px(view.size);
        (width, height) = (bbox.width() / fx, bbox.height() / fy);
        at = view.direction_of(bbox.center());
    }
    Some((Direction::new(at.pan_rad.to_degrees(), at.tilt_rad.to_degrees()), width, height))
}

/// Where to start: on the first box of at least this share of the usual area. Of who comes in a sliver is seen at first, and a tracker
/// that is started on a sliver goes on with that.
const LEAST_SEEN: f64 = 0.5;

/// The first box to start on; `None` where there is none at all.
fn start(boxes: &[TimedBox]) -> Option<usize> {
    let mut areas: Vec<f64> = boxes.iter().filter_map(|b| Some(b.1?.area())).collect();
    areas.sort_by(f64::total_cmp);
    let usual = *areas.get(areas.len() / 2)?;
    boxes.iter().position(|b| b.1.is_some_and(|b| b.area() >= LEAST_SEEN * usual))
}

/// Who is not seen for less than this is behind something; else they have left, and who comes is another.
const LEFT_S: f64 = 1.0;

/// Spans of time in which somebody is there.
fn visits(boxes: &[TimedBox]) -> Vec<Range<f64>> {
    let seen: Vec<TimedBox> = boxes.iter().filter(|b| b.1.is_some()).copied().collect();
    let spans = seen.chunk_by(|a, b| b.0 - a.0 < LEFT_S);
    spans.filter_map(|span| Some(span[start(span)?].0..span.last()?.0)).collect()
}

impl Clip {
    /// All of it.
    fn read(input: &str, width_deg: f64, options: OpenOptions) -> Result<Self, RunError> {
        let mut source = open_with(input, &options)?;
        let lens = Lens::new(source.info().size, 0.5 * width_deg)?;
        let Some(truth) = source.info().truth.clone() else {
            return Err(RunError::usage(format!(
                "{input} has no true boxes, and a simulation has to know where the target is; give a folder with frames.csv, or a \
                 video with a CSV of boxes of the same name beside it"
            )));
        };
        let mut boxes = Vec::new();
        while let Some(frame) = source.next_frame()? {
            let truth = usize::try_from(frame.index()).ok().and_then(|k| truth.get(k));
            boxes.push((frame.time_s(), truth.and_then(Truth::bbox)));
        }
        if boxes.iter().all(|b| b.1.is_none()) {
            return Err(RunError::usage(format!("nobody is to be seen in {input}")));
        }
        Ok(Self { input: input.to_owned(), options, lens, boxes, starts_s: 0.0 })
    }

    /// Between two frames the box is between theirs.
    fn target(&self, time_s: f64) -> Option<KnownTarget> {
        let next = self.boxes.partition_point(|b| b.0 <= time_s);
        let (before_s, before) = *self.boxes.get(next.checked_sub(1)?)?;
        let before = before?;
        let bbox = match self.boxes.get(next).copied() {
            Some((after_s, Some(after))) => between(&before, &after, (time_s - before_s) / (after_s - before_s)),
            _ => before,
        };
        let direction = direction_of(&self.lens, Direction::AHEAD, bbox.center(), AngleFormula::PanThenTilt);
        let per_px = self.lens.half_fov_deg().0.to_radians().tan() / self.lens.middle().x;
        Some((direction, bbox.width() * per_px, bbox.height() * per_px))
    }

    /// The picture shown at a time, read on from the last.
    fn pictures(&self) -> Result<impl FnMut(f64) -> pursuit_ptz::Result<Arc<Image<Rgb8>>> + '_, RunError> {
        let mut reader = Reader { source: open_with(&self.input, &self.options)?, shown: None, next: None };
        Ok(move |time_s: f64| reader.at(time_s + self.starts_s).map_err(|reason| PtzError::Picture { reason }))
    }
}

/// `part` of the way from one box to another.
fn between(a: &BBox, b: &BBox, part: f64) -> BBox {
    let mix = |a: f64, b: f64| a + part.clamp(0.0, 1.0) * (b - a);
    let (from, to) = (a.center(), b.center());
    let center = Point::new(mix(from.x, to.x), mix(from.y, to.y));
    BBox::from_center_size(center, mix(a.width(), b.width()), mix(a.height(), b.height()))
}

type Picture = (f64, Arc<Image<Rgb8>>);

/// Reads on to a time.
struct Reader {
    source: Box<dyn Source>,
    shown: Option<Picture>,
    next: Option<Picture>,
}

impl Reader {
    fn at(&mut self, time_s: f64) -> Result<Arc<Image<Rgb8>>, String> {
        loop {
            if self.next.is_none() {
                let frame = self.source.next_frame().map_err(|e| e.to_string())?;
                self.next = frame.map(|f| (f.time_s(), Arc::new(f.color().to_image())));
            }
            match self.next.take() {
                // The first picture is shown from the beginning.
                Some(next) if next.0 <= time_s || self.shown.is_none() => self.shown = Some(next),
                next => {
                    self.next = next;
                    break;
                }
            }
        }
        self.shown.as_ref().map(|shown| shown.1.clone()).ok_or_else(|| "the clip is empty".to_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_geometry::Size;

    #[test]
    fn a_scene_says_where_its_target_is_wherever_one_looks() {
        let world = KnownWorld::scene("wide-world?seed=3&reach=80&duration=40").unwrap();
        assert_eq!(world.duration_s(), 40.0);
        let widest = (0..400).filter_map(|k| world.target(f64::from(k) * 0.1)).map(|t| t.0.pan_deg.abs());
        let widest = widest.fold(0.0, f64::max);
        assert!((79.0..81.0).contains(&widest), "{widest}");
        // In the middle of a view aimed at it.
        let (direction, width, height) = world.target(2.0).unwrap();
        assert!(height > width && width > 0.02, "{width} {height}");
        let lens = Lens::new(Size::new(320, 180), 30.0).unwrap();
        let mut seen = world.world().unwrap();
        let (on_it, beside) =
            (seen.render(2.0, &lens, direction).unwrap(), seen.render(2.0, &lens, Direction::AHEAD).unwrap());
        assert_ne!(on_it, beside);
        assert!(KnownWorld::scene("no-such-scene").is_err());
    }

    #[test]
    fn a_sliver_is_no_start() {
        let seen = |k: f64, width: f64| (k, Some(BBox::from_ltwh(0.0, 0.0, width, 100.0)));
        let comes = [
            (0.0, None),
            seen(1.0, 4.0),
            seen(2.0, 19.0),
            seen(3.0, 21.0),
            seen(4.0, 40.0),
            seen(5.0, 40.0),
            seen(6.0, 44.0),
        ];
        assert_eq!(start(&comes), Some(3), "half of 40 and more");
        assert_eq!(start(&[(0.0, None), seen(1.0, 4.0)]), Some(1));
        assert_eq!((start(&[(0.0, None)]), start(&[])), (None, None));
    }

    #[test]
    fn who_comes_after_a_while_is_another_visit() {
        let seen = |k: f64, width: f64| (k, Some(BBox::from_ltwh(0.0, 0.0, width, 100.0)));
        let boxes = [
            (0.0, None),
            seen(0.5, 10.0),
            seen(1.0, 40.0),
            (1.5, None),
            seen(1.9, 40.0),
            seen(2.5, 8.0),
            (3.0, None),
            seen(3.5, 90.0),
            (4.0, None),
        ];
        assert_eq!(visits(&boxes), [1.0..2.5, 3.5..3.5], "hidden for .9 s, away for a whole second");
        assert!(visits(&[(0.0, None)]).is_empty());
    }

    #[test]
    fn boxes_are_mixed() {
        let (a, b) = (BBox::from_ltwh(0.0, 0.0, 10.0, 20.0), BBox::from_ltwh(20.0, 10.0, 20.0, 20.0));
        assert_eq!(between(&a, &b, 0.5), BBox::from_ltwh(10.0, 5.0, 15.0, 20.0));
        assert_eq!((between(&a, &b, -1.0), between(&a, &b, 2.0)), (a, b));
    }
}
