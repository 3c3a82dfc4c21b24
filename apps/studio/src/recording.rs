//! A run of `pursuit track`, as its folder below the root tells it: opened, it is a trial whose trajectory is known.

use crate::error::Refusal;
use crate::root::Root;
use crate::runs::{TRACKED, TRAJECTORY, read};
use crate::trial::seeking;
use pursuit::BBox;
use pursuit::media::Locator;
use pursuit::parameters::Parameters;
use pursuit::revise::{ChosenDetector, Edit, EditKind, Revised, Row, complete};
use pursuit::sinks::read_trajectory;
use pursuit::toml::Table;
use pursuit::tracking::many::AcquisitionParams;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Trajectories that are longer are not read, bytes.
const MOST_BYTES: u64 = 64 << 20;

/// What a run was made of, and what came of it.
pub(crate) struct Recording {
    /// The input, as a source names it.
    pub source: String,
    pub locator: Locator,
    pub tracker: String,
    pub parameters: Table,
    pub seeking: Option<ChosenDetector>,
    pub known: Known,
    /// Its folder, where the studio wrote it: there it is gone on with.
    pub own: Option<PathBuf>,
}

/// What came of it.
pub(crate) struct Known {
    pub rows: Vec<Row>,
    /// What was done to it: of a run of the command line, the boxes that it was started on.
    pub revised: Revised,
    /// Whether it went on to its end.
    pub is_whole: bool,
    /// Why it cannot be followed again from here, where it cannot.
    pub fixed: Option<String>,
}

impl Recording {
    /// # Errors
    /// A folder without a run, a run whose input is not below the root, a method that there is not.
    pub fn read(root: &Root, path: &str, given: Option<&Locator>) -> Result<Self, Refusal> {
        let folder = root.folder(path)?;
        let facts = read(root, &folder, TRACKED)?;
        let (input, recipe) = (&facts["input"], &facts["recipe"]);
        let damaged = || Refusal::unfit(format!("{TRACKED} does not say what a run's does"));
        let name = input["name"].as_str().ok_or_else(damaged)?;
        let (source, locator) = match given.filter(|given| given.to_string() == name) {
            Some(given) => (name.to_owned(), given.clone()),
            None => locate(root, name)?,
        };
        let table = |value: &Value| serde_json::from_value::<Table>(value.clone()).map_err(|_| damaged());
        let boxes: Vec<[f64; 4]> = serde_json::from_value(recipe["boxes"].clone()).map_err(|_| damaged())?;
        let boxes = boxes.into_iter().map(|[left, top, width, height]| BBox::from_ltwh(left, top, width, height));
        let seeking = match recipe["detector"].as_str() {
            Some(detector) if !recipe["acquire"].is_null() => {
                Some(seeking(detector, &table(&recipe["detector_parameters"])?, root)?)
            }
            _ => None,
        };
        let file = root.file(&folder.join(TRAJECTORY))?;
        if std::fs::metadata(&file).map_or(u64::MAX, |m| m.len()) > MOST_BYTES {
            return Err(Refusal::unfit(format!("{TRAJECTORY} is larger than {} MiB", MOST_BYTES >> 20)));
        }
        let records = read_trajectory(&file).map_err(|e| Refusal::unfit(format!("{TRAJECTORY}: {e}")))?;
        let mut rows: Vec<Row> = Vec::new();
        for record in records {
            match rows.last_mut() {
                Some(row) if row.frame == record.frame => row.records.push(record),
                Some(row) if row.frame > record.frame => break,
                _ => rows.push(Row {
                    frame: record.frame,
                    time_s: record.time_s,
                    records: vec![record],
                    backward: Vec::new(),
                }),
            }
        }
        if rows.is_empty() {
            return Err(Refusal::unfit("this run has followed nothing"));
        }
        let revised = Revised::read(&folder)?;
        let is_own = revised.is_some();
        let first = rows[0].frame;
        let added = (1..).zip(boxes);
        let added = added.map(|(target, bbox)| Edit { frame: first, kind: EditKind::Add { target, bbox } });
        let revised = revised.unwrap_or_else(|| Revised { edits: added.collect(), ..Revised::default() });
        revised.mark(&mut rows);
        let is_strided = !is_own && rows.len() > 1 && rows.windows(2).all(|pair| pair[1].frame > pair[0].frame + 1);
        Ok(Self {
            source,
            locator,
            tracker: recipe["tracker"].as_str().ok_or_else(damaged)?.to_owned(),
            parameters: table(&recipe["parameters"])?,
            seeking,
            known: Known {
                rows: if is_own { complete(rows, facts["input"]["nominal_fps"].as_f64()) } else { rows },
                revised,
                is_whole: facts["status"] == "done",
                fixed: fixed(&facts, is_strided),
            },
            own: is_own.then_some(folder),
        })
    }
}

/// The input of a run, which was named from wherever the command was called.
fn locate(root: &Root, name: &str) -> Result<(String, Locator), Refusal> {
    if ["camera:", "rtsp://", "rtsps://"].iter().any(|live| name.starts_with(live)) {
        return Err(Refusal::unfit("its input was live and does not come again"));
    }
    if let Ok(locator) = root.resolve(name) {
        let shown = root.shown(Path::new(name));
        return Ok((shown.unwrap_or_else(|_| name.to_owned()), locator));
    }
    let stem = Path::new(name).with_extension("");
    let found = stem.file_name().and_then(|stem| root.footage(stem.to_str()?));
    let missing = || Refusal::missing("its input is not below the root, or there are several of its name");
    let source = root.shown(&found.ok_or_else(missing)?)?;
    let locator = root.resolve(&source)?;
    Ok((source, locator))
}

/// Why a trial would not do as the run did, if so.
fn fixed(facts: &Value, is_strided: bool) -> Option<String> {
    let (input, recipe) = (&facts["input"], &facts["recipe"]);
    let acquire = AcquisitionParams::default().to_table("acquire").ok().map(|table| json!(table));
    let reasons = [
        (!recipe["many"].is_null(), "it followed everything that was detected (`--many`)"),
        (is_strided, "it did not look at every frame"),
        (!input["view"].is_null(), "it looked at a part of the picture, or at a smaller one"),
        (!input["depth"].is_null(), "how its depth is read was said on the command line"),
        (!recipe["acquire"].is_null() && acquire.as_ref() != Some(&recipe["acquire"]), "`acquire` was set"),
    ];
    let why = reasons.into_iter().find_map(|(is_so, why)| is_so.then_some(why))?;
    Some(format!("this run can be looked at and not gone on with: {why}; open its input instead"))
}
