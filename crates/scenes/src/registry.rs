use crate::patches::{self, params::*};
use crate::plan::{Built, Picture, Plan};
use crate::surround::{self, Lighting, People, Person, Walk, WideWorld};
use crate::table_tennis::{self, TableTennisParams};
use crate::{Scene, SceneError};
use pursuit_parameters::{Parameter, Table};

/// A scene that can be asked for by name.
pub struct SceneEntry {
    /// The name.
    pub name: &'static str,
    /// One line: what happens and what it tries.
    pub summary: &'static str,
    plan: &'static dyn Plan,
}

/// Patches at `speed`, in px/s.
fn at(speed: f64) -> Common {
    (Picture::default(), Patch::default(), Speed { speed })
}

/// The same in another picture.
fn within(picture: Picture, (_, patch, speed): Common) -> Common {
    (picture, patch, speed)
}

/// The picture of a scene that lasts `duration` seconds.
fn lasting(duration: f64) -> Picture {
    Picture { duration, ..Picture::default() }
}

/// A patch of `size` pixels.
fn sized(size: f64) -> Patch {
    Patch { size, ..Patch::default() }
}

/// The picture and the way of those who walk in the room.
fn walking() -> (Picture, Walk) {
    (surround::picture(), Walk::default())
}

/// All scenes, in the order in which they are listed.
pub static SCENES: &[SceneEntry] = &[
    SceneEntry {
        name: "table-tennis",
        summary: "a yellow ball bounces on a table: blur, shadow, a hand that hides it, dimmed light, like-coloured balls",
        plan: &Built { defaults: || TableTennisParams::default(), build: table_tennis::build },
    },
    SceneEntry {
        name: "drift",
        summary: "a textured patch moves smoothly over a textured background",
        plan: &Built { defaults: || Common::default(), build: patches::drift },
    },
    SceneEntry {
        name: "scale-ramp",
        summary: "the patch drifts while its size changes steadily",
        plan: &Built { defaults: || (at(25.0), ScaleRamp::default()), build: patches::scale_ramp },
    },
    SceneEntry {
        name: "occluding-bar",
        summary: "the patch passes to and fro behind a bar that hides it wholly",
        plan: &Built {
            defaults: || (within(lasting(6.0), at(80.0)), OccludingBar::default()),
            build: patches::occluding_bar,
        },
    },
    SceneEntry {
        name: "lighting-step",
        summary: "the light drops from one frame to the next, halfway through",
        plan: &Built { defaults: || (at(30.0), LightingStep::default()), build: patches::lighting_step },
    },
    SceneEntry {
        name: "camera-pan",
        summary: "the camera sweeps and shakes while the patch moves",
        plan: &Built { defaults: || (at(30.0), CameraPan::default()), build: patches::camera_pan },
    },
    SceneEntry {
        name: "look-alike",
        summary: "a second patch of almost the same texture passes close by",
        plan: &Built { defaults: || (at(20.0), Second::default(), LookAlike::default()), build: patches::look_alike },
    },
    SceneEntry {
        name: "low-frame-rate",
        summary: "few frames a second: the patch moves by most of its size between frames",
        plan: &Built { defaults: || within(Picture { fps: 6.0, ..lasting(10.0) }, at(130.0)), build: patches::drift },
    },
    SceneEntry {
        name: "leave-and-return",
        summary: "the patch vanishes for 80 frames and returns 280 px away",
        plan: &Built {
            defaults: || {
                (within(Picture { width: 400, ..lasting(7.0) }, at(30.0)), Second::default(), LeaveAndReturn::default())
            },
            build: patches::leave_and_return,
        },
    },
    SceneEntry {
        name: "motion",
        summary: "the patch moves on a line, turns, stops and goes, is thrown or swings, or the camera jumps: for comparing motion models",
        plan: &Built {
            defaults: || (within(Picture { width: 640, height: 360, ..lasting(5.0) }, at(110.0)), Motion::default()),
            build: patches::motion,
        },
    },
    SceneEntry {
        name: "depth-occluder",
        summary: "with depth in millimetres: something nearer passes before the patch; the depth has holes and shadows",
        plan: &Built {
            defaults: || {
                ((lasting(6.0), sized(40.0), Speed { speed: 25.0 }), Depth::default(), OccludingBar { bar: 70.0 })
            },
            build: patches::depth_occluder,
        },
    },
    SceneEntry {
        name: "rgbd-occlusion",
        summary: "with depth: one patch, one occlusion by something nearer, at true depths, in any light",
        plan: &Built {
            defaults: || {
                ((Picture::default(), sized(40.0), Speed { speed: 50.0 }), Depth::default(), RgbdOcclusion::default())
            },
            build: patches::rgbd_occlusion,
        },
    },
    SceneEntry {
        name: "person",
        summary: "a fixed camera: somebody comes in, stands, and leaves; light, door and shadow to mislead",
        plan: &Built { defaults: || (walking(), Lighting::default(), Person::default()), build: surround::person },
    },
    SceneEntry {
        name: "people",
        summary: "several people walk to and fro at different distances and cover each other",
        plan: &Built {
            defaults: || {
                (
                    (Picture { duration: 10.0, ..surround::picture() }, Walk { distance: 4.5, ..Walk::default() }),
                    Lighting::default(),
                    People::default(),
                )
            },
            build: surround::people,
        },
    },
    SceneEntry {
        name: "wide-world",
        summary: "somebody, or a ball, goes to and fro far beyond the picture: to be followed by turning the camera",
        plan: &Built {
            defaults: || {
                (
                    (
                        Picture { width: 320, height: 240, ..surround::picture() },
                        Walk { fov: 50.0, speed: 1.5, ..Walk::default() },
                    ),
                    WideWorld::default(),
                )
            },
            build: surround::wide_world,
        },
    },
    SceneEntry {
        name: "crowd",
        summary: "many patches, each wandering about its own part of a large picture",
        plan: &Built {
            defaults: || {
                (
                    (Picture { width: 1280, height: 720, ..Picture::default() }, sized(48.0), Speed::default()),
                    Crowd::default(),
                )
            },
            build: patches::crowd,
        },
    },
    SceneEntry {
        name: "static",
        summary: "nothing moves; only the sensor's noise changes",
        plan: &Built { defaults: || (Picture::default(), Patch::default()), build: patches::motionless },
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
    /// What can be set, with defaults; the seed is apart.
    pub fn schema(&self) -> Vec<Parameter> {
        self.plan.schema()
    }

    /// Makes the scene.
    pub(crate) fn scene(&self, seed: u64, params: &Table) -> Result<Box<dyn Scene>, SceneError> {
        Ok(self.plan.build(self.name, seed, params)?)
    }
}
