//! Textured patches over textured backgrounds: the scenes on which any tracker is tried.

mod depth;
mod motions;
mod occlusion;
mod paint;
pub(crate) mod params;
mod scenarios;
mod world;

pub(crate) use motions::{depth_occluder, motion};
pub(crate) use occlusion::rgbd_occlusion;
pub(crate) use scenarios::*;
