//! What detections look like, asked where it decides whose they are.

use super::super::association::{Claimant, emptied};
use super::super::target::Target;
use super::Associating;
use crate::{Detection, Result};
use pursuit_imaging::Frame;

impl Associating {
    /// Asks what those of `detections` look like that have no embedding, where that decides whose they are.
    pub(super) fn embed(&mut self, frame: &Frame, detections: &mut [Detection]) -> Result<()> {
        let Some(embedder) = &mut self.embedder else { return Ok(()) };
        let mut claimants: Vec<Claimant<'_>> = std::mem::take(&mut self.claimants);
        claimants.extend(self.targets.iter().filter_map(Target::claimant));
        let undecided = self.association.undecided(&claimants, detections, self.params.embedding.every_s);
        let mut asked = Ok(());
        for (detection, _) in detections.iter_mut().zip(undecided).filter(|(d, is)| **is && d.embedding.is_none()) {
            match embedder.embed(frame, &detection.bbox) {
                Ok(embedding) => detection.embedding = Some(embedding),
                Err(error) => {
                    asked = Err(error);
                    break;
                }
            }
        }
        self.claimants = emptied(claimants);
        asked
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::many::{ManyParams, Track};
    use pursuit_geometry::BBox;
    use pursuit_imaging::Image;
    use pursuit_parameters::Parameters;
    use std::sync::Arc;
    use std::sync::atomic::{AtomicUsize, Ordering};

    /// The colour in the middle of the box, and how often it was asked.
    struct Middle(Arc<AtomicUsize>);

    impl crate::Embedder for Middle {
        fn embed(&mut self, frame: &Frame, bbox: &BBox) -> Result<Arc<[f32]>> {
            self.0.fetch_add(1, Ordering::Relaxed);
            let center = bbox.center();
            let color = frame.color().get(center.x as usize, center.y as usize).copied().unwrap_or([60; 3]);
            Ok(color.map(|code| f32::from(code) - 60.0).into())
        }
    }

    const RED: [u8; 3] = [200, 20, 20];
    const BLUE: [u8; 3] = [20, 20, 200];

    fn walker(x: f64) -> BBox {
        BBox::from_ltwh(x, 60.0, 20.0, 40.0)
    }

    /// Walkers in their colours, and a detection of each.
    fn frame(k: u64, walkers: &[(f64, [u8; 3])]) -> (Frame, Vec<Detection>) {
        let inside =
            |x: usize, y: usize, left: f64| (left..left + 20.0).contains(&(x as f64)) && (60..100).contains(&y);
        let image = Image::from_fn(320, 160, |x, y| {
            walkers.iter().find(|(left, _)| inside(x, y, *left)).map_or([60; 3], |(_, color)| *color)
        })
        .unwrap();
        let detections = walkers.iter().map(|(left, _)| Detection::new(walker(*left), 0.9)).collect();
        (Frame::new(k, k as f64 / 10.0, image), detections)
    }

    fn many() -> (Associating, Arc<AtomicUsize>) {
        let asked = Arc::new(AtomicUsize::new(0));
        let params = ManyParams::default().with("many", &"embedding.every_s = 1.0".parse().unwrap()).unwrap();
        let embedder: Box<dyn crate::Embedder> = Box::new(Middle(asked.clone()));
        (Associating::fed(params).unwrap().with_embedder(Some(embedder)), asked)
    }

    fn ids(tracks: &[Track]) -> Vec<(u64, Option<usize>)> {
        tracks.iter().map(|t| (t.id.0, t.detection)).collect()
    }

    #[test]
    fn looks_tell_two_who_changed_places_unseen() {
        let (mut many, _) = many();
        let apart = [(100.0, RED), (124.0, BLUE)];
        for k in 0..20 {
            let (frame, found) = frame(k, &apart);
            many.update_in(&frame, &found).unwrap();
        }
        for k in 20..32 {
            let (frame, _) = frame(k, &[]);
            many.update_in(&frame, &[]).unwrap();
        }
        let (changed, found) = frame(32, &[(100.0, BLUE), (124.0, RED)]);
        assert_eq!(ids(many.update_in(&changed, &found).unwrap()), [(1, Some(1)), (2, Some(0))]);
        // By their places alone they are the other way round.
        let mut blind = Associating::fed(ManyParams::default()).unwrap();
        for k in 0..32 {
            let walkers: &[_] = if k >= 20 { &[] } else { &apart };
            let (frame, found) = frame(k, walkers);
            blind.update_in(&frame, &found).unwrap();
        }
        let (frame, found) = frame(32, &[(100.0, BLUE), (124.0, RED)]);
        assert_eq!(ids(blind.update_in(&frame, &found).unwrap()), [(1, Some(0)), (2, Some(1))]);
    }

    #[test]
    fn who_is_alone_is_looked_at_now_and_then() {
        let (mut many, asked) = many();
        for k in 0..50 {
            let (frame, found) = frame(k, &[(40.0, RED), (240.0, BLUE)]);
            many.update_in(&frame, &found).unwrap();
        }
        // Ten frames a second: both once a second.
        let so_often = asked.load(Ordering::Relaxed);
        assert!((6..=14).contains(&so_often), "{so_often}");
    }

    #[test]
    fn an_embedding_that_came_along_is_kept() {
        let (mut many, asked) = many();
        let (frame, mut found) = frame(0, &[(40.0, RED), (64.0, BLUE)]);
        found.iter_mut().for_each(|d| d.embedding = Some([1.0, 0.0].into()));
        for k in 0..5 {
            many.update_in(&frame.clone().retimed(k, k as f64 / 10.0), &found).unwrap();
        }
        assert_eq!(asked.load(Ordering::Relaxed), 0);
    }

    #[test]
    fn looks_that_nobody_weighs_are_refused() {
        let fed = |model: &str, embedding: &str| {
            let text = format!("association.model = '{model}'\nembedding.model = '{embedding}'");
            Associating::fed(ManyParams::default().with("many", &text.parse().unwrap()).unwrap())
        };
        for model in ["two-stage", "buffered", "observation", "joint"] {
            let error = fed(model, "colors").err().unwrap().to_string();
            assert!(error.contains("`nearest` and `hypotheses` alone"), "{error}");
            assert!(fed(model, "none").is_ok());
        }
        assert!(fed("nearest", "colors").is_ok() && fed("hypotheses", "colors").is_ok());
    }
}
