//! What is written down of many targets: each with its appearance tracker's own bytes.

use super::super::target::Known;
use super::super::{ManyParams, RecipeOf};
use super::{Associating, Fed, NAME, Target};
use crate::motion::CameraShift;
use crate::{Result, TrackingError, snapshot};
use serde::{Deserialize, Serialize};

#[derive(Serialize, Deserialize)]
struct State {
    params: ManyParams,
    /// Name and parameters (TOML) of the recipe of appearance trackers.
    appearance: Option<(String, String)>,
    targets: Vec<(Known, Option<Vec<u8>>)>,
    camera: CameraShift,
    last_id: u64,
    fed: Fed,
}

impl State {
    /// Whether it can be a state: what is restored is checked.
    fn check(&self) -> Result<(), &'static str> {
        let mut ids: Vec<u64> = self.targets.iter().filter_map(|(known, _)| known.id()).map(|id| id.0).collect();
        ids.sort_unstable();
        if ids.windows(2).any(|w| w[0] == w[1]) || ids.iter().any(|id| !(1..=self.last_id).contains(id)) {
            return Err("two targets have one id, or an id was never handed out");
        }
        if !self.fed.is_sound() {
            return Err("a time or a size is none");
        }
        if !self.targets.iter().all(|(known, _)| known.is_sound()) {
            return Err("a time or a box is not a finite number");
        }
        Ok(())
    }
}

pub(super) fn save(targets: &Associating) -> Result<Vec<u8>> {
    let appearance = targets.appearance.as_ref();
    let appearance =
        appearance.map(|r| Ok::<_, TrackingError>((r.name().to_owned(), r.parameters()?.to_string()))).transpose()?;
    let one = |t: &Target| Ok((t.known.clone(), t.appearance.as_ref().map(|a| a.save()).transpose()?));
    let all = targets.targets.iter().map(one).collect::<Result<_>>()?;
    let (params, camera, last_id) = (targets.params.clone(), targets.camera.clone(), targets.last_id);
    let state = State { params, appearance, targets: all, camera, last_id, fed: targets.fed };
    snapshot::write(NAME, &state)
}

pub(super) fn restore(saved: &[u8], recipe_of: RecipeOf<'_>) -> Result<Associating> {
    let problem = |problem: String| TrackingError::Snapshot { tracker: NAME.to_owned(), problem };
    let state: State = snapshot::read(NAME, saved)?;
    state.check().map_err(|e| problem(e.to_owned()))?;
    let mut restored = Associating::fed(state.params)?;
    if let Some((name, parameters)) = state.appearance {
        let parameters = parameters.parse().map_err(|e: toml::de::Error| problem(e.to_string()))?;
        restored.appearance = Some(recipe_of(&name)?.with(&parameters)?);
    }
    for (known, appearance) in state.targets {
        let appearance =
            appearance.map(|bytes| recipe_of(snapshot::owner(&bytes)?)?.restore_appearance(&bytes)).transpose()?;
        restored.targets.push(Target::of(known, appearance));
    }
    (restored.last_id, restored.camera, restored.fed) = (state.last_id, state.camera, state.fed);
    Ok(restored)
}
