//! The tracker `point`: a key point, followed by the motion of its surroundings and held to how they looked at the start.

use super::follower::failed;
use super::{FlowParams, Follower};
use pursuit_estimation::sigmoid;
use pursuit_geometry::{BBox, Point};
use pursuit_imaging::{Frame, Image};
use pursuit_parameters::Parameters;
use pursuit_tracking::search::{SearchModel, SearchParams};
use pursuit_tracking::{
    Figure, Figures, GroupParams, Localizer, LocalizerRecipe, Look, Measurement, Outcome, Result, Search, TrackState,
    TrackerRecipe,
};
use pursuit_vision::flow::{Appearance, Likeness};
use pursuit_vision::template_match::TemplateMatcher;
use pursuit_vision::{PixelWindow, VisionError};
use serde::{Deserialize, Serialize};

/// The side of the surroundings by which a point is followed where nothing else is said, pixels.
pub const SURROUNDINGS_PX: f64 = 31.0;
/// Sides of the surroundings that can be compared, odd pixels.
const SIDES: (usize, usize) = (7, 63);
/// Pixels kept of the start beyond the surroundings, for their gradients.
const RIM: usize = 3;
/// Places that are looked at closely where the point is looked for.
const PLACES: usize = 4;
/// Where others like it are looked for in the first frame, in sizes of the box.
const NEIGHBOURHOOD: f64 = 5.0;
/// No turn, no stretch.
const UNCHANGED: [[f64; 2]; 2] = [[1.0, 0.0], [0.0, 1.0]];

pursuit_parameters::parameters! {
    /// Parameters of the tracker of one point.
    pub struct PointTrackerParams {
        /// How the surroundings are followed from frame to frame.
        pub flow: FlowParams = FlowParams { points: 7, guided_levels: 1, ..FlowParams::eight_px() };
        /// Where the surroundings of the start are farther than this from where the flow led, it led elsewhere. What is less is
        /// drift, and taken back.
        pub drift_px: f64 = 3.0, in above(0.0).at_most(50.0), unit "px", source "ours";
        /// Pixels that are one when the point is looked for, as a share of its surroundings' side.
        pub coarse: f64 = 0.08, in 0.0..=0.2, unit "target sizes", source "ours";
        /// Places that are looked at in one look at most, as long as a fifth of the surroundings' side tells them apart: large regions
        /// are looked over more coarsely.
        pub most_places: usize = 200_000, in 1000..=100_000_000, source "ours";
        /// What the correlation usually is, is that of so long.
        pub usual_s: f64 = 1.0, in above(0.0).at_most(3600.0), unit "s", source "ours";
        /// Score: constant of the logistic regression.
        pub score_bias: f64 = -2.9, in Bounds::default(), source "ours, fitted";
        /// Score: weight of the correlation with the start, by Fisher's z.
        pub score_correlation: f64 = 0.8, in Bounds::default(), source "ours, fitted";
        /// Score: weight of what the correlation usually is, by Fisher's z.
        pub score_usual: f64 = 0.5, in Bounds::default(), source "ours, fitted";
        /// Score: weight of how much more it correlates than another place of the first frame did, by Fisher's z.
        pub score_beyond: f64 = 2.8, in Bounds::default(), source "ours, fitted";
        /// Score of a point that was looked for: what is added to the constant.
        pub found_bias: f64 = -3.2, in Bounds::default(), source "ours; fitted: -1.2, less because what is found wrongly is followed on";
        /// Score of a point that was looked for: weight of how much better it correlates than the next best place, by Fisher's z.
        pub found_margin: f64 = 1.5, in Bounds::default(), source "ours, fitted";
    }
}

pursuit_tracking::figures! {
    /// What the surroundings of a point say.
    struct PointFigures {
        /// Correlation with the surroundings of the start, after the affine change that fits best.
        likeness;
        /// What that usually is.
        usual;
        /// What it was at the best other place of the first frame.
        rival;
        /// By how much the next best place correlates less, by Fisher's z; 0 where the point was followed, and not looked for.
        margin;
        /// How far the surroundings of the start are from where the flow led, or from where they were looked at.
        drift_px in "px";
    }
}

/// The surroundings of the point as they were, enough of them to make [`Appearance`] from.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Start {
    pixels: Vec<u8>,
    width: usize,
    /// The point in them, continuous pixels.
    at: (f64, f64),
    /// Side of what is compared, pixels.
    side: usize,
}

impl Start {
    fn of(frame: &Frame, bbox: &BBox) -> Self {
        let most = bbox.width().min(bbox.height()).clamp(SIDES.0 as f64, SIDES.1 as f64) as usize;
        let side = if most % 2 == 1 { most } else { most - 1 };
        let (gray, center) = (frame.gray(), bbox.center());
        let reach = (side / 2 + RIM) as isize;
        let (left, top) = (center.x.floor() as isize - reach, center.y.floor() as isize - reach);
        let width = 2 * (side / 2 + RIM) + 1;
        let pixel = |i: usize| {
            let (x, y) = ((i % width) as isize, (i / width) as isize);
            gray.clamped(left.saturating_add(x), top.saturating_add(y))
        };
        let pixels = (0..width * width).map(pixel).collect();
        Self { pixels, width, at: (center.x - left as f64, center.y - top as f64), side }
    }

    /// `None` where nothing can be told from what is there.
    fn appearance(&self) -> std::result::Result<Option<Appearance>, VisionError> {
        let image = Image::from_vec(self.pixels.clone(), self.width, self.width)?;
        Appearance::of(image.view(), Point::new(self.at.0, self.at.1), self.side)
    }
}

/// How the surroundings are turned and stretched where they were seen.
#[derive(Debug, Clone, Copy)]
pub struct Turned {
    change: [[f64; 2]; 2],
    correlation: f64,
}

/// A place that may be the point's.
#[derive(Debug, Clone, Copy)]
struct Candidate {
    likeness: Likeness,
    turned: Turned,
    /// Where it was looked at.
    at: Point,
}

/// A mean over the last `usual_s`, and at first over all that there is.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
struct Usual {
    mean: f64,
    /// Seconds that it is over.
    over_s: f64,
}

impl Usual {
    fn take(&mut self, value: f64, dt_s: f64, most_s: f64) {
        self.over_s = (self.over_s + dt_s).min(most_s);
        self.mean += (value - self.mean) * (dt_s / self.over_s).min(1.0);
    }
}

/// Fisher's z of a correlation, which is as uncertain at any value of it. What is beyond .999 says no more.
fn fisher(correlation: f64) -> f64 {
    correlation.clamp(-0.999, 0.999).atanh()
}

/// Follows one point. Only what it looked like at the start counts, and nothing is learnt.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(remote = "PointLocalizer")]
pub struct PointLocalizer {
    params: PointTrackerParams,
    follower: Follower,
    /// Whether the follower keeps the frame before.
    follows: bool,
    start: Start,
    /// Width and height of the box about the point.
    size: (f64, f64),
    /// How the surroundings were turned and stretched when they were seen last.
    change: [[f64; 2]; 2],
    /// Correlation of the best other place of the first frame.
    rival: f64,
    /// Fisher's z of the correlation while it was tracked.
    usual: Usual,
    #[serde(skip)]
    appearance: Option<Appearance>,
    #[serde(skip)]
    matcher: TemplateMatcher,
    #[serde(skip)]
    template: Vec<f32>,
}

pursuit_estimation::checked!(PointLocalizer);

impl PointLocalizer {
    fn restored(mut self) -> Result<Self, String> {
        self.params.check_all().map_err(|(name, problem)| format!("`{name}` {problem}"))?;
        let (start, n) = (&self.start, self.start.width);
        let fits = (SIDES.0..=SIDES.1).contains(&start.side) && n == 2 * (start.side / 2 + RIM) + 1;
        if !fits || start.pixels.len() != n * n {
            return Err("the surroundings of its start have another size".to_owned());
        }
        if ![self.size.0, self.size.1].iter().all(|v| v.is_finite() && *v > 0.0) {
            return Err("its box has no size".to_owned());
        }
        if !self.rival.is_finite()
            || !self.usual.mean.is_finite()
            || !(0.0..=self.params.usual_s).contains(&self.usual.over_s)
        {
            return Err("its correlations are none".to_owned());
        }
        self.appearance = self.start.appearance().map_err(|e| e.to_string())?;
        Ok(self)
    }

    /// How the surroundings of `at` look. Changes nothing that is saved.
    fn compared(&mut self, frame: &Frame, at: Point) -> Option<(Likeness, Turned)> {
        let appearance = self.appearance.as_mut()?;
        appearance.set_change(self.change);
        let likeness = appearance.compare(frame.gray(), at)?;
        Some((likeness, Turned { change: appearance.change(), correlation: likeness.correlation }))
    }

    /// What is told of a place; `second` is the correlation of the next best one, where the point was looked for.
    fn measurement(&self, likeness: Likeness, second: Option<f64>, drift_px: f64) -> Measurement {
        let p = &self.params;
        let (usual, seen) = (self.usual.mean, fisher(likeness.correlation));
        let beyond = seen - fisher(self.rival);
        let mut log_odds = p.score_bias + p.score_correlation * seen + p.score_usual * usual + p.score_beyond * beyond;
        let margin = second.map_or(0.0, |second| seen - fisher(second));
        if second.is_some() {
            log_odds += p.found_bias + p.found_margin * margin;
        }
        let bbox = BBox::from_center_size(likeness.point, self.size.0, self.size.1);
        let likeness = likeness.correlation;
        let diagnostics = PointFigures { likeness, usual: usual.tanh(), rival: self.rival, margin, drift_px }.into();
        Measurement { diagnostics, ..Measurement::new(bbox, sigmoid(log_odds)) }
    }

    /// Where the flow led, if the surroundings of the start are there.
    fn followed(&mut self, frame: &Frame, search: &Search) -> Result<Option<(Measurement, Turned)>> {
        let Some(motion) = self.follower.follow(frame, &search.expected)? else { return Ok(None) };
        let at = motion.bbox.center();
        let Some((likeness, turned)) = self.compared(frame, at) else { return Ok(None) };
        let drift_px = likeness.point.distance(at);
        let held = drift_px <= self.params.drift_px && frame.size().bounds().contains(likeness.point);
        Ok(held.then(|| (self.measurement(likeness, None, drift_px), turned)))
    }

    /// The places of `region` that look most like the start, in no order.
    fn candidates(&mut self, frame: &Frame, region: &BBox) -> [Option<Candidate>; PLACES] {
        let mut candidates = [None; PLACES];
        let side = self.start.side;
        let window = PixelWindow::of(&region.expanded(side as f64 / 2.0), frame.size());
        let (Some(window), Some(appearance)) = (window, self.appearance.as_mut()) else { return candidates };
        let step = step(&self.params, side, window.width * window.height);
        appearance.set_change(self.change);
        let cells = appearance.template(step, &mut self.template);
        let places = self.matcher.find(frame.gray(), &window, &self.template, (cells, step), PLACES);
        let mut centers = [None; PLACES];
        centers.iter_mut().zip(places).for_each(|(center, place)| *center = Some(place.center));
        for (candidate, at) in candidates.iter_mut().zip(centers.into_iter().flatten()) {
            let seen = self.compared(frame, at).filter(|(likeness, _)| region.contains(likeness.point));
            *candidate = seen.map(|(likeness, turned)| Candidate { likeness, turned, at });
        }
        candidates
    }

    /// The best correlation of those that are elsewhere than at `point`; 0 where there are none.
    fn rival(&self, candidates: &[Option<Candidate>], point: Point) -> f64 {
        let apart = |c: &&Candidate| c.likeness.point.distance(point) >= self.start.side as f64 / 2.0;
        candidates.iter().flatten().filter(apart).map(|c| c.likeness.correlation).fold(0.0, f64::max)
    }

    /// The place of `region` that looks most like the start.
    fn found(&mut self, frame: &Frame, region: &BBox) -> Option<(Measurement, Turned)> {
        let candidates = self.candidates(frame, region);
        let better = |a: &&Candidate, b: &&Candidate| a.likeness.correlation.total_cmp(&b.likeness.correlation);
        let Candidate { likeness, turned, at } = *candidates.iter().flatten().max_by(better)?;
        let second = self.rival(&candidates, likeness.point);
        Some((self.measurement(likeness, Some(second), likeness.point.distance(at)), turned))
    }
}

impl LocalizerRecipe for PointTrackerParams {
    type Localizer = PointLocalizer;

    fn localizer(&self, frame: &Frame, bbox: BBox) -> Result<PointLocalizer> {
        let follower = Follower::new(self.flow.clone(), frame, surroundings(&bbox))?;
        let start = Start::of(frame, &bbox);
        let appearance = start.appearance().map_err(failed(frame))?;
        let mut localizer = PointLocalizer {
            params: self.clone(),
            follower,
            follows: true,
            start,
            size: (bbox.width(), bbox.height()),
            change: UNCHANGED,
            rival: 0.0,
            usual: Usual { mean: fisher(1.0), over_s: 0.0 },
            appearance,
            matcher: TemplateMatcher::default(),
            template: Vec::new(),
        };
        let around = localizer.candidates(frame, &bbox.scaled(NEIGHBOURHOOD));
        localizer.rival = localizer.rival(&around, bbox.center());
        Ok(localizer)
    }
}

impl Localizer for PointLocalizer {
    type Finding = Turned;

    const FIGURES: &[&[Figure]] = &[PointFigures::ALL];

    fn locate(&mut self, frame: &Frame, search: &Search) -> Result<Option<(Measurement, Turned)>> {
        if self.follows
            && search.look == Look::Near
            && let Some(seen) = self.followed(frame, search)?
        {
            return Ok(Some(seen));
        }
        Ok(self.found(frame, &search.region))
    }

    fn adapt(&mut self, _: &Frame, _: BBox, _: &Turned) -> Result<()> {
        Ok(())
    }

    fn observe(&mut self, frame: &Frame, outcome: &Outcome<'_, Turned>) -> Result<()> {
        self.follows = false;
        if let Some((measured, turned)) = outcome.found.filter(|_| outcome.followed.is_some()) {
            self.follower.keep(frame, surroundings(&measured))?;
            (self.follows, self.change) = (true, turned.change);
            if outcome.state == TrackState::Tracking {
                self.usual.take(fisher(turned.correlation), outcome.dt_s, self.params.usual_s);
            }
        }
        Ok(())
    }

    fn restart(&mut self, frame: &Frame, bbox: BBox) -> Result<()> {
        *self = self.params.localizer(frame, bbox)?;
        Ok(())
    }
}

/// Pixels that are one when a region of so many `pixels` is looked over for surroundings of that side, along a side.
fn step(params: &PointTrackerParams, side: usize, pixels: usize) -> usize {
    let side = side as f64;
    let few_enough = (pixels as f64 / params.most_places as f64).sqrt().ceil();
    (params.coarse * side).round().max(few_enough).min((side / 5.0).floor()).max(1.0) as usize
}

/// The square about the point whose motion is the point's: within the box, what is beside it moves otherwise.
fn surroundings(bbox: &BBox) -> BBox {
    let side = bbox.width().min(bbox.height()).clamp(SIDES.0 as f64, SIDES.1 as f64);
    BBox::from_center_size(bbox.center(), side, side)
}

/// `point`. Lost, it is looked for all over the picture.
pub fn point(name: &'static str) -> TrackerRecipe<PointTrackerParams> {
    let groups = GroupParams {
        search: SearchParams { model: SearchModel::NearThenWide, ..SearchParams::default() },
        ..GroupParams::default()
    };
    TrackerRecipe { name, localizer: PointTrackerParams::default(), groups }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_regions_are_looked_over_more_coarsely() {
        let params = PointTrackerParams::default();
        let steps = |side: usize| [320 * 240, 640 * 480, 1920 * 1080, 3840 * 2160].map(|n| step(&params, side, n));
        assert_eq!(steps(31), [2, 2, 4, 6]);
        assert_eq!(steps(63), [5, 5, 5, 7]);
        assert_eq!(steps(7), [1, 1, 1, 1]);
    }

    #[test]
    fn what_is_usual_is_a_mean_over_seconds_at_any_frame_rate() {
        for fps in [5.0, 30.0, 240.0] {
            let mut usual = Usual { mean: 3.8, over_s: 0.0 };
            usual.take(1.0, 1.0 / fps, 1.0);
            assert_eq!(usual.mean, 1.0, "what was assumed counts for nothing once there is a value");
            let mut second = |value: f64| (0..fps as usize).for_each(|_| usual.take(value, 1.0 / fps, 1.0));
            second(1.0);
            second(2.0);
            let left = 2.0 - usual.mean;
            assert!((left - (-1.0_f64).exp()).abs() < 0.05, "{fps}: {left}");
        }
    }
}
