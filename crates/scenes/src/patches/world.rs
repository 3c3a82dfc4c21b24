use super::depth::{DepthSensor, turned_depth};
use crate::compose::{Layer, Noise, Shot, compose, compose_view};
use crate::texture::{Color, Texture};
use crate::{Scene, SceneMoment, TargetTruth, View};
use pursuit_geometry::{BBox, Point, Size};

/// Where something is at a time: a box, or nowhere.
pub(super) type Path = Box<dyn Fn(f64) -> Option<BBox> + Send + Sync>;

/// Something rectangular with a look and a path.
pub(super) struct Thing {
    pub(super) look: Texture,
    pub(super) path: Path,
}

/// A background, the targets, things behind and before them, a camera and a light.
pub(super) struct World {
    pub(super) size: Size,
    pub(super) fps: f64,
    pub(super) duration_s: f64,
    pub(super) seed: u64,
    pub(super) noise: f64,
    pub(super) backdrop: Texture,
    /// Backdrop point in the picture's top left corner.
    pub(super) camera: Box<dyn Fn(f64) -> Point + Send + Sync>,
    pub(super) behind: Vec<Thing>,
    /// The first is the one to follow; later ones lie over earlier ones.
    pub(super) targets: Vec<Thing>,
    pub(super) before: Vec<Thing>,
    pub(super) light: Box<dyn Fn(f64) -> Color + Send + Sync>,
    pub(super) depth: Option<DepthSensor>,
}

/// How wide the camera of these scenes sees, in radians.
const HOME_RAD: f64 = 1.0;

impl Thing {
    fn layer(&self, time_s: f64, size: Size) -> Option<(BBox, Layer)> {
        let bbox = (self.path)(time_s)?;
        Some((bbox, textured_box(&self.look, &bbox, size)))
    }
}

impl Scene for World {
    fn size(&self) -> Size {
        self.size
    }

    fn fps(&self) -> f64 {
        self.fps
    }

    fn duration_s(&self) -> f64 {
        self.duration_s
    }

    fn home(&self) -> View {
        View::ahead(HOME_RAD, self.size)
    }

    fn render_view(&self, time_s: f64, view: &View) -> SceneMoment {
        let mut layers = self.layers(&self.behind, time_s);
        let (shown, targets) = self.targets_and_before(time_s);
        layers.extend(shown);
        let shot = Shot {
            size: self.size,
            backdrop: &self.backdrop,
            origin: (self.camera)(time_s),
            layers: &layers,
            light: (self.light)(time_s),
            noise: Noise::of_frame(self.noise, self.seed, time_s, self.fps),
        };
        let (home, depth_mm) = (self.home(), self.depth.as_ref().map(|d| d.image(self, time_s)));
        if view.shows_the_same(&home) {
            return SceneMoment { image: compose(&shot), depth_mm, targets };
        }
        let targets = targets.iter().map(|t| view.truth_from(&home, t)).collect();
        let depth_mm = depth_mm.map(|depth| turned_depth(&depth, &home, view));
        SceneMoment { image: compose_view(&shot, &home, view), depth_mm, targets }
    }

    fn targets_in_view(&self, time_s: f64, view: &View) -> Vec<TargetTruth> {
        let (home, targets) = (self.home(), self.targets_and_before(time_s).1);
        match view.shows_the_same(&home) {
            true => targets,
            false => targets.iter().map(|t| view.truth_from(&home, t)).collect(),
        }
    }
}

impl World {
    fn layers(&self, things: &[Thing], time_s: f64) -> Vec<Layer> {
        things.iter().filter_map(|t| t.layer(time_s, self.size)).map(|(_, layer)| layer).collect()
    }

    /// The layers of the targets and of what is before them, and the truth.
    fn targets_and_before(&self, time_s: f64) -> (Vec<Layer>, Vec<TargetTruth>) {
        // From the front to the back, so that what hides a target is known when its turn comes.
        let mut shown = self.layers(&self.before, time_s);
        shown.reverse();
        let mut truths = Vec::with_capacity(self.targets.len());
        for target in self.targets.iter().rev() {
            let Some((bbox, layer)) = target.layer(time_s, self.size) else {
                truths.push(TargetTruth::ABSENT);
                continue;
            };
            let visible_fraction = (layer.visible_area_px(&shown) / bbox.area()).clamp(0.0, 1.0);
            truths.push(TargetTruth { extent: Some(bbox), visible_fraction });
            shown.push(layer);
        }
        shown.reverse();
        truths.reverse();
        (shown, truths)
    }
}

/// `look` stretched over `bbox`: border pixels covered in part are blended in part, inside each pixel 2 × 2 points are
/// sampled.
fn textured_box(look: &Texture, bbox: &BBox, size: Size) -> Layer {
    let overlap = |low: f64, high: f64, at: i64| (high.min(at as f64 + 1.0) - low.max(at as f64)).clamp(0.0, 1.0);
    let (gain_x, gain_y) = (look.width() as f64 / bbox.width(), look.height() as f64 / bbox.height());
    Layer::paint([bbox.left(), bbox.top(), bbox.right(), bbox.bottom()], size, |x, y| {
        let cover = overlap(bbox.left(), bbox.right(), x) * overlap(bbox.top(), bbox.bottom(), y);
        let mut color = [0.0; 3];
        for (i, j) in [(0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75)] {
            let sample = look.sample((x as f64 + i - bbox.left()) * gain_x, (y as f64 + j - bbox.top()) * gain_y);
            color = std::array::from_fn(|c| color[c] + 0.25 * sample[c]);
        }
        let cover = cover as f32;
        [color[0] * cover, color[1] * cover, color[2] * cover, cover]
    })
}
