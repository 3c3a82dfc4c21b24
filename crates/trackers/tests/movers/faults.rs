//! Rooms with people and one thing that leads a background astray, with truth.

use pursuit_geometry::BBox;
use pursuit_imaging::{Frame, Image, Rgb8};
use pursuit_scenes::{Scene, View};
use pursuit_testkit::{lattice, value_noise};

/// What goes wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    /// Nothing.
    None,
    /// The camera's exposure goes down to less than half and up again, within four seconds.
    Ramp,
    /// The light goes down to 60 % while somebody walks.
    Switch,
    /// A lamp goes out that lights one half of the picture.
    Lamp,
    /// The camera shakes by up to 2.5 pixels, from frame to frame.
    Shake,
    /// The camera sways by 3 pixels, slowly.
    Sway,
    /// Somebody stands for a minute and a half.
    Stands,
    /// Somebody enters at a quarter of a walk.
    Slow,
    /// Two people meet, who are there from the first frame.
    Crossing,
    /// Shadows on the floor take two thirds of the light.
    Shadow,
    /// The floor reflects.
    Reflection,
    /// A tree behind a window sways.
    Leaves,
    /// It rains before the camera.
    Rain,
    /// The sensor is noisy.
    Noise,
}

impl Fault {
    /// All of them.
    #[allow(dead_code, reason = "the tests name each")]
    pub const ALL: &[Self] = &[
        Self::None,
        Self::Ramp,
        Self::Switch,
        Self::Lamp,
        Self::Shake,
        Self::Sway,
        Self::Stands,
        Self::Slow,
        Self::Crossing,
        Self::Shadow,
        Self::Reflection,
        Self::Leaves,
        Self::Rain,
        Self::Noise,
    ];

    /// Its name.
    pub fn name(self) -> String {
        format!("{self:?}").to_lowercase()
    }

    /// How many people there are.
    #[allow(dead_code, reason = "the instrument beside the tests does not ask")]
    pub const fn people(self) -> usize {
        match self {
            Self::Crossing => 2,
            _ => 1,
        }
    }

    fn query(self, seed: u64) -> String {
        let what = match self {
            Self::Switch => "person?gain=0.6&step=4.5",
            Self::Stands => "person?stands=90&fps=10&duration=100",
            Self::Slow => "person?speed=0.3&stands=1&duration=30&fps=15",
            Self::Crossing => "people?count=2&duration=10",
            Self::Shadow => "person?shadow=0.65",
            Self::Noise => "person?noise=9",
            // One thing at a time: where the camera moves, shadows are faint.
            Self::Shake | Self::Sway => "person?shadow=0.2",
            Self::None | Self::Ramp | Self::Lamp | Self::Reflection | Self::Leaves | Self::Rain => "person?fov=60",
        };
        format!("scene:{what}&seed={seed}")
    }
}

/// A room in which something goes wrong.
pub struct Staged {
    scene: Box<dyn Scene>,
    fault: Fault,
    seed: u64,
    empty: Image<Rgb8>,
}

/// A frame, and where people are in it.
pub struct Moment {
    pub frame: Frame,
    /// Those of whom anything is seen, and those of whom half is.
    pub seen: Vec<BBox>,
    pub half_seen: Vec<BBox>,
}

impl Staged {
    pub fn new(fault: Fault, seed: u64) -> Self {
        let scene = pursuit_scenes::open(&fault.query(seed)).unwrap();
        let empty = scene.render(0.0).image;
        Self { scene, fault, seed, empty }
    }

    pub fn frames(&self) -> u64 {
        self.scene.frame_count()
    }

    pub fn moment(&self, k: u64) -> Moment {
        let time_s = self.scene.frame_time_s(k);
        let moment = self.scene.render_view(time_s, &self.view(k, time_s));
        let size = moment.image.size();
        let seen = |least: f64| {
            let visible = moment.targets.iter().filter(|t| t.visible_fraction >= least);
            visible.filter_map(|t| t.visible()?.clipped_to(size)).collect::<Vec<_>>()
        };
        let (any, half) = (seen(0.0), seen(0.5));
        let image = self.spoiled(moment.image, &any, k, time_s);
        Moment { frame: Frame::new(k, time_s, image), seen: any, half_seen: half }
    }

    /// Where the camera looks.
    fn view(&self, k: u64, time_s: f64) -> View {
        let home = self.scene.home();
        // 480 pixels see 60 degrees: a pixel is 2.4 mrad in the middle.
        let pixel = 2.0 * 30f64.to_radians().tan() / 480.0;
        let between = |j: i64| 2.0 * lattice(k as i64, j, self.seed) - 1.0;
        let (x, y) = match self.fault {
            Fault::Shake if k > 0 => (2.5 * between(1), 2.5 * between(2)),
            Fault::Sway => (3.0 * (2.1 * time_s).sin(), 2.0 * (1.3 * time_s).sin()),
            _ => return home,
        };
        home.aimed(x * pixel, y * pixel).unwrap_or(home)
    }

    fn spoiled(&self, image: Image<Rgb8>, people: &[BBox], k: u64, time_s: f64) -> Image<Rgb8> {
        let (width, height) = (image.width(), image.height());
        let lit = |gain: &dyn Fn(usize) -> f64| {
            let light = |x: usize, y: usize| image.row(y)[x].map(|v| (f64::from(v) * gain(x)).min(255.0) as u8);
            Image::from_fn(width, height, light).unwrap()
        };
        match self.fault {
            Fault::Ramp => lit(&|_| 0.72 + 0.28 * (std::f64::consts::TAU * time_s / 4.0).cos()),
            Fault::Lamp if time_s > 4.5 => {
                // The lamp's light ends softly, about a third of the way across.
                lit(&|x| 1.0 - 0.45 / (1.0 + ((x as f64 - 0.35 * width as f64) / 25.0).exp()))
            }
            Fault::Reflection => self.reflected(image, people),
            Fault::Leaves => self.with_leaves(image, time_s),
            Fault::Rain => self.rained_on(image, k),
            _ => image,
        }
    }

    /// People and a mirror image of them on the floor.
    fn reflected(&self, mut image: Image<Rgb8>, people: &[BBox]) -> Image<Rgb8> {
        let whole = image.clone();
        for bbox in people {
            let (left, right) = (bbox.left().max(0.0) as usize, (bbox.right() as usize).min(image.width()));
            let feet = bbox.bottom() as usize;
            for y in feet..image.height().min(feet + bbox.height() as usize) {
                let Some(from) = (2 * feet).checked_sub(y + 1) else { break };
                for x in left..right {
                    let (person, room) = (whole.row(from)[x], self.empty.row(from)[x]);
                    if person.iter().zip(room).any(|(a, b)| a.abs_diff(b) > 30) {
                        let floor = image.row(y)[x];
                        let mixed = |c: usize| 0.65 * f64::from(floor[c]) + 0.35 * f64::from(person[c]);
                        image.row_mut(y)[x] = [mixed(0) as u8, mixed(1) as u8, mixed(2) as u8];
                    }
                }
            }
        }
        image
    }

    /// A window full of leaves, high on the wall.
    fn with_leaves(&self, mut image: Image<Rgb8>, time_s: f64) -> Image<Rgb8> {
        for y in 10..90 {
            for x in 40..150 {
                let away = 3.0 * (2.3 * time_s + 0.05 * y as f64).sin() + 1.5 * (5.1 * time_s).sin();
                let leaf = value_noise(
                    (x as f64 + away, y as f64),
                    6.0,
                    |t| t,
                    |i, j| lattice(i, j, self.seed.wrapping_add(9)),
                );
                image.row_mut(y)[x] =
                    [(60.0 + 70.0 * leaf) as u8, (90.0 + 110.0 * leaf) as u8, (40.0 + 50.0 * leaf) as u8];
            }
        }
        image
    }

    /// Streaks, others in every frame.
    fn rained_on(&self, mut image: Image<Rgb8>, k: u64) -> Image<Rgb8> {
        for drop in 0..120 {
            let place = |j: i64, n: usize| (lattice(k as i64, 3 * drop + j, self.seed) * n as f64) as usize;
            let (x, top) = (place(0, image.width()), place(1, image.height()));
            for y in top..(top + 14).min(image.height()) {
                image.row_mut(y)[x] = image.row(y)[x].map(|v| v.saturating_add(55));
            }
        }
        image
    }
}
