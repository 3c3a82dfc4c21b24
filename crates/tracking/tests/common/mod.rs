//! What the tests of many targets share: painted frames, a tracker of grey values, detectors that follow a script.
#![allow(dead_code, clippy::unwrap_used, reason = "not every test uses everything; a test may panic")]

use pursuit_geometry::BBox;
use pursuit_imaging::{Frame, Image, Pixels};
use pursuit_tracking::{
    Detection, Detector, Followed, GroupParams, Localizer, LocalizerRecipe, Measurement, Recipe, Result, Search,
    TrackerRecipe, TrackingError,
};
use serde::{Deserialize, Serialize};
use std::sync::{Arc, Mutex};

pub const WIDTH: usize = 320;
pub const HEIGHT: usize = 200;
pub const FPS: f64 = 25.0;

pub fn at(x: f64, y: f64) -> BBox {
    BBox::from_center_size(pursuit_geometry::Point::new(x, y), 20.0, 20.0)
}

/// Frame `index` at 25 frames/s, black but for boxes of a grey value each.
pub fn frame(index: u64, boxes: &[(BBox, u8)]) -> Frame {
    frame_at(index, index as f64 / FPS, boxes)
}

pub fn frame_at(index: u64, time_s: f64, boxes: &[(BBox, u8)]) -> Frame {
    let shade = |x: usize, y: usize| {
        let center = pursuit_geometry::Point::new(x as f64 + 0.5, y as f64 + 0.5);
        boxes.iter().rev().find(|(b, _)| b.contains(center)).map_or(0, |(_, v)| *v)
    };
    Frame::new(index, time_s, Pixels::Gray8(Image::from_fn(WIDTH, HEIGHT, shade).unwrap().into()))
}

pub fn empty(index: u64) -> Frame {
    frame(index, &[])
}

pursuit_parameters::parameters! {
    /// Follows a grey value.
    pub struct ShadeParams {
        /// Confidence of what it finds.
        pub confidence: f64 = 0.9, in 0.0..=1.0;
    }
}

#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct ShadeLocalizer {
    confidence: f64,
    shade: u8,
}

fn shade_at(frame: &Frame, bbox: &BBox) -> u8 {
    let center = bbox.center();
    let (x, y) = ((center.x as usize).min(WIDTH - 1), (center.y as usize).min(HEIGHT - 1));
    frame.gray().row(y)[x]
}

impl LocalizerRecipe for ShadeParams {
    type Localizer = ShadeLocalizer;

    fn localizer(&self, frame: &Frame, bbox: BBox) -> Result<ShadeLocalizer> {
        Ok(ShadeLocalizer { confidence: self.confidence, shade: shade_at(frame, &bbox) })
    }
}

impl Localizer for ShadeLocalizer {
    type Finding = ();

    fn locate(&mut self, frame: &Frame, search: &Search) -> Result<Option<(Measurement, ())>> {
        let gray = frame.gray();
        let mut found: Option<BBox> = None;
        for y in 0..gray.height() {
            for (x, v) in gray.row(y).iter().enumerate() {
                let pixel = BBox::from_ltwh(x as f64, y as f64, 1.0, 1.0);
                if *v == self.shade && search.region.contains(pixel.center()) {
                    found = Some(found.map_or(pixel, |f| f.union(&pixel)));
                }
            }
        }
        Ok(found.filter(|_| self.shade > 0).map(|b| (Measurement::new(b, self.confidence), ())))
    }

    fn adapt(&mut self, _: &Frame, _: BBox, (): &()) -> Result<()> {
        Ok(())
    }

    fn restart(&mut self, frame: &Frame, bbox: BBox) -> Result<()> {
        self.shade = shade_at(frame, &bbox);
        Ok(())
    }
}

pub fn recipe() -> Box<dyn Recipe> {
    Box::new(TrackerRecipe { name: "shade", localizer: ShadeParams::default(), groups: GroupParams::default() })
}

/// Knows the one recipe there is.
pub fn recipe_of(name: &str) -> Result<Box<dyn Recipe>> {
    if name == "shade" {
        Ok(recipe())
    } else {
        Err(TrackingError::UnknownName { kind: "tracker", name: name.to_owned(), available: "shade".to_owned() })
    }
}

/// What a detector was told, frame by frame.
pub type Told = Arc<Mutex<Vec<Vec<Followed>>>>;

/// Says what its script says for the frame's index, and remembers what it was told.
pub struct Scripted {
    pub script: Arc<dyn Fn(u64) -> Vec<Detection> + Send + Sync>,
    pub told: Told,
}

impl Detector for Scripted {
    fn detect(&mut self, frame: &Frame, followed: &[Followed]) -> Result<Vec<Detection>> {
        self.told.lock().unwrap().push(followed.to_vec());
        Ok((self.script)(frame.index()))
    }
}

pub fn scripted(script: impl Fn(u64) -> Vec<Detection> + Send + Sync + 'static) -> Box<Scripted> {
    Box::new(Scripted { script: Arc::new(script), told: Told::default() })
}

pub fn seen(bbox: BBox) -> Detection {
    Detection::new(bbox, 0.8)
}
