//! A ruler: from a pixel to a place in the world, and how uncertain the ruler itself is.

use crate::calibration::{Axes, Calibration, Plane, Stick, TargetSize, Up};
use crate::homography::{Homography, Jet};
use crate::{Camera, MeasuringError, Result, Unit};
use nalgebra::{Matrix2, Matrix3, SMatrix, SVector, SymmetricEigen};
use serde::Serialize;

/// From pixels to places. However it was made it is one projective map behind the camera's distortion, and a handful of others
/// that are as likely: those with one of the ruler's independent errors turned up by its standard deviation.
#[derive(Debug, Clone)]
pub struct Ruler {
    camera: Option<Camera>,
    map: Homography,
    back: Homography,
    others: Vec<Homography>,
    unit: Unit,
    facts: RulerFacts,
}

/// What is known of a ruler.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RulerFacts {
    /// `stick`, `target`, `plane` or `pixels`.
    pub kind: &'static str,
    /// The unit of what it measures.
    pub unit: Unit,
    /// How long a pixel is, of a ruler that is the same all over.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub per_pixel: Option<f64>,
    /// The standard deviation of lengths measured with it, relative, of a ruler that is the same all over.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub relative_error: Option<f64>,
    /// How far each point of a plane is from where it was clicked, in pixels.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub residuals_px: Vec<f64>,
    /// What should be looked at.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
}

/// Numbers that a ruler is made of, each with its standard deviation.
type Inputs = Vec<(f64, f64)>;

impl Ruler {
    /// The ruler of a calibration; `boxes` are width and height of the target where it was measured, of use where its size is
    /// the ruler.
    ///
    /// # Errors
    /// Where the calibration contradicts itself, its points make no plane, or no box says how large the target is seen.
    pub fn new(calibration: &Calibration, boxes: &[[f64; 2]]) -> Result<Self> {
        calibration.check()?;
        let unit = calibration.result_unit();
        let ideal = |at: [f64; 2]| match &calibration.camera {
            Some(camera) => camera.undistort(at).map(|(at, _)| at).ok_or_else(|| off_lens(at)),
            None => Ok(at),
        };
        let maker = Maker { calibration, unit };
        let (mut inputs, mut facts) = match (&calibration.stick, &calibration.target, &calibration.plane) {
            (Some(stick), ..) => (maker.of_stick(stick, &ideal)?, maker.facts("stick")),
            (_, Some(target), _) => (maker.of_target(target, boxes)?, maker.facts("target")),
            (.., Some(plane)) => maker.of_plane(plane, &ideal)?,
            _ => (Vec::new(), maker.facts("pixels")),
        };
        let own = inputs.len();
        inputs.extend(maker.of_axes(&ideal)?);
        let values: Vec<f64> = inputs.iter().map(|i| i.0).collect();
        let map = maker.map(&values, own)?;
        let mut changes = Vec::new();
        for (i, (value, error)) in inputs.iter().enumerate().filter(|(_, input)| input.1 > 0.0) {
            let mut turned = values.clone();
            turned[i] = value + error;
            changes.push(maker.map(&turned, own)? - map);
        }
        let others = gathered(&changes, calibration).into_iter().map(|change| Homography(map + change)).collect();
        let map = Homography(map);
        let back = map.inverse().ok_or_else(|| {
            MeasuringError::Ruler("the ruler sends the whole picture to a line; click its points anew".into())
        })?;
        if facts.kind != "plane" {
            let scale = |h: &Matrix3<f64>| (h.fixed_view::<2, 2>(0, 0).determinant().abs()).sqrt() / h[(2, 2)].abs();
            facts.per_pixel = Some(scale(&map.0));
            let relative = |c: &Matrix3<f64>| scale(&(map.0 + c)) / scale(&map.0) - 1.0;
            facts.relative_error = Some(changes.iter().map(|c| relative(c).powi(2)).sum::<f64>().sqrt());
        }
        Ok(Self { camera: calibration.camera.clone(), map, back, others, unit, facts })
    }

    /// What is known of it.
    pub const fn facts(&self) -> &RulerFacts {
        &self.facts
    }

    /// The unit that it measures in.
    pub const fn unit(&self) -> Unit {
        self.unit
    }

    /// Where the ray through a pixel meets the world, and how that changes with the pixel; none at or above the horizon of a
    /// plane, or where the lens shows nothing.
    pub fn place(&self, pixel: [f64; 2]) -> Option<([f64; 2], Matrix2<f64>)> {
        let (ideal, lens) = match &self.camera {
            Some(camera) => camera.undistort(pixel)?,
            None => (pixel, Matrix2::identity()),
        };
        let place = self.map.apply(ideal)?;
        Some((place, self.map.slope(ideal)? * lens))
    }

    /// The pixel at which a place is seen; none where it is not in front of the camera.
    pub fn pixel(&self, place: [f64; 2]) -> Option<[f64; 2]> {
        let ideal = self.back.apply(place)?;
        Some(self.camera.as_ref().map_or(ideal, |camera| camera.distort(ideal)))
    }

    /// By how much what is measured at a place, with its velocity and acceleration, would differ with the ruler's errors turned
    /// up, one after the other: the roots of the covariance that the ruler brings in.
    pub(crate) fn changes(&self, mean: &SVector<f64, 6>) -> Vec<SVector<f64, 6>> {
        let Some(seen) = self.back.of_jet(&split(mean)) else { return Vec::new() };
        let joined = |jet: Jet| {
            let Jet { at, velocity, acceleration } = jet;
            SVector::from([at.x, at.y, velocity.x, velocity.y, acceleration.x, acceleration.y])
        };
        self.others.iter().filter_map(|other| Some(joined(other.of_jet(&seen)?) - mean)).collect()
    }

    /// How many independent errors it has.
    pub(crate) fn error_count(&self) -> usize {
        self.others.len()
    }

    /// The place as it would be with error `index` turned up.
    pub(crate) fn place_with_error(&self, index: usize, place: [f64; 2]) -> Option<[f64; 2]> {
        self.others.get(index)?.apply(self.back.apply(place)?)
    }
}

fn split(mean: &SVector<f64, 6>) -> Jet {
    let part = |i: usize| nalgebra::Vector2::new(mean[i], mean[i + 1]);
    Jet { at: part(0), velocity: part(2), acceleration: part(4) }
}

fn off_lens(at: [f64; 2]) -> MeasuringError {
    MeasuringError::Ruler(format!(
        "the camera's lens shows nothing at {at:?}; click inside the picture that it was calibrated on"
    ))
}

/// Makes the map of a calibration from the numbers that it rests on, which may be changed.
struct Maker<'a> {
    calibration: &'a Calibration,
    unit: Unit,
}

impl Maker<'_> {
    fn facts(&self, kind: &'static str) -> RulerFacts {
        let (unit, residuals_px, warnings) = (self.unit, Vec::new(), Vec::new());
        RulerFacts { kind, unit, per_pixel: None, relative_error: None, residuals_px, warnings }
    }

    /// How many of the unit of results are in one of `unit`.
    fn ratio(&self, unit: Unit) -> f64 {
        unit.metres().unwrap_or(1.0) / self.unit.metres().unwrap_or(1.0)
    }

    fn of_stick(&self, stick: &Stick, ideal: &dyn Fn([f64; 2]) -> Result<[f64; 2]>) -> Result<Inputs> {
        let ratio = self.ratio(stick.length.unit);
        let mut inputs = vec![(stick.length.value * ratio, stick.length.error * ratio)];
        for end in [stick.from, stick.to] {
            inputs.extend(ideal(end)?.map(|v| (v, stick.click_error_px)));
        }
        Ok(inputs)
    }

    fn of_target(&self, target: &TargetSize, boxes: &[[f64; 2]]) -> Result<Inputs> {
        let ratio = self.ratio(target.size.unit);
        Ok(vec![(target.size.value * ratio, target.size.error * ratio), target.in_pixels(boxes)?])
    }

    fn of_plane(&self, plane: &Plane, ideal: &dyn Fn([f64; 2]) -> Result<[f64; 2]>) -> Result<(Inputs, RulerFacts)> {
        let pixels: Vec<[f64; 2]> = plane.pixels().into_iter().map(ideal).collect::<Result<_>>()?;
        let ratio = self.ratio(plane.unit);
        let places: Vec<[f64; 2]> = plane.places().iter().map(|p| p.map(|v| v * ratio)).collect();
        let map = Homography::fitted(&pixels, &places).ok_or_else(no_plane)?;
        let back = map.inverse().ok_or_else(no_plane)?;
        let mut facts = self.facts("plane");
        let mut square = 0.0;
        for (pixel, place) in pixels.iter().zip(&places) {
            let seen = back.apply(*place).ok_or_else(no_plane)?;
            let apart = (seen[0] - pixel[0]).hypot(seen[1] - pixel[1]);
            square += apart * apart;
            facts.residuals_px.push(apart);
        }
        // With more points than a plane needs, what is left over says how good the clicks were.
        let spare = 2 * pixels.len() as i64 - 8;
        let found = if spare > 0 { (square / spare as f64).sqrt() } else { 0.0 };
        if spare == 0 {
            facts
                .warnings
                .push("four points fit any plane, so that nothing says whether they are right; a fifth would".into());
        } else if found > 2.0 * plane.click_error_px.max(0.5) {
            let worst = facts.residuals_px.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1));
            let (worst, apart) = worst.map_or((0, 0.0), |(i, r)| (i + 1, *r));
            facts.warnings.push(format!(
                "the plane's points do not fit: they are {found:.1} px off, point {worst} most ({apart:.1} px); look at their places, click that one anew, or give the camera's distortion"
            ));
        }
        let click = plane.click_error_px.max(found);
        let mut inputs = Vec::new();
        for (pixel, place) in pixels.iter().zip(&places) {
            inputs.extend(pixel.map(|v| (v, click)));
            inputs.extend(place.map(|v| (v, plane.error * ratio)));
        }
        Ok((inputs, facts))
    }

    fn of_axes(&self, ideal: &dyn Fn([f64; 2]) -> Result<[f64; 2]>) -> Result<Inputs> {
        let Axes { origin, toward, click_error_px, .. } = self.calibration.axes;
        // In pixels nothing is uncertain: a pixel is a pixel.
        let error = if self.unit == Unit::Pixel { 0.0 } else { click_error_px };
        let mut inputs = Vec::new();
        for point in [origin, toward].into_iter().flatten() {
            inputs.extend(ideal(point)?.map(|v| (v, error)));
        }
        Ok(inputs)
    }

    /// The map made of `inputs`: `own` of the ruler, then those of the axes.
    fn map(&self, inputs: &[f64], own: usize) -> Result<Matrix3<f64>> {
        let (ruler, axes) = inputs.split_at_checked(own).unwrap_or((inputs, &[]));
        let flipped = Matrix3::new(1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 1.0);
        let scaled = |s: f64| Matrix3::new(s, 0.0, 0.0, 0.0, s, 0.0, 0.0, 0.0, 1.0);
        let metric = match (&self.calibration.plane, ruler) {
            (Some(_), _) => {
                let (pixels, places): (Vec<[f64; 2]>, Vec<[f64; 2]>) =
                    ruler.as_chunks::<4>().0.iter().map(|[a, b, c, d]| ([*a, *b], [*c, *d])).unzip();
                Homography::fitted(&pixels, &places).ok_or_else(no_plane)?.0
            }
            (None, &[length, ax, ay, bx, by]) => scaled(length / (bx - ax).hypot(by - ay)) * flipped,
            (None, &[length, pixels]) => scaled(length / pixels) * flipped,
            (None, _) => flipped,
        };
        // The axes are laid on what the ruler made, where lengths are true and y goes up.
        let seen = |at: [f64; 2]| Homography(metric).apply(at).ok_or_else(|| off_plane(at));
        let placing = match *axes {
            [ox, oy, tx, ty] => crate::calibration::axes_placed(seen([ox, oy])?, Some(seen([tx, ty])?), None),
            [ox, oy] => crate::calibration::axes_placed(seen([ox, oy])?, None, self.calibration.axes.angle_deg),
            _ => crate::calibration::axes_placed([0.0, 0.0], None, self.calibration.axes.angle_deg),
        };
        let down = self.calibration.plane.is_none() && self.calibration.axes.up == Up::Down;
        Ok(if down { flipped * placing * metric } else { placing * metric })
    }
}

fn no_plane() -> MeasuringError {
    MeasuringError::Ruler(
        "the points make no plane that a camera could see; look whether two of them were swapped".into(),
    )
}

fn off_plane(at: [f64; 2]) -> MeasuringError {
    MeasuringError::Ruler(format!("{at:?} lies at or above the horizon of the plane; click the axes on the plane"))
}

/// As few changes as do the same as all of them: the roots of the sum of their squares.
fn gathered(changes: &[Matrix3<f64>], calibration: &Calibration) -> Vec<Matrix3<f64>> {
    if changes.len() <= 8 || calibration.plane.is_none() {
        return changes.to_vec();
    }
    // The map's numbers are of very different sizes: each row is scaled to 1.
    let rows = |c: &Matrix3<f64>| SVector::<f64, 9>::from_iterator(c.iter().copied());
    let sizes = changes.iter().fold(SVector::<f64, 9>::zeros(), |sum, c| sum + rows(c).component_mul(&rows(c)));
    let sizes = sizes.map(|s| if s > 0.0 { s.sqrt() } else { 1.0 });
    let gram = changes.iter().fold(SMatrix::<f64, 9, 9>::zeros(), |sum, c| {
        let row = rows(c).component_div(&sizes);
        sum + row * row.transpose()
    });
    let eigen = SymmetricEigen::new(gram);
    let most = eigen.eigenvalues.max();
    let kept = (0..9).filter(|i| eigen.eigenvalues[*i] > 1e-12 * most);
    kept.map(|i| {
        let column = (eigen.eigenvectors.column(i) * eigen.eigenvalues[i].sqrt()).component_mul(&sizes);
        Matrix3::from_iterator(column.iter().copied())
    })
    .collect()
}
