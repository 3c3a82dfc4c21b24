use super::DepthOcclusionParams;
use super::path::{Pinhole, SpacePath};
use crate::ahead::Ahead;
use crate::depth::DepthHistogram;
use nalgebra::SVector;
use pursuit_estimation::Result;
use pursuit_estimation::particle::ParticleOptions;
use pursuit_estimation::zhai2024::{LikelihoodNoiseFilter, VarianceParams, similarity_log_likelihood};
use pursuit_geometry::{BBox, Point};
use pursuit_imaging::{Frame, ImageView};
use serde::{Deserialize, Serialize};

/// Seed of the particles: trackers that are shown the same frames say the same.
const SEED: u64 = 2024;

/// Where the target may be: particles with maximum-likelihood noise, weighed by histograms of depth (zhai2024, eqs. 21–29),
/// and its path in space, where the camera's lens is known.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Hypotheses {
    particles: LikelihoodNoiseFilter,
    target: Option<DepthHistogram>,
    path: Option<SpacePath>,
    /// The particles in the frame being looked at.
    #[serde(skip)]
    ahead: Ahead<LikelihoodNoiseFilter>,
    /// A buffer: logarithms of the particles' likelihoods.
    #[serde(skip)]
    likelihoods: Vec<f64>,
}

/// What the camera's lens makes of a frame, where it is known.
fn pinhole(frame: &Frame) -> Option<Pinhole> {
    frame.camera().map(|camera| camera.lens().pinhole_px(frame.size()))
}

fn vector(point: Point) -> SVector<f64, 2> {
    SVector::from([point.x, point.y])
}

impl Hypotheses {
    /// Starts on the target at `bbox`.
    ///
    /// # Errors
    /// Where the box is not finite.
    pub fn new(params: &DepthOcclusionParams, depth: Option<ImageView<'_, u16>>, bbox: &BBox) -> Result<Self> {
        let variance = VarianceParams::for_target(bbox.area().sqrt());
        let options = ParticleOptions { threshold: params.resample_below, ..ParticleOptions::default() };
        let at = vector(bbox.center());
        Ok(Self {
            particles: LikelihoodNoiseFilter::new(params.particles.max(1), at, variance, options, SEED)?,
            target: depth.map(|depth| DepthHistogram::of(&params.histogram, depth, bbox)),
            path: None,
            ahead: Ahead::default(),
            likelihoods: Vec::new(),
        })
    }

    /// Moves copies of the particles over `dt_s` seconds to this frame and weighs them: eqs. 22 and 26–28.
    ///
    /// # Errors
    /// Where the step cannot be computed.
    pub fn look_ahead(
        &mut self,
        params: &DepthOcclusionParams,
        frame: &Frame,
        depth: Option<ImageView<'_, u16>>,
        size: &BBox,
        dt_s: f64,
    ) -> Result<()> {
        let in_space = match (&self.path, pinhole(frame)) {
            (Some(path), Some(pinhole)) => path.shift_px(&params.space, pinhole, dt_s)?,
            _ => None,
        };
        let Self { particles, target, ahead, likelihoods, .. } = self;
        ahead.carry(particles, |ahead| {
            match in_space {
                Some(shift) => ahead.predict_by(&shift, dt_s)?,
                None => ahead.predict(dt_s)?,
            }
            let (Some(target), Some(depth)) = (target, depth) else { return Ok(()) };
            let log_likelihood = |state: &SVector<f64, 2>| {
                let here = size.centered_at(Point::new(state[0], state[1]));
                let similarity = DepthHistogram::of(&params.histogram, depth, &here).similarity(target);
                similarity_log_likelihood(similarity.max(params.least_similarity), params.likelihood_sigma)
            };
            likelihoods.clear();
            likelihoods.extend(ahead.particles().states().iter().map(log_likelihood));
            ahead.particles_mut().weigh(likelihoods).map(drop)
        })
    }

    /// Places worth a look, into `places`: the particles' mean (eq. 29), and the heaviest particles that are apart from it
    /// and from each other, as many as the parameters say in all.
    pub fn clusters(&self, params: &DepthOcclusionParams, size: &BBox, places: &mut Vec<BBox>) {
        let Some(ahead) = self.ahead.get() else { return };
        let first = places.len();
        let mean = ahead.particles().mean();
        add_apart(places, size.centered_at(Point::new(mean[0], mean[1])), params.apart);
        let (states, weights) = (ahead.particles().states(), ahead.particles().weights());
        while places.len() < first + params.clusters {
            let candidates = states.iter().zip(weights).filter(|(state, _)| {
                let place = size.centered_at(Point::new(state[0], state[1]));
                !is_near_any(places, &place, params.apart)
            });
            let Some((state, _)) = candidates.max_by(|a, b| a.1.total_cmp(b.1)) else { return };
            places.push(size.centered_at(Point::new(state[0], state[1])));
        }
    }

    /// The frame was judged: the particles stay as they are in it. `seen` is where the target is and how far away, when it
    /// was seen: the filter's variance and velocity learn from that (eqs. 24 and 25), and the particles gather there.
    ///
    /// # Errors
    /// Where a number is not finite.
    pub fn settle(
        &mut self,
        params: &DepthOcclusionParams,
        frame: &Frame,
        seen: Option<(Point, Option<f64>)>,
        dt_s: f64,
    ) -> Result<()> {
        let space = &params.space;
        self.ahead.settle(&mut self.particles);
        if let Some(path) = &mut self.path {
            path.predict(space, dt_s)?;
        }
        let Some((center, distance_m)) = seen else {
            return self.particles.particles_mut().resample_if_needed().map(drop);
        };
        self.particles.center_on(&vector(center))?;
        self.particles.correct(&vector(center))?;
        match (&mut self.path, pinhole(frame), distance_m) {
            (Some(path), Some(pinhole), Some(z)) => path.correct(space, pinhole, center, z)?,
            (path @ None, Some(pinhole), Some(z)) => *path = Some(SpacePath::new(space, pinhole, center, z)?),
            _ => {}
        }
        Ok(())
    }

    /// The target, wholly in sight, is at `bbox`.
    pub fn learn(&mut self, params: &DepthOcclusionParams, depth: ImageView<'_, u16>, bbox: &BBox) {
        let now = DepthHistogram::of(&params.histogram, depth, bbox);
        match &mut self.target {
            Some(target) => target.blend(&now, params.histogram_rate),
            None => self.target = Some(now),
        }
    }
}

/// Whether `place` is within a share `apart` of its size of one of `places`.
pub fn is_near_any(places: &[BBox], place: &BBox, apart: f64) -> bool {
    let (c, w, h) = (place.center(), apart * place.width(), apart * place.height());
    places.iter().any(|p| (p.center().x - c.x).abs() < w && (p.center().y - c.y).abs() < h)
}

/// Adds a place, unless one is within a share `apart` of its size.
pub fn add_apart(places: &mut Vec<BBox>, place: BBox, apart: f64) {
    if !is_near_any(places, &place, apart) {
        places.push(place);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_imaging::Image;

    fn params() -> DepthOcclusionParams {
        DepthOcclusionParams { particles: 40, least_similarity: 0.3, ..DepthOcclusionParams::default() }
    }

    /// A box of 20 px at 1.5 m before a wall at 3 m.
    fn frame(k: u64, center: Point) -> Frame {
        let bbox = BBox::from_center_size(center, 20.0, 20.0);
        let depth = Image::from_fn(200, 150, |x, y| {
            if bbox.contains(Point::new(x as f64 + 0.5, y as f64 + 0.5)) { 1500 } else { 3000 }
        });
        let frame = Frame::new(k, k as f64 / 30.0, Image::filled(200, 150, 9u8).unwrap());
        frame.with_depth(depth.unwrap()).unwrap()
    }

    fn followed() -> (Hypotheses, BBox, Point) {
        let at = |k: f64| Point::new(50.0 + 2.0 * k, 60.0 + k);
        let size = BBox::from_center_size(at(0.0), 20.0, 20.0);
        let first = frame(0, at(0.0));
        let mut hypotheses = Hypotheses::new(&params(), first.depth_mm(), &size).unwrap();
        for k in 1..=10 {
            let frame = frame(k, at(k as f64));
            hypotheses.look_ahead(&params(), &frame, frame.depth_mm(), &size, 1.0 / 30.0).unwrap();
            hypotheses.settle(&params(), &frame, Some((at(k as f64), None)), 1.0 / 30.0).unwrap();
        }
        (hypotheses, size, at(10.0))
    }

    #[test]
    fn a_hidden_target_is_sought_where_it_went() {
        let (mut hypotheses, size, last) = followed();
        let empty = frame(11, Point::new(-99.0, -99.0));
        for k in 1..=10 {
            hypotheses.look_ahead(&params(), &empty, empty.depth_mm(), &size, 1.0 / 30.0).unwrap();
            let mut places = Vec::new();
            hypotheses.clusters(&params(), &size, &mut places);
            let expected = Point::new(last.x + 2.0 * f64::from(k), last.y + f64::from(k));
            let away = places[0].center().distance(expected);
            assert!(away < 4.0, "{k}: {places:?} {expected:?}");
            hypotheses.settle(&params(), &empty, None, 1.0 / 30.0).unwrap();
        }
    }

    #[test]
    fn particles_gather_where_the_depths_are_the_targets() {
        let (mut hypotheses, size, last) = followed();
        // Six pixels aside of where it is expected.
        let there = Point::new(last.x + 2.0 + 4.0, last.y + 1.0 - 4.0);
        let shown = frame(11, there);
        // Spread them first: hidden for a while.
        let gone = frame(11, Point::new(-99.0, -99.0));
        let still = Point::new(last.x, last.y);
        hypotheses.look_ahead(&params(), &gone, None, &size, 1.0 / 30.0).unwrap();
        hypotheses.settle(&params(), &gone, Some((still, None)), 1.0 / 30.0).unwrap();
        let unweighed = {
            hypotheses.look_ahead(&params(), &shown, None, &size, 1.0 / 30.0).unwrap();
            hypotheses.ahead.get().unwrap().particles().mean()
        };
        hypotheses.look_ahead(&params(), &shown, shown.depth_mm(), &size, 1.0 / 30.0).unwrap();
        let weighed = hypotheses.ahead.get().unwrap().particles().mean();
        let away = |v: SVector<f64, 2>| (v - vector(there)).norm();
        assert!(away(weighed) < away(unweighed), "{weighed} {unweighed} {there:?}");
    }

    #[test]
    fn looking_ahead_changes_nothing_that_is_saved() {
        let (mut hypotheses, size, last) = followed();
        let before = postcard::to_stdvec(&hypotheses).unwrap();
        let shown = frame(11, last);
        hypotheses.look_ahead(&params(), &shown, shown.depth_mm(), &size, 1.0 / 30.0).unwrap();
        assert_eq!(postcard::to_stdvec(&hypotheses).unwrap(), before);
        hypotheses.settle(&params(), &shown, None, 1.0 / 30.0).unwrap();
        assert_ne!(postcard::to_stdvec(&hypotheses).unwrap(), before);
    }

    #[test]
    fn places_are_apart() {
        let bbox = |x: f64| BBox::from_center_size(Point::new(x, 0.0), 10.0, 10.0);
        let mut places = vec![bbox(0.0)];
        add_apart(&mut places, bbox(3.9), 0.4);
        assert_eq!(places.len(), 1);
        add_apart(&mut places, bbox(4.1), 0.4);
        assert_eq!(places, [bbox(0.0), bbox(4.1)]);
    }
}
