//! From parameters to a scene.

use crate::Scene;
use pursuit_parameters::{Parameter, ParameterError, Parameters, Table};

/// How a scene is made of its seed and its parameters.
pub(crate) trait Plan: Sync {
    /// The parameters with their defaults.
    fn schema(&self) -> Vec<Parameter>;

    /// Makes the scene `name` of `seed` with `changes` to the defaults.
    fn build(&self, name: &str, seed: u64, changes: &Table) -> Result<Box<dyn Scene>, ParameterError>;
}

/// A scene whose parameters are `P`.
pub(crate) struct Built<P> {
    /// The parameters unless others are given.
    pub(crate) defaults: fn() -> P,
    /// Makes the scene of a seed.
    pub(crate) build: fn(u64, &P) -> Box<dyn Scene>,
}

impl<P: Parameters> Plan for Built<P> {
    fn schema(&self) -> Vec<Parameter> {
        (self.defaults)().schema()
    }

    fn build(&self, name: &str, seed: u64, changes: &Table) -> Result<Box<dyn Scene>, ParameterError> {
        Ok((self.build)(seed, &(self.defaults)().with(name, changes)?))
    }
}

pursuit_parameters::parameters! {
    /// The camera's picture.
    pub struct Picture {
        /// The picture's width.
        pub width: usize = 320, in 64..=4096, unit "px";
        /// The picture's height.
        pub height: usize = 240, in 64..=4096, unit "px";
        /// The rate.
        pub fps: f64 = 30.0, in 1.0..=1000.0, unit "frames/s";
        /// The length.
        pub duration: f64 = 4.0, in 0.1..=3600.0, unit "s";
        /// The standard deviation of the sensor's noise.
        pub noise: f64 = 3.0, in 0.0..=80.0, unit "grey levels";
    }
}
