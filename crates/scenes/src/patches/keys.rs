//! What can be set in the scenes of patches.

use crate::keys::Key;

const WIDTH: Key = Key::number("width", "the picture's width in pixels", 320.0, 64.0, 4096.0);
const HEIGHT: Key = Key::number("height", "the picture's height in pixels", 240.0, 64.0, 4096.0);
const FPS: Key = Key::number("fps", "the rate in frames per second", 30.0, 1.0, 1000.0);
const DURATION: Key = Key::number("duration", "the length in seconds", 4.0, 0.1, 3600.0);
const SIZE: Key = Key::number("size", "the patch's side in pixels", 32.0, 4.0, 512.0);
const SPEED: Key = Key::number("speed", "the patch's usual speed in pixels per second", 60.0, 0.0, 5000.0);
const NOISE: Key = Key::number("noise", "the sensor noise's standard deviation in grey levels", 3.0, 0.0, 80.0);
const PLAIN: Key =
    Key::number("plain", "1 to paint the patch plain magenta, for checking truth against pixels", 0.0, 0.0, 1.0);
const DIFFERENCE: Key =
    Key::number("difference", "how much the second patch's texture differs, 0 not at all, 1 wholly", 0.25, 0.0, 1.0);

pub(crate) const DRIFT_KEYS: &[Key] = &[WIDTH, HEIGHT, FPS, DURATION, SIZE, SPEED, NOISE, PLAIN];
pub(crate) const SCALE_RAMP_KEYS: &[Key] = &[
    WIDTH,
    HEIGHT,
    FPS,
    DURATION,
    SIZE,
    Key { default: 25.0, ..SPEED },
    Key::number("growth", "the factor between the patch's first and last side", 2.5, 0.1, 10.0),
    NOISE,
    PLAIN,
];
pub(crate) const OCCLUDING_BAR_KEYS: &[Key] = &[
    WIDTH,
    HEIGHT,
    FPS,
    Key { default: 6.0, ..DURATION },
    SIZE,
    Key { default: 80.0, ..SPEED },
    Key::number("bar", "the bar's width in pixels", 60.0, 1.0, 400.0),
    NOISE,
    PLAIN,
];
pub(crate) const LIGHTING_STEP_KEYS: &[Key] = &[
    WIDTH,
    HEIGHT,
    FPS,
    DURATION,
    SIZE,
    Key { default: 30.0, ..SPEED },
    Key::number("gain", "the light's gain after the step", 0.5, 0.05, 2.0),
    NOISE,
    PLAIN,
];
pub(crate) const CAMERA_PAN_KEYS: &[Key] = &[
    WIDTH,
    HEIGHT,
    FPS,
    DURATION,
    SIZE,
    Key { default: 30.0, ..SPEED },
    Key::number("pan", "the camera's greatest speed in pixels per second", 120.0, 0.0, 600.0),
    Key::number("shake", "the camera's trembling in pixels", 1.5, 0.0, 20.0),
    NOISE,
    PLAIN,
];
pub(crate) const LOOK_ALIKE_KEYS: &[Key] = &[
    WIDTH,
    HEIGHT,
    FPS,
    DURATION,
    SIZE,
    Key { default: 20.0, ..SPEED },
    Key::number("gap", "the distance between the centres at the closest, in patch sides", 1.4, 0.0, 4.0),
    DIFFERENCE,
    NOISE,
    PLAIN,
];
pub(crate) const LOW_FRAME_RATE_KEYS: &[Key] = &[
    WIDTH,
    HEIGHT,
    Key { default: 6.0, ..FPS },
    Key { default: 10.0, ..DURATION },
    SIZE,
    Key { default: 130.0, ..SPEED },
    NOISE,
    PLAIN,
];
pub(crate) const LEAVE_AND_RETURN_KEYS: &[Key] = &[
    Key { default: 400.0, ..WIDTH },
    HEIGHT,
    FPS,
    Key { default: 7.0, ..DURATION },
    SIZE,
    Key { default: 30.0, ..SPEED },
    Key::number("leaves", "when the patch vanishes, in seconds", 2.0, 0.0, 3600.0),
    Key::number("absent", "how many frames it is gone", 80.0, 0.0, 10_000.0),
    Key::number("away", "how far away it returns, in pixels to the right", 280.0, -4000.0, 4000.0),
    Key::number(
        "look-alike",
        "1 for a patch of almost the same texture that stands near while it is gone",
        0.0,
        0.0,
        1.0,
    ),
    DIFFERENCE,
    NOISE,
    PLAIN,
];
pub(crate) const CROWD_KEYS: &[Key] = &[
    Key { default: 1280.0, ..WIDTH },
    Key { default: 720.0, ..HEIGHT },
    FPS,
    DURATION,
    Key {
        help: "the patches' usual side in pixels; they are between three fifths of it and once and a half",
        default: 48.0,
        ..SIZE
    },
    Key { help: "the patches' usual speed in pixels per second", ..SPEED },
    Key::number("targets", "how many patches there are", 20.0, 1.0, 100.0),
    NOISE,
    PLAIN,
];
pub(crate) const STATIC_KEYS: &[Key] = &[WIDTH, HEIGHT, FPS, DURATION, SIZE, NOISE, PLAIN];

pub(crate) const MOTION_KEYS: &[Key] = &[
    Key { default: 640.0, ..WIDTH },
    Key { default: 360.0, ..HEIGHT },
    FPS,
    Key { default: 5.0, ..DURATION },
    SIZE,
    Key { default: 110.0, ..SPEED },
    Key::choice(
        "motion",
        "what moves: the patch on a line, on a circle, in goes and stops of a second, or the camera by jumps",
        &["line", "turn", "stop", "jump"],
    ),
    Key::number("radius", "the circle's radius in pixels", 90.0, 5.0, 2000.0),
    Key::number("jump", "how far the camera jumps every second, in pixels", 40.0, 0.0, 400.0),
    NOISE,
    PLAIN,
];
pub(crate) const DEPTH_OCCLUDER_KEYS: &[Key] = &[
    WIDTH,
    HEIGHT,
    FPS,
    Key { default: 6.0, ..DURATION },
    Key { default: 40.0, ..SIZE },
    Key { default: 25.0, ..SPEED },
    Key::number("distance", "the patch's mean distance in millimetres", 2200.0, 500.0, 9000.0),
    Key::number("nearer", "how much nearer what passes before it is, in millimetres", 900.0, 50.0, 8000.0),
    Key::number("bar", "the width of what passes before it, in pixels", 70.0, 1.0, 400.0),
    Key::number("holes", "the fraction of pixels without depth, besides the shadows of what is nearer", 0.03, 0.0, 1.0),
    NOISE,
    PLAIN,
];
pub(crate) const RGBD_OCCLUSION_KEYS: &[Key] = &[
    WIDTH,
    HEIGHT,
    FPS,
    DURATION,
    Key { default: 40.0, ..SIZE },
    Key { default: 50.0, ..SPEED },
    Key::number("distance", "the patch's distance at the start in millimetres", 2200.0, 500.0, 9000.0),
    Key::number("approach", "how fast the patch comes nearer in millimetres per second", 0.0, -1000.0, 1000.0),
    Key::number("nearer", "how much nearer what passes before it is, in millimetres", 900.0, 50.0, 8000.0),
    Key::number("hidden", "for how many frames the patch is covered as far as it gets", 22.0, 0.0, 300.0),
    Key::number("cover", "the share of the patch that is covered, 1 wholly", 1.0, 0.0, 1.0),
    Key::choice(
        "occluder",
        "what passes before the patch: a board, or what looks almost like it",
        &["board", "similar"],
    ),
    Key::choice(
        "light",
        "steady, darkened to a tenth, flickering, or none at all",
        &["steady", "dark", "flicker", "black"],
    ),
    Key::number("pan", "how far the camera sweeps to and fro, in pixels", 0.0, 0.0, 200.0),
    Key::number("relief", "how far surfaces stand out, in millimetres", 60.0, 0.0, 500.0),
    Key::number("clutter", "how many boxes stand before the wall", 6.0, 0.0, 50.0),
    Key::number("holes", "the fraction of pixels without depth, besides the shadows of what is nearer", 0.03, 0.0, 1.0),
    Key::number("quantised", "1 for disparities in eighths of a pixel", 1.0, 0.0, 1.0),
    NOISE,
    PLAIN,
];
