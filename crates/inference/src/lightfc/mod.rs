//! LightFC (Li et al. 2024, arXiv:2310.05392; github.com/LiYunfengLYF/LightFC, MIT), written out: its layers as code, its weights as
//! whole numbers of eight bits with a scale a filter, which hold the released ones without loss.

mod engine;
mod head;

use crate::written::WrittenOut;

/// LightFC and a template.
///
/// The images have red, green and blue, normalised; the template's features are 96 × 8 × 8 numbers. The scores are the probability of each
/// point (16 × 16), the boxes width and height by the side of the image and the middle relative to the point in points, across and
/// down (4 × 16 × 16).
pub type LightFc = WrittenOut<engine::Engine>;
