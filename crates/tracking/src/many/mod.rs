//! Many targets at once.

mod independent;

pub use independent::{TargetId, TargetSet};
