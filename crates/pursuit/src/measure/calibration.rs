//! Where calibrations are kept, and how they are made of what is said on a command line.

use super::RecordedRun;
use crate::RunError;
use crate::config::options::options;
use pursuit_measuring::calibration::{Axes, CLICK_ERROR_PX, Plane, Stick, TargetSize, Up};
use pursuit_measuring::{Calibration, Camera, Length, Unit};
use std::fs::OpenOptions;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

/// The name of a calibration's file.
pub const CALIBRATION: &str = "calibration.toml";

options! {
    /// A calibration as a command line or Python says it; what is said replaces what a file says.
    pub struct CalibrationOptions {
        /// A stick, `X1,Y1,X2,Y2=LENGTH`, for example `100,400,600,400=0.50m` or with its uncertainty `=0.50m+-1mm`.
        pub scale: Option<String>,
        /// The size of the target itself, `LENGTH`, or `width=LENGTH` or `height=LENGTH` where only that side is known.
        pub target_size: Option<String>,
        /// Points of a plane, four or more, each `X,Y=A,B` with a unit behind the last: `412,300=0,2.4m`.
        pub plane: Vec<String>,
        /// The origin, `X,Y` in pixels.
        pub origin: Option<String>,
        /// A point toward which x goes from the origin, `X,Y` in pixels.
        pub axis: Option<String>,
        /// By how many degrees x is turned to the left, against right in the picture.
        pub angle_deg: Option<f64>,
        /// Whether y grows downward.
        pub y_down: Option<bool>,
        /// A camera with distortion: the YAML or JSON file that OpenCV writes after a calibration, or a `calibration.toml` that has
        /// one.
        pub camera: Option<PathBuf>,
        /// How many frames a second the camera took, where the file says another number (slow motion).
        pub true_fps: Option<f64>,
        /// How uncertain each click is across and down: standard deviation in pixels.
        pub click_error_px: Option<f64>,
    }
}

impl CalibrationOptions {
    /// Whether nothing is said.
    pub fn is_silent(&self) -> bool {
        *self == Self::default()
    }

    /// `base` with what is said in its place. A ruler said replaces the ruler there was.
    ///
    /// # Errors
    /// Where something cannot be read, or the whole makes no calibration.
    pub fn applied(&self, base: Calibration) -> Result<Calibration, RunError> {
        let mut made = base;
        let click = self.click_error_px.unwrap_or(CLICK_ERROR_PX);
        if self.scale.is_some() || self.target_size.is_some() || !self.plane.is_empty() {
            (made.stick, made.target, made.plane) = (None, None, None);
        }
        if let Some(text) = &self.scale {
            made.stick = Some(stick(text, click)?);
        }
        if let Some(text) = &self.target_size {
            made.target = Some(target_size(text)?);
        }
        if !self.plane.is_empty() {
            made.plane = Some(plane(&self.plane, click)?);
        }
        if self.origin.is_some() || self.axis.is_some() || self.angle_deg.is_some() {
            let up = made.axes.up;
            made.axes = Axes {
                origin: self.origin.as_deref().map(|t| point("--origin", t)).transpose()?.or(made.axes.origin),
                toward: self.axis.as_deref().map(|t| point("--axis", t)).transpose()?,
                angle_deg: self.angle_deg,
                up,
                click_error_px: click,
            };
        }
        if self.y_down == Some(true) {
            made.axes.up = Up::Down;
        }
        if let Some(path) = &self.camera {
            let text = std::fs::read_to_string(path).map_err(|e| unreadable("camera file", path, &e))?;
            made.camera = Some(camera(&text, path.extension().is_some_and(|e| e == "toml"))?);
        }
        made.true_fps = self.true_fps.or(made.true_fps);
        made.check()?;
        Ok(made)
    }
}

fn unreadable(what: &str, path: &Path, why: &dyn std::fmt::Display) -> RunError {
    RunError::usage(format!("{what} {}: {why}", path.display()))
}

/// A camera of a calibration that has one, or of what OpenCV writes.
fn camera(text: &str, is_ours: bool) -> Result<Camera, RunError> {
    if !is_ours {
        return Ok(Camera::from_opencv(text)?);
    }
    let none =
        || RunError::usage("this calibration has no camera; find one with `pursuit calibrate CLIP --board chessboard`");
    Calibration::from_toml(text)?.camera.ok_or_else(none)
}

/// `N` finite numbers between commas.
fn numbers<const N: usize>(text: &str) -> Option<[f64; N]> {
    let all: Option<Vec<f64>> =
        text.split(',').map(|n| n.trim().parse().ok().filter(|v: &f64| v.is_finite())).collect();
    all?.try_into().ok()
}

fn point(what: &str, text: &str) -> Result<[f64; 2], RunError> {
    numbers(text).ok_or_else(|| RunError::usage(format!("{what} `{text}` is not X,Y in pixels, for example 120,400")))
}

fn stick(text: &str, click_error_px: f64) -> Result<Stick, RunError> {
    let wrong = || {
        RunError::usage(format!(
            "--scale `{text}` is not X1,Y1,X2,Y2=LENGTH in pixels and a unit, for example 100,400,600,400=0.50m"
        ))
    };
    let (ends, length) = text.split_once('=').ok_or_else(wrong)?;
    let [x1, y1, x2, y2] = numbers(ends).ok_or_else(wrong)?;
    Ok(Stick { from: [x1, y1], to: [x2, y2], length: length.parse::<Length>()?, click_error_px })
}

fn target_size(text: &str) -> Result<TargetSize, RunError> {
    use pursuit_measuring::calibration::Side;
    let (side, length) = match text.split_once('=') {
        None => (Side::Mean, text),
        Some(("width", length)) => (Side::Width, length),
        Some(("height", length)) => (Side::Height, length),
        Some((other, _)) => {
            return Err(RunError::usage(format!(
                "`{other}` is no side of a target; give LENGTH, width=LENGTH or height=LENGTH, for example --target-size 7cm"
            )));
        }
    };
    Ok(TargetSize { size: length.parse()?, side })
}

fn plane(texts: &[String], click_error_px: f64) -> Result<Plane, RunError> {
    let wrong = |text: &str| {
        RunError::usage(format!(
            "--plane `{text}` is not X,Y=A,B: pixels, and a place on the plane with a unit, for example 412,300=0,2.4m"
        ))
    };
    let mut unit: Option<Unit> = None;
    let mut points = Vec::new();
    for text in texts {
        let (pixel, place) = text.split_once('=').ok_or_else(|| wrong(text))?;
        let [x, y] = numbers(pixel).ok_or_else(|| wrong(text))?;
        let end = place.rfind(|c: char| c.is_ascii_digit() || c == '.').map_or(0, |i| i + 1);
        let (place, of) = place.split_at(end);
        let [a, b] = numbers(place).ok_or_else(|| wrong(text))?;
        let of: Unit = of.parse()?;
        if unit.is_some_and(|unit| unit != of) {
            return Err(RunError::usage("the points of the plane have different units; give all in one"));
        }
        unit = Some(of);
        points.push([x, y, a, b]);
    }
    Ok(Plane { unit: unit.unwrap_or(Unit::Metre), points, click_error_px, error: 0.0 })
}

/// The calibration of a run and the file it is from: the one named, else `calibration.toml` in the run's folder, else beside its
/// input, else none.
pub(super) fn find(run: &RecordedRun, named: Option<&Path>) -> Result<(Calibration, Option<PathBuf>), RunError> {
    if let Some(path) = named {
        return read_calibration(path).map(|calibration| (calibration, Some(path.to_path_buf())));
    }
    let beside_input = run.input.as_ref().and_then(|input| Some(Path::new(input).parent()?.join(CALIBRATION)));
    for path in [Some(run.folder.join(CALIBRATION)), beside_input].into_iter().flatten() {
        if path.is_file() {
            return read_calibration(&path).map(|calibration| (calibration, Some(path)));
        }
    }
    Ok((Calibration::default(), None))
}

/// Reads a calibration.
///
/// # Errors
/// [`RunError::Usage`] where it cannot be read or makes none.
pub fn read_calibration(path: &Path) -> Result<Calibration, RunError> {
    /// A calibration is a few hundred bytes.
    const MOST_BYTES: u64 = 1 << 20;
    let length = std::fs::metadata(path).map_err(|e| unreadable("calibration", path, &e))?.len();
    if length > MOST_BYTES {
        return Err(unreadable("calibration", path, &"it is larger than a megabyte, which no calibration is"));
    }
    let text = std::fs::read_to_string(path).map_err(|e| unreadable("calibration", path, &e))?;
    Calibration::from_toml(&text).map_err(|e| unreadable("calibration", path, &e))
}

/// Writes a calibration; one that is there is replaced only where `overwrite` says so.
///
/// # Errors
/// [`RunError::Usage`] where one is there, [`RunError::Output`] where it cannot be written.
pub fn write_calibration(calibration: &Calibration, path: &Path, overwrite: bool) -> Result<(), RunError> {
    let text = calibration.to_toml()?;
    if overwrite {
        let part = path.with_extension("toml.part");
        // What lies there, of a run that was broken off, is no file to write through: it may be a link.
        match std::fs::remove_file(&part) {
            Err(e) if e.kind() != ErrorKind::NotFound => return Err(RunError::output(&part)(e)),
            _ => {}
        }
        let file = OpenOptions::new().write(true).create_new(true).open(&part);
        file.and_then(|mut file| file.write_all(text.as_bytes())).map_err(RunError::output(&part))?;
        return std::fs::rename(&part, path).map_err(RunError::output(path));
    }
    match OpenOptions::new().write(true).create_new(true).open(path) {
        Ok(mut file) => file.write_all(text.as_bytes()).map_err(RunError::output(path)),
        Err(e) if e.kind() == ErrorKind::AlreadyExists => Err(RunError::usage(format!(
            "there is a calibration at {} already; replace it with `--overwrite`, or name another with `--out FILE`",
            path.display()
        ))),
        Err(e) => Err(RunError::output(path)(e)),
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;

    fn said(text: &str) -> CalibrationOptions {
        toml::from_str(text).unwrap()
    }

    #[test]
    fn what_is_said_makes_a_calibration() {
        let made =
            said("scale = '10,20,110,20=0.5m+-1mm'\norigin = '5,6'\naxis = '50,6'\ny_down = true\ntrue_fps = 240.0")
                .applied(Calibration::default())
                .unwrap();
        let stick = made.stick.unwrap();
        assert_eq!((stick.to, stick.length.error), ([110.0, 20.0], 0.001));
        assert_eq!((made.axes.toward, made.axes.up, made.true_fps), (Some([50.0, 6.0]), Up::Down, Some(240.0)));
        // A ruler said replaces the one there was; the rest stays.
        let plane = said("plane = ['0,0=0,0m', '100,0=1,0m', '100,90=1,1m', '0,100=0,1m']");
        let other = plane.applied(Calibration { stick: Some(stick), true_fps: Some(240.0), ..Calibration::default() });
        let other = other.unwrap();
        assert!(other.stick.is_none() && other.true_fps == Some(240.0));
        assert_eq!(other.plane.unwrap().points[2], [100.0, 90.0, 1.0, 1.0]);
        let ball = said("target_size = 'width=7cm'").applied(Calibration::default()).unwrap();
        assert_eq!(ball.target.unwrap().size.value, 7.0);
        assert!(CalibrationOptions::default().is_silent() && !plane.is_silent());
    }

    #[test]
    fn what_cannot_be_read_is_shown_with_an_example() {
        for (text, words) in [
            ("scale = '10,20,110,20'", "100,400,600,400=0.50m"),
            ("scale = '10,20,110=1m'", "100,400,600,400=0.50m"),
            ("scale = '10,20,10,20=1m'", "click its two ends"),
            ("scale = '10,20,110,20=0m'", "above 0"),
            ("scale = '10,20,110,20=3 ell'", "no unit `ell`"),
            ("target_size = 'depth=3m'", "no side"),
            ("plane = ['1,2=3']", "412,300=0,2.4m"),
            ("plane = ['0,0=0,0m', '1,0=1,0cm']", "different units"),
            ("plane = ['0,0=0,0m', '10,0=1,0m', '20,0=2,0m', '30,0=3,0m']", "lie on a line"),
            ("plane = ['0,0=0,0']", "no unit ``"),
            ("origin = '5'", "--origin"),
            ("axis = '5,5'", "give the origin too"),
            ("camera = '/nowhere/camera.yml'", "/nowhere/camera.yml"),
            ("true_fps = -3.0", "true_fps"),
        ] {
            let error = said(text).applied(Calibration::default()).unwrap_err();
            assert!(error.to_string().contains(words) && error.exit_code() == 2, "{text}: {error}");
        }
    }

    #[test]
    fn a_calibration_is_replaced_only_where_asked() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(CALIBRATION);
        let first = said("scale = '10,20,110,20=0.5m'").applied(Calibration::default()).unwrap();
        write_calibration(&first, &path, false).unwrap();
        assert_eq!(read_calibration(&path).unwrap(), first);
        let second = Calibration { true_fps: Some(240.0), ..first.clone() };
        let refused = write_calibration(&second, &path, false).unwrap_err();
        assert!(refused.to_string().contains("--overwrite") && refused.exit_code() == 2, "{refused}");
        assert_eq!(read_calibration(&path).unwrap(), first);
        write_calibration(&second, &path, true).unwrap();
        assert_eq!(read_calibration(&path).unwrap(), second);
        std::fs::write(&path, "stick = 3").unwrap();
        assert!(read_calibration(&path).unwrap_err().to_string().contains("calibration.toml"));
    }
}
