//! The arithmetic of detectors of objects: a network sees the whole frame, fitted into its image, and proposes boxes with a
//! score for each class; what it answers is decoded here, and of boxes that overlap the best is kept.
//!
//! The default is YOLOX (Ge et al. 2021, arXiv:2107.08430; `yolox/data/data_augment.py`, `preproc`, and
//! `yolox/utils/demo_utils.py`, `demo_postprocess`). What another network does otherwise stands in a [`DetectionConfig`], which its
//! file and its answers say where it is one of a known [`Family`], and a description beside it where not.

mod classes;
mod config;
mod decode;
mod detector;
mod letterbox;
mod names;
mod recognised;
mod suppression;

pub use classes::COCO;
pub use config::{BoxCoding, Description, DetectionConfig, Family, Placing, ScoreCoding};
pub use decode::Object;
pub use detector::{Limits, ObjectDetector};
pub use letterbox::Letterbox;
pub use suppression::suppress;
