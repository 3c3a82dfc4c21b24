//! The tracker `point`: a key point, followed by the motion of its surroundings and held to how they looked at the start.

use super::follower::failed;
use super::{FlowParams, Follower};
use pursuit_estimation::sigmoid;
use pursuit_geometry::{BBox, Point};
use pursuit_imaging::{Frame, Image};
use pursuit_parameters::Parameters;
use pursuit_tracking::policy::PolicyParams;
use pursuit_tracking::search::{SearchModel, SearchParams};
use pursuit_tracking::{
    Figure, Figures, GroupParams, Localizer, LocalizerRecipe, Look, Measurement, Outcome, Result, Search, TrackerRecipe,
};
use pursuit_vision::flow::{Appearance, Likeness};
use pursuit_vision::template_match::TemplateMatcher;
use pursuit_vision::{PixelWindow, VisionError};
use serde::{Deserialize, Serialize};

/// Sides of the surroundings that can be compared, odd pixels.
const SIDES: (usize, usize) = (7, 63);
/// Pixels kept of the start beyond the surroundings, for their gradients.
const RIM: usize = 3;
/// Places that are looked at closely where the point is looked for.
const PLACES: usize = 4;
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
        /// Score: constant of the logistic regression.
        pub score_bias: f64 = -11.0, in Bounds::default(), source "ours, fitted";
        /// Score: weight of the correlation with the start.
        pub score_correlation: f64 = 14.0, in Bounds::default(), source "ours, fitted";
        /// Score of a point that was looked for: constant.
        pub found_bias: f64 = -14.0, in Bounds::default(), source "ours, fitted";
        /// Score of a point that was looked for: weight of the correlation with the start.
        pub found_correlation: f64 = 14.0, in Bounds::default(), source "ours, fitted";
        /// Score of a point that was looked for: weight of how much better it correlates than the next best place.
        pub found_margin: f64 = 10.0, in Bounds::default(), source "ours, fitted";
    }
}

pursuit_tracking::figures! {
    /// What the surroundings of a point say.
    struct PointFigures {
        /// Correlation with the surroundings of the start, after the affine change that fits best.
        likeness;
        /// By how much another place correlates less, where the point was looked for; 1 where it was followed.
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
        let usual = ((bbox.width() + bbox.height()) / 2.0).clamp(SIDES.0 as f64, SIDES.1 as f64) as usize;
        let side = if usual % 2 == 1 { usual } else { usual - 1 };
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
        self.appearance = self.start.appearance().map_err(|e| e.to_string())?;
        Ok(self)
    }

    /// How the surroundings of `at` look. Changes nothing that is saved.
    fn compared(&mut self, frame: &Frame, at: Point) -> Option<(Likeness, Turned)> {
        let appearance = self.appearance.as_mut()?;
        appearance.set_change(self.change);
        let likeness = appearance.compare(frame.gray(), at)?;
        Some((likeness, Turned { change: appearance.change() }))
    }

    fn measurement(&self, likeness: Likeness, margin: f64, drift_px: f64, followed: bool) -> Measurement {
        let p = &self.params;
        let correlation = likeness.correlation;
        let log_odds = if followed {
            p.score_bias + p.score_correlation * correlation
        } else {
            p.found_bias + p.found_correlation * correlation + p.found_margin * margin
        };
        let bbox = BBox::from_center_size(likeness.point, self.size.0, self.size.1);
        let diagnostics = PointFigures { likeness: correlation, margin, drift_px }.into();
        Measurement { diagnostics, ..Measurement::new(bbox, sigmoid(log_odds)) }
    }

    /// Where the flow led, if the surroundings of the start are there.
    fn followed(&mut self, frame: &Frame, search: &Search) -> Result<Option<(Measurement, Turned)>> {
        let Some(motion) = self.follower.follow(frame, &search.expected)? else { return Ok(None) };
        let at = motion.bbox.center();
        let Some((likeness, turned)) = self.compared(frame, at) else { return Ok(None) };
        let drift_px = likeness.point.distance(at);
        let held = drift_px <= self.params.drift_px && frame.size().bounds().contains(likeness.point);
        Ok(held.then(|| (self.measurement(likeness, 1.0, drift_px, true), turned)))
    }

    /// The place of `region` that looks most like the start.
    fn found(&mut self, frame: &Frame, region: &BBox) -> Option<(Measurement, Turned)> {
        let side = self.start.side;
        let step = ((self.params.coarse * side as f64).round() as usize).max(1);
        let reach = side as f64 / 2.0;
        let window = PixelWindow::of(&region.expanded(reach), frame.size())?;
        let appearance = self.appearance.as_mut()?;
        appearance.set_change(self.change);
        let cells = appearance.template(step, &mut self.template);
        let places = self.matcher.find(frame.gray(), &window, &self.template, (cells, step), PLACES);
        let mut centers = [None; PLACES];
        centers.iter_mut().zip(places).for_each(|(center, place)| *center = Some(place.center));
        let (mut best, mut second): (Option<(Likeness, Turned, f64)>, f64) = (None, 0.0);
        for at in centers.into_iter().flatten() {
            let Some((likeness, turned)) = self.compared(frame, at) else { continue };
            if !region.contains(likeness.point) {
                continue;
            }
            let drift_px = likeness.point.distance(at);
            match best {
                // Two coarse places can lead to one.
                Some((known, ..)) if known.point.distance(likeness.point) < reach => {
                    if likeness.correlation > known.correlation {
                        best = Some((likeness, turned, drift_px));
                    }
                }
                Some((known, ..)) if likeness.correlation <= known.correlation => {
                    second = second.max(likeness.correlation);
                }
                _ => {
                    second = best.map_or(second, |(known, ..)| second.max(known.correlation));
                    best = Some((likeness, turned, drift_px));
                }
            }
        }
        let (likeness, turned, drift_px) = best?;
        let margin = (likeness.correlation - second).clamp(0.0, 1.0);
        Some((self.measurement(likeness, margin, drift_px, false), turned))
    }
}

impl LocalizerRecipe for PointTrackerParams {
    type Localizer = PointLocalizer;

    fn localizer(&self, frame: &Frame, bbox: BBox) -> Result<PointLocalizer> {
        let follower = Follower::new(self.flow.clone(), frame, surroundings(&bbox))?;
        let start = Start::of(frame, &bbox);
        let appearance = start.appearance().map_err(failed(frame))?;
        Ok(PointLocalizer {
            params: self.clone(),
            follower,
            follows: true,
            start,
            size: (bbox.width(), bbox.height()),
            change: UNCHANGED,
            appearance,
            matcher: TemplateMatcher::default(),
            template: Vec::new(),
        })
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
        }
        Ok(())
    }

    fn restart(&mut self, frame: &Frame, bbox: BBox) -> Result<()> {
        *self = self.params.localizer(frame, bbox)?;
        Ok(())
    }
}

/// The square about the point whose motion is the point's.
fn surroundings(bbox: &BBox) -> BBox {
    let side = ((bbox.width() + bbox.height()) / 2.0).clamp(SIDES.0 as f64, SIDES.1 as f64);
    BBox::from_center_size(bbox.center(), side, side)
}

/// `point`. Unseen, it is looked for as far as it may have gone.
pub fn point(name: &'static str) -> TrackerRecipe<PointTrackerParams> {
    let groups = GroupParams {
        policy: PolicyParams::default(),
        search: SearchParams { model: SearchModel::Widening, ..SearchParams::default() },
        ..GroupParams::default()
    };
    TrackerRecipe { name, localizer: PointTrackerParams::default(), groups }
}
