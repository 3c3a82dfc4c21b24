//! Points followed from picture to picture, each as long as it can be trusted.

use super::{Appearance, LucasKanade, LucasKanadeParams, Outcome, Pyramid, RoundTrip};
use crate::error::{VisionError, require_range};
use pursuit_geometry::{Point, Size};
use serde::{Deserialize, Serialize};

/// Parameters of [`PointFollower`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PointFollowerParams {
    /// How a point is followed from one picture to the next.
    pub flow: LucasKanadeParams,
    /// A point whose way back ends farther than this from where it came from is lost, pixels, > 0.
    pub max_forward_backward_px: f64,
    /// A point is lost when its surroundings correlate by less than this with those of its start, after the affine change that
    /// fits best; −1 to 1, −1: they are not looked at.
    pub least_correlation: f64,
    /// A point is lost when the surroundings of its start are found farther than this from where the flow led it, pixels, > 0; what
    /// is nearer is drift, and the point goes to where they are.
    pub max_drift_px: f64,
    /// Side of the surroundings that are compared, an odd number from 7 to 63 pixels.
    pub patch_px: usize,
}

impl Default for PointFollowerParams {
    fn default() -> Self {
        Self {
            flow: LucasKanadeParams { window: Size::new(15, 15), ..LucasKanadeParams::default() },
            max_forward_backward_px: 1.0,
            least_correlation: 0.8,
            max_drift_px: 1.5,
            patch_px: 21,
        }
    }
}

/// What became of a point in a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PointState {
    /// It is where it is said to be.
    Tracked,
    /// It is hidden, or nothing there can be followed, or it looks otherwise: it is followed no further.
    Lost,
    /// It has left the picture: it is followed no further.
    Outside,
}

impl PointState {
    /// Its word.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Tracked => "tracked",
            Self::Lost => "lost",
            Self::Outside => "outside",
        }
    }
}

/// A point in a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FollowedPoint {
    /// Its number, in the order in which points were given, from 0.
    pub id: usize,
    /// Where it is, continuous pixels; `None` from the picture on in which it was lost.
    pub point: Option<Point>,
    /// How far its way back ended from where it came from, pixels; `None` where it was started, and where there is no way back.
    pub forward_backward_px: Option<f64>,
    /// What became of it.
    pub state: PointState,
}

/// A point that is followed still.
#[derive(Debug, Clone)]
struct Alive {
    id: usize,
    /// `None` where surroundings are not looked at.
    appearance: Option<Appearance>,
}

/// Follows points by pyramidal Lucas-Kanade there and back (Kalal, Mikolajczyk and Matas 2010), and watches each by the looks of
/// its start (Shi and Tomasi 1994). A point that fails is told as lost in that picture, once, and never again.
#[derive(Debug, Clone)]
pub struct PointFollower {
    params: PointFollowerParams,
    flow: LucasKanade,
    alive: Vec<Alive>,
    points: Vec<Point>,
    trips: Vec<RoundTrip>,
    told: Vec<FollowedPoint>,
    started: usize,
}

impl PointFollower {
    /// A follower of no points yet.
    ///
    /// # Errors
    /// When a parameter is out of its range.
    pub fn new(params: PointFollowerParams) -> Result<Self, VisionError> {
        let positive = (f64::MIN_POSITIVE, f64::MAX);
        let most = params.max_forward_backward_px;
        require_range("max_forward_backward_px", most, positive, "positive and finite")?;
        require_range("max_drift_px", params.max_drift_px, positive, "positive and finite")?;
        require_range("least_correlation", params.least_correlation, (-1.0, 1.0), "from -1 to 1")?;
        let side = if params.patch_px % 2 == 1 { params.patch_px as f64 } else { f64::NAN };
        if !(7.0..=63.0).contains(&side) {
            let (value, range) = (params.patch_px as f64, "an odd number from 7 to 63 pixels");
            return Err(VisionError::Parameter { name: "patch_px", value, range });
        }
        Ok(Self {
            params,
            flow: LucasKanade::new(params.flow)?,
            alive: Vec::new(),
            points: Vec::new(),
            trips: Vec::new(),
            told: Vec::new(),
            started: 0,
        })
    }

    /// The parameters.
    pub const fn params(&self) -> &PointFollowerParams {
        &self.params
    }

    /// How many points were ever given.
    pub const fn started(&self) -> usize {
        self.started
    }

    /// Where the points are that are followed still.
    pub fn points(&self) -> &[Point] {
        &self.points
    }

    /// Takes more points of `picture` (continuous pixels), and tells which can be followed: one outside of the picture is lost as it
    /// starts, and so is one where nothing can be told from its surroundings.
    ///
    /// # Errors
    /// When a patch cannot be.
    pub fn start(&mut self, picture: &Pyramid, points: &[Point]) -> Result<&[FollowedPoint], VisionError> {
        self.told.clear();
        let (Some(gray), size) = (picture.level(0), picture.size()) else { return Ok(&self.told) };
        for &point in points {
            let id = self.started;
            self.started += 1;
            let mut told = FollowedPoint { id, point: None, forward_backward_px: None, state: PointState::Tracked };
            let inside = is_inside(point, size);
            let watches = self.params.least_correlation > -1.0;
            let appearance = if inside && watches { Appearance::of(gray, point, self.params.patch_px)? } else { None };
            if !inside {
                told.state = PointState::Outside;
            } else if watches && appearance.is_none() {
                told.state = PointState::Lost;
            } else {
                told.point = Some(point);
                self.alive.push(Alive { id, appearance });
                self.points.push(point);
            }
            self.told.push(told);
        }
        Ok(&self.told)
    }

    /// Follows all points from one picture to the next, and tells of each that was followed until then.
    ///
    /// # Errors
    /// When the two pictures are not equally large.
    pub fn update(&mut self, from: &Pyramid, to: &Pyramid) -> Result<&[FollowedPoint], VisionError> {
        self.flow.track_there_and_back(from, to, &self.points, &mut self.trips)?;
        self.told.clear();
        let (size, params) = (to.size(), self.params);
        let mut kept = 0;
        for (k, trip) in self.trips.iter().enumerate() {
            let Some(alive) = self.alive.get_mut(k) else { break };
            let (at, error) = (trip.there.point, trip.error_px);
            let left = trip.there.outcome == Outcome::Outside || !is_inside(at, size);
            let point = if left {
                // From the middle of the picture nothing leaves at once: a search has run away.
                let near = is_near_border(self.points[k], size, params.flow.window);
                Err(if near { PointState::Outside } else { PointState::Lost })
            } else if error <= params.max_forward_backward_px {
                anchored(alive, to, at, &params).ok_or(PointState::Lost)
            } else {
                Err(PointState::Lost)
            };
            let state = point.err().unwrap_or(PointState::Tracked);
            let point = point.ok();
            let forward_backward_px = Some(error).filter(|e| e.is_finite());
            self.told.push(FollowedPoint { id: alive.id, point, forward_backward_px, state });
            if let Some(at) = point {
                self.alive.swap(kept, k);
                self.points[kept] = at;
                kept += 1;
            }
        }
        self.alive.truncate(kept);
        self.points.truncate(kept);
        Ok(&self.told)
    }
}

fn is_inside(point: Point, size: Size) -> bool {
    (0.0..=size.width as f64).contains(&point.x) && (0.0..=size.height as f64).contains(&point.y)
}

/// Whether a point is less than one and a half windows from the border.
fn is_near_border(point: Point, size: Size, window: Size) -> bool {
    let near = |at: f64, length: usize, side: usize| at.min(length as f64 - at) < 1.5 * side as f64;
    near(point.x, size.width, window.width) || near(point.y, size.height, window.height)
}

/// Where the surroundings of a point's start are now; `None` where it looks otherwise, or has been led elsewhere.
fn anchored(alive: &mut Alive, picture: &Pyramid, at: Point, params: &PointFollowerParams) -> Option<Point> {
    let (Some(appearance), Some(gray)) = (&mut alive.appearance, picture.level(0)) else { return Some(at) };
    let likeness = appearance.compare(gray, at)?;
    let same = likeness.correlation >= params.least_correlation && likeness.point.distance(at) <= params.max_drift_px;
    (same && is_inside(likeness.point, picture.size())).then_some(likeness.point)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flow::tests::texture;
    use pursuit_imaging::Image;

    const WIDTH: usize = 200;
    const HEIGHT: usize = 150;

    fn ground(dx: i64, dy: i64) -> Image<u8> {
        texture(WIDTH, HEIGHT, [256, 0, 300_000 - dx, 0, 256, 300_000 - dy])
    }

    fn pyramid(image: &Image<u8>) -> Pyramid {
        Pyramid::of(image.view(), 4).unwrap()
    }

    fn grid() -> Vec<Point> {
        (0..12 * 9).map(|i| Point::new(12.0 + 16.0 * f64::from(i % 12), 10.0 + 16.0 * f64::from(i / 12))).collect()
    }

    fn follower(params: PointFollowerParams) -> PointFollower {
        PointFollower::new(params).unwrap()
    }

    /// Where the points were last told to be, and in which picture each was lost.
    fn run(params: PointFollowerParams, pictures: &[Image<u8>]) -> (Vec<Point>, Vec<Option<(usize, PointState)>>) {
        let mut follower = follower(params);
        let start = grid();
        let (mut last, mut gone) = (start.clone(), vec![None; start.len()]);
        let pyramids: Vec<Pyramid> = pictures.iter().map(pyramid).collect();
        assert!(follower.start(&pyramids[0], &start).unwrap().iter().all(|p| p.state == PointState::Tracked));
        for (k, pair) in pyramids.windows(2).enumerate() {
            for told in follower.update(&pair[0], &pair[1]).unwrap() {
                assert_eq!(gone[told.id], None, "what is lost is told once");
                match told.point {
                    Some(at) => last[told.id] = at,
                    None => gone[told.id] = Some((k + 1, told.state)),
                }
            }
        }
        assert_eq!(follower.points().len(), gone.iter().filter(|g| g.is_none()).count());
        (last, gone)
    }

    #[test]
    fn points_go_with_the_picture_and_leave_with_it() {
        // 2.5 pixels to the left and one down, a picture.
        let pictures: Vec<Image<u8>> = (0..12).map(|k| ground(-640 * k, 256 * k)).collect();
        let (last, gone) = run(PointFollowerParams::default(), &pictures);
        for ((start, last), gone) in grid().iter().zip(&last).zip(&gone) {
            let end = Point::new(start.x - 27.5, start.y + 11.0);
            match gone {
                // The window of one at the border is half a guess.
                None => assert!(
                    last.distance(end) < if end.x < 12.0 || end.y > 138.0 { 1.5 } else { 0.3 },
                    "{start:?} {last:?}"
                ),
                Some((k, state)) => {
                    let (then, down) = (start.x - 2.5 * *k as f64, start.y + *k as f64);
                    // Near the border half of the window has nothing to follow.
                    assert!(then < 9.0 || down > HEIGHT as f64 - 9.0, "{start:?} was given up at {then} {down}");
                    assert!(
                        then < 5.0 || down > HEIGHT as f64 - 5.0 || *state == PointState::Lost,
                        "{start:?} {gone:?}"
                    );
                }
            }
        }
        assert!(gone.iter().flatten().any(|(_, state)| *state == PointState::Outside), "{gone:?}");
        let stayed = gone.iter().filter(|g| g.is_none()).count();
        assert!((60..grid().len()).contains(&stayed), "{stayed}");
    }

    /// Something with a texture of its own goes by before a ground that stands still: five pixels a picture, from the left.
    fn passing() -> Vec<Image<u8>> {
        let (back, front) = (ground(0, 0), ground(90_000, 70_000));
        let hides = |x: usize, y: usize, k: usize| (5 * k..5 * k + 60).contains(&(x + 60)) && (40..110).contains(&y);
        let picture = |k: usize| {
            let own = |x: usize, y: usize| front.row(y)[(x + 60 - 5 * k) % WIDTH];
            let pixel = |x: usize, y: usize| if hides(x, y, k) { own(x, y) } else { back.row(y)[x] };
            Image::from_fn(WIDTH, HEIGHT, pixel).unwrap()
        };
        (0..45).map(picture).collect()
    }

    #[test]
    fn what_passes_in_front_hides_points_and_takes_none_along() {
        let (last, gone) = run(PointFollowerParams::default(), &passing());
        let mut hidden = 0;
        for ((start, last), gone) in grid().iter().zip(&last).zip(&gone) {
            // Until the half of the window is another thing.
            assert!(last.distance(*start) < 8.0, "{start:?} was taken to {last:?}");
            let (x, y) = (start.x as usize, start.y as usize);
            let deep = (50..100).contains(&y) && x < 190;
            if let Some((k, state)) = gone.filter(|_| deep) {
                assert!(state == PointState::Lost || x < 24, "{start:?} {state:?}");
                // Not before the thing's edge is in the window.
                let (front, rear) = (5 * k as i64, 5 * k as i64 - 60);
                assert!((front - x as i64).abs() < 20 || (rear - x as i64).abs() < 20, "{start:?} {k}");
                hidden += 1;
            }
            if !(25..125).contains(&y) {
                assert_eq!(*gone, None, "{start:?} is never hidden");
            }
        }
        let deep = grid().iter().filter(|p| (50.0..100.0).contains(&p.y) && p.x < 190.0).count();
        assert_eq!(hidden, deep, "all that were hidden were told as lost");
    }

    #[test]
    fn without_a_look_at_their_start_points_are_taken_along() {
        let params = PointFollowerParams { least_correlation: -1.0, ..PointFollowerParams::default() };
        let (last, _) = run(params, &passing());
        let farthest = grid().iter().zip(&last).map(|(start, last)| last.distance(*start)).fold(0.0, f64::max);
        assert!(farthest > 40.0, "{farthest}");
    }

    #[test]
    fn points_outside_and_on_plain_ground_do_not_start() {
        let mut follower = follower(PointFollowerParams::default());
        let ground = ground(0, 0);
        let plain = Image::from_fn(WIDTH, HEIGHT, |x, y| if x < 100 { 90 } else { ground.row(y)[x] });
        let told = follower
            .start(
                &pyramid(&plain.unwrap()),
                &[(-1.0, 20.0), (f64::NAN, 3.0), (40.0, 75.0), (150.0, 75.0)].map(|(x, y)| Point::new(x, y)),
            )
            .unwrap();
        let states: Vec<PointState> = told.iter().map(|t| t.state).collect();
        assert_eq!(
            states,
            [PointState::Outside, PointState::Outside, PointState::Lost, PointState::Tracked],
            "{told:?}"
        );
        assert_eq!((follower.started(), follower.points()), (4, &[Point::new(150.0, 75.0)][..]));
    }

    #[test]
    fn bad_parameters_are_refused() {
        let params = PointFollowerParams::default();
        for bad in [
            PointFollowerParams { max_forward_backward_px: 0.0, ..params },
            PointFollowerParams { max_drift_px: f64::NAN, ..params },
            PointFollowerParams { least_correlation: 2.0, ..params },
            PointFollowerParams { patch_px: 14, ..params },
            PointFollowerParams { flow: LucasKanadeParams { levels: 0, ..params.flow }, ..params },
        ] {
            assert!(PointFollower::new(bad).is_err(), "{bad:?}");
        }
    }
}
