use crate::error::require;
use crate::{Direction, PtzError, Result};
use serde::{Deserialize, Serialize};

/// What one axis of a head can do.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Raw", into = "Raw")]
pub struct AxisLimits {
    /// Greatest speed, above 0, degrees per second.
    pub max_speed_deg_s: f64,
    /// Greatest acceleration, above 0, degrees per second².
    pub max_acceleration_deg_s2: f64,
    /// The lower end of the travel, degrees.
    pub min_deg: f64,
    /// The upper end of the travel, degrees.
    pub max_deg: f64,
    /// How far the motor turns after a reversal before the camera follows, 0 or more, degrees.
    pub backlash_deg: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename = "AxisLimits")]
struct Raw {
    max_speed_deg_s: f64,
    max_acceleration_deg_s2: f64,
    min_deg: f64,
    max_deg: f64,
    backlash_deg: f64,
}

impl Default for Raw {
    fn default() -> Self {
        AxisLimits::PAN.into()
    }
}

impl From<AxisLimits> for Raw {
    fn from(of: AxisLimits) -> Self {
        let AxisLimits { max_speed_deg_s, max_acceleration_deg_s2, min_deg, max_deg, backlash_deg } = of;
        Self { max_speed_deg_s, max_acceleration_deg_s2, min_deg, max_deg, backlash_deg }
    }
}

impl TryFrom<Raw> for AxisLimits {
    type Error = PtzError;

    fn try_from(raw: Raw) -> Result<Self> {
        let Raw { max_speed_deg_s, max_acceleration_deg_s2, min_deg, max_deg, backlash_deg } = raw;
        let limits = Self { max_speed_deg_s, max_acceleration_deg_s2, min_deg, max_deg, backlash_deg };
        limits.check()?;
        Ok(limits)
    }
}

impl AxisLimits {
    /// A common pan axis: 60°/s, 120°/s², ±170°, no play.
    pub const PAN: Self = Self {
        max_speed_deg_s: 60.0,
        max_acceleration_deg_s2: 120.0,
        min_deg: -170.0,
        max_deg: 170.0,
        backlash_deg: 0.0,
    };

    /// A common tilt axis: 60°/s, 120°/s², −30° to 90°, no play.
    pub const TILT: Self = Self { min_deg: -30.0, max_deg: 90.0, ..Self::PAN };

    /// Refuses limits with which nothing can move.
    ///
    /// # Errors
    /// Where a number is out of its range.
    pub fn check(&self) -> Result<()> {
        let Self { max_speed_deg_s: speed, max_acceleration_deg_s2: acceleration, .. } = *self;
        require("max_speed_deg_s", speed, speed > 0.0 && speed <= 1e4, "above 0 and at most 10000")?;
        let sound = acceleration > 0.0 && acceleration <= 1e6;
        require("max_acceleration_deg_s2", acceleration, sound, "above 0 and at most 1000000")?;
        require("min_deg", self.min_deg, self.min_deg.abs() <= 1e6, "a finite angle")?;
        let sound = self.max_deg > self.min_deg && self.max_deg <= 1e6;
        require("max_deg", self.max_deg, sound, "above `min_deg`")?;
        require("backlash_deg", self.backlash_deg, (0.0..=10.0).contains(&self.backlash_deg), "between 0 and 10")
    }
}

/// What a head can do.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct HeadLimits {
    /// The pan axis.
    pub pan: AxisLimits,
    /// The tilt axis.
    pub tilt: AxisLimits,
    /// How much of its range the zoom travels in a second, above 0.
    pub zoom_per_s: f64,
}

impl Default for HeadLimits {
    fn default() -> Self {
        Self { pan: AxisLimits::PAN, tilt: AxisLimits::TILT, zoom_per_s: 0.3 }
    }
}

impl HeadLimits {
    /// Refuses limits with which nothing can move.
    ///
    /// # Errors
    /// Where a number is out of its range.
    pub fn check(&self) -> Result<()> {
        self.pan.check()?;
        self.tilt.check()?;
        require(
            "zoom_per_s",
            self.zoom_per_s,
            self.zoom_per_s > 0.0 && self.zoom_per_s <= 100.0,
            "above 0, at most 100",
        )
    }

    /// The nearest direction that the head can look to.
    pub fn reachable(&self, direction: Direction) -> Direction {
        let pan = direction.pan_deg.clamp(self.pan.min_deg, self.pan.max_deg);
        Direction::new(pan, direction.tilt_deg.clamp(self.tilt.min_deg, self.tilt.max_deg))
    }

    /// The zoom as an axis of its own, in units of its range.
    pub(crate) const fn zoom_axis(&self) -> AxisLimits {
        AxisLimits {
            max_speed_deg_s: self.zoom_per_s,
            max_acceleration_deg_s2: self.zoom_per_s * 20.0,
            min_deg: 0.0,
            max_deg: 1.0,
            backlash_deg: 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_read_with_their_checks() {
        let limits: HeadLimits = toml::from_str("pan = { max_speed_deg_s = 20 }\ntilt = { min_deg = -90 }").unwrap();
        assert_eq!(limits.pan, AxisLimits { max_speed_deg_s: 20.0, ..AxisLimits::PAN });
        assert_eq!(limits.tilt.min_deg, -90.0);
        for bad in [
            "pan = { max_speed_deg_s = 0 }",
            "pan = { max_acceleration_deg_s2 = -1 }",
            "pan = { min_deg = 10, max_deg = 10 }",
            "tilt = { backlash_deg = -0.1 }",
            "tilt = { max_speed_deg_s = nan }",
            "pan = { speed = 3 }",
        ] {
            assert!(toml::from_str::<HeadLimits>(bad).is_err(), "{bad}");
        }
        assert!(HeadLimits::default().check().is_ok());
        assert!(HeadLimits { zoom_per_s: 0.0, ..HeadLimits::default() }.check().is_err());
        let tilt = AxisLimits { max_deg: f64::INFINITY, ..AxisLimits::TILT };
        assert!(HeadLimits { tilt, ..HeadLimits::default() }.check().is_err());
        let pan = AxisLimits { max_speed_deg_s: -1.0, ..AxisLimits::PAN };
        assert!(HeadLimits { pan, ..HeadLimits::default() }.check().is_err());
    }

    #[test]
    fn directions_out_of_reach_are_brought_to_the_end_of_the_travel() {
        let limits = HeadLimits::default();
        assert_eq!(limits.reachable(Direction::new(-200.0, 95.0)), Direction::new(-170.0, 90.0));
        assert_eq!(limits.reachable(Direction::new(12.0, -31.0)), Direction::new(12.0, -30.0));
    }
}
