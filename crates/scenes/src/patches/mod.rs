//! Textured patches over textured backgrounds: the scenes on which any tracker is tried.

mod paint;
mod scenarios;
mod world;

pub(crate) use scenarios::*;
