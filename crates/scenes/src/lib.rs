//! Deterministic synthetic worlds with ground truth: pure functions of seed and time.
//!
//! A [`Scene`] is asked for a moment and answers with a picture and the truth about each target. Nothing is drawn from a
//! generator that has to be advanced: textures, paths and sensor noise are hashes of what they belong to, so moments can be
//! rendered in any order, on any thread, and always come out the same. [`scene`] and [`open`] make scenes by name;
//! [`SCENES`] lists them. [`SceneSource`] makes one an input like
//! any other. [`ball`] has trajectories without pictures.
//!
//! ```
//! let scene = pursuit_scenes::open("scene:drift?seed=7&size=24")?;
//! let moment = scene.render(scene.frame_time_s(10));
//! assert_eq!(moment.image.width(), 320);
//! assert_eq!(moment.targets[0].visible().map(|b| b.width()), Some(24.0));
//! # Ok::<(), pursuit_scenes::SceneError>(())
//! ```

pub mod ball;
mod compose;
mod error;
mod hash;
mod patches;
mod query;
mod registry;
mod scene;
mod source;
mod table_tennis;
mod texture;

pub use error::SceneError;
pub use query::{SceneParams, SceneQuery, open, scene};
pub use registry::{Key, SCENES, SceneEntry, find};
pub use scene::{Scene, SceneMoment, TargetTruth};
pub use source::SceneSource;
