//! What a calibration says: how pixels become lengths, where the origin is, which way is up, how fast the clip was taken.

mod axes;
mod plane;
mod stick;

pub(crate) use axes::placed as axes_placed;
pub use axes::{Axes, Up};
pub use plane::Plane;
pub(crate) use stick::median;
pub use stick::{Side, Stick, TargetSize};

use crate::{Camera, MeasuringError, Result, Unit};
use serde::{Deserialize, Serialize};

/// How uncertain a click is, where nothing else is said: standard deviation across and down, in pixels.
pub const CLICK_ERROR_PX: f64 = 0.5;

/// A calibration, as `calibration.toml` holds it. One of `stick`, `target` and `plane` makes the ruler; with none of them what
/// is measured stays in pixels.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Calibration {
    /// Width and height of the pictures that it was made on; a run on pictures of another size is refused.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub picture: Option<[usize; 2]>,
    /// How many frames a second the camera took, where the file says another number (slow motion).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub true_fps: Option<f64>,
    /// The unit of the results; that of the ruler where it is not said.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<Unit>,
    /// A length in the picture.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stick: Option<Stick>,
    /// The size of the target itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub target: Option<TargetSize>,
    /// Points of a plane in which the target moves.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub plane: Option<Plane>,
    /// Origin and directions.
    #[serde(skip_serializing_if = "Axes::is_default")]
    pub axes: Axes,
    /// The camera, where its distortion is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub camera: Option<Camera>,
}

impl Calibration {
    /// Reads the text of a `calibration.toml`.
    ///
    /// # Errors
    /// Where it is no TOML, holds a key that there is not, or contradicts itself.
    pub fn from_toml(text: &str) -> Result<Self> {
        let wrong = |e: toml::de::Error| MeasuringError::Calibration(e.to_string().trim_end().to_owned());
        let calibration: Self = toml::from_str(text).map_err(wrong)?;
        calibration.check()?;
        Ok(calibration)
    }

    /// The text of a `calibration.toml`, which [`from_toml`](Self::from_toml) reads.
    ///
    /// # Errors
    /// Where a number in it cannot be written.
    pub fn to_toml(&self) -> Result<String> {
        let text = toml::to_string(self).map_err(|e| MeasuringError::Calibration(e.to_string()))?;
        Ok(format!("# How pixels become lengths: read by `pursuit measure`. Pixels: x right, y down.\n{text}"))
    }

    /// Refuses what cannot be meant.
    ///
    /// # Errors
    /// Two rulers, a frame rate or a unit without sense, a stick without length, points on a line.
    pub fn check(&self) -> Result<()> {
        let rulers: Vec<&str> = [
            self.stick.as_ref().map(|_| "stick"),
            self.target.as_ref().map(|_| "target"),
            self.plane.as_ref().map(|_| "plane"),
        ]
        .into_iter()
        .flatten()
        .collect();
        if rulers.len() > 1 {
            return Err(MeasuringError::Calibration(format!(
                "there are two rulers, {}; one says how long a pixel is, leave the other out",
                rulers.join(" and ")
            )));
        }
        if let Some(fps) = self.true_fps.filter(|fps| !(*fps > 0.0 && fps.is_finite())) {
            return Err(MeasuringError::Calibration(format!(
                "true_fps is {fps}; give the frames a second that the camera took, for example 240"
            )));
        }
        if let (Some(unit), true) = (self.unit, rulers.is_empty())
            && unit != Unit::Pixel
        {
            return Err(MeasuringError::Calibration(format!(
                "nothing says how long a pixel is, so there are no results in {unit}; give a ruler: a stick, a size of the target or a plane"
            )));
        }
        if self.unit == Some(Unit::Pixel) && !rulers.is_empty() {
            return Err(MeasuringError::Calibration(
                "results in px need no ruler; leave the ruler out, or give a unit of length".into(),
            ));
        }
        if let Some(camera) = &self.camera {
            camera.check()?;
            if let Some(picture) = self.picture.filter(|picture| *picture != camera.picture) {
                let [[w, h], [cw, ch]] = [picture, camera.picture];
                return Err(MeasuringError::Calibration(format!(
                    "the camera was calibrated on pictures of {cw}x{ch}, and these are {w}x{h}; calibrate the camera at this size"
                )));
            }
        }
        self.stick.iter().try_for_each(Stick::check)?;
        self.target.iter().try_for_each(TargetSize::check)?;
        self.plane.iter().try_for_each(Plane::check)?;
        self.axes.check()
    }

    /// Refuses to be used on pictures of another size than it was made on.
    ///
    /// # Errors
    /// Where both sizes are known and differ.
    pub fn check_picture(&self, width: usize, height: usize) -> Result<()> {
        let made_on = self.picture.or(self.camera.as_ref().map(|camera| camera.picture));
        match made_on {
            Some([w, h]) if [w, h] != [width, height] => Err(MeasuringError::Calibration(format!(
                "the calibration was made on pictures of {w}x{h}, and this run's are {width}x{height}; calibrate on a picture of this size"
            ))),
            _ => Ok(()),
        }
    }

    /// The unit that results are in.
    pub fn result_unit(&self) -> Unit {
        let of_ruler = self.stick.as_ref().map(|s| s.length.unit);
        let of_ruler = of_ruler.or(self.target.as_ref().map(|t| t.size.unit)).or(self.plane.as_ref().map(|p| p.unit));
        self.unit.or(of_ruler).unwrap_or(Unit::Pixel)
    }
}

/// Refuses an uncertainty that is none.
fn require_error(what: &str, error: f64) -> Result<()> {
    if error >= 0.0 && error.is_finite() {
        return Ok(());
    }
    Err(MeasuringError::Ruler(format!("the {what} is {error}; give a standard deviation of 0 or more")))
}

#[cfg(test)]
mod tests {
    use super::*;

    const STICK: &str = "stick = { from = [10.0, 20.0], to = [110.0, 20.0], length = '0.5m+-1mm' }";

    #[test]
    fn what_is_written_is_read_again() {
        let text = format!(
            "picture = [640, 480]\ntrue_fps = 240.0\nunit = 'cm'\n{STICK}\naxes = {{ origin = [5.0, 6.0], toward = [9.0, 6.5], up = 'down' }}\n\
             [camera]\npicture = [640, 480]\nfocal = [500.0, 501.0]\ncentre = [320.0, 240.0]\ndistortion = [-0.1, 0.0, 0.0, 0.0]"
        );
        let read = Calibration::from_toml(&text).unwrap();
        assert_eq!(Calibration::from_toml(&read.to_toml().unwrap()).unwrap(), read);
        assert_eq!((read.result_unit(), read.true_fps), (Unit::Centimetre, Some(240.0)));
        let empty = Calibration::default();
        assert_eq!(Calibration::from_toml(&empty.to_toml().unwrap()).unwrap(), empty);
        assert_eq!(empty.result_unit(), Unit::Pixel);
    }

    #[test]
    fn contradictions_name_their_mend() {
        let target = "target = { size = '7cm' }";
        let camera = "[camera]\npicture = [640, 480]\nfocal = [500.0, 500.0]\ncentre = [320.0, 240.0]";
        for (text, words) in [
            (format!("{STICK}\n{target}"), "stick and target; one says"),
            (format!("{STICK}\ntrue_fps = 0.0"), "true_fps is 0"),
            ("unit = 'm'".to_owned(), "give a ruler"),
            (format!("unit = 'px'\n{STICK}"), "need no ruler"),
            (format!("unit = 'furlong'\n{STICK}"), "no unit `furlong`"),
            (format!("picture = [320, 240]\n{STICK}\n{camera}"), "calibrate the camera at this size"),
            ("stik = 1".to_owned(), "unknown field `stik`"),
            (STICK.replace("110.0, 20.0", "10.0, 20.0"), "no length in the picture"),
            (STICK.replace("0.5m", "0m"), "not a length"),
        ] {
            let message = Calibration::from_toml(&text).unwrap_err().to_string();
            assert!(message.contains(words), "{text}: {message}");
        }
    }

    #[test]
    fn another_size_of_picture_is_refused() {
        let made = Calibration::from_toml(&format!("picture = [640, 480]\n{STICK}")).unwrap();
        assert!(made.check_picture(640, 480).is_ok());
        let message = made.check_picture(1280, 720).unwrap_err().to_string();
        assert!(
            message.contains("640x480") && message.contains("1280x720") && message.contains("calibrate on"),
            "{message}"
        );
        assert!(Calibration::default().check_picture(7, 7).is_ok());
    }
}
