//! Rulers of one length: a stick in the picture, and the size of the target itself.

use super::{CLICK_ERROR_PX, require_error};
use crate::{Length, MeasuringError, Result, Unit};
use serde::{Deserialize, Serialize};

/// A length in the picture, at the distance at which the target moves.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Stick {
    /// One end, in pixels.
    pub from: [f64; 2],
    /// The other end, in pixels.
    pub to: [f64; 2],
    /// How long it is.
    pub length: Length,
    /// How uncertain each end is across and down: standard deviation in pixels.
    #[serde(default = "click_error")]
    pub click_error_px: f64,
}

pub(super) const fn click_error() -> f64 {
    CLICK_ERROR_PX
}

impl Stick {
    pub(super) fn check(&self) -> Result<()> {
        require_error("click_error_px of the stick", self.click_error_px)?;
        require_length(&self.length)?;
        let pixels = (self.to[0] - self.from[0]).hypot(self.to[1] - self.from[1]);
        if !pixels.is_finite() || pixels <= 2.0 * self.click_error_px.max(1e-9) {
            return Err(MeasuringError::Ruler(format!(
                "the stick from {:?} to {:?} has no length in the picture; click its two ends, far apart",
                self.from, self.to
            )));
        }
        Ok(())
    }
}

/// Which side of the box is the known size.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Side {
    /// The mean of width and height: of a ball.
    #[default]
    Mean,
    /// Its width.
    Width,
    /// Its height.
    Height,
}

/// The size of the target itself.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TargetSize {
    /// How large it is.
    pub size: Length,
    /// Which side of its box that is.
    #[serde(default)]
    pub side: Side,
}

impl TargetSize {
    pub(super) fn check(&self) -> Result<()> {
        require_length(&self.size)
    }

    /// The size in pixels by the boxes measured, and its standard deviation. The median of all boxes; that they differ says
    /// how far a box may be from the target's edge, which many boxes share, so that many are no better than one.
    pub(crate) fn in_pixels(&self, boxes: &[[f64; 2]]) -> Result<(f64, f64)> {
        let side = |b: &[f64; 2]| match self.side {
            Side::Mean => 0.5 * (b[0] + b[1]),
            Side::Width => b[0],
            Side::Height => b[1],
        };
        let mut sizes: Vec<f64> = boxes.iter().map(side).filter(|s| *s > 0.0 && s.is_finite()).collect();
        let Some(median) = median(&mut sizes) else {
            return Err(MeasuringError::Ruler(
                "the target was measured in no frame, so that its size says nothing; give a stick: --scale X1,Y1,X2,Y2=LENGTH".into(),
            ));
        };
        let mut apart: Vec<f64> = sizes.iter().map(|s| (s - median).abs()).collect();
        Ok((median, 1.4826 * self::median(&mut apart).unwrap_or(0.0)))
    }
}

/// The middle value; none of nothing.
pub(crate) fn median(values: &mut [f64]) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

fn require_length(length: &Length) -> Result<()> {
    if length.unit == Unit::Pixel {
        return Err(MeasuringError::Ruler(
            "a ruler of pixels says nothing of lengths; give its length in m, cm, mm, … or leave it out".into(),
        ));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_targets_size_is_the_median_of_its_boxes() {
        let ball = TargetSize { size: "7cm".parse().unwrap(), side: Side::Mean };
        let boxes = [[40.0, 42.0], [41.0, 41.0], [42.0, 42.0], [300.0, 2.0], [40.0, 40.0]];
        let (pixels, error) = ball.in_pixels(&boxes).unwrap();
        assert_eq!(pixels, 41.0);
        assert!((error - 1.4826).abs() < 1e-9);
        assert_eq!(TargetSize { side: Side::Width, ..ball }.in_pixels(&boxes[..1]).unwrap(), (40.0, 0.0));
        assert!(ball.in_pixels(&[]).unwrap_err().to_string().contains("--scale"));
    }

    #[test]
    fn sticks_without_length_are_refused() {
        let stick = Stick { from: [3.0, 4.0], to: [3.5, 4.0], length: "1m".parse().unwrap(), click_error_px: 0.5 };
        assert!(stick.check().unwrap_err().to_string().contains("no length in the picture"));
        let good = Stick { to: [300.0, 4.0], ..stick };
        assert!(good.check().is_ok());
        for bad in [
            Stick { click_error_px: -1.0, ..good },
            Stick { length: "3px".parse().unwrap(), ..good },
            Stick { to: [f64::NAN, 0.0], ..good },
        ] {
            assert!(bad.check().is_err(), "{bad:?}");
        }
    }
}
