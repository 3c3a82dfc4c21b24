use super::{go_home, known, origin, read};
use anyhow::Context;
use pursuit::parameters::{Parameters, Table, Value, nested};
use pursuit::ptz::control::{FollowerParams, PredictBy};
use pursuit::ptz::drivers::Head;
use pursuit::{RunConfig, RunError, head};
use std::path::Path;

/// How a head is to follow what a run follows: what `--follower FILE` says, with `--set follower.KEY=VALUE` in its place.
pub struct Manner {
    said: Table,
    predict_by: PredictBy,
}

impl Manner {
    /// Takes the group `follower` out of the run's parameters.
    ///
    /// # Errors
    /// A file that cannot be read or is no TOML, keys that there are not, values out of range.
    pub fn take(config: &mut RunConfig, file: Option<&Path>) -> anyhow::Result<Self> {
        config.parameters = nested(&config.parameters);
        let settings = match config.parameters.remove("follower") {
            Some(Value::Table(settings)) => settings,
            Some(_) => return Err(RunError::usage("`follower` is a group; set `follower.KEY`").into()),
            None => Table::new(),
        };
        let mut said = read(file, settings)?;
        if config.detect.is_some() {
            go_home(&mut said);
        }
        let params = FollowerParams::default().with("follower", &said);
        let params = params.with_context(|| format!("{} does not say how to follow", origin(file)))?;
        Ok(Self { said, predict_by: params.predict_by })
    }

    /// The run for a camera on a moving head: a forecast is of use there, and what a detector finds is carried along, where it is known how the
    /// head moves. Poses are of the whole picture.
    pub fn on_a_head(&self, config: RunConfig) -> RunConfig {
        let by_pose = self.predict_by == PredictBy::Tracker || config.detect.is_some();
        if by_pose && config.region.is_none() { head::compensated(config) } else { config }
    }

    /// The parameters for this head, with what it says of itself where nothing else is said.
    ///
    /// # Errors
    /// Values out of range.
    pub fn of(&self, head: &mut dyn Head) -> anyhow::Result<FollowerParams> {
        Ok(known(head).with("follower", &self.said)?)
    }
}
