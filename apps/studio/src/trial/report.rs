//! What the page is told, as JSON.

use pursuit::geometry::Truth;
use pursuit::media::SourceInfo;
use pursuit::revise::{Edit, EditKind, Row};
use pursuit::tracking::Class;
use pursuit::{BBox, Record};
use serde_json::{Map, Value, json};

/// What is known of every target in one frame; errors are against the truth where the input brings it.
pub(crate) fn row(row: &Row, info: &SourceInfo) -> Value {
    let truth = info.truth_at(row.frame);
    let records: Vec<Value> =
        row.records.iter().map(|r| record(r, row.backward.contains(&r.target.0), &truth)).collect();
    json!({
        "frame": row.frame,
        "time_s": row.time_s,
        "truth": truth.bbox().map(ltwh),
        "absent": matches!(truth, Truth::Absent),
        "records": records,
    })
}

fn record(record: &Record, backward: bool, truth: &Truth) -> Value {
    let Some(e) = &record.estimate else { return json!({ "target": record.target.0 }) };
    let apart = |a: BBox, b: BBox| (a.center().x - b.center().x).hypot(a.center().y - b.center().y);
    let why: Map<String, Value> = e.diagnostics.iter().map(|(name, value)| (name.to_owned(), value.into())).collect();
    json!({
        "target": record.target.0,
        "class": record.class.as_ref().map(Class::as_str),
        "state": e.state,
        "doubt": e.doubt,
        "score": e.score,
        "box": ltwh(e.bbox),
        "predicted": e.prediction.map(ltwh),
        "measured": e.measurement.map(ltwh),
        "searched": e.searched.map(ltwh),
        "covariance": e.covariance.map(|c| [c[(0, 0)], c[(0, 1)], c[(1, 1)]]),
        "velocity": e.velocity.map(|v| [v.x, v.y]),
        "innovation_px": e.prediction.zip(e.measurement).map(|(p, m)| apart(p, m)),
        "error_px": truth.bbox().map(|t| apart(t, e.bbox)),
        "update_ms": record.update_ms,
        "backward": backward,
        "why": why,
    })
}

/// What is known of an input; its length in frames, and whether that is about so.
pub(crate) fn input(info: &SourceInfo, (frame_count, about): (Option<u64>, bool)) -> Value {
    let size = info.input_size();
    json!({
        "name": info.name, "width": size.width, "height": size.height, "region": info.view.map(|view| view.region), "fps": info.fps,
        "frame_count": frame_count, "about": about, "live": info.live, "decoder": info.decoder, "truth": info.truth.is_some(),
    })
}

fn ltwh(bbox: BBox) -> [f64; 4] {
    [bbox.left(), bbox.top(), bbox.width(), bbox.height()]
}

/// What a time line needs of a row: target, state, score and box; a few numbers each.
pub(crate) fn brief(row: &Row) -> Value {
    let records = row.records.iter().filter_map(|r| {
        let e = r.estimate.as_ref()?;
        let innovation = e.prediction.zip(e.measurement).map(|(p, m)| {
            let (p, m) = (p.center(), m.center());
            (m.x - p.x).hypot(m.y - p.y)
        });
        Some(json!([r.target.0, e.state, e.score, ltwh(e.bbox), innovation, row.backward.contains(&r.target.0)]))
    });
    json!([row.frame, row.time_s, records.collect::<Vec<_>>()])
}

/// What the user did, as the page lists it.
pub(crate) fn edit(edit: &Edit) -> Value {
    let (what, target) = match &edit.kind {
        EditKind::Add { target, .. } => ("add", Some(*target)),
        EditKind::Correct { target, .. } => ("correct", Some(*target)),
        EditKind::Remove { target } => ("remove", Some(*target)),
        EditKind::Change { .. } => ("change", None),
    };
    json!({ "frame": edit.frame, "what": what, "target": target })
}
