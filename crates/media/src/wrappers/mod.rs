//! Sources around sources: they compose, and each does one thing.

mod faulty;
mod prefetch;
mod reconnecting;
mod recorded;
mod retimed;
mod strided;
mod throttled;
mod trimmed;
mod with_depth;

pub use faulty::{Faults, Faulty};
pub use prefetch::{Prefetch, PrefetchStats};
pub use reconnecting::{Connect, Patience, Reconnect, Reconnecting, StreamCounts, StreamStats};
pub use recorded::{Recorded, write_png};
pub use retimed::Retimed;
pub use strided::Strided;
pub use throttled::Throttled;
pub use trimmed::Trimmed;
pub use with_depth::WithDepth;
