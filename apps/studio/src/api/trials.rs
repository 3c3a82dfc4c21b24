//! Trials: opening, commanding, editing.

use crate::Picked;
use crate::error::Refusal;
use crate::measuring::{Bench, Place};
use crate::recording::Recording;
use crate::studio::Studio;
use crate::trial::{Look, Order, Setup, seeking};
use crate::uploads;
use axum::Json;
use axum::extract::{Path, State};
use axum::http::StatusCode;
use pursuit::BBox;
use pursuit::toml::Table;
use serde::Deserialize;
use serde_json::{Value, json};
use std::sync::Arc;

/// The slowest and the fastest pace, in times the input's own.
const PACES: std::ops::RangeInclusive<f64> = 0.01..=1000.0;

type Answer = Result<Json<Value>, Refusal>;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Opening {
    /// Without, the input of the command line.
    source: Option<String>,
    tracker: Option<String>,
    #[serde(default)]
    parameters: Table,
    /// The detector that finds the target, where no box is to.
    detector: Option<String>,
    #[serde(default)]
    detector_parameters: Table,
    /// The folder of a run of `pursuit track`, in place of all this.
    run: Option<String>,
}

pub(crate) async fn open(
    State(studio): State<Arc<Studio>>,
    Json(opening): Json<Opening>,
) -> Result<(StatusCode, Json<Value>), Refusal> {
    let Opening { source, tracker, parameters, detector, detector_parameters, run } = opening;
    if let Some(folder) = run {
        return open_run(&studio, folder).await;
    }
    let root = studio.root()?.clone();
    let seeking = detector.map(|name| seeking(&name, &detector_parameters, &root)).transpose()?;
    let given = studio.given.clone();
    // What was uploaded goes with the studio, and so would what is kept beside it.
    let has_place = source.as_ref().is_none_or(|name| !name.starts_with(uploads::PREFIX));
    let locator = match source {
        Some(name) if Some(&name) == given.as_ref().map(ToString::to_string).as_ref() => given,
        Some(name) => Some(match name.strip_prefix(uploads::PREFIX) {
            Some(upload) => studio.uploads.resolve(upload)?,
            None => {
                let looking = studio.clone();
                let found = tokio::task::spawn_blocking(move || looking.root()?.resolve(&name)).await;
                found.unwrap_or_else(|_| Err(Refusal::unfit("this source cannot be looked at")))?
            }
        }),
        None => given,
    };
    if studio.picking && locator != studio.given {
        return Err(other_than_wanted());
    }
    let locator = locator.ok_or_else(|| Refusal::unfit("no source; name one"))?;
    let tracker = tracker.unwrap_or_else(|| pursuit::trackers::registry::DEFAULT_TRACKER.to_owned());
    let options = studio.options.clone();
    let is_given = Some(&locator) == studio.given.as_ref();
    let place = if has_place { Place::beside(&root, &locator, is_given) } else { None };
    let bench = Bench::at(place.into_iter().collect());
    let (number, trial) =
        studio.open(Setup { locator, options, root, tracker, parameters, seeking, known: None, bench }).await?;
    let facts = trial.order(Order::Tell).await?;
    Ok((StatusCode::CREATED, Json(json!({ "trial": number, "facts": facts }))))
}

/// Opens what a run left: its trajectory is known.
async fn open_run(studio: &Arc<Studio>, folder: String) -> Result<(StatusCode, Json<Value>), Refusal> {
    let root = studio.root()?.clone();
    if studio.picking {
        return Err(other_than_wanted());
    }
    let held = root.clone();
    let read = tokio::task::spawn_blocking(move || {
        let recording = Recording::read(&held, &folder)?;
        let beside = Place::beside(&held, &recording.locator, false);
        let places = [Place::of_run(&held, &held.folder(&folder)?), beside];
        Ok((recording, Bench::at(places.into_iter().flatten().collect())))
    })
    .await;
    let (recording, bench) = read.unwrap_or_else(|_| Err(Refusal::unfit("this run cannot be read")))?;
    let Recording { source, locator, tracker, parameters, seeking, known } = recording;
    let options = studio.options.clone();
    let setup = Setup { locator, options, root, tracker, parameters, seeking, known: Some(known), bench };
    let (number, trial) = studio.open(setup).await?;
    let facts = trial.order(Order::Tell).await?;
    Ok((StatusCode::CREATED, Json(json!({ "trial": number, "source": source, "facts": facts }))))
}

fn other_than_wanted() -> Refusal {
    Refusal::unfit("the box is wanted for the input of the command line; no other can be opened now")
}

pub(crate) async fn list(State(studio): State<Arc<Studio>>) -> Json<Value> {
    Json(json!({ "trials": studio.numbers() }))
}

pub(crate) async fn tell(State(studio): State<Arc<Studio>>, Path(trial): Path<u64>) -> Answer {
    obey(&studio, trial, Order::Tell).await
}

pub(crate) async fn close(State(studio): State<Arc<Studio>>, Path(trial): Path<u64>) -> Result<StatusCode, Refusal> {
    studio.close(trial).map(|()| StatusCode::NO_CONTENT)
}

#[derive(Deserialize)]
#[serde(rename_all = "lowercase", tag = "order", deny_unknown_fields)]
pub(crate) enum Ordered {
    Start,
    Pause,
    Step,
    Back,
    Stop,
    Seek { frame: u64 },
    Speed { times: Option<f64> },
    Look { at: Look },
}

pub(crate) async fn order(
    State(studio): State<Arc<Studio>>,
    Path(trial): Path<u64>,
    Json(ordered): Json<Ordered>,
) -> Answer {
    let order = match ordered {
        Ordered::Start => Order::Start,
        Ordered::Pause => Order::Pause,
        Ordered::Step => Order::Step,
        Ordered::Back => Order::Back,
        Ordered::Stop => Order::Stop,
        Ordered::Look { at } => Order::Look(at),
        Ordered::Seek { frame } => Order::Seek(frame),
        Ordered::Speed { times } if times.is_none_or(|t| PACES.contains(&t)) => Order::Speed(times),
        Ordered::Speed { .. } => return Err(Refusal::unfit("a speed is between 0.01 and 1000, or null")),
    };
    obey(&studio, trial, order).await
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Boxed {
    /// Left, top, width, height in pixels of the input.
    #[serde(rename = "box")]
    ltwh: [f64; 4],
}

impl Boxed {
    fn bbox(&self) -> BBox {
        let [l, t, w, h] = self.ltwh;
        BBox::from_ltwh(l, t, w, h)
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Corrected {
    #[serde(rename = "box")]
    ltwh: [f64; 4],
    /// Whether the frames before are put right too, back to the last one in which the target was tracked there.
    #[serde(default)]
    backward: bool,
}

pub(crate) async fn add(State(studio): State<Arc<Studio>>, Path(trial): Path<u64>, Json(boxed): Json<Boxed>) -> Answer {
    let facts = obey(&studio, trial, Order::Add(boxed.bbox())).await?;
    if let Some(frame) = facts["now"]["frame"].as_u64().filter(|_| studio.picking) {
        // The first one counts.
        let _ = studio.picked.set(Picked { frame, bbox: boxed.bbox() });
    }
    Ok(facts)
}

pub(crate) async fn correct(
    State(studio): State<Arc<Studio>>,
    Path((trial, target)): Path<(u64, u64)>,
    Json(Corrected { ltwh, backward }): Json<Corrected>,
) -> Answer {
    obey(&studio, trial, Order::Correct(target, Boxed { ltwh }.bbox(), backward)).await
}

pub(crate) async fn remove(State(studio): State<Arc<Studio>>, Path((trial, target)): Path<(u64, u64)>) -> Answer {
    obey(&studio, trial, Order::Remove(target)).await
}

pub(crate) async fn change(
    State(studio): State<Arc<Studio>>,
    Path(trial): Path<u64>,
    Json(parameters): Json<Table>,
) -> Answer {
    obey(&studio, trial, Order::Change(parameters)).await
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Method {
    tracker: String,
    #[serde(default)]
    parameters: Table,
}

pub(crate) async fn method(
    State(studio): State<Arc<Studio>>,
    Path(trial): Path<u64>,
    Json(Method { tracker, parameters }): Json<Method>,
) -> Answer {
    obey(&studio, trial, Order::Tracker(tracker, parameters)).await
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Detecting {
    /// None for no detector.
    detector: Option<String>,
    #[serde(default)]
    parameters: Table,
}

pub(crate) async fn detect(
    State(studio): State<Arc<Studio>>,
    Path(trial): Path<u64>,
    Json(Detecting { detector, parameters }): Json<Detecting>,
) -> Answer {
    let root = studio.root()?;
    let seeking = detector.map(|name| seeking(&name, &parameters, root)).transpose()?;
    obey(&studio, trial, Order::Detect(seeking)).await
}

async fn obey(studio: &Studio, trial: u64, order: Order) -> Answer {
    studio.trial(trial)?.order(order).await.map(Json)
}
