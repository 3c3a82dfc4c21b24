//! Everything that looks: features, appearance models, correlation filters, and every tracker and detector, each a short
//! file of parameters and assembly, in one [`registry`].

pub mod acpf;
pub mod appearance;
pub mod ball;
pub mod correlation;
pub mod depth;
pub mod depth_occlusion;
pub mod detectors;
pub mod dsst;
pub mod features;
pub mod flow;
pub mod kcf;
pub mod mosse;
pub mod nanotrack;
pub mod person;
pub mod pursuit;
pub mod registry;
pub mod regularised;
pub mod runtime;
pub mod siamese;
pub mod staple;
pub mod tld;
