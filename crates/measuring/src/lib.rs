//! From the pixels of a followed target to metres and metres per second, each with its standard deviation.
//!
//! A [`Calibration`] says how pixels become lengths: a stick, a known size, a plane seen obliquely, a camera with distortion,
//! origin and axes. It makes a [`Ruler`], which knows how uncertain it is. [`measure`] takes the [`Track`] of a target and
//! says where it truly was, how fast, and how it was accelerated: by the two-pass smoother of `pursuit-estimation`, whose
//! noises are found from the track itself, or by Savitzky and Golay's polynomials, or by raw differences. [`events`] and
//! [`fits`] are made of that. Lengths are in the unit chosen, times in seconds, angles in degrees; pixels are continuous,
//! x right and y down, as everywhere in `pursuit`.
//!
//! ```
//! use pursuit_measuring::{Calibration, Options, Ruler, Sighting, Track, measure};
//!
//! # fn main() -> pursuit_measuring::Result<()> {
//! // A stick of half a metre lies in the picture from (100, 400) to (600, 400): a pixel is a millimetre.
//! let calibration = Calibration::from_toml("stick = { from = [100.0, 400.0], to = [600.0, 400.0], length = '0.50m' }")?;
//! let ruler = Ruler::new(&calibration, &[])?;
//! // Something falls with 9.81 m/s², seen 60 times a second.
//! let seen = (0..40_u64).map(|k| {
//!     let time_s = k as f64 / 60.0;
//!     Sighting { frame: k, time_s, at: Some([300.0, 50.0 + 0.5 * 9810.0 * time_s * time_s]), size: None }
//! });
//! let measured = measure(&Track { target: 1, sightings: seen.collect() }, &ruler, &Options::default())?;
//! let middle = measured.moments[20].state.as_ref().ok_or_else(|| unreachable!())?;
//! assert!((middle.acceleration()[1] + 9.81).abs() < 0.1);
//! # Ok(())
//! # }
//! ```

pub mod calibration;
pub mod camera;
mod error;
pub mod events;
pub mod fits;
mod homography;
pub mod kinematics;
mod ruler;
mod table;
mod units;

pub use calibration::Calibration;
pub use camera::Camera;
pub use error::{MeasuringError, Result};
pub use homography::Homography;
pub use kinematics::{How, Measured, Method, Moment, Options, Sighting, State, Track, measure};
pub use ruler::{Ruler, RulerFacts};
pub use table::{Cells, Column, Table, between, events_table, kinematics_table, stays_table};
pub use units::{Length, Unit};
