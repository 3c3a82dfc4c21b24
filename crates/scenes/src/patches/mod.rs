//! Textured patches over textured backgrounds: the scenes on which any tracker is tried.

mod depth;
mod keys;
mod motions;
mod occlusion;
mod paint;
mod scenarios;
mod world;

pub(crate) use keys::*;
pub(crate) use motions::{depth_occluder, motion};
pub(crate) use occlusion::rgbd_occlusion;
pub(crate) use scenarios::*;
