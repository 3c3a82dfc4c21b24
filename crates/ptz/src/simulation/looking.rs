use super::closed_loop::Eye;
use super::{Exposure, World};
use crate::{Aim, Forecast, Result};
use pursuit_imaging::{CameraPose, Frame};
use pursuit_tracking::many::{MultiTracker, Track};
use pursuit_tracking::{Estimate, Recipe, Tracker};

/// A tracker that looks at what a simulated camera sees of a world: nothing of the loop is assumed but the head and the
/// world. It is started on the target's true box in the first picture that shows the target, or finds its target by itself.
pub struct TrackingEye<'a> {
    world: Box<dyn World + 'a>,
    looker: Looker<'a>,
    looked: u64,
    watcher: Option<Box<Watcher<'a>>>,
}

/// What looks at the pictures.
enum Looker<'a> {
    /// A tracker by the recipe, once the target was shown.
    Told(&'a dyn Recipe, Option<Box<dyn Tracker>>),
    /// The first of its targets is followed.
    Finds(Box<dyn MultiTracker>, Vec<Track>),
}

/// Is shown each picture that was looked at, how it was taken, and what the tracker said of it.
type Watcher<'a> = dyn FnMut(&Frame, &Exposure, Option<&Estimate>) -> Result<()> + 'a;

impl<'a> TrackingEye<'a> {
    /// An eye for `world`, with a tracker by `recipe`.
    pub const fn new(world: Box<dyn World + 'a>, recipe: &'a dyn Recipe) -> Self {
        Self { world, looker: Looker::Told(recipe, None), looked: 0, watcher: None }
    }

    /// An eye for `world` that is told nothing of a target: `targets` finds one.
    pub const fn finding(world: Box<dyn World + 'a>, targets: Box<dyn MultiTracker>) -> Self {
        Self { world, looker: Looker::Finds(targets, Vec::new()), looked: 0, watcher: None }
    }

    /// The same, and `watcher` is shown each picture that was looked at, how it was taken, and what the tracker said of it.
    #[must_use]
    pub fn shown_to(self, watcher: impl FnMut(&Frame, &Exposure, Option<&Estimate>) -> Result<()> + 'a) -> Self {
        Self { watcher: Some(Box::new(watcher)), ..self }
    }
}

impl Looker<'_> {
    /// What is said of a frame.
    fn estimate(&mut self, frame: &Frame, exposure: &Exposure) -> Result<Option<Estimate>> {
        match self {
            Self::Told(_, Some(tracker)) => Ok(Some(tracker.update(frame)?)),
            Self::Told(recipe, tracker) => {
                let Some(truth) = exposure.truth.filter(|_| exposure.shows_target()) else { return Ok(None) };
                *tracker = Some(recipe.init(frame, truth)?);
                Ok(Some(Estimate::started(frame.time_s(), truth, 1.0)))
            }
            Self::Finds(targets, tracks) => {
                targets.step(frame, tracks)?;
                Ok(tracks.first().and_then(|track| track.estimate.clone()))
            }
        }
    }

    /// Where it expects the target so many seconds after the last frame.
    fn forecast(&self, seconds: f64) -> Option<pursuit_tracking::Forecast> {
        match self {
            Self::Told(_, tracker) => tracker.as_deref()?.forecast(seconds).ok(),
            Self::Finds(targets, tracks) => targets.forecast(tracks.first()?.id, seconds).ok(),
        }
    }
}

impl Eye for TrackingEye<'_> {
    fn look(&mut self, exposure: &Exposure, camera: Option<CameraPose>) -> Result<Box<dyn Forecast + '_>> {
        // Worlds are rendered level: a tracker would look at another picture than the camera takes.
        crate::error::require(
            "roll_deg",
            exposure.roll_deg,
            exposure.roll_deg == 0.0,
            "0 where pictures are rendered",
        )?;
        let image = self.world.render(exposure.time_s, &exposure.lens, exposure.position.direction)?;
        let frame = Frame::new(self.looked, exposure.time_s, image);
        let frame = match camera {
            Some(camera) => frame.with_camera(camera),
            None => frame,
        };
        self.looked += 1;
        let seen = self.looker.estimate(&frame, exposure)?;
        if let Some(watcher) = &mut self.watcher {
            watcher(&frame, exposure, seen.as_ref())?;
        }
        let (looker, stamp_s) = (&self.looker, exposure.arrival_s);
        Ok(Box::new(move |time_s: f64| {
            Aim::ahead(seen.as_ref()?, time_s - stamp_s, |seconds| looker.forecast(seconds))
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Direction;
    use crate::simulation::{Contender, Figures, Rendered, Study};
    use pursuit_geometry::{BBox, Point};
    use pursuit_imaging::Image;
    use pursuit_tracking::{GroupParams, Localizer, LocalizerRecipe, Measurement, Search, TrackerRecipe};
    use serde::{Deserialize, Serialize};

    pursuit_parameters::parameters! {
        /// Follows what is white.
        pub struct WhiteParams {
            /// Least grey value.
            pub least: usize = 128, in 1..=255;
        }
    }

    #[derive(Clone, Serialize, Deserialize)]
    pub struct White(WhiteParams, (f64, f64));

    impl LocalizerRecipe for WhiteParams {
        type Localizer = White;

        fn localizer(&self, _: &Frame, bbox: BBox) -> pursuit_tracking::Result<White> {
            Ok(White(self.clone(), (bbox.width(), bbox.height())))
        }
    }

    impl Localizer for White {
        type Finding = ();

        fn locate(&mut self, frame: &Frame, _: &Search) -> pursuit_tracking::Result<Option<(Measurement, ())>> {
            let (mut sum, mut count) = ((0.0, 0.0), 0.0);
            for (y, row) in frame.gray().rows().enumerate() {
                for x in (0..row.len()).filter(|x| usize::from(row[*x]) >= self.0.least) {
                    sum = (sum.0 + x as f64 + 0.5, sum.1 + y as f64 + 0.5);
                    count += 1.0;
                }
            }
            let center = Point::new(sum.0 / count, sum.1 / count);
            let bbox = BBox::from_center_size(center, self.1.0, self.1.1);
            Ok((count > 0.0).then(|| (Measurement::new(bbox, 0.9), ())))
        }

        fn adapt(&mut self, _: &Frame, _: BBox, (): &()) -> pursuit_tracking::Result<()> {
            Ok(())
        }

        fn restart(&mut self, _: &Frame, bbox: BBox) -> pursuit_tracking::Result<()> {
            self.1 = (bbox.width(), bbox.height());
            Ok(())
        }
    }

    /// A white disk that goes to and fro by 40°, as wide as 4°.
    fn target(time_s: f64) -> (Direction, f64, f64) {
        (Direction::new(40.0 * (0.4 * time_s).sin(), 2.0), 0.07, 0.07)
    }

    fn eye(recipe: &dyn Recipe) -> TrackingEye<'_> {
        let world = Rendered(|time_s: f64, lens: &crate::geometry::Lens, pose| {
            let at = crate::geometry::pixel_of(lens, pose, target(time_s).0).unwrap_or(Point::new(-99.0, -99.0));
            let size = lens.size();
            let white = |x: usize, y: usize| (x as f64 - at.x).hypot(y as f64 - at.y) < 5.0;
            Ok(Image::from_fn(size.width, size.height, |x, y| if white(x, y) { [250; 3] } else { [20; 3] })?)
        });
        TrackingEye::new(Box::new(world), recipe)
    }

    #[test]
    fn a_tracker_that_looks_closes_the_loop() {
        let recipe = TrackerRecipe { name: "white", localizer: WhiteParams::default(), groups: GroupParams::default() };
        let study: Study = toml::from_str("duration_s = 12\ncamera = { width = 160, height = 90 }").unwrap();
        let follow = |contender, eye: &mut dyn Eye| {
            let samples = study.follow(contender, 1, Direction::new(0.0, 2.0), &target, eye).unwrap();
            Figures::of(&samples, 3.0)
        };
        let mut shown = Vec::new();
        let mut seen = eye(&recipe).shown_to(|frame, exposure, estimate| {
            shown.push((frame.time_s(), exposure.time_s, estimate.is_some()));
            Ok(())
        });
        let with = follow(Contender::Velocity, &mut seen);
        drop(seen);
        assert!(shown.len() > 250 && shown.iter().all(|(at, taken, told)| at == taken && *told), "{}", shown.len());
        assert!(with.central > 0.9 && with.shown == 1.0, "{with:?}");
        let without = follow(Contender::StopAndGo, &mut eye(&recipe));
        assert!(without.central < with.central - 0.2, "{without:?}");
        let rolls = Study { drone: Some(crate::simulation::DroneParams::default()), ..study.clone() };
        let refused = rolls.follow(Contender::Velocity, 1, Direction::AHEAD, &target, &mut eye(&recipe));
        assert!(refused.unwrap_err().to_string().contains("roll_deg"));
    }
}
