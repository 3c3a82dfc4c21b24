//! Kernelized correlation filters: `kcf`, `kcf-fixed` and `csk` (henriques2015, henriques2012).

mod assembly;
mod filter;
mod kernel;
#[cfg(test)]
mod oracle;
mod params;

pub use assembly::{KcfAssembly, KcfFeatures, KcfTracker};
pub use filter::KernelFilter;
pub use kernel::Kernel;
pub use params::{CskParams, KcfFeatureKind, KcfFixedParams, KcfParams, KernelKind};
