use crate::query::SceneParams;
use crate::{Scene, SceneError, patches, table_tennis};

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

/// A number that can be set in a scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Key {
    /// The name.
    pub name: &'static str,
    /// What it means, with its unit.
    pub help: &'static str,
    /// Value when not given.
    pub default: f64,
    /// Smallest value.
    pub min: f64,
    /// Largest value.
    pub max: f64,
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

impl SceneEntry {
    /// The key `name` of this scene.
    ///
    /// # Errors
    /// [`SceneError::UnknownKey`], which lists all keys.
    pub fn key(&self, name: &str) -> Result<&'static Key, SceneError> {
        self.keys.iter().find(|k| k.name == name).ok_or_else(|| {
            let list = |k: &Key| format!("{} ({} to {}, default {})", k.name, k.min, k.max, k.default);
            let known =
                std::iter::once("seed".to_owned()).chain(self.keys.iter().map(list)).collect::<Vec<_>>().join(", ");
            SceneError::UnknownKey { scene: self.name.to_owned(), key: name.to_owned(), known }
        })
    }
}

impl Key {
    pub(crate) fn bad_value(&self, scene: &str, value: &str) -> SceneError {
        SceneError::BadValue {
            scene: scene.to_owned(),
            key: self.name.to_owned(),
            value: value.to_owned(),
            help: self.help,
            min: self.min,
            max: self.max,
        }
    }
}

/// What a scene is built from: its seed and checked values.
pub(crate) struct Scenery {
    /// The seed.
    pub(crate) seed: u64,
    values: Vec<(&'static str, f64)>,
}

impl Scenery {
    /// Checks `params` against the entry's keys.
    pub(crate) fn new(entry: &'static SceneEntry, seed: u64, params: &SceneParams) -> Result<Self, SceneError> {
        let mut values: Vec<_> = entry.keys.iter().map(|k| (k.name, k.default)).collect();
        for (name, &value) in params {
            let key = entry.key(name)?;
            if !(key.min..=key.max).contains(&value) {
                return Err(key.bad_value(entry.name, &value.to_string()));
            }
            values.iter_mut().filter(|(n, _)| n == name).for_each(|(_, v)| *v = value);
        }
        Ok(Self { seed, values })
    }

    /// The value of the key `name`; zero for a key that the scene does not have (a scene without bars has bar 0).
    pub(crate) fn get(&self, name: &str) -> f64 {
        self.values.iter().find(|(n, _)| *n == name).map_or(0.0, |(_, v)| *v)
    }
}
