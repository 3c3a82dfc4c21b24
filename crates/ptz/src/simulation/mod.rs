//! Simulated heads, cameras and walkers, so that a whole loop runs in a test: deterministic functions of their parameters
//! and a seed.

mod camera;
mod closed_loop;
mod drone;
mod figures;
mod grid;
mod head;
mod looking;
mod params;
mod random;
mod study;
mod walker;
mod wave;
mod worlds;

pub use camera::{Exposure, SimulatedCamera};
pub use closed_loop::{Eye, NoisyEye, Sample, Simulation, run};
pub use drone::{Drone, DroneParams, Flight, GimbalYaw};
pub use figures::{Figures, overshoot, wandering_deg};
pub use grid::{Cell, Grid, Pair};
pub use head::SimulatedHead;
pub use looking::TrackingEye;
pub use params::{CameraParams, HeadParams, StatusHonesty, StatusParams};
pub use study::{Contender, Study};
pub use walker::{Walk, Walker};
pub use worlds::{Panorama, Rendered, WideClip, World};
