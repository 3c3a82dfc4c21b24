//! Trials: opening, commanding, editing.

use crate::Picked;
use crate::error::Refusal;
use crate::measuring::{Bench, Place};
use crate::recording::Recording;
use crate::studio::Studio;
use crate::trial::{Look, Order, Place as Kept, Setup, seeking};
use crate::uploads;
use axum::Json;
use axum::body::Bytes;
use axum::extract::{Path, State};
use axum::http::StatusCode;
use pursuit::BBox;
use pursuit::revise::Label;
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
    /// The folder of a run of `pursuit track`, or of an earlier trial, in place of all this.
    run: Option<String>,
    /// Whether it is kept in a folder of its own.
    #[serde(default = "yes")]
    kept: bool,
}

const fn yes() -> bool {
    true
}

pub(crate) async fn open(
    State(studio): State<Arc<Studio>>,
    Json(opening): Json<Opening>,
) -> Result<(StatusCode, Json<Value>), Refusal> {
    let Opening { source, tracker, parameters, detector, detector_parameters, run, kept } = opening;
    if let Some(folder) = run {
        return open_run(&studio, folder).await;
    }
    let root = studio.root()?.clone();
    let seeking = detector.map(|name| seeking(&name, &detector_parameters, &root)).transpose()?;
    let given = studio.given.clone();
    // What was uploaded goes with the studio, and so would what is kept beside it.
    let uploaded = source.clone().filter(|name| name.starts_with(uploads::PREFIX));
    let called = uploaded.as_deref().and_then(uploads::name_of).map(str::to_owned);
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
    let place = (kept && !studio.picking).then(|| Kept::Below(root.kept()));
    let source = uploaded.unwrap_or_else(|| root.shown_as(&locator));
    let setup = Setup { locator, options, root, tracker, parameters, seeking, known: None, bench, place, called };
    let (number, trial) = studio.open(setup, source).await?;
    let facts = trial.order(Order::Tell).await?;
    Ok((StatusCode::CREATED, Json(json!({ "trial": number, "facts": facts }))))
}

/// Opens what a run left: its trajectory is known.
async fn open_run(studio: &Arc<Studio>, folder: String) -> Result<(StatusCode, Json<Value>), Refusal> {
    let root = studio.root()?.clone();
    if studio.picking {
        return Err(other_than_wanted());
    }
    let (held, given) = (root.clone(), studio.given.clone());
    let read = tokio::task::spawn_blocking(move || {
        let recording = Recording::read(&held, &folder, given.as_ref())?;
        let beside = Place::beside(&held, &recording.locator, false);
        let places = [Place::of_run(&held, &held.folder(&folder)?), beside];
        Ok((recording, Bench::at(places.into_iter().flatten().collect())))
    })
    .await;
    let (recording, bench) = read.unwrap_or_else(|_| Err(Refusal::unfit("this run cannot be read")))?;
    let Recording { source, locator, tracker, parameters, seeking, known, own } = recording;
    let options = studio.options.clone();
    let place = Some(own.map_or_else(|| Kept::Below(root.kept()), Kept::At));
    let known = Some(known);
    let setup = Setup { locator, options, root, tracker, parameters, seeking, known, bench, place, called: None };
    let (number, trial) = studio.open(setup, source.clone()).await?;
    let facts = trial.order(Order::Tell).await?;
    Ok((StatusCode::CREATED, Json(json!({ "trial": number, "source": source, "facts": facts }))))
}

fn other_than_wanted() -> Refusal {
    Refusal::unfit("the box is wanted for the input of the command line; no other can be opened now")
}

pub(crate) async fn list(State(studio): State<Arc<Studio>>) -> Json<Value> {
    let mut trials = Vec::new();
    for (number, source, trial) in studio.all() {
        // One that does not answer is there all the same.
        let facts = trial.order(Order::Tell).await.map(|facts| trial_facts(&facts)).unwrap_or_default();
        trials.push(json!({ "trial": number, "source": source, "viewers": trial.screen.viewers(), "facts": facts }));
    }
    Json(json!({ "trials": trials }))
}

/// What a list says of a trial.
fn trial_facts(facts: &Value) -> Value {
    json!({ "phase": facts["phase"], "tracker": facts["tracker"], "frame": facts["now"]["frame"], "frame_count": facts["input"]["frame_count"],
        "targets": facts["targets"].as_array().map_or(0, Vec::len), "folder": facts["folder"] })
}

pub(crate) async fn tell(State(studio): State<Arc<Studio>>, Path(trial): Path<u64>) -> Answer {
    obey(&studio, trial, Order::Tell).await
}

pub(crate) async fn close(State(studio): State<Arc<Studio>>, Path(trial): Path<u64>) -> Result<StatusCode, Refusal> {
    studio.close(trial).await.map(|()| StatusCode::NO_CONTENT)
}

#[derive(Deserialize)]
#[serde(rename_all = "lowercase", tag = "order", deny_unknown_fields)]
pub(crate) enum Ordered {
    Start,
    Pause,
    Step,
    Back,
    Stop,
    Seek {
        frame: u64,
    },
    Speed {
        times: Option<f64>,
    },
    Look {
        at: Look,
    },
    Undo,
    Redo,
    /// Not to go ahead of another trial, so that both can be looked at in the same frame.
    Beside {
        trial: Option<u64>,
    },
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
        Ordered::Undo => Order::Undo,
        Ordered::Redo => Order::Redo,
        Ordered::Beside { trial: Some(other) } if other == trial => {
            return Err(Refusal::unfit("a trial does not wait for itself"));
        }
        Ordered::Beside { trial: other } => {
            let other = other.map(|other| studio.trial(other)).transpose()?;
            Order::Beside(other.and_then(|other| other.progress()))
        }
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

/// Longest name of a target, characters.
const LONGEST_NAME: usize = 60;

/// Names a target and chooses its colour; what is left out is as it was in the beginning.
pub(crate) async fn label(
    State(studio): State<Arc<Studio>>,
    Path((trial, target)): Path<(u64, u64)>,
    Json(Label { name, color }): Json<Label>,
) -> Answer {
    let name = name.map(|name| name.trim().to_owned()).filter(|name| !name.is_empty());
    if name.as_ref().is_some_and(|n| n.chars().count() > LONGEST_NAME || n.chars().any(char::is_control)) {
        return Err(Refusal::unfit(format!("a name has {LONGEST_NAME} characters at most, in one line")));
    }
    let is_color = |c: &String| c.len() == 7 && c.starts_with('#') && c[1..].bytes().all(|b| b.is_ascii_hexdigit());
    if color.as_ref().is_some_and(|color| !is_color(color)) {
        return Err(Refusal::unfit("a colour is #rrggbb"));
    }
    obey(&studio, trial, Order::Label(target, Label { name, color })).await
}

#[derive(Deserialize)]
#[serde(rename_all = "lowercase", tag = "change", deny_unknown_fields)]
pub(crate) enum Identified {
    /// Both are one target, known by the other's number.
    Merge { into: u64 },
    /// From the frame shown on it is another target.
    Split,
    /// In these frames each was taken for the other.
    Swap { with: u64, from: u64, to: u64 },
}

/// Says who is who.
pub(crate) async fn identify(
    State(studio): State<Arc<Studio>>,
    Path((trial, target)): Path<(u64, u64)>,
    Json(identified): Json<Identified>,
) -> Answer {
    let order = match identified {
        Identified::Merge { into } => Order::Merge(target, into),
        Identified::Split => Order::Split(target),
        Identified::Swap { with, from, to } => Order::Swap([target, with], from..=to.min(u64::MAX - 1)),
    };
    obey(&studio, trial, order).await
}

/// Takes a trajectory in place of what there is: CSV, MOT, COCO or CVAT as the body of the request.
pub(crate) async fn import(State(studio): State<Arc<Studio>>, Path(trial): Path<u64>, body: Bytes) -> Answer {
    obey(&studio, trial, Order::Import(body.to_vec())).await
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
