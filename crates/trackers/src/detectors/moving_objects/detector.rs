use super::MovingObjectsParams;
use super::confirmed::{Agreement, Confirmed, carry, nearest, renew};
use crate::detectors::motion::MotionDetectorParams;
use pursuit_geometry::BBox;
use pursuit_imaging::{Frame, Image};
use pursuit_parameters::ParameterError;
use pursuit_tracking::motion::MotionParams;
use pursuit_tracking::{
    Detection, Detector, DetectorRecipe, Diagnostics, Figure, Figures, Followed, Needs, Result, TrackingError,
};
use std::sync::Arc;

impl DetectorRecipe for MovingObjectsParams {
    const NEEDS: Needs = Needs { color: false, file: true };
    const FIGURES: &[&[Figure]] =
        &[MotionDetectorParams::FIGURES[0], MotionDetectorParams::FIGURES[1], NetworkFigures::ALL];

    fn detector(&self) -> Result<Box<dyn Detector>> {
        let network = self.objects.detector().map_err(|e| match e {
            // The group's parameters have names of their own here.
            TrackingError::Parameter(e) => {
                let problem = e.problem.replace("--set ", "--set detect.objects.");
                ParameterError::new("moving-objects", format!("objects.{}", e.name), problem).into()
            }
            other => other,
        })?;
        Ok(Box::new(MovingObjects::new(self.clone(), self.motion.detector()?, network)))
    }
}

/// Motion that a network confirms and names.
struct MovingObjects {
    params: MovingObjectsParams,
    motion: Box<dyn Detector>,
    network: Box<dyn Detector>,
    confirmed: Vec<Confirmed>,
    /// Frames since the network was asked; `None` before it was.
    waited: Option<usize>,
}

impl MovingObjects {
    fn new(params: MovingObjectsParams, motion: Box<dyn Detector>, network: Box<dyn Detector>) -> Self {
        Self { params, motion, network, confirmed: Vec::new(), waited: None }
    }

    const fn agreement(&self) -> Agreement {
        Agreement { overlap: self.params.agree, inside: self.params.inside }
    }

    /// Whether the network is to be asked about this frame.
    fn is_due(&self, regions: &[Detection], followed: &[Followed]) -> bool {
        let something = !regions.is_empty() || !followed.is_empty();
        something && self.waited.is_none_or(|waited| waited >= self.params.every)
    }

    /// Asks the network; what it sees that neither moves nor is followed is no matter of ours.
    fn ask(&mut self, frame: &Frame, regions: &[Detection], followed: &[Followed]) -> Result<()> {
        let agreement = self.agreement();
        let Self { params, motion, network, confirmed, .. } = self;
        let mut seen = network.detect(frame, followed)?;
        seen.retain(|object| {
            let out = motion.standing_out(&object.bbox).is_some_and(|share| share >= params.out);
            let known = || regions.iter().map(|r| r.bbox).chain(followed.iter().map(|f| f.bbox));
            out || nearest(&object.bbox, known(), params.agree).is_some()
        });
        renew(confirmed, seen, params.agree, params.patience);
        // Its boxes are those of this frame: no target says better where an object is.
        carry(confirmed, regions, &[], agreement);
        Ok(())
    }

    /// The regions with the names of the objects that they are; in frames of an answer, which is told by `asked`, also the objects
    /// of a region that is several, and those that are followed but do not stand out.
    fn named(&self, regions: &[Detection], followed: &[Followed], asked: bool) -> Vec<Detection> {
        let (params, agreement) = (&self.params, self.agreement());
        let mut all = Vec::with_capacity(regions.len());
        let mut told = vec![false; self.confirmed.len()];
        for (r, region) in regions.iter().enumerate() {
            let lies_in = |object: &Confirmed| object.is_seen() && agreement.lies_in(object, &region.bbox);
            if asked && self.confirmed.iter().filter(|object| lies_in(object)).count() > 1 {
                for (object, told) in self.confirmed.iter().zip(&mut told).filter(|(object, _)| lies_in(object)) {
                    all.push(named(object, Detection::new(object.bbox, object.score)));
                    *told = true;
                }
                continue;
            }
            match self.confirmed.iter().position(|object| object.region == Some(r)) {
                Some(o) => {
                    all.extend(self.confirmed.get(o).map(|object| named(object, region.clone())));
                    told.get_mut(o).into_iter().for_each(|told| *told = true);
                }
                None => {
                    let known = nearest(&region.bbox, followed.iter().map(|f| f.bbox), params.agree).is_some();
                    let worth = if known { 1.0 } else { params.unconfirmed };
                    all.push(Detection { confidence: worth * region.confidence, ..region.clone() });
                }
            }
        }
        let still = |object: &Confirmed| {
            object.is_seen()
                && nearest(&object.bbox, followed.iter().map(|f| f.bbox), params.agree).is_some()
                && nearest(&object.bbox, regions.iter().map(|r| r.bbox), params.agree).is_none()
        };
        let stands = self.confirmed.iter().zip(&told).filter(|(object, told)| asked && !**told && still(object));
        all.extend(stands.map(|(object, _)| named(object, Detection::new(object.bbox, object.score))));
        all.sort_by(|a, b| b.confidence.total_cmp(&a.confidence));
        all
    }
}

/// A detection as the object that it is. What a network confirmed may start a target, however sure it was of it.
fn named(object: &Confirmed, detection: Detection) -> Detection {
    let confidence = (0.5 + 0.5 * object.score).max(detection.confidence);
    Detection { class: object.class.clone(), confidence, ..detection }
}

impl Detector for MovingObjects {
    fn notes(&self) -> Vec<String> {
        self.network.notes()
    }

    fn detect(&mut self, frame: &Frame, followed: &[Followed]) -> Result<Vec<Detection>> {
        let regions = self.motion.detect(frame, followed)?;
        let agreement = self.agreement();
        carry(&mut self.confirmed, &regions, followed, agreement);
        self.waited = self.waited.map(|waited| waited.saturating_add(1));
        let asked = self.is_due(&regions, followed);
        if asked {
            self.ask(frame, &regions, followed)?;
            self.waited = Some(0);
        }
        Ok(self.named(&regions, followed, asked))
    }

    fn watches(&self) -> bool {
        true
    }

    fn standing_out(&self, bbox: &BBox) -> Option<f64> {
        let share = self.motion.standing_out(bbox)?;
        // Somebody who stands for long becomes background, but the network sees that somebody is there.
        let seen = nearest(bbox, self.confirmed.iter().map(|object| object.bbox), self.params.agree).is_some();
        (!seen || share >= self.params.out).then_some(share)
    }

    fn foreground(&mut self) -> Option<Arc<Image<u8>>> {
        self.motion.foreground()
    }

    fn shown(&mut self, frame: &Frame) -> Option<Frame> {
        self.motion.shown(frame)
    }

    fn motion(&self) -> Option<MotionParams> {
        self.motion.motion()
    }

    fn diagnostics(&self) -> Diagnostics {
        let mut said = self.motion.diagnostics();
        let network_asked = f64::from(u8::from(self.waited == Some(0)));
        NetworkFigures { network_asked, confirmed: self.confirmed.len() as f64 }.report(&mut said);
        said
    }
}

pursuit_tracking::figures! {
    /// What the network has to do with the frame.
    struct NetworkFigures {
        /// Whether it was asked in this frame: 1, else 0.
        network_asked;
        /// Objects that it has confirmed.
        confirmed;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_tracking::Class;
    use std::sync::atomic::{AtomicUsize, Ordering};

    /// Says of frame k what stands in its place of the script, and how often it was asked.
    struct Scripted {
        script: Vec<Vec<Detection>>,
        out: f64,
        asked: Arc<AtomicUsize>,
    }

    impl Scripted {
        fn new(script: Vec<Vec<Detection>>) -> Self {
            Self { script, out: 1.0, asked: Arc::default() }
        }
    }

    impl Detector for Scripted {
        fn detect(&mut self, frame: &Frame, _: &[Followed]) -> Result<Vec<Detection>> {
            self.asked.fetch_add(1, Ordering::Relaxed);
            Ok(self.script.get(frame.index() as usize).cloned().unwrap_or_default())
        }

        fn standing_out(&self, _: &BBox) -> Option<f64> {
            Some(self.out)
        }
    }

    fn frame(k: u64) -> Frame {
        Frame::new(k, k as f64 * 0.04, Image::filled(9, 9, 0u8).unwrap())
    }

    fn at(x: f64) -> BBox {
        BBox::from_ltwh(x, 50.0, 20.0, 60.0)
    }

    fn region(x: f64) -> Detection {
        Detection::new(at(x), 0.9)
    }

    fn person(x: f64) -> Detection {
        Detection { class: Some(Class::from("person")), ..Detection::new(at(x), 0.6) }
    }

    fn detector(motion: Scripted, network: Scripted, every: usize) -> MovingObjects {
        let params = MovingObjectsParams { every, ..MovingObjectsParams::default() };
        MovingObjects::new(params, Box::new(motion), Box::new(network))
    }

    #[test]
    fn names_are_carried_between_answers() {
        // Nobody, then a walker whom the network sees in its first answer, and a curtain that it does not.
        let walks = |k: usize| if k < 3 { Vec::new() } else { vec![region(3.0 * k as f64), region(300.0)] };
        let motion = Scripted::new((0..23).map(walks).collect());
        let network = Scripted::new((0..23).map(|k| vec![person(3.0 * k as f64 + 2.0)]).collect());
        let asked = network.asked.clone();
        let mut both = detector(motion, network, 10);
        for k in 0..23 {
            let found = both.detect(&frame(k), &[]).unwrap();
            if k < 3 {
                assert!(found.is_empty());
                continue;
            }
            let (walker, curtain) = (&found[0], &found[1]);
            assert_eq!(walker.class.as_ref().map(ToString::to_string).as_deref(), Some("person"), "{k}");
            assert_eq!(walker.bbox, at(3.0 * k as f64), "motion's box");
            assert!(walker.confidence > 0.5 && curtain.confidence < 0.5 && curtain.class.is_none());
        }
        assert_eq!(asked.load(Ordering::Relaxed), 2, "in frames 3 and 13 alone");
    }

    #[test]
    fn what_is_no_longer_seen_loses_its_name() {
        let motion = Scripted::new(vec![vec![region(50.0)]; 9]);
        let mut script = vec![vec![person(50.0)]];
        script.resize(9, Vec::new());
        let mut both = detector(motion, Scripted::new(script), 1);
        let named = |both: &mut MovingObjects, k| both.detect(&frame(k), &[]).unwrap()[0].class.is_some();
        assert_eq!((0..9).map(|k| named(&mut both, k)).filter(|named| *named).count(), 3, "two answers of patience");
        let followed = [Followed { bbox: at(50.0), measured: true }];
        assert_eq!(both.detect(&frame(3), &followed).unwrap()[0].confidence, 0.9, "who is followed goes on");
    }

    #[test]
    fn a_region_of_two_is_divided_by_the_network() {
        let both_in_one = Detection::new(BBox::from_ltwh(50.0, 50.0, 42.0, 60.0), 0.9);
        let motion = Scripted::new(vec![vec![both_in_one]; 2]);
        let mut both = detector(motion, Scripted::new(vec![vec![person(50.0), person(72.0)]]), 10);
        let found = both.detect(&frame(0), &[]).unwrap();
        assert_eq!(found.iter().map(|d| d.bbox).collect::<Vec<_>>(), [at(50.0), at(72.0)]);
        assert_eq!(both.detect(&frame(1), &[]).unwrap().len(), 1, "no answer, no division");
    }

    #[test]
    fn who_stands_is_seen_and_what_never_moved_is_not() {
        let network = || Scripted::new(vec![vec![person(50.0), person(400.0)]]);
        let still = Scripted { out: 0.0, ..Scripted::new(vec![Vec::new()]) };
        let mut both = detector(still, network(), 1);
        let followed = [Followed { bbox: at(52.0), measured: true }];
        let found = both.detect(&frame(0), &followed).unwrap();
        assert_eq!(found.iter().map(|d| d.bbox).collect::<Vec<_>>(), [at(50.0)]);
        assert_eq!(both.standing_out(&at(51.0)), None, "the network has seen somebody there");
        assert_eq!(both.standing_out(&at(400.0)), Some(0.0));
        let mut nobody = detector(Scripted { out: 0.0, ..Scripted::new(vec![Vec::new()]) }, network(), 1);
        assert!(nobody.detect(&frame(0), &[]).unwrap().is_empty());
    }
}
