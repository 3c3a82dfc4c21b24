//! What `pursuit track`, `eval` and `reproduce` left in folders below the root, to be looked at and not changed.

use crate::error::Refusal;
use crate::root::Root;
use pursuit::evaluation::metrics::accuracy::believed;
use pursuit::evaluation::{Dataset, Footage, Trajectory};
use pursuit::geometry::Truth;
use pursuit::media::OpenOptions;
use pursuit::revise::EDITS;
use serde::Serialize;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// The file that evaluations and reproductions leave.
const RESULTS: &str = "results.json";
/// Those that a run of a tracker leaves.
pub(crate) const TRACKED: &str = "run.json";
pub(crate) const TRAJECTORY: &str = "trajectory.csv";
/// Results that are larger are not ours.
const MOST_BYTES: u64 = 64 << 20;
/// How deep runs are looked for, how many folders on the way, and how many runs are shown.
const DEEPEST: usize = 5;
const MOST_FOLDERS: usize = 5_000;
const MOST_RUNS: usize = 200;
/// The worst frames of a sequence that are shown, well apart.
const MOST_WORST: usize = 6;
/// Passes of one sequence that are looked through.
const MOST_PASSES: usize = 100;

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Kind {
    Evaluation,
    Reproduction,
    Tracking,
}

/// A folder of results.
#[derive(Debug, Serialize)]
pub(crate) struct Run {
    /// Relative to the root.
    pub path: String,
    pub kind: Kind,
    /// When it was written last, milliseconds since 1970.
    pub written_ms: Option<u64>,
    /// Of a run of a tracker, its name.
    pub tracker: Option<String>,
    /// Whether it was put right by hand.
    pub edited: bool,
}

/// A frame in which a tracker's box was far from the truth.
#[derive(Debug, Serialize)]
struct Worst {
    /// Of which pass, where a sequence is run through several times.
    pass: Option<String>,
    frame: usize,
    overlap: f64,
    #[serde(rename = "box")]
    bbox: Option<[f64; 4]>,
    truth: [f64; 4],
}

impl Run {
    fn of(root: &Root, folder: &Path, path: String, kind: Kind) -> Self {
        let is_run = kind == Kind::Tracking;
        let modified =
            std::fs::metadata(folder.join(if is_run { TRACKED } else { RESULTS })).and_then(|m| m.modified());
        let since = modified.ok().and_then(|time| time.duration_since(SystemTime::UNIX_EPOCH).ok());
        let facts = if is_run { read(root, folder, TRACKED).ok() } else { None };
        let tracker = facts.and_then(|facts| facts["recipe"]["tracker"].as_str().map(str::to_owned));
        let written_ms = since.and_then(|time| u64::try_from(time.as_millis()).ok());
        Self { path, kind, written_ms, tracker, edited: folder.join(EDITS).is_file() }
    }
}

/// The folders of results below the root, the newest first. Links are not followed.
pub(crate) fn list(root: &Root) -> Result<Vec<Run>, Refusal> {
    let top = root.folder("")?;
    let (mut runs, mut seen, mut waiting) = (Vec::new(), 0, vec![(top.clone(), 0)]);
    while let Some((folder, depth)) = waiting.pop() {
        seen += 1;
        if seen > MOST_FOLDERS || runs.len() >= MOST_RUNS {
            break;
        }
        let kind = match folder.join(RESULTS).is_file() {
            true if folder.join("boxes").is_dir() => Some(Kind::Evaluation),
            true => Some(Kind::Reproduction),
            false => [TRACKED, TRAJECTORY].iter().all(|file| folder.join(file).is_file()).then_some(Kind::Tracking),
        };
        if let Some(kind) = kind {
            let path = folder.strip_prefix(&top).ok().and_then(Path::to_str).map(str::to_owned);
            runs.extend(path.map(|path| Run::of(root, &folder, path, kind)));
            continue;
        }
        let Ok(entries) = std::fs::read_dir(&folder) else { continue };
        let is_folder = |e: &std::fs::DirEntry| e.file_type().is_ok_and(|kind| kind.is_dir());
        let shown = |e: &std::fs::DirEntry| !e.file_name().to_string_lossy().starts_with('.');
        let inner = entries.flatten().filter(|e| depth < DEEPEST && is_folder(e) && shown(e));
        waiting.extend(inner.take(MOST_FOLDERS).map(|e| (e.path(), depth + 1)));
    }
    runs.sort_by(|a, b| b.written_ms.cmp(&a.written_ms).then_with(|| a.path.cmp(&b.path)));
    Ok(runs)
}

/// What is in such a folder.
pub(crate) fn open(root: &Root, path: &str) -> Result<Value, Refusal> {
    let folder = root.folder(path)?;
    if !folder.join(RESULTS).exists() {
        let run = read(root, &folder, TRACKED)?;
        return Ok(json!({ "path": path, "kind": Kind::Tracking, "run": run }));
    }
    let results = read(root, &folder, RESULTS)?;
    if let (Some(protocol), Some(trackers)) = (results.get("protocol"), results["trackers"].as_object()) {
        let trackers: Vec<Value> = trackers
            .iter()
            .map(|(name, own)| json!({ "name": name, "mean": own["mean"], "sequences": own["sequences"] }))
            .collect();
        return Ok(json!({ "path": path, "kind": Kind::Evaluation, "protocol": protocol, "trackers": trackers,
            "problems": results["problems"], "interrupted": results["interrupted"] }));
    }
    if let (Some(paper), Some(rows)) = (results.get("paper"), results.get("rows")) {
        return Ok(json!({ "path": path, "kind": Kind::Reproduction, "paper": paper, "title": results["title"],
            "seeds": results["seeds"], "rows": rows, "findings": results["findings"], "pictures": pictures(&folder) }));
    }
    Err(foreign())
}

fn foreign() -> Refusal {
    Refusal::unfit("this folder holds no results of `pursuit track`, `eval` or `reproduce`")
}

pub(crate) fn read(root: &Root, folder: &Path, name: &str) -> Result<Value, Refusal> {
    let file = root.file(&folder.join(name)).map_err(|_| foreign())?;
    if std::fs::metadata(&file).map_or(u64::MAX, |m| m.len()) > MOST_BYTES {
        return Err(foreign());
    }
    let bytes = std::fs::read(&file).map_err(|e| Refusal::unfit(format!("{name} cannot be read: {e}")))?;
    serde_json::from_slice(&bytes).map_err(|_| foreign())
}

/// Names of the pictures in a folder.
fn pictures(folder: &Path) -> Vec<String> {
    let names = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let names = names.filter_map(|e| e.file_name().into_string().ok());
    let mut names: Vec<String> = names.filter(|name| media_type(name).is_some()).take(MOST_RUNS).collect();
    names.sort();
    names
}

fn media_type(name: &str) -> Option<&'static str> {
    match Path::new(name).extension()?.to_str()? {
        "svg" => Some("image/svg+xml"),
        "png" => Some("image/png"),
        _ => None,
    }
}

/// A picture of a folder of results, and its media type.
pub(crate) fn picture(root: &Root, path: &str, name: &str) -> Result<(&'static str, Vec<u8>), Refusal> {
    let missing = || Refusal::missing("there is no such picture in this folder of results");
    let folder = root.folder(path)?;
    read(root, &folder, RESULTS)?;
    let kind = media_type(name).filter(|_| !name.contains(['/', '\\'])).ok_or_else(missing)?;
    let file = root.file(&folder.join(name)).map_err(|_| missing())?;
    if std::fs::metadata(&file).map_or(u64::MAX, |m| m.len()) > MOST_BYTES {
        return Err(missing());
    }
    std::fs::read(file).map(|bytes| (kind, bytes)).map_err(|_| missing())
}

/// Where a tracker of an evaluation did worst on a sequence: the frames with boxes and truth, and, where the footage is below
/// the root, the source that shows them.
pub(crate) fn worst(
    root: &Root,
    path: &str,
    (tracker, sequence): (&str, &str),
    open: &OpenOptions,
) -> Result<Value, Refusal> {
    let folder = root.folder(path)?;
    let results = read(root, &folder, RESULTS)?;
    let missing = || Refusal::missing("this evaluation has no such tracker or sequence");
    results["trackers"].get(tracker).and_then(|own| own["sequences"].get(sequence)).ok_or_else(missing)?;
    let boxes: PathBuf = [folder.as_path(), "boxes".as_ref(), tracker.as_ref(), sequence.as_ref()].iter().collect();
    let passes = passes(root, &boxes)?;
    if passes.is_empty() {
        return Err(Refusal::missing("the boxes of this sequence are not in this folder"));
    }
    let Some(found) = root.footage(sequence) else {
        return Ok(json!({ "source": null, "first": 0, "frames": [] }));
    };
    let dataset = Dataset::discover(&found, open).map_err(|e| Refusal::unfit(e.to_string()))?;
    let one = dataset.sequences.first().filter(|_| dataset.sequences.len() == 1);
    let Some((one, Footage::Input { path: footage, first })) = one.map(|one| (one, one.footage())) else {
        return Ok(json!({ "source": null, "first": 0, "frames": [] }));
    };
    let source = root.shown(footage)?;
    let frames = worst_of(one.truth(), &passes);
    Ok(json!({ "source": source, "first": first, "frames": frames }))
}

/// What was said in every pass over a sequence: `NAME.csv`, or `NAME@PASS.csv` of each.
fn passes(root: &Root, boxes: &Path) -> Result<Vec<(Option<String>, Trajectory)>, Refusal> {
    let (Some(folder), Some(name)) = (boxes.parent(), boxes.file_name().and_then(|name| name.to_str())) else {
        return Ok(Vec::new());
    };
    let pass_of = |file: &str| -> Option<Option<String>> {
        let rest = file.strip_suffix(".csv")?.strip_prefix(name)?;
        if rest.is_empty() { Some(None) } else { rest.strip_prefix('@').map(|pass| Some(pass.to_owned())) }
    };
    let shown = root.shown(folder).and_then(|folder| root.folder(&folder));
    let Ok(folder) = shown else { return Ok(Vec::new()) };
    let files = std::fs::read_dir(&folder).into_iter().flatten().flatten();
    let files = files.filter_map(|entry| Some((pass_of(entry.file_name().to_str()?)?, entry.path())));
    let mut files: Vec<(Option<String>, PathBuf)> = files.collect();
    files.sort();
    let read = |(pass, path): (Option<String>, PathBuf)| {
        let trajectory = Trajectory::read(&root.file(&path)?).map_err(|e| Refusal::unfit(e.to_string()))?;
        Ok((pass, trajectory))
    };
    files.into_iter().take(MOST_PASSES).map(read).collect()
}

fn worst_of(truth: &[Truth], passes: &[(Option<String>, Trajectory)]) -> Vec<Worst> {
    let ltwh = |b: pursuit::BBox| [b.left(), b.top(), b.width(), b.height()];
    let judge = |(pass, trajectory): &(Option<String>, Trajectory)| {
        let frames = 0..truth.len().min(trajectory.end());
        // Before its start, and after a failure that it is begun again from, a pass says nothing and is not judged.
        let said = frames.filter_map(|frame| Some((frame, trajectory.get(frame)?, truth[frame].bbox()?)));
        let judged = said.map(|(frame, output, there)| {
            let bbox = believed(Some(output));
            let overlap = bbox.map_or(0.0, |b| b.iou(&there));
            Worst { pass: pass.clone(), frame, overlap, bbox: bbox.map(ltwh), truth: ltwh(there) }
        });
        judged.collect::<Vec<_>>()
    };
    let mut all: Vec<Worst> = passes.iter().flat_map(judge).collect();
    all.sort_by(|a, b| a.overlap.total_cmp(&b.overlap).then(a.frame.cmp(&b.frame)).then_with(|| a.pass.cmp(&b.pass)));
    let apart = (truth.len() / 10).max(3);
    let mut chosen: Vec<Worst> = Vec::new();
    for one in all {
        if chosen.len() < MOST_WORST && chosen.iter().all(|c| c.frame.abs_diff(one.frame) >= apart) {
            chosen.push(one);
        }
    }
    chosen
}
