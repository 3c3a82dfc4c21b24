use crate::RunError;
use pursuit_geometry::{BBox, Point};
use pursuit_imaging::{Frame, Rgb8};
use pursuit_media::output::{Canvas, Mp4Writer, Stroke, VideoOptions, VideoWriter};
use pursuit_ptz::geometry::{AngleFormula, direction_of};
use pursuit_ptz::simulation::Exposure;
use pursuit_tracking::{Estimate, TrackState};
use std::path::Path;

const TRUE: Rgb8 = [40, 220, 60];
const TRACKED: Rgb8 = [255, 255, 255];
const DOUBTED: Rgb8 = [255, 190, 40];
const MIDDLE: Rgb8 = [90, 170, 255];

/// A video of what a simulated camera saw: the picture with its central fifth blue, the true box of the target green, the
/// tracker's white (amber where it does not track), and in words how the head stood and how far it was off.
pub struct Film(Mp4Writer);

impl Film {
    /// Begins one at `fps` frames per second.
    ///
    /// # Errors
    /// [`RunError::Output`] where the file cannot be made.
    pub fn create(path: &Path, fps: f64) -> Result<Self, RunError> {
        Ok(Self(Mp4Writer::create(path, VideoOptions { nominal_fps: fps, ..VideoOptions::default() })?))
    }

    /// The next picture, as it was taken, and what a tracker said of it.
    ///
    /// # Errors
    /// Where it cannot be encoded or written.
    pub fn add(&mut self, frame: &Frame, taken: &Exposure, estimate: Option<&Estimate>) -> Result<(), RunError> {
        let mut canvas = Canvas::new(frame.color().to_image());
        let (size, width) = (taken.lens.size(), 1.5 * canvas.scale());
        let (wide, high) = (size.width as f64, size.height as f64);
        let center = Point::new(0.5 * wide, 0.5 * high);
        let central = BBox::from_center_size(center, 0.2 * wide, 0.2 * high);
        canvas.rectangle(&central, &Stroke::new(MIDDLE, width).with_opacity(0.6));
        canvas.cross(center, 4.0 * width, &Stroke::new(MIDDLE, width));
        if let Some(truth) = taken.truth.filter(|_| taken.shows_target()) {
            canvas.rectangle(&truth, &Stroke::new(TRUE, width).dashed(4.0 * width, 3.0 * width));
        }
        if let Some(estimate) = estimate {
            let color = if estimate.state == TrackState::Tracking { TRACKED } else { DOUBTED };
            canvas.rectangle(&estimate.bbox, &Stroke::new(color, width));
        }
        let height_px = canvas.text_height_px();
        let words = words(taken, estimate);
        let (text_wide, text_high) = Canvas::text_size(&words, height_px);
        canvas.fill(&BBox::from_ltwh(0.0, 0.0, text_wide + height_px, text_high + height_px), [0; 3], 0.5);
        canvas.text(Point::new(0.5 * height_px, 0.5 * height_px), &words, height_px, TRACKED);
        Ok(self.0.write(canvas.into_image().view(), taken.time_s)?)
    }

    /// Writes what is held back.
    ///
    /// # Errors
    /// As [`add`](Self::add).
    pub fn finish(&mut self) -> Result<(), RunError> {
        Ok(self.0.finish()?)
    }
}

/// When it was taken, how the head stood, how far off the target was, and what the tracker says.
fn words(taken: &Exposure, estimate: Option<&Estimate>) -> String {
    let pose = taken.position.direction;
    let off = match taken.truth.filter(|_| taken.shows_target()) {
        Some(truth) => {
            let there = direction_of(&taken.lens, pose, truth.center(), AngleFormula::PanThenTilt);
            format!("{:.1}° off", there.angle_to(pose))
        }
        None => "out of the picture".to_owned(),
    };
    let said = estimate.map_or("nothing yet", |estimate| estimate.state.as_str());
    format!("{:.2} s  pan {:.1}°  tilt {:.1}°  {off}  {said}", taken.time_s, pose.pan_deg, pose.tilt_deg)
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_geometry::Size;
    use pursuit_imaging::Image;
    use pursuit_ptz::geometry::Lens;
    use pursuit_ptz::{Direction, Position};

    #[test]
    fn a_film_has_every_picture_and_says_how_far_off_it_was() {
        let lens = Lens::new(Size::new(160, 90), 30.0).unwrap();
        let position = Position { direction: Direction::new(12.0, -3.0), zoom: 0.0 };
        let at = |x: f64| Some(BBox::from_center_size(Point::new(x, 45.0), 10.0, 20.0));
        let taken = |time_s, truth| Exposure { time_s, arrival_s: time_s, position, roll_deg: 0.0, lens, truth };
        assert!(words(&taken(1.0, at(80.0)), None).contains("pan 12.0°  tilt -3.0°  0.0° off  nothing yet"));
        assert!(words(&taken(1.0, at(160.0)), None).contains("30.0° off"));
        let tracked = Estimate::started(1.0, at(80.0).unwrap(), 1.0);
        assert!(words(&taken(1.0, at(200.0)), Some(&tracked)).contains("out of the picture  tracking"));
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("film.mp4");
        let mut film = Film::create(&path, 25.0).unwrap();
        for k in 0..10_i32 {
            let time_s = f64::from(k) * 0.04;
            let frame = Frame::new(u64::from(k.unsigned_abs()), time_s, Image::filled(160, 90, [60; 3]).unwrap());
            film.add(&frame, &taken(time_s, at(80.0)), Some(&tracked)).unwrap();
        }
        film.finish().unwrap();
        let mut source = crate::open(path.to_str().unwrap()).unwrap();
        let frames = std::iter::from_fn(|| source.next_frame().unwrap()).collect::<Vec<_>>();
        assert_eq!(frames.len(), 10);
        assert!(Film::create(&folder.path().join("no/such/folder.mp4"), 25.0).is_err());
    }
}
