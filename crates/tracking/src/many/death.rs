//! When a target is given up: the model that [`DeathParams`] name.

use serde::{Deserialize, Serialize};

pursuit_parameters::choices! {
    /// When a target is given up, and its id with it.
    pub enum DeathModel {
        /// By the time for which it was not seen.
        Unseen = "unseen",
        /// By the frames in which it was not seen, one after the other.
        Misses = "misses",
    }
}

pursuit_parameters::parameters! {
    /// When a target is given up. One that is lost outside of the picture has left and is given up whatever the model.
    pub struct DeathParams {
        /// Of detectors that know the scene: a box in which a lesser share stands out of it is empty …
        pub empty_below: f64 = 0.15, in 0.0..=1.0, source "ours";
        /// … and a target whose box has been empty for so long is gone: it is lost, and given up where it was at the picture's border …
        pub empty_s: f64 = 0.3, in 0.0.., unit "s", source "ours";
        /// … and for so long, anywhere.
        pub gone_s: f64 = 1.0, in 0.0.., unit "s", source "ours";
        /// The model.
        pub model: DeathModel = DeathModel::Unseen, source "ours";
        /// By time.
        pub unseen: UnseenParams = UnseenParams::default(), of [DeathModel::Unseen];
        /// By frames.
        pub misses: MissesParams = MissesParams::default(), of [DeathModel::Misses];
    }
}

pursuit_parameters::parameters! {
    /// By the time for which it was not seen.
    pub struct UnseenParams {
        /// A target that was not seen for longer is given up.
        pub after_s: f64 = 3.0, in 0.0.., unit "s", source "ours";
    }
}

pursuit_parameters::parameters! {
    /// By the frames in which it was not seen.
    pub struct MissesParams {
        /// A target that was not seen in more frames, one after the other, is given up.
        pub most: usize = 30, in 0..=1_000_000, unit "frames", source "zhang2022, section 4.1";
    }
}

/// For how long a target was not measured by anything.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Unseen {
    pub seconds: f64,
    pub frames: usize,
}

impl Unseen {
    /// A further frame.
    pub fn wait(&mut self, dt_s: f64) {
        self.seconds += dt_s;
        self.frames = self.frames.saturating_add(1);
    }

    /// Whether the target is to be given up.
    pub fn is_too_long(&self, params: &DeathParams) -> bool {
        match params.model {
            DeathModel::Unseen => self.seconds > params.unseen.after_s,
            DeathModel::Misses => self.frames > params.misses.most,
        }
    }

    /// Whether it can be a time: what is restored is checked.
    pub fn is_sound(&self) -> bool {
        self.seconds.is_finite() && self.seconds >= 0.0
    }
}
