use super::PersonLocalizer;
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_tracking::{Figure, Gate, Localizer, Measurement, Outcome, Result, Search, TrackingError, ViewSize};
use serde::{Deserialize, Serialize};

/// A person seen as coarse as whoever knows the background sees the picture ([`Frame::coarse`]): what is large in a large picture needs
/// no more pixels. It is learnt in one of as many frames as pixels are one. Without such a sight the picture is seen as it is, and learnt in
/// every frame.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(remote = "PersonSight")]
pub struct PersonSight {
    person: PersonLocalizer,
    /// So many pixels each way are one to `person`; as it was at the start.
    step: usize,
    /// Frames since the last that was learnt.
    waited: usize,
}

pursuit_estimation::checked!(PersonSight);

impl PersonSight {
    /// Starts on the person at `bbox`; `start` makes what looks of the frame and the box as they are seen.
    ///
    /// # Errors
    /// As `start`.
    pub fn new(
        frame: &Frame,
        bbox: &BBox,
        start: impl FnOnce(&Frame, BBox) -> Result<PersonLocalizer>,
    ) -> Result<Self> {
        Ok(match frame.coarse() {
            Some((step, coarse)) => Self { person: start(coarse, bbox.resized(1.0 / step as f64))?, step, waited: 0 },
            None => Self { person: start(frame, *bbox)?, step: 1, waited: 0 },
        })
    }

    fn restored(self) -> Result<Self, &'static str> {
        if self.step > 0 { Ok(self) } else { Err("it sees no pixels") }
    }

    /// The frame as it is seen.
    ///
    /// # Errors
    /// When it has become too small to be seen as coarse as the first one was.
    fn frame(&self, frame: &Frame) -> Result<Frame> {
        match frame.coarse() {
            _ if self.step == 1 => Ok(frame.clone()),
            Some((step, coarse)) if step == self.step => Ok(coarse.clone()),
            // A detector that sees otherwise than the one before the tracker was saved.
            _ => frame.reduced(self.step).map_err(|e| TrackingError::Computation {
                tracker: "person".to_owned(),
                index: frame.index(),
                source: Box::new(e),
            }),
        }
    }

    /// A box of the frame as it is seen.
    fn seen(&self, bbox: &BBox) -> BBox {
        bbox.resized(1.0 / self.step as f64)
    }

    /// A box that is seen in pixels of the frame.
    fn told(&self, bbox: &BBox) -> BBox {
        bbox.resized(self.step as f64)
    }

    fn search(&self, search: &Search) -> Search {
        let variance = (self.step * self.step) as f64;
        let gate = search.gate.map(|gate| Gate { covariance: gate.covariance / variance, ..gate });
        Search { expected: self.seen(&search.expected), region: self.seen(&search.region), gate, ..search.clone() }
    }
}

impl Localizer for PersonSight {
    type Finding = <PersonLocalizer as Localizer>::Finding;

    const FIGURES: &[&[Figure]] = PersonLocalizer::FIGURES;

    fn locate(&mut self, frame: &Frame, search: &Search) -> Result<Option<(Measurement, Self::Finding)>> {
        let found = self.person.locate(&self.frame(frame)?, &self.search(search))?;
        Ok(found.map(|(seen, finding)| {
            let sigma_px = seen.sigma_px.map(|sigma| sigma * self.step as f64);
            (Measurement { bbox: self.told(&seen.bbox), sigma_px, ..seen }, finding)
        }))
    }

    fn refine(
        &mut self,
        frame: &Frame,
        search: &Search,
        measurement: &mut Measurement,
        finding: &mut Self::Finding,
    ) -> Result<()> {
        measurement.bbox = self.seen(&measurement.bbox);
        self.person.refine(&self.frame(frame)?, &self.search(search), measurement, finding)?;
        measurement.bbox = self.told(&measurement.bbox);
        Ok(())
    }

    fn adapt(&mut self, frame: &Frame, bbox: BBox, finding: &Self::Finding) -> Result<()> {
        self.waited += 1;
        if self.waited < self.step {
            return Ok(());
        }
        self.waited = 0;
        self.person.adapt(&self.frame(frame)?, self.seen(&bbox), finding)
    }

    fn observe(&mut self, frame: &Frame, outcome: &Outcome<'_, Self::Finding>) -> Result<()> {
        let seen = Outcome {
            bbox: self.seen(&outcome.bbox),
            found: outcome.found.map(|(bbox, finding)| (self.seen(&bbox), finding)),
            followed: outcome.followed.map(|bbox| self.seen(&bbox)),
            ..*outcome
        };
        self.person.observe(&self.frame(frame)?, &seen)
    }

    fn restart(&mut self, frame: &Frame, bbox: BBox) -> Result<()> {
        (self.step, self.waited) = (frame.coarse().map_or(1, |(step, _)| step), 0);
        self.person.restart(&self.frame(frame)?, self.seen(&bbox))
    }

    fn view(&self, expected: &BBox) -> Option<ViewSize> {
        let view = self.person.view(&self.seen(expected))?;
        Some(ViewSize { width: view.width * self.step as f64, height: view.height * self.step as f64 })
    }
}

#[cfg(test)]
mod tests {
    use super::super::PersonParams;
    use super::*;
    use pursuit_imaging::Image;
    use pursuit_testkit::{lattice, value_noise};
    use pursuit_tracking::{LocalizerRecipe, Look, TrackState};
    use std::sync::Arc;

    const STEP: usize = 2;

    /// Somebody `k` steps to the right before a wall, and what stands out of the wall; each pixel `enlarged` times as wide and high.
    fn frame(k: usize, enlarged: usize) -> Frame {
        let inside = |x: usize, y: usize| (60 + 2 * k..76 + 2 * k).contains(&x) && (30..74).contains(&y);
        let grain = |x: usize, y: usize, seed| {
            60.0 + 120.0 * value_noise((x as f64, y as f64), 5.0, |t| t, |i, j| lattice(i, j, seed))
        };
        let shade = |x: usize, y: usize| {
            let (x, y) = (x / enlarged, y / enlarged);
            if inside(x, y) { [grain(x - 2 * k, y, 7) as u8, 40, 30] } else { [grain(x, y, 3) as u8, 90, 80] }
        };
        let stands_out = |x: usize, y: usize| if inside(x / enlarged, y / enlarged) { 255 } else { 0 };
        let (width, height) = (160 * enlarged, 100 * enlarged);
        let mask = Arc::new(Image::from_fn(width, height, stands_out).unwrap());
        let image = Image::from_fn(width, height, shade).unwrap();
        Frame::new(k as u64, k as f64 / 25.0, image).with_foreground(mask).unwrap()
    }

    /// The frame enlarged, with itself beside it as coarse as it was.
    fn large(k: usize) -> Frame {
        frame(k, STEP).with_coarse(STEP, frame(k, 1)).unwrap()
    }

    fn search(expected: BBox) -> Search {
        Search { expected, region: expected.scaled(5.0), gate: None, look: Look::Near, keep_inside: true }
    }

    /// What is found in a frame about `expected`, and learnt.
    fn follow<L: Localizer>(eye: &mut L, frame: &Frame, expected: BBox) -> Measurement {
        let search = search(expected);
        let (mut seen, mut finding) = eye.locate(frame, &search).unwrap().unwrap();
        eye.refine(frame, &search, &mut seen, &mut finding).unwrap();
        eye.adapt(frame, seen.bbox, &finding).unwrap();
        let (bbox, found) = (seen.bbox, Some((seen.bbox, &finding)));
        let outcome = Outcome { state: TrackState::Tracking, bbox, found, followed: Some(bbox), dt_s: 0.04 };
        eye.observe(frame, &outcome).unwrap();
        seen
    }

    #[test]
    fn a_large_picture_is_seen_as_the_small_one() {
        let (params, factor) = (PersonParams::default(), STEP as f64);
        let start = BBox::from_ltwh(60.0, 30.0, 16.0, 44.0);
        let mut small = PersonLocalizer::new(&params, &frame(0, 1), start).unwrap();
        let mut coarse = params.localizer(&large(0), start.resized(factor)).unwrap();
        let mut expected = start;
        // The one learns in every frame, and so does the other, where it is let wait for none.
        for k in 1..8 {
            coarse.waited = STEP - 1;
            let (wanted, mut seen) =
                (follow(&mut small, &frame(k, 1), expected), follow(&mut coarse, &large(k), expected.resized(factor)));
            let bytes = postcard::to_stdvec(&coarse).unwrap();
            coarse = postcard::from_bytes(&bytes).unwrap();
            seen.bbox = seen.bbox.resized(1.0 / factor);
            assert_eq!(seen, wanted, "{k}");
            assert!(wanted.bbox.iou(&start.translated(2.0 * k as f64, 0.0)) > 0.7, "{k}: {}", wanted.bbox);
            expected = wanted.bbox;
        }
        let (wide, view) = (small.view(&expected).unwrap(), coarse.view(&expected.resized(factor)).unwrap());
        assert_eq!((view.width, view.height), (factor * wide.width, factor * wide.height));
    }

    #[test]
    fn one_of_so_many_frames_is_learnt() {
        let start = BBox::from_ltwh(120.0, 60.0, 32.0, 88.0);
        let mut coarse = PersonParams::default().localizer(&large(0), start).unwrap();
        let (_, finding) = coarse.locate(&large(1), &search(start)).unwrap().unwrap();
        let known = |it: &PersonSight| postcard::to_stdvec(&it.person).unwrap();
        let mut learnt = Vec::new();
        for _ in 0..4 {
            let before = known(&coarse);
            coarse.adapt(&large(1), start, &finding).unwrap();
            learnt.push(known(&coarse) != before);
        }
        assert_eq!(learnt, [false, true, false, true]);
    }

    #[test]
    fn a_gate_is_as_wide_as_it_was() {
        let start = BBox::from_ltwh(120.0, 60.0, 32.0, 88.0);
        let coarse = PersonParams::default().localizer(&large(0), start).unwrap();
        let covariance = pursuit_tracking::BoxCovariance::identity() * 36.0;
        let seen = coarse.search(&Search { gate: Some(Gate { covariance, chi2: 9.0 }), ..search(start) });
        assert_eq!(seen.gate, Some(Gate { covariance: covariance / 4.0, chi2: 9.0 }));
        assert_eq!((seen.expected, seen.region), (start.resized(0.5), start.scaled(5.0).resized(0.5)));
    }

    #[test]
    fn without_a_coarser_sight_the_picture_is_seen_as_it_is() {
        let (params, start) = (PersonParams::default(), BBox::from_ltwh(60.0, 30.0, 16.0, 44.0));
        let mut whole = PersonLocalizer::new(&params, &frame(0, 1), start).unwrap();
        let mut plain = params.localizer(&frame(0, 1), start).unwrap();
        let wanted = follow(&mut whole, &frame(1, 1), start);
        assert_eq!(follow(&mut plain, &frame(1, 1), start), wanted);
        // What began without one goes on so; what begins anew begins as the frame is.
        let beside = frame(1, 1).with_coarse(STEP, frame(1, 1).reduced(STEP).unwrap()).unwrap();
        assert_eq!(plain.frame(&beside).unwrap().size(), beside.size());
        plain.restart(&beside, wanted.bbox).unwrap();
        assert_eq!(plain.frame(&beside).unwrap().size(), pursuit_geometry::Size::new(80, 50));
        assert_eq!(plain.frame(&frame(2, 1)).unwrap().size(), pursuit_geometry::Size::new(80, 50));
        let too_small = Frame::new(3, 0.12, Image::filled(1, 1, [0; 3]).unwrap());
        assert!(matches!(plain.frame(&too_small), Err(TrackingError::Computation { index: 3, .. })));
        plain.step = 0;
        assert!(postcard::from_bytes::<PersonSight>(&postcard::to_stdvec(&plain).unwrap()).is_err());
    }
}
