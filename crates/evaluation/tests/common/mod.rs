//! Trackers without eyes and data sets of a few pixels, for tests.
#![allow(dead_code, clippy::unwrap_used)]

use pursuit_evaluation::Entry;
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_parameters::Parameter;
use pursuit_tracking::{
    Appearance, Estimate, Forecast, Measurement, Needs, Recipe, Result, TrackState, Tracker, TrackingError,
};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// What a scripted tracker does in a frame: `None` makes it fail.
pub type Script = Arc<dyn Fn(u64, BBox) -> Option<(BBox, TrackState, f64)> + Send + Sync>;

/// A tracker that follows a script of (frame number, first box).
#[derive(Clone)]
pub struct Scripted {
    pub name: &'static str,
    pub script: Script,
    pub setting: i64,
    pub updates: Arc<AtomicUsize>,
}

impl Scripted {
    pub fn new(
        name: &'static str,
        script: impl Fn(u64, BBox) -> Option<(BBox, TrackState, f64)> + Send + Sync + 'static,
    ) -> Self {
        Self { name, script: Arc::new(script), setting: 0, updates: Arc::default() }
    }

    /// Stays where it was started, sure of itself.
    pub fn still() -> Self {
        Self::new("still", |_, first| Some((first, TrackState::Tracking, 0.9)))
    }

    pub fn entry(&self) -> Entry {
        Entry { name: self.name.to_owned(), recipe: Box::new(self.clone()) }
    }

    pub fn updates(&self) -> usize {
        self.updates.load(Ordering::Relaxed)
    }
}

#[derive(Clone)]
struct Started {
    recipe: Scripted,
    first: BBox,
}

impl Recipe for Scripted {
    fn name(&self) -> &str {
        self.name
    }

    fn needs(&self) -> Needs {
        Needs::default()
    }

    fn schema(&self) -> Vec<Parameter> {
        Vec::new()
    }

    fn with(&self, _: &toml::Table) -> Result<Box<dyn Recipe>> {
        Ok(self.boxed_clone())
    }

    fn boxed_clone(&self) -> Box<dyn Recipe> {
        Box::new(self.clone())
    }

    fn parameters(&self) -> Result<toml::Table> {
        Ok(toml::Table::from_iter([("setting".to_owned(), toml::Value::Integer(self.setting))]))
    }

    fn init(&self, frame: &Frame, bbox: BBox) -> Result<Box<dyn Tracker>> {
        pursuit_tracking::check_box(frame, bbox)?;
        Ok(Box::new(Started { recipe: self.clone(), first: bbox }))
    }

    fn restore(&self, _: &[u8]) -> Result<Box<dyn Tracker>> {
        unimplemented!("not needed here")
    }

    fn appearance(&self, _: &Frame, _: BBox) -> Result<Box<dyn Appearance>> {
        unimplemented!("not needed here")
    }

    fn restore_appearance(&self, _: &[u8]) -> Result<Box<dyn Appearance>> {
        unimplemented!("not needed here")
    }
}

impl Tracker for Started {
    fn update(&mut self, frame: &Frame) -> Result<Estimate> {
        self.recipe.updates.fetch_add(1, Ordering::Relaxed);
        let (bbox, state, score) =
            (self.recipe.script)(frame.index(), self.first).ok_or(TrackingError::MissingPlane {
                tracker: "scripted".to_owned(),
                needed: "a script",
                index: frame.index(),
            })?;
        Ok(Estimate { state, measurement: None, ..Estimate::started(frame.time_s(), bbox, score) })
    }

    fn reinit(&mut self, _: &Frame, bbox: BBox) -> Result<()> {
        self.first = bbox;
        Ok(())
    }

    fn peek(&mut self, _: &Frame) -> Result<Option<Measurement>> {
        Ok(None)
    }

    fn forecast(&self, _: f64) -> Result<Forecast> {
        Ok(Forecast { time_s: 0.0, bbox: self.first, covariance: None, velocity: None })
    }

    fn change(&mut self, _: &toml::Table) -> Result<()> {
        Ok(())
    }

    fn save(&self) -> Result<Vec<u8>> {
        Ok(Vec::new())
    }

    fn boxed_clone(&self) -> Box<dyn Tracker> {
        Box::new(self.clone())
    }
}

/// Writes `count` small grey PNGs, numbered from `first`, and returns their names.
pub fn write_images(folder: &Path, count: usize, first: usize, digits: usize) -> Vec<String> {
    std::fs::create_dir_all(folder).unwrap();
    let name = |i: usize| format!("{:0digits$}.png", first + i);
    for i in 0..count {
        let file = std::fs::File::create(folder.join(name(i))).unwrap();
        let mut encoder = png::Encoder::new(file, 16, 12);
        encoder.set_color(png::ColorType::Grayscale);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.write_header().unwrap().write_image_data(&[(i * 10 % 250) as u8; 16 * 12]).unwrap();
    }
    (0..count).map(name).collect()
}

/// Writes a text file, making its folder.
pub fn write(path: &Path, text: &str) {
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    std::fs::write(path, text).unwrap();
}
