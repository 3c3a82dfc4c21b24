//! The part of the picture that is looked at, and at what size: `--region` and `--resize`.
//!
//! Trackers see the part alone, in its own pixels. A [`Session`](crate::Session) translates: what it is given (boxes) and what
//! it hands on (estimates) is in pixels of the whole input, as the truth is.

mod resize;
mod source;

pub use resize::Resize;
pub use source::part_of;

use crate::RunError;
use nalgebra::{Matrix4, Vector4};
use pursuit_geometry::Size;
use pursuit_imaging::{CameraPose, Lens};
use pursuit_media::View;
use pursuit_tracking::{BoxCovariance, Estimate, Forecast, Velocity};
use std::sync::Arc;

/// The shortest side of a region or of a picture that was resized, in pixels: smaller ones hold no target.
const LEAST_SIDE: usize = 8;
/// The longest side of a picture that was resized, in pixels.
const MOST_SIDE: usize = 16_384;
/// The largest picture that is made by resizing, in pixels: that of 8K.
const MOST_PIXELS: usize = 7680 * 4320;

/// The view of an input of this size; `None` where everything is looked at as it is. A region is widened to whole pixels, its
/// left and top to even ones, as the colours of video are shared by pairs of pixels.
fn view(input: Size, region: Option<[f64; 4]>, resize: Option<Resize>) -> Result<Option<View>, RunError> {
    let region = region.map_or(Ok([0, 0, input.width, input.height]), |region| inside(input, region))?;
    let [_, _, width, height] = region;
    let size = resize.map_or([width, height], |resize| resize.of(width, height));
    let sensible = |side: &usize| (LEAST_SIDE..=MOST_SIDE).contains(side);
    if resize.is_some() && !(size.iter().all(sensible) && size[0] * size[1] <= MOST_PIXELS) {
        let [w, h] = size;
        return Err(RunError::usage(format!(
            "{width}x{height} pixels cannot be resized to {w}x{h}; sides go from {LEAST_SIDE} to {MOST_SIDE}, pictures to {MOST_PIXELS} pixels"
        )));
    }
    let view = View { input, region, size };
    Ok((view.size() != input || region[..2] != [0, 0]).then_some(view))
}

/// What is said of a frame of the view, in the input's pixels. The method's raw figures stay as they are.
pub(crate) fn estimate_in_input(view: &View, estimate: Estimate) -> Estimate {
    let ([sx, sy], [x, y]) = (view.scale(), view.origin());
    Estimate {
        bbox: view.in_input(estimate.bbox),
        prediction: estimate.prediction.map(|b| view.in_input(b)),
        measurement: estimate.measurement.map(|b| view.in_input(b)),
        searched: estimate.searched.map(|b| view.in_input(b)),
        covariance: estimate.covariance.map(|c| covariance_in_input(view, &c)),
        velocity: estimate.velocity.map(|v| velocity_in_input(view, v)),
        mask: estimate.mask.map(|mask| Arc::new(mask.mapped([1.0 / sx, 1.0 / sy], [x, y], view.input))),
        next: estimate.next.map(|mut next| {
            next.center = next.center.map(|p| view.point_in_input(p));
            next
        }),
        ..estimate
    }
}

/// What is expected in the view, in the input's pixels.
pub(crate) fn forecast_in_input(view: &View, forecast: &Forecast) -> Forecast {
    Forecast {
        time_s: forecast.time_s,
        bbox: view.in_input(forecast.bbox),
        covariance: forecast.covariance.map(|c| covariance_in_input(view, &c)),
        velocity: forecast.velocity.map(|v| velocity_in_input(view, v)),
    }
}

fn covariance_in_input(view: &View, covariance: &BoxCovariance) -> BoxCovariance {
    let [sx, sy] = view.scale();
    let scale = Matrix4::from_diagonal(&Vector4::new(1.0 / sx, 1.0 / sy, 1.0 / sx, 1.0 / sy));
    scale * covariance * scale
}

fn velocity_in_input(view: &View, velocity: Velocity) -> Velocity {
    let [sx, sy] = view.scale();
    Velocity { x: velocity.x / sx, y: velocity.y / sy }
}

/// The pose of a camera that takes the whole input as that of one which takes the view.
pub(crate) fn pose_of_input(view: &View, pose: &CameraPose) -> Option<CameraPose> {
    let ([sx, sy], [x, y], [fx, fy, cx, cy]) = (view.scale(), view.origin(), pose.lens().pinhole_px(view.input));
    let lens = Lens::intrinsics(fx * sx, fy * sy, (cx - x) * sx, (cy - y) * sy).ok()?;
    CameraPose::new(pose.time_s(), pose.pan_rad(), pose.tilt_rad(), lens).ok()
}

/// The region in whole pixels, widened.
fn inside(input: Size, region: [f64; 4]) -> Result<[usize; 4], RunError> {
    let [left, top, width, height] = region;
    let wrong = || {
        RunError::usage(format!(
            "region {left},{top},{width},{height} is no part of {}x{} pixels of at least {LEAST_SIDE}x{LEAST_SIDE}; it is LEFT,TOP,WIDTH,HEIGHT",
            input.width, input.height
        ))
    };
    let fits = |from: f64, length: f64, whole: usize| {
        from >= 0.0 && length > 0.0 && from + length <= whole as f64 && (from + length).is_finite()
    };
    if !(fits(left, width, input.width) && fits(top, height, input.height)) {
        return Err(wrong());
    }
    let even = |from: f64| 2 * (0.5 * from).floor() as usize;
    let (x, y) = (even(left), even(top));
    let (right, bottom) = ((left + width).ceil() as usize, (top + height).ceil() as usize);
    let region = [x, y, right - x, bottom - y];
    if region[2].min(region[3]) < LEAST_SIDE { Err(wrong()) } else { Ok(region) }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use pursuit_geometry::{BBox, Mask, Point};

    const INPUT: Size = Size::new(640, 480);

    fn view(region: Option<[f64; 4]>, resize: Option<&str>) -> Result<Option<View>, RunError> {
        super::view(INPUT, region, resize.map(|r| r.parse().unwrap()))
    }

    #[test]
    fn a_region_is_widened_to_whole_pixels_and_the_whole_is_no_view() {
        assert_eq!(view(None, None).unwrap(), None);
        assert_eq!(view(Some([0.0, 0.0, 640.0, 480.0]), Some("1")).unwrap(), None);
        let odd = view(Some([101.5, 51.0, 20.2, 30.0]), None).unwrap().unwrap();
        assert_eq!((odd.region, odd.size), ([100, 50, 22, 31], [22, 31]));
        let half = view(None, Some("0.5")).unwrap().unwrap();
        assert_eq!((half.region, half.size), ([0, 0, 640, 480], [320, 240]));
        let both = view(Some([320.0, 240.0, 320.0, 240.0]), Some("160x60")).unwrap().unwrap();
        assert_eq!((both.size(), both.scale()), (Size::new(160, 60), [0.5, 0.25]));
    }

    #[test]
    fn what_is_no_part_of_the_picture_is_refused() {
        for bad in [
            [-1.0, 0.0, 20.0, 20.0],
            [0.0, 0.0, 641.0, 20.0],
            [0.0, 470.0, 20.0, 20.0],
            [0.0, 0.0, 4.0, 20.0],
            [0.0, 0.0, f64::NAN, 20.0],
            [0.0, 0.0, f64::INFINITY, 20.0],
            [f64::MAX, 0.0, 20.0, 20.0],
        ] {
            let error = view(Some(bad), None).unwrap_err();
            assert_eq!(error.exit_code(), 2);
            assert!(error.to_string().contains("LEFT,TOP,WIDTH,HEIGHT"), "{error}");
        }
        for bad in ["7x100", "100x20000", "16384x16384", "1000"] {
            assert!(view(None, Some(bad)).unwrap_err().to_string().contains("cannot be resized"), "{bad}");
        }
    }

    #[test]
    fn there_and_back_is_where_it_was() {
        let view = view(Some([100.0, 50.0, 200.0, 100.0]), Some("400x100")).unwrap().unwrap();
        let bbox = BBox::from_ltwh(110.0, 60.0, 20.0, 30.0);
        assert_eq!(view.of_input(bbox).ltwh(), (20.0, 10.0, 40.0, 30.0));
        assert_eq!(view.in_input(view.of_input(bbox)), bbox);
    }

    #[test]
    fn pixels_change_their_shape_with_the_picture() {
        let shape = |resize| view(None, Some(resize)).unwrap().unwrap().pixel_aspect((4, 3));
        assert_eq!([shape("0.5"), shape("320x480"), shape("640x240")], [(4, 3), (8, 3), (2, 3)]);
    }

    #[test]
    fn all_that_is_said_is_in_the_input_s_pixels() {
        let view = view(Some([100.0, 50.0, 200.0, 100.0]), Some("400x50")).unwrap().unwrap();
        let seen = BBox::from_ltwh(20.0, 10.0, 40.0, 30.0);
        let next = pursuit_tracking::NextSample { in_s: 0.1, center: Some(Point::new(40.0, 20.0)) };
        let estimate = Estimate {
            mask: Some(Arc::new(Mask::from_bbox(&seen, view.size()))),
            prediction: Some(seen),
            searched: Some(seen),
            covariance: Some(Matrix4::identity()),
            velocity: Some(Velocity { x: 10.0, y: 10.0 }),
            next: Some(next),
            ..Estimate::started(0.0, seen, 0.5)
        };
        let said = estimate_in_input(&view, estimate.clone());
        let wanted = BBox::from_ltwh(110.0, 70.0, 20.0, 60.0);
        assert_eq!((said.bbox, said.prediction, said.measurement), (wanted, Some(wanted), Some(wanted)));
        assert_eq!(said.searched, Some(wanted));
        assert_eq!(said.mask.as_deref().and_then(Mask::bounds), Some(wanted));
        assert_eq!(said.covariance.unwrap().diagonal(), Vector4::new(0.25, 4.0, 0.25, 4.0));
        assert_eq!(said.velocity.unwrap(), Velocity { x: 5.0, y: 20.0 });
        assert_eq!(said.next.unwrap().center.unwrap(), Point::new(120.0, 90.0));
        assert_eq!((said.score, said.state), (0.5, estimate.state));
    }
}
