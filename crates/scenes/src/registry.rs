use crate::keys::{Key, SceneParams, Scenery};
use crate::{Scene, SceneError, patches, surround, table_tennis};

/// A scene that can be asked for by name.
pub struct SceneEntry {
    /// The name.
    pub name: &'static str,
    /// One line: what happens and what it tries.
    pub summary: &'static str,
    /// What can be set.
    pub keys: &'static [Key],
    pub(crate) build: fn(&Scenery) -> Box<dyn Scene>,
}

/// All scenes, in the order in which they are listed.
pub static SCENES: &[SceneEntry] = &[
    SceneEntry {
        name: "table-tennis",
        summary: "a yellow ball bounces on a table: blur, shadow, a hand that hides it, dimmed light, like-coloured balls",
        keys: table_tennis::KEYS,
        build: table_tennis::build,
    },
    SceneEntry {
        name: "drift",
        summary: "a textured patch moves smoothly over a textured background",
        keys: patches::DRIFT_KEYS,
        build: patches::drift,
    },
    SceneEntry {
        name: "scale-ramp",
        summary: "the patch drifts while its size changes steadily",
        keys: patches::SCALE_RAMP_KEYS,
        build: patches::scale_ramp,
    },
    SceneEntry {
        name: "occluding-bar",
        summary: "the patch passes to and fro behind a bar that hides it wholly",
        keys: patches::OCCLUDING_BAR_KEYS,
        build: patches::occluding_bar,
    },
    SceneEntry {
        name: "lighting-step",
        summary: "the light drops from one frame to the next, halfway through",
        keys: patches::LIGHTING_STEP_KEYS,
        build: patches::lighting_step,
    },
    SceneEntry {
        name: "camera-pan",
        summary: "the camera sweeps and shakes while the patch moves",
        keys: patches::CAMERA_PAN_KEYS,
        build: patches::camera_pan,
    },
    SceneEntry {
        name: "look-alike",
        summary: "a second patch of almost the same texture passes close by",
        keys: patches::LOOK_ALIKE_KEYS,
        build: patches::look_alike,
    },
    SceneEntry {
        name: "low-frame-rate",
        summary: "few frames a second: the patch moves by most of its size between frames",
        keys: patches::LOW_FRAME_RATE_KEYS,
        build: patches::low_frame_rate,
    },
    SceneEntry {
        name: "leave-and-return",
        summary: "the patch vanishes for 80 frames and returns 280 px away",
        keys: patches::LEAVE_AND_RETURN_KEYS,
        build: patches::leave_and_return,
    },
    SceneEntry {
        name: "motion",
        summary: "the patch moves on a line, turns, stops and goes, or the camera jumps: for comparing motion models",
        keys: patches::MOTION_KEYS,
        build: patches::motion,
    },
    SceneEntry {
        name: "depth-occluder",
        summary: "with depth in millimetres: something nearer passes before the patch; the depth has holes and shadows",
        keys: patches::DEPTH_OCCLUDER_KEYS,
        build: patches::depth_occluder,
    },
    SceneEntry {
        name: "rgbd-occlusion",
        summary: "with depth: one patch, one occlusion by something nearer, at true depths, in any light",
        keys: patches::RGBD_OCCLUSION_KEYS,
        build: patches::rgbd_occlusion,
    },
    SceneEntry {
        name: "person",
        summary: "a fixed camera: somebody comes in, stands, and leaves; light, door and shadow to mislead",
        keys: surround::PERSON_KEYS,
        build: surround::person,
    },
    SceneEntry {
        name: "people",
        summary: "several people walk to and fro at different distances and cover each other",
        keys: surround::PEOPLE_KEYS,
        build: surround::people,
    },
    SceneEntry {
        name: "wide-world",
        summary: "somebody, or a ball, goes to and fro far beyond the picture: to be followed by turning the camera",
        keys: surround::WIDE_WORLD_KEYS,
        build: surround::wide_world,
    },
    SceneEntry {
        name: "crowd",
        summary: "many patches, each wandering about its own part of a large picture",
        keys: patches::CROWD_KEYS,
        build: patches::crowd,
    },
    SceneEntry {
        name: "static",
        summary: "nothing moves; only the sensor's noise changes",
        keys: patches::STATIC_KEYS,
        build: patches::motionless,
    },
];

/// The entry of the scene `name`.
///
/// # Errors
/// [`SceneError::UnknownScene`], which lists all names.
pub fn find(name: &str) -> Result<&'static SceneEntry, SceneError> {
    SCENES.iter().find(|e| e.name == name).ok_or_else(|| {
        let known = SCENES.iter().map(|e| e.name).collect::<Vec<_>>().join(", ");
        SceneError::UnknownScene { name: name.to_owned(), known }
    })
}

/// A key's range in few words.
fn range(key: &Key) -> String {
    match key.choices {
        [] => format!("{} to {}", key.min, key.max),
        words => words.join("|"),
    }
}

impl SceneEntry {
    /// Makes the scene.
    pub(crate) fn scene(&self, seed: u64, params: &SceneParams) -> Result<Box<dyn Scene>, SceneError> {
        params.keys().try_for_each(|name| self.key(name).map(drop))?;
        Ok((self.build)(&Scenery::new(self.name, self.keys, seed, params)?))
    }

    /// The key `name` of this scene.
    ///
    /// # Errors
    /// [`SceneError::UnknownKey`], which lists all keys.
    pub fn key(&self, name: &str) -> Result<&'static Key, SceneError> {
        self.keys.iter().find(|k| k.name == name).ok_or_else(|| {
            let list = |k: &Key| format!("{} ({}, default {})", k.name, range(k), k.default_text());
            let known =
                std::iter::once("seed".to_owned()).chain(self.keys.iter().map(list)).collect::<Vec<_>>().join(", ");
            SceneError::UnknownKey { scene: self.name.to_owned(), key: name.to_owned(), known }
        })
    }
}
