//! Points, followed from frame to frame.

#[cfg(feature = "encode")]
use super::drawing;
use super::folder::{Folder, Rows};
use super::{Seen, refused};
use crate::RunError;
use crate::timing::Timing;
use pursuit_geometry::{Point, Size};
use pursuit_imaging::Frame;
use pursuit_media::output::VideoWriter;
use pursuit_vision::flow::{
    FollowedPoint, GoodFeatures, GoodFeaturesParams, PointFollower, PointFollowerParams, PointState, Pyramid,
};
use serde::Serialize;
use std::fmt::Write as _;
use std::time::Instant;

/// Which points are followed.
#[derive(Debug, Clone, PartialEq)]
pub enum PointChoice {
    /// These, continuous pixels of the input.
    Given(Vec<Point>),
    /// So many corners, the best there are.
    Corners(usize),
    /// A grid over the picture, or the part of it that is seen, so many pixels of the input apart.
    Grid(f64),
}

/// How points are chosen and followed.
#[derive(Debug, Clone, PartialEq)]
pub struct PointOptions {
    /// Which points.
    pub choice: PointChoice,
    /// Whether new corners take the place of those that were lost; of corners only.
    pub renew: bool,
    /// What corners are.
    pub corners: GoodFeaturesParams,
    /// How they are followed, in pixels of the frames.
    pub follower: PointFollowerParams,
}

impl Default for PointOptions {
    fn default() -> Self {
        Self {
            choice: PointChoice::Corners(200),
            renew: false,
            corners: GoodFeaturesParams::default(),
            follower: PointFollowerParams::default(),
        }
    }
}

/// What became of the points.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct PointFacts {
    /// How many were started.
    pub started: usize,
    /// How many were followed to the last frame.
    pub tracked: usize,
    /// How many were lost.
    pub lost: usize,
    /// How many left the picture.
    pub outside: usize,
}

/// Most points of a grid: more are a field.
const MOST_POINTS: usize = 100_000;

/// Refuses points that are not in the part of the picture that is seen.
pub(super) fn check(points: &[Point], seen: &Seen) -> Result<(), RunError> {
    let Size { width, height } = seen.0.size();
    let inside = |p: &Point| (0.0..=width as f64).contains(&p.x) && (0.0..=height as f64).contains(&p.y);
    match points.iter().find(|p| !inside(&seen.of_input(**p))) {
        Some(p) => {
            let (size, [left, top, ..]) = (seen.size(), seen.0.region);
            let part = if size == seen.0.input { String::new() } else { format!(" from {left},{top} on") };
            Err(RunError::usage(format!("the point {},{} lies outside of the picture, {size} pixels{part}", p.x, p.y)))
        }
        None => Ok(()),
    }
}

/// A run over points.
pub(super) struct PointRun {
    options: PointOptions,
    follower: PointFollower,
    corners: GoodFeatures,
    pyramids: Option<[Pyramid; 2]>,
    facts: PointFacts,
    rows: Option<Rows>,
    #[cfg(feature = "encode")]
    overlay: Option<(Box<dyn VideoWriter>, drawing::Trails)>,
    timing: Timing,
    line: String,
}

impl PointRun {
    pub fn new(options: PointOptions) -> Result<Self, RunError> {
        let count = match options.choice {
            PointChoice::Corners(count) => count,
            _ if options.renew => {
                return Err(RunError::usage("only corners are renewed; choose points by their number"));
            }
            PointChoice::Grid(step) if !(1.0..=1e6).contains(&step) => {
                return Err(RunError::usage(format!("a grid of {step} pixels makes no sense; give at least 1")));
            }
            _ => options.corners.count,
        };
        let corners = GoodFeatures::new(GoodFeaturesParams { count, ..options.corners }).map_err(refused)?;
        let follower = PointFollower::new(options.follower).map_err(refused)?;
        Ok(Self {
            options,
            follower,
            corners,
            pyramids: None,
            facts: PointFacts::default(),
            rows: None,
            #[cfg(feature = "encode")]
            overlay: None,
            timing: Timing::default(),
            line: String::new(),
        })
    }

    /// Chooses the points in the first frame and opens the files.
    ///
    /// # Errors
    /// When there is no point to follow, or a file cannot be written.
    pub fn begin(
        &mut self,
        folder: &Folder,
        overlay: Option<Box<dyn VideoWriter>>,
        (first, seen): (&Frame, &Seen),
    ) -> Result<(), RunError> {
        let levels = self.options.follower.flow.levels.min(Pyramid::MAX_LEVELS);
        let picture = Pyramid::of(first.gray(), levels).map_err(refused)?;
        let points = self.chosen(first, seen)?;
        self.rows = Some(folder.points()?);
        #[cfg(feature = "encode")]
        {
            self.overlay = overlay.map(|video| (video, drawing::Trails::default()));
        }
        #[cfg(not(feature = "encode"))]
        drop(overlay);
        let told = self.follower.start(&picture, &points).map_err(refused)?.to_vec();
        self.pyramids = Some([picture.clone(), picture]);
        self.tell(first, &told, seen)
    }

    fn chosen(&mut self, first: &Frame, seen: &Seen) -> Result<Vec<Point>, RunError> {
        let points: Vec<Point> = match &self.options.choice {
            PointChoice::Given(points) => points.iter().map(|p| seen.of_input(*p)).collect(),
            PointChoice::Corners(_) => self.corners.find(first.gray(), &[]).iter().map(|c| c.point).collect(),
            PointChoice::Grid(step) => {
                let (count, grid) = seen.grid(*step);
                if count > MOST_POINTS {
                    return Err(RunError::usage(format!(
                        "a grid of {step} pixels has {count} points, more than {MOST_POINTS}; a field (`--dense`) has them all"
                    )));
                }
                grid.map(|p| seen.of_input(p)).collect()
            }
        };
        if points.is_empty() {
            return Err(RunError::usage(
                "there is no corner in the first frame that could be followed; give points or a grid, or begin elsewhere (`--from`)",
            ));
        }
        Ok(points)
    }

    /// Follows the points into the next frame.
    ///
    /// # Errors
    /// When a file cannot be written.
    pub fn step(&mut self, [_, frame]: [&Frame; 2], seen: &Seen) -> Result<(), RunError> {
        let begun = Instant::now();
        let Some([from, to]) = &mut self.pyramids else { return Ok(()) };
        std::mem::swap(from, to);
        to.build(frame.gray(), self.options.follower.flow.levels.min(Pyramid::MAX_LEVELS)).map_err(refused)?;
        let mut told = self.follower.update(from, to).map_err(refused)?.to_vec();
        if let (true, PointChoice::Corners(count)) = (self.options.renew, &self.options.choice) {
            let missing = count.saturating_sub(self.follower.points().len());
            if missing > 0 {
                let found = self.corners.find(frame.gray(), self.follower.points());
                let new: Vec<Point> = found.iter().take(missing).map(|c| c.point).collect();
                told.extend_from_slice(self.follower.start(to, &new).map_err(refused)?);
            }
        }
        self.timing.add(begun.elapsed().as_secs_f64() * 1e3);
        self.tell(frame, &told, seen)
    }

    /// Writes what became of the points in a frame.
    fn tell(&mut self, frame: &Frame, told: &[FollowedPoint], seen: &Seen) -> Result<(), RunError> {
        for point in told {
            match point.state {
                PointState::Tracked => {}
                PointState::Lost => self.facts.lost += 1,
                PointState::Outside => self.facts.outside += 1,
            }
        }
        self.facts.started = self.follower.started();
        self.facts.tracked = self.follower.points().len();
        if let Some(rows) = &mut self.rows {
            for point in told {
                let cell = |value: Option<f64>| value.map_or_else(String::new, |v| format!("{v:.3}"));
                let place = point.point.map(|p| seen.in_input(p));
                let (x, y) = (cell(place.map(|p| p.x)), cell(place.map(|p| p.y)));
                let error = point.forward_backward_px.map(|e| seen.length(e));
                let error = error.map_or_else(String::new, |e| format!("{e:.4}"));
                self.line.clear();
                let (index, time, state) = (frame.index(), frame.time_s(), point.state.as_str());
                // Writing to memory cannot fail.
                let _ = write!(self.line, "{index},{time:.6},{},{x},{y},{error},{state}", point.id);
                rows.add(&self.line)?;
            }
            rows.flush()?;
        }
        #[cfg(feature = "encode")]
        if let Some((video, trails)) = &mut self.overlay {
            let picture = trails.draw(frame, told).map_err(|e| RunError::usage(e.to_string()))?;
            video.write(picture.view(), frame.time_s())?;
        }
        Ok(())
    }

    /// Closes the files.
    ///
    /// # Errors
    /// When they cannot be written.
    pub fn finish(&mut self) -> Result<PointFacts, RunError> {
        #[cfg(feature = "encode")]
        if let Some((video, _)) = &mut self.overlay {
            video.finish()?;
        }
        Ok(self.facts)
    }

    pub fn mean_ms(&self) -> f64 {
        self.timing.summary().mean
    }
}
