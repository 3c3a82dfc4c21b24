//! A ball on a table, seen from the table's end: the scene of `pursuit demo`.
//!
//! A pinhole camera looks at a world measured in metres, so sizes, bounces, shadows and perspective agree with each other.
//! The clip plays at about 0.6 of real time: gravity is 3.5 m/s², some 2600 px/s² where the ball is.

mod backdrop;
mod ball;
mod camera;
mod hand;
mod path;

use crate::compose::{Layer, Noise, Shot, compose, compose_view};
use crate::texture::{Color, Texture, hsv, smooth_step};
use crate::{Scene, SceneMoment, TargetTruth, View};
use ball::Ball;
use camera::World;
use path::Path;
use pursuit_geometry::{Point, Size};

pursuit_parameters::parameters! {
    /// Of `table-tennis`.
    pub struct TableTennisParams {
        /// The rate.
        pub fps: f64 = 30.0, in 1.0..=1000.0, unit "frames/s";
        /// The length.
        pub duration: f64 = 10.0, in 0.1..=600.0, unit "s";
        /// The standard deviation of the sensor's noise.
        pub noise: f64 = 4.0, in 0.0..=80.0, unit "grey levels";
        /// The fraction of the frame interval during which the shutter is open.
        pub exposure: f64 = 0.35, in 0.0..=1.0;
        /// The ball's hue (24 orange, 50 yellow).
        pub hue: f64 = 50.0, in 0.0..=360.0, unit "degrees";
        /// By how much of hue the other balls are redder.
        pub like: f64 = 14.0, in -180.0..=180.0, unit "degrees";
        /// How many other balls there are: none, one at rest, and one rolling.
        pub distractors: usize = 2, in 0..=2;
        /// Whether a hand hides the ball for a while.
        pub hand: bool = true;
        /// The light's gain while it is dimmed.
        pub light: f64 = 0.62, in 0.1..=1.5;
    }
}

/// When the light goes down and up again, in seconds: begin and end of each change.
const DIMMED_S: [(f64, f64); 2] = [(3.0, 3.3), (8.5, 8.8)];

pub(crate) fn build(seed: u64, params: &TableTennisParams) -> Box<dyn Scene> {
    let color = |offset: f64| hsv(params.hue - offset, 0.88, 0.98);
    let others = [Path::resting(seed), Path::rolling_by(seed)].into_iter().take(params.distractors);
    Box::new(TableTennis {
        fps: params.fps,
        duration_s: params.duration,
        seed,
        noise: params.noise,
        exposure_s: params.exposure / params.fps,
        dimmed: params.light as f32,
        backdrop: backdrop::paint(seed),
        ball: Ball { path: Path::played(seed), color: color(0.0) },
        others: others.map(|path| Ball { path, color: color(params.like) }).collect(),
        hand: params.hand.then(|| hand::Hand::new(seed)),
    })
}

struct TableTennis {
    fps: f64,
    duration_s: f64,
    seed: u64,
    noise: f64,
    exposure_s: f64,
    dimmed: f32,
    backdrop: Texture,
    ball: Ball,
    others: Vec<Ball>,
    hand: Option<hand::Hand>,
}

impl TableTennis {
    const SIZE: Size = Size::new(640, 480);

    /// Gains of red, green and blue: dimmed light is warmer.
    fn light(&self, time_s: f64) -> Color {
        let [down, up] = DIMMED_S.map(|(begin, end)| smooth_step(begin, end, time_s) as f32);
        let (dim, weight) = (self.dimmed, down - up);
        [dim * 1.06, dim, dim * 0.9].map(|gain| 1.0 + (gain - 1.0) * weight)
    }

    /// The ball, the hand where there is one, and how much of the ball the hand leaves to be seen.
    fn ball_and_hand(&self, time_s: f64) -> (Layer, Option<Layer>, TargetTruth) {
        let ball = self.ball.layer(time_s, self.exposure_s);
        let hand = self.hand.as_ref().map(|h| h.layer(time_s));
        let extent = self.ball.extent(time_s);
        let full_px = std::f64::consts::PI * extent.area() / 4.0;
        let visible_fraction = (ball.visible_area_px(hand.as_slice()) / full_px).clamp(0.0, 1.0);
        (ball, hand, TargetTruth { extent: Some(extent), visible_fraction })
    }
}

impl Scene for TableTennis {
    fn size(&self) -> Size {
        Self::SIZE
    }

    fn fps(&self) -> f64 {
        self.fps
    }

    fn duration_s(&self) -> f64 {
        self.duration_s
    }

    fn home(&self) -> View {
        View::ahead(camera::home_rad(), Self::SIZE)
    }

    fn render_view(&self, time_s: f64, view: &View) -> SceneMoment {
        let balls = || self.others.iter().chain(std::iter::once(&self.ball));
        let mut layers: Vec<Layer> = balls().map(|b| b.shadow(time_s, self.exposure_s)).collect();
        layers.extend(self.others.iter().map(|b| b.layer(time_s, self.exposure_s)));
        let (ball, hand, truth) = self.ball_and_hand(time_s);
        layers.push(ball);
        layers.extend(hand);
        let shot = Shot {
            size: Self::SIZE,
            backdrop: &self.backdrop,
            origin: Point::new(0.0, 0.0),
            layers: &layers,
            light: self.light(time_s),
            noise: Noise::of_frame(self.noise, self.seed, time_s, self.fps),
        };
        let home = self.home();
        if view.shows_the_same(&home) {
            return SceneMoment { image: compose(&shot), depth_mm: None, targets: vec![truth] };
        }
        let image = compose_view(&shot, &home, view);
        SceneMoment { image, depth_mm: None, targets: vec![view.truth_from(&home, &truth)] }
    }

    fn targets_in_view(&self, time_s: f64, view: &View) -> Vec<TargetTruth> {
        let (home, truth) = (self.home(), self.ball_and_hand(time_s).2);
        vec![if view.shows_the_same(&home) { truth } else { view.truth_from(&home, &truth) }]
    }
}
