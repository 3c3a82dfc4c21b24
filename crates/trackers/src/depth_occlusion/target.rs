use super::DepthOcclusionParams;
use super::response::{Judged, penalised};
use crate::depth::{BoxDepth, Surface};
use pursuit_geometry::BBox;
use pursuit_imaging::ImageView;
use serde::{Deserialize, Serialize};

/// What is known of the target's distance and of how it answers.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Raw", into = "Raw")]
pub struct TargetDepth(Raw);

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Raw {
    /// Width and height at the start, in pixels.
    first_px: (f64, f64),
    /// Distance of its surface at the start.
    first_m: f64,
    /// Distance of its surface when it was seen last.
    surface_m: f64,
    /// Mean depth of its box then, d_l.
    mean_m: Option<f64>,
    /// Share of its own box that is nearer than its surface, less the margin: a thing has a shape.
    own_nearer: f64,
    /// The response while it is in sight.
    usual: Option<f64>,
}

impl From<TargetDepth> for Raw {
    fn from(target: TargetDepth) -> Self {
        target.0
    }
}

impl TryFrom<Raw> for TargetDepth {
    type Error = &'static str;

    fn try_from(raw: Raw) -> Result<Self, Self::Error> {
        let lengths = [raw.first_px.0, raw.first_px.1, raw.first_m, raw.surface_m, raw.mean_m.unwrap_or(1.0)];
        let sound = lengths.iter().all(|v| v.is_finite() && *v > 0.0)
            && (0.0..=1.0).contains(&raw.own_nearer)
            && raw.usual.is_none_or(f64::is_finite);
        if sound { Ok(Self(raw)) } else { Err("its target has a size or a distance that cannot be") }
    }
}

/// How a target is looked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sought {
    /// It was in sight in the frame before.
    InSight,
    /// It was not, and is expected about where it is looked for.
    Hidden,
    /// It may be anywhere.
    Anywhere,
}

/// What depth says of a candidate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Candidate {
    /// Its box's depth.
    pub depth: BoxDepth,
    /// The share of it that something nearer covers, beyond what is the target's own shape.
    pub covered: f64,
    /// The response after depth had its say, and what it has to be.
    pub judged: Judged,
}

impl TargetDepth {
    /// The target at `bbox`, to begin with; `None` where there is no depth.
    pub fn new(params: &DepthOcclusionParams, depth: ImageView<'_, u16>, bbox: &BBox) -> Option<Self> {
        let surface = Surface::first(&params.region, depth, bbox, params.half_depth)?;
        let seen = BoxDepth::of(&params.region, depth, bbox, surface.mean_m - params.nearer_by);
        Self::try_from(Raw {
            first_px: (bbox.width(), bbox.height()),
            first_m: surface.mean_m,
            surface_m: surface.mean_m,
            mean_m: seen.mean_m,
            own_nearer: seen.nearer,
            usual: None,
        })
        .ok()
    }

    /// Distance of its surface when it was seen last, in metres.
    pub const fn surface_m(&self) -> f64 {
        self.0.surface_m
    }

    /// Judges a `response` at `bbox`: by equation (20) while the target is in sight; by equation (30) while it is not, and
    /// then against the response it usually has.
    pub fn judge(
        &self,
        params: &DepthOcclusionParams,
        depth: ImageView<'_, u16>,
        bbox: &BBox,
        response: f64,
        sought: Sought,
    ) -> Candidate {
        let hidden = sought != Sought::InSight;
        let seen = BoxDepth::of(&params.region, depth, bbox, self.0.surface_m - params.nearer_by);
        let covered = (seen.nearer - self.0.own_nearer).max(0.0);
        let epsilon = if hidden { params.epsilon_again } else { params.epsilon };
        let here =
            self.0.mean_m.zip(seen.mean_m).map(|(l, p)| l + (p - l).clamp(-params.farthest_m, params.farthest_m));
        let response = penalised(response, epsilon, self.0.mean_m, here) - params.cover_weight * covered;
        let here = self.is_here(params, depth, bbox);
        let threshold = match self.0.usual {
            Some(usual) if sought == Sought::Hidden && here => params.min_response.max(usual - params.drop_clear),
            Some(usual) if hidden => params.min_response.max(usual - params.response_drop),
            _ if !hidden && here && covered <= params.learn_covered => params.min_clear.min(params.min_response),
            _ => params.min_response,
        };
        Candidate { depth: seen, covered, judged: Judged { response, threshold } }
    }

    /// Whether a `response` is farther below the usual one than Δf.
    pub fn has_dropped(&self, params: &DepthOcclusionParams, response: f64) -> bool {
        self.0.usual.is_some_and(|usual| response < usual - params.response_drop)
    }

    /// Share of its correction that the velocity takes of something seen with `response`: while the target is being covered, the
    /// response falls and its peak slides off the cover.
    pub fn velocity_share(&self, params: &DepthOcclusionParams, response: f64) -> f64 {
        let left = self.0.usual.map_or(1.0, |usual| response.max(0.0) / usual.max(f64::EPSILON));
        left.min(1.0).powf(params.velocity_doubt)
    }

    /// Whether most of what is in `bbox` is as far away as the target was: then it may be the target that looks different.
    fn is_here(&self, params: &DepthOcclusionParams, depth: ImageView<'_, u16>, bbox: &BBox) -> bool {
        let near = Surface::near(&params.region, depth, bbox, self.0.surface_m, params.nearer_by);
        near.is_some_and(|surface| surface.share >= params.here)
    }

    /// The target was seen at `bbox`, answering with `response`, and little of it was covered.
    pub fn learn(&mut self, params: &DepthOcclusionParams, depth: ImageView<'_, u16>, bbox: &BBox, response: f64) {
        if let Some(surface) = Surface::near(&params.region, depth, bbox, self.0.surface_m, params.half_depth) {
            self.0.surface_m = surface.mean_m;
        }
        let seen = BoxDepth::of(&params.region, depth, bbox, self.0.surface_m - params.nearer_by);
        self.0.mean_m = seen.mean_m.or(self.0.mean_m);
        let usual = self.0.usual.get_or_insert(response);
        *usual += params.usual_rate * (response - *usual);
    }

    /// It was found again, at a distance that has to be found out anew.
    pub fn found_again(&mut self, params: &DepthOcclusionParams, depth: ImageView<'_, u16>, bbox: &BBox) {
        if let Some(surface) = Surface::first(&params.region, depth, bbox, params.half_depth) {
            self.0.surface_m = surface.mean_m;
            self.0.mean_m = BoxDepth::of(&params.region, depth, bbox, 0.0).mean_m.or(self.0.mean_m);
        }
    }

    /// How many times larger than at the start something of its size is at a distance of `m` metres.
    pub fn scale_at(&self, m: f64) -> f64 {
        self.0.first_m / m
    }

    /// How many times larger than at the start it is, by the distance of what lies in `bbox` near the distance it had;
    /// `anywhere` for a target that may be at any other distance by now.
    pub fn scale_in(
        &self,
        params: &DepthOcclusionParams,
        depth: ImageView<'_, u16>,
        bbox: &BBox,
        anywhere: bool,
    ) -> Option<f64> {
        let surface = if anywhere {
            Surface::first(&params.region, depth, bbox, params.half_depth)
        } else {
            Surface::near(&params.region, depth, bbox, self.0.surface_m, params.half_depth)
        };
        surface.map(|s| self.scale_at(s.mean_m))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_imaging::Image;

    fn params() -> DepthOcclusionParams {
        DepthOcclusionParams {
            epsilon: 0.1,
            epsilon_again: 0.3,
            min_response: 0.2,
            response_drop: 0.15,
            cover_weight: 0.4,
            half_depth: 0.3,
            nearer_by: 0.15,
            min_clear: 0.1,
            drop_clear: 0.25,
            learn_covered: 0.2,
            ..DepthOcclusionParams::default()
        }
    }

    fn region() -> BBox {
        BBox::from_ltwh(40.0, 30.0, 40.0, 40.0)
    }

    /// Something at `mm` before a wall at 3 m, its left half covered by what is at 1 m if `covered`.
    fn image(mm: u16, covered: bool) -> Image<u16> {
        let half = if covered { 40..60 } else { 0..0 };
        Image::from_fn(120, 100, |x, y| match (x, y) {
            (x, 30..70) if half.contains(&x) => 1000,
            (40..80, 30..70) => mm,
            _ => 3000,
        })
        .unwrap()
    }

    #[test]
    fn depth_speaks_against_covers_and_other_places() {
        let params = params();
        let mut target = TargetDepth::new(&params, image(2000, false).view(), &region()).unwrap();
        assert_eq!(target.surface_m(), 2.0);
        let judge = |target: &TargetDepth, mm, covered, sought| {
            target.judge(&params, image(mm, covered).view(), &region(), 0.6, sought)
        };
        let plain = judge(&target, 2000, false, Sought::InSight);
        assert_eq!((plain.covered, plain.judged), (0.0, Judged { response: 0.6, threshold: 0.1 }), "nothing covers it");
        assert_eq!(judge(&target, 2140, false, Sought::InSight).judged.threshold, 0.1);
        assert_eq!(judge(&target, 2160, false, Sought::InSight).judged.threshold, 0.2, "something else");
        // Half is covered, the mean 0.5 m nearer.
        let half = judge(&target, 2000, true, Sought::InSight);
        assert!((half.covered - 0.5).abs() < 0.03 && (half.depth.nearer_m.unwrap() - 1.0).abs() < 1e-9, "{half:?}");
        assert!((half.judged.response - (0.6 - 0.1 * 0.5 - 0.4 * 0.5)).abs() < 0.02, "{half:?}");
        assert_eq!(half.judged.threshold, 0.2);
        // While it is hidden the other ε counts, and the response it had.
        target.learn(&params, image(2000, false).view(), &region(), 0.5);
        assert!((judge(&target, 2100, false, Sought::Hidden).judged.threshold - 0.25).abs() < 1e-9, "at its distance");
        assert!(
            (judge(&target, 2100, false, Sought::Anywhere).judged.threshold - 0.35).abs() < 1e-9,
            "all over the frame"
        );
        let behind = judge(&target, 2500, false, Sought::Hidden);
        assert!((behind.judged.response - (0.6 - 0.3 * 0.5)).abs() < 1e-9, "{behind:?}");
        assert!((behind.judged.threshold - 0.35).abs() < 1e-9);
        target.learn(&params, image(2000, false).view(), &region(), 0.3);
        assert!((judge(&target, 2500, false, Sought::Hidden).judged.threshold - 0.33).abs() < 1e-9);
        // Never more than a metre's worth.
        let far = judge(&target, 8000, false, Sought::Hidden).judged.response;
        assert!((far - (0.6 - 0.3)).abs() < 1e-9, "{far}");
    }

    #[test]
    fn a_lower_response_moves_the_velocity_less() {
        let params = DepthOcclusionParams { velocity_doubt: 2.0, ..params() };
        let mut target = TargetDepth::new(&params, image(2000, false).view(), &region()).unwrap();
        assert_eq!(target.velocity_share(&params, 0.1), 1.0, "no response is usual yet");
        target.learn(&params, image(2000, false).view(), &region(), 0.6);
        let share = |response| target.velocity_share(&params, response);
        assert!((share(0.3) - 0.25).abs() < 1e-12 && share(0.6) == 1.0 && share(0.9) == 1.0 && share(-0.2) == 0.0);
        assert_eq!(target.velocity_share(&DepthOcclusionParams { velocity_doubt: 0.0, ..params }, 0.3), 1.0);
    }

    #[test]
    fn what_is_nearer_appears_larger() {
        let params = params();
        let mut target = TargetDepth::new(&params, image(2000, false).view(), &region()).unwrap();
        let near = image(1800, false);
        assert!((target.scale_in(&params, near.view(), &region(), false).unwrap() - 2.0 / 1.8).abs() < 1e-9);
        assert_eq!(target.scale_in(&params, image(1500, false).view(), &region(), false), None);
        let scale = target.scale_in(&params, image(1000, false).view(), &region(), true).unwrap();
        assert!((scale - 2.0).abs() < 1e-9 && (target.scale_at(4.0) - 0.5).abs() < 1e-12);
        target.learn(&params, near.view(), &region(), 0.5);
        assert!((target.surface_m() - 1.8).abs() < 1e-9);
        assert!((target.scale_in(&params, image(1600, false).view(), &region(), false).unwrap() - 1.25).abs() < 1e-9);
        target.found_again(&params, image(1200, false).view(), &region());
        assert!((target.surface_m() - 1.2).abs() < 1e-9);
        assert_eq!(TargetDepth::new(&params, image(0, false).view(), &region().scaled(0.5)), None);
    }

    #[test]
    fn a_target_that_cannot_be_is_refused() {
        let target = TargetDepth::new(&params(), image(2000, false).view(), &region()).unwrap();
        let back = |raw: Raw| postcard::from_bytes::<TargetDepth>(&postcard::to_stdvec(&raw).unwrap());
        assert_eq!(back(target.0).unwrap(), target);
        assert!(back(Raw { first_m: 0.0, ..target.0 }).is_err());
        assert!(back(Raw { surface_m: f64::NAN, ..target.0 }).is_err());
        assert!(back(Raw { own_nearer: 1.5, ..target.0 }).is_err());
        assert!(back(Raw { usual: Some(f64::INFINITY), ..target.0 }).is_err());
        assert!(back(Raw { first_px: (-1.0, 3.0), ..target.0 }).is_err());
        assert!(back(Raw { mean_m: Some(-2.0), ..target.0 }).is_err());
    }
}
