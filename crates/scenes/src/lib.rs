//! Deterministic synthetic worlds with ground truth: pure functions of seed, time and view.
//!
//! A [`Scene`] is asked for a moment and answers with a picture and the truth about each target. Nothing is drawn from a
//! generator that has to be advanced: textures, paths and sensor noise are hashes of what they belong to, so moments can be
//! rendered in any order, on any thread, and always come out the same. [`scene`] and [`open`] make scenes by name;
//! [`SCENES`] lists them with their parameters. [`SceneSource`] makes one an input like any other. [`ball`] has trajectories without pictures.
//!
//! ```
//! let scene = pursuit_scenes::open("scene:drift?seed=7&size=24")?;
//! let moment = scene.render(scene.frame_time_s(10));
//! assert_eq!(moment.image.width(), 320);
//! assert_eq!(moment.targets[0].visible().map(|b| b.width()), Some(24.0));
//! # Ok::<(), pursuit_scenes::SceneError>(())
//! ```
//!
//! Scenes can be aimed, as a pan-tilt head aims a camera: [`Scene::render_view`] renders any [`View`], and says where the
//! targets are in it.
//!
//! ```
//! let scene = pursuit_scenes::open("scene:wide-world?seed=1&who=ball")?;
//! let walking = scene.render(3.0).targets[0];
//! assert!(walking.visible().is_none(), "it has left the picture");
//! let turned = scene.home().aimed(1.0, 0.0).ok_or("a tilt below a right angle")?;
//! assert!(scene.render_view(3.0, &turned).targets[0].visible().is_some(), "turned to the right, the camera sees it");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod ball;
mod compose;
mod error;
mod hash;
mod patches;
mod plan;
mod query;
mod registry;
mod scene;
mod source;
mod surround;
mod table_tennis;
mod texture;
mod view;

pub use error::SceneError;
pub use query::{SceneQuery, open, scene};
pub use registry::{SCENES, SceneEntry, find};
pub use scene::{Scene, SceneMoment, TargetTruth};
pub use source::SceneSource;
pub use view::View;
