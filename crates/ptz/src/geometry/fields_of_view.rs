use super::{Distortion, Lens};
use crate::Result;
use crate::error::require;
use pursuit_geometry::Size;
use serde::{Deserialize, Serialize};

/// A measured angle of view.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FieldOfView {
    /// Zoom position in `[0, 1]`.
    pub zoom: f64,
    /// Half the horizontal angle of view there, degrees, in (0, 85].
    pub half_fov_x_deg: f64,
}

/// How the angle of view depends on the zoom: a measured table, from wide to long.
///
/// Between two entries the focal length (the inverse of the tangent of half the angle) changes geometrically, as zoom
/// drives are usually geared; outside of the table the nearest entry holds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(remote = "FieldsOfView", deny_unknown_fields)]
pub struct FieldsOfView {
    table: Vec<FieldOfView>,
    #[serde(default)]
    distortion: Distortion,
}

pursuit_estimation::checked!(FieldsOfView);

impl FieldsOfView {
    fn restored(self) -> Result<Self> {
        Ok(Self::new(self.table)?.with_distortion(self.distortion))
    }
}

impl FieldsOfView {
    /// The most entries a table may have.
    pub const MAX_ENTRIES: usize = 1024;

    /// A table of measured angles.
    ///
    /// # Errors
    /// Unless zooms lie in `[0, 1]` and grow strictly, and angles lie in (0, 85] and fall strictly; without entries.
    pub fn new(table: Vec<FieldOfView>) -> Result<Self> {
        let entries = table.len();
        require("entries", entries as f64, (1..=Self::MAX_ENTRIES).contains(&entries), "between 1 and 1024")?;
        for entry in &table {
            require("zoom", entry.zoom, (0.0..=1.0).contains(&entry.zoom), "between 0 and 1")?;
            let angle = entry.half_fov_x_deg;
            require("half_fov_x_deg", angle, angle > 0.0 && angle <= 85.0, "above 0 and at most 85 degrees")?;
        }
        for (wider, longer) in table.iter().zip(table.iter().skip(1)) {
            require("zoom", longer.zoom, longer.zoom > wider.zoom, "above that of the entry before it")?;
            let (angle, before) = (longer.half_fov_x_deg, wider.half_fov_x_deg);
            require("half_fov_x_deg", angle, angle < before, "below that of the entry before it")?;
        }
        Ok(Self { table, distortion: Distortion::NONE })
    }

    /// A camera without zoom.
    ///
    /// # Errors
    /// Where the angle is not in (0, 85].
    pub fn fixed(half_fov_x_deg: f64) -> Result<Self> {
        Self::new(vec![FieldOfView { zoom: 0.0, half_fov_x_deg }])
    }

    /// The same with a distortion, taken to be the same at every zoom.
    #[must_use]
    pub const fn with_distortion(mut self, distortion: Distortion) -> Self {
        self.distortion = distortion;
        self
    }

    /// The measured entries.
    pub fn table(&self) -> &[FieldOfView] {
        &self.table
    }

    /// Whether the camera can zoom.
    pub const fn can_zoom(&self) -> bool {
        self.table.len() > 1
    }

    /// Half the horizontal angle of view at `zoom`, degrees.
    pub fn half_fov_x_deg(&self, zoom: f64) -> f64 {
        self.interpolate(zoom, |e| e.zoom, log_focal, |log_focal| (-log_focal).exp().atan().to_degrees())
    }

    /// The zoom at which half the horizontal angle of view is `half_fov_x_deg`, or the nearest there is.
    pub fn zoom_of(&self, half_fov_x_deg: f64) -> f64 {
        let wanted = -half_fov_x_deg.clamp(1e-6, 85.0).to_radians().tan().ln();
        self.interpolate(wanted, log_focal, |e| e.zoom, |zoom| zoom)
    }

    /// The lens at `zoom` for pictures of `size`.
    ///
    /// # Errors
    /// Where the picture has no pixels.
    pub fn lens(&self, zoom: f64, size: Size) -> Result<Lens> {
        Ok(Lens::new(size, self.half_fov_x_deg(zoom))?.with_distortion(self.distortion))
    }

    /// The straight line between the two entries about `at`; `x` grows along the table.
    fn interpolate(
        &self,
        at: f64,
        x: impl Fn(&FieldOfView) -> f64,
        y: impl Fn(&FieldOfView) -> f64,
        finish: impl Fn(f64) -> f64,
    ) -> f64 {
        let above = self.table.iter().position(|entry| x(entry) >= at).unwrap_or(self.table.len() - 1);
        let (Some(high), Some(low)) = (self.table.get(above), self.table.get(above.saturating_sub(1))) else {
            return f64::NAN;
        };
        let span = x(high) - x(low);
        let part = if span > 0.0 { ((at - x(low)) / span).clamp(0.0, 1.0) } else { 0.0 };
        finish(y(low) + part * (y(high) - y(low)))
    }
}

/// The logarithm of the focal length in half widths of the picture.
fn log_focal(entry: &FieldOfView) -> f64 {
    -entry.half_fov_x_deg.to_radians().tan().ln()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(entries: &[(f64, f64)]) -> Result<FieldsOfView> {
        FieldsOfView::new(entries.iter().map(|&(zoom, half_fov_x_deg)| FieldOfView { zoom, half_fov_x_deg }).collect())
    }

    #[test]
    fn entries_are_met_and_between_them_the_focal_length_is_geometric() {
        let views = table(&[(0.0, 30.0), (0.5, 10.0), (1.0, 2.0)]).unwrap();
        for (zoom, angle) in [(0.0, 30.0), (0.5, 10.0), (1.0, 2.0), (-1.0, 30.0), (7.0, 2.0)] {
            assert!((views.half_fov_x_deg(zoom) - angle).abs() < 1e-12, "{zoom}");
        }
        let tangent = |zoom: f64| views.half_fov_x_deg(zoom).to_radians().tan();
        assert!((tangent(0.25) - (tangent(0.0) * tangent(0.5)).sqrt()).abs() < 1e-12);
        assert!(views.can_zoom() && !FieldsOfView::fixed(30.0).unwrap().can_zoom());
    }

    #[test]
    fn zooms_and_angles_are_inverse_and_clamped() {
        let views = table(&[(0.1, 30.0), (0.5, 10.0), (0.9, 2.0)]).unwrap();
        for zoom in [0.1, 0.2, 0.5, 0.77, 0.9] {
            assert!((views.zoom_of(views.half_fov_x_deg(zoom)) - zoom).abs() < 1e-12);
        }
        assert_eq!(views.zoom_of(60.0), 0.1);
        assert_eq!(views.zoom_of(0.0), 0.9);
        assert!((FieldsOfView::fixed(20.0).unwrap().half_fov_x_deg(0.6) - 20.0).abs() < 1e-12);
    }

    #[test]
    fn tables_that_make_no_sense_are_refused() {
        for entries in [
            &[][..],
            &[(0.0, 30.0), (0.0, 20.0)],
            &[(0.0, 30.0), (1.0, 30.0)],
            &[(0.0, 0.0)],
            &[(1.5, 30.0)],
            &[(-0.5, 30.0)],
            &[(f64::NAN, 30.0)],
            &[(0.0, 86.0)],
        ] {
            assert!(table(entries).is_err(), "{entries:?}");
        }
        assert!(FieldsOfView::new(vec![FieldOfView { zoom: 0.0, half_fov_x_deg: 1.0 }; 2000]).is_err());
    }

    #[test]
    fn tables_are_read_with_their_checks() {
        let text = "distortion = { k1 = -0.1 }\ntable = [{ zoom = 0.0, half_fov_x_deg = 30.0 }, { zoom = 1.0, half_fov_x_deg = 3.0 }]";
        let views: FieldsOfView = toml::from_str(text).unwrap();
        assert_eq!(views.table()[1].half_fov_x_deg, 3.0);
        let lens = views.lens(0.0, Size::new(320, 240)).unwrap();
        assert!(lens.offset(pursuit_geometry::Point::new(320.0, 120.0)).0 > 30f64.to_radians().tan());
        assert!(toml::from_str::<FieldsOfView>("table = []").is_err());
        let back: FieldsOfView = serde_json::from_str(&serde_json::to_string(&views).unwrap()).unwrap();
        assert_eq!(back, views);
    }
}
