//! Published ways to associate boxes, each as values of what is exchangeable.

use super::{
    AssociationModel, AssociationParams, BirthModel, BirthParams, BufferedParams, DeathModel, DeathParams, HitsParams,
    ManyParams, ObservationParams, TwoStageParams,
};
use crate::motion::{BoxState, CameraCompensation, MotionModel, MotionParams, PerFrameParams};
use crate::policy::{PolicyModel, PolicyParams};
use pursuit_parameters::ParameterError;

pursuit_parameters::choices! {
    /// A published way to associate boxes. Each is written from its paper; where papers leave something open, values are those of the programs that are in use.
    pub enum Preset {
        /// By overlap in one assignment (bewley2016).
        Sort = "sort",
        /// Sure detections first, then weak ones (zhang2022).
        ByteTrack = "bytetrack",
        /// By what was observed: direction, a second look, the gap gone through again (cao2023).
        OcSort = "ocsort",
        /// Overlap weighed by confidence in three turns; the camera's motion is taken out where there are frames (aharon2022), without appearance.
        BotSort = "botsort",
        /// By the overlap of widened boxes (yang2023).
        CBiou = "cbiou",
    }
}

impl std::str::FromStr for Preset {
    type Err = ParameterError;

    fn from_str(name: &str) -> Result<Self, ParameterError> {
        let known = || Self::ALL.iter().map(|preset| preset.as_str()).collect::<Vec<_>>().join(", ");
        let found = Self::ALL.iter().copied().find(|preset| preset.as_str() == name);
        found.ok_or_else(|| ParameterError::new("many", "preset", format!("`{name}` is none; there are: {}", known())))
    }
}

impl Preset {
    /// Its parameters.
    pub fn params(self) -> ManyParams {
        match self {
            Self::Sort => sort(),
            Self::ByteTrack => bytetrack(),
            Self::OcSort => ocsort(),
            Self::BotSort => botsort(),
            Self::CBiou => cbiou(),
        }
    }
}

/// No gate but overlap.
fn ungated(model: AssociationModel) -> AssociationParams {
    let (gate, reach, buffer) = (f64::MAX, f64::MAX, 0.0);
    AssociationParams { model, least_confidence: 0.0, gate, reach, buffer, buffer_growth: 0.0, ..Default::default() }
}

/// Confirmed by `hits` detections one after the other, of detections from a confidence; given up after 30 frames.
fn lives(association: AssociationParams, state: BoxState, from: f64, hits: usize) -> ManyParams {
    let hits = HitsParams { hits, looks: hits, ..HitsParams::default() };
    let per_frame = PerFrameParams { state, ..PerFrameParams::default() };
    ManyParams {
        association,
        birth: BirthParams { model: BirthModel::Hits, from, crowding: 1.0, hits, ..BirthParams::default() },
        death: DeathParams { model: DeathModel::Misses, ..DeathParams::default() },
        motion: MotionParams { model: MotionModel::PerFrame, per_frame, ..MotionParams::default() },
        policy: PolicyParams { model: PolicyModel::Always, ..PolicyParams::default() },
        ..ManyParams::default()
    }
}

fn sort() -> ManyParams {
    let two_stage = TwoStageParams {
        sure_from: 0.0,
        sure_overlap: 0.3,
        candidates_last: false,
        late: true,
        ..TwoStageParams::default()
    };
    let association = AssociationParams { two_stage, ..ungated(AssociationModel::TwoStage) };
    lives(association, BoxState::Corners, 0.25, 3)
}

fn bytetrack() -> ManyParams {
    let two_stage = TwoStageParams {
        sure_from: 0.6,
        sure_overlap: 0.1,
        weak_overlap: 0.1,
        candidates_last: false,
        weak_to_lost: true,
        late: true,
        ..TwoStageParams::default()
    };
    let association = AssociationParams { two_stage, ..ungated(AssociationModel::TwoStage) };
    lives(association, BoxState::Corners, 0.7, 2)
}

fn ocsort() -> ManyParams {
    let observation = ObservationParams { late: true, ..ObservationParams::default() };
    let association = AssociationParams { observation, ..ungated(AssociationModel::Observation) };
    let mut params = lives(association, BoxState::Area, 0.6, 3);
    params.birth.hits = HitsParams { birth_counts: false, patience: 30, ..params.birth.hits };
    params.birth.at_start = 4;
    ManyParams { reported_from: 3, ..params }
}

fn botsort() -> ManyParams {
    let two_stage = TwoStageParams { weigh: true, late: true, ..TwoStageParams::default() };
    let ungated = ungated(AssociationModel::TwoStage);
    let association = AssociationParams { two_stage, least_confidence: 0.1, ..ungated };
    let mut params = lives(association, BoxState::Size, 0.7, 2);
    params.birth.at_start = 1;
    params.motion.camera = CameraCompensation::Flow;
    params
}

fn cbiou() -> ManyParams {
    let buffered = BufferedParams {
        overlap: 0.2,
        weak_overlap: 0.5,
        candidate_overlap: 0.3,
        sure_from: 0.6,
        weak_by_large: true,
        weigh: true,
        late: true,
        ..BufferedParams::default()
    };
    let buffer = buffered.large;
    let ungated = ungated(AssociationModel::Buffered);
    let association = AssociationParams { buffered, least_confidence: 0.1, buffer, ..ungated };
    let mut params = lives(association, BoxState::Size, 0.7, 2);
    params.birth.at_start = 1;
    params
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_parameters::Parameters;

    #[test]
    fn every_preset_is_in_range() {
        for preset in Preset::ALL {
            let params = preset.params();
            params.validate("many").unwrap_or_else(|e| panic!("{}: {e}", preset.as_str()));
            let written = params.to_table("many").unwrap();
            // What the models chosen do not use is not written, and may differ.
            let read = ManyParams::default().with("many", &written).unwrap();
            assert_eq!(read.to_table("many").unwrap(), written, "{} survives being written", preset.as_str());
        }
    }
}
