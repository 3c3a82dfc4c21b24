//! The camera's own motion, taken out before the target's is predicted.

use pursuit_geometry::{BBox, Point, Size};
use pursuit_imaging::{CameraPose, Frame};
use pursuit_vision::global_motion::{PictureMotion, PictureShift};
use serde::{Deserialize, Serialize};

pursuit_parameters::choices! {
    /// How the camera's motion is found.
    pub enum CameraCompensation {
        /// It is not: the camera is taken to stand still.
        None = "none",
        /// By the pose of the camera, where frames carry it: those of a pan-tilt head that is followed with, and of scenes.
        Pose = "pose",
        /// By a robust fit of shift, turn and zoom to the flow of points all over the picture.
        Flow = "flow",
        /// By phase correlation of the whole picture: shifts alone, quicker.
        Phase = "phase",
    }
}

/// Says how the camera's motion moved the picture since the frame before.
///
/// The pixels of the frame before are not saved: a tracker that is restored compensates by them from its second frame on.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct CameraShift {
    kind: CameraCompensation,
    /// How the camera stood in the frame before.
    before: Option<CameraPose>,
    #[serde(skip)]
    picture: Option<Box<PictureMotion>>,
}

impl CameraShift {
    /// Of this kind; no frame has been seen.
    pub const fn new(kind: CameraCompensation) -> Self {
        Self { kind, before: None, picture: None }
    }

    /// How the picture moved since the frame before; points inside `targets`, boxes there, do not count. `None` where nothing is
    /// compensated, in the first frame, and where no motion of the whole picture can be told.
    pub fn look(&mut self, frame: &Frame, targets: &[BBox]) -> Option<CameraMotion> {
        let first = match self.kind {
            CameraCompensation::None => return None,
            CameraCompensation::Pose => return self.turned(frame.camera().copied(), frame.size()),
            CameraCompensation::Flow => PictureMotion::by_flow,
            CameraCompensation::Phase => PictureMotion::by_phase,
        };
        match &mut self.picture {
            Some(picture) => picture.shift(frame.gray(), targets).map(CameraMotion::Moved),
            None => {
                self.picture = Some(Box::new(first(frame.gray()).ok()?));
                None
            }
        }
    }

    /// The same at the place of the one `target`.
    pub fn at(&mut self, frame: &Frame, target: &BBox) -> Option<(f64, f64)> {
        self.look(frame, std::slice::from_ref(target))?.at(target.center())
    }

    /// How far what was at `place` in the frame before has moved in a picture of `size`, by how the camera stands now.
    pub fn by_pose(&mut self, now: Option<CameraPose>, size: Size, place: Point) -> Option<(f64, f64)> {
        self.turned(now, size)?.at(place)
    }

    fn turned(&mut self, now: Option<CameraPose>, size: Size) -> Option<CameraMotion> {
        let before = std::mem::replace(&mut self.before, now)?;
        Some(CameraMotion::Turned { before, now: now?, size })
    }
}

/// How the camera's motion moved the picture since the frame before.
#[derive(Debug, Clone, Copy)]
pub enum CameraMotion {
    /// The camera turned.
    Turned {
        /// How it stood in the frame before.
        before: CameraPose,
        /// How it stands now.
        now: CameraPose,
        /// Size of the picture.
        size: Size,
    },
    /// The pixels say so.
    Moved(PictureShift),
}

impl CameraMotion {
    /// How far what was at `place` in the frame before has moved, in pixels to the right and down; `None` where that cannot be
    /// told.
    pub fn at(&self, place: Point) -> Option<(f64, f64)> {
        match self {
            Self::Moved(shift) => shift.at(place),
            Self::Turned { before, now, size } => {
                let there = now.point_of(before.direction_of(place, *size), *size)?;
                let (dx, dy) = (there.x - place.x, there.y - place.y);
                (dx.is_finite() && dy.is_finite()).then_some((dx, dy))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_imaging::{Image, Lens};

    fn frame(pan_rad: Option<f64>) -> Frame {
        let frame = Frame::new(0, 0.0, Image::filled(640, 480, 0_u8).unwrap());
        let pose = |pan| CameraPose::new(0.0, pan, 0.0, Lens::field_of_view(1.0).unwrap()).unwrap();
        match pan_rad {
            Some(pan) => frame.with_camera(pose(pan)),
            None => frame,
        }
    }

    #[test]
    fn a_turn_to_the_right_shifts_the_picture_left() {
        let target = BBox::from_center_size(Point::new(320.0, 240.0), 20.0, 20.0);
        let mut shift = CameraShift::new(CameraCompensation::Pose);
        assert_eq!(shift.at(&frame(Some(0.0)), &target), None, "there is no frame before");
        let (dx, dy) = shift.at(&frame(Some(0.1)), &target).unwrap();
        let focal_px = 320.0 / 0.5_f64.tan();
        assert!((dx + focal_px * 0.1_f64.tan()).abs() < 1e-9 && dy.abs() < 1e-9, "{dx} {dy}");
        assert_eq!(shift.at(&frame(None), &target), None, "this frame has no pose");
        assert_eq!(shift.at(&frame(Some(0.2)), &target), None, "the one before had none");
    }
}
