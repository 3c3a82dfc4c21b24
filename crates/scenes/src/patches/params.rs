//! What can be set in the scenes of patches.

use crate::plan::Picture;
use pursuit_parameters::{choices, parameters};

/// What a scene of patches has beside its own.
pub(crate) type Common = (Picture, Patch, Speed);

parameters! {
    /// The patch.
    pub struct Patch {
        /// The patch's side; of several patches the usual one, from which theirs differ by up to a half.
        pub size: f64 = 32.0, in 4.0..=512.0, unit "px";
        /// Whether the patch is painted plain magenta, for checking truth against pixels.
        pub plain: bool = false;
    }
}

parameters! {
    /// How fast the patch is.
    pub struct Speed {
        /// The patch's usual speed.
        pub speed: f64 = 60.0, in 0.0..=5000.0, unit "px/s";
    }
}

parameters! {
    /// Of `scale-ramp`.
    pub struct ScaleRamp {
        /// The patch's last side by its first.
        pub growth: f64 = 2.5, in 0.1..=10.0;
    }
}

parameters! {
    /// Of `occluding-bar`.
    pub struct OccludingBar {
        /// The bar's width.
        pub bar: f64 = 60.0, in 1.0..=400.0, unit "px";
    }
}

parameters! {
    /// Of `lighting-step`.
    pub struct LightingStep {
        /// The light's gain after the step.
        pub gain: f64 = 0.5, in 0.05..=2.0;
    }
}

parameters! {
    /// Of `camera-pan`.
    pub struct CameraPan {
        /// The camera's greatest speed.
        pub pan: f64 = 120.0, in 0.0..=600.0, unit "px/s";
        /// The camera's trembling.
        pub shake: f64 = 1.5, in 0.0..=20.0, unit "px";
    }
}

parameters! {
    /// Of scenes with a second patch.
    pub struct Second {
        /// How much the second patch's texture differs, 0 not at all, 1 wholly.
        pub difference: f64 = 0.25, in 0.0..=1.0;
    }
}

parameters! {
    /// Of `look-alike`.
    pub struct LookAlike {
        /// The distance between the centres at the closest.
        pub gap: f64 = 1.4, in 0.0..=4.0, unit "patch sides";
    }
}

parameters! {
    /// Of `leave-and-return`.
    pub struct LeaveAndReturn {
        /// When the patch vanishes.
        pub leaves: f64 = 2.0, in 0.0..=3600.0, unit "s";
        /// How long it is gone.
        pub absent: u32 = 80, in 0..=10_000, unit "frames";
        /// How far away it returns, to the right.
        pub away: f64 = 280.0, in -4000.0..=4000.0, unit "px";
        /// Whether a patch of almost the same texture stands near while it is gone.
        pub look_alike: bool = false;
    }
}

parameters! {
    /// Of `crowd`.
    pub struct Crowd {
        /// How many patches there are.
        pub targets: usize = 20, in 1..=100;
    }
}

choices! {
    /// What moves in the scene `motion`.
    pub enum Course {
        /// The patch on a line.
        Line = "line",
        /// The patch on a circle.
        Turn = "turn",
        /// The patch, in goes and stops of a second.
        Stop = "stop",
        /// The camera, by jumps, and the patch on a line.
        Jump = "jump",
        /// The patch, thrown.
        Throw = "throw",
        /// The patch, on a pendulum.
        Swing = "swing",
    }
}

parameters! {
    /// Of `motion`.
    pub struct Motion {
        /// What moves: the patch on a line, on a circle, in goes and stops of a second, thrown, or on a pendulum; or the camera by
        /// jumps.
        pub motion: Course = Course::Line;
        /// The circle's radius, and the pendulum's length.
        pub radius: f64 = 90.0, in 5.0..=2000.0, unit "px";
        /// How far the camera jumps every second.
        pub jump: f64 = 40.0, in 0.0..=400.0, unit "px";
        /// How fast what is thrown or swings falls: of a world of 100 pixels a metre, unless it is said otherwise.
        pub gravity: f64 = 981.0, in 1.0..=100_000.0, unit "px/s²";
    }
}

parameters! {
    /// Of scenes with depth.
    pub struct Depth {
        /// The patch's distance: the mean one where it goes to and fro, the first one where it comes nearer.
        pub distance: f64 = 2200.0, in 500.0..=9000.0, unit "mm";
        /// How much nearer what passes before it is.
        pub nearer: f64 = 900.0, in 50.0..=8000.0, unit "mm";
        /// The fraction of pixels without depth, besides the shadows of what is nearer.
        pub holes: f64 = 0.03, in 0.0..=1.0;
    }
}

choices! {
    /// What passes before the patch.
    pub enum Occluder {
        /// A board.
        Board = "board",
        /// What looks almost like the patch.
        Similar = "similar",
    }
}

choices! {
    /// The light.
    pub enum Light {
        /// Steady.
        Steady = "steady",
        /// Darkened to a tenth.
        Dark = "dark",
        /// Flickering.
        Flicker = "flicker",
        /// None at all.
        Black = "black",
    }
}

parameters! {
    /// Of `rgbd-occlusion`.
    pub struct RgbdOcclusion {
        /// How fast the patch comes nearer.
        pub approach: f64 = 0.0, in -1000.0..=1000.0, unit "mm/s";
        /// For how long the patch is covered as far as it gets.
        pub hidden: u32 = 22, in 0..=300, unit "frames";
        /// The share of the patch that is covered, 1 wholly.
        pub cover: f64 = 1.0, in 0.0..=1.0;
        /// What passes before the patch: a board, or what looks almost like it.
        pub occluder: Occluder = Occluder::Board;
        /// Steady, darkened to a tenth, flickering, or none at all.
        pub light: Light = Light::Steady;
        /// How far the camera sweeps to and fro.
        pub pan: f64 = 0.0, in 0.0..=200.0, unit "px";
        /// How far surfaces stand out.
        pub relief: f64 = 60.0, in 0.0..=500.0, unit "mm";
        /// How many boxes stand before the wall.
        pub clutter: u64 = 6, in 0..=50;
        /// Whether disparities come in eighths of a pixel.
        pub quantised: bool = true;
    }
}
