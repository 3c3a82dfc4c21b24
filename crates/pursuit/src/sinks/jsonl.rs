use super::format::{Declared, Format, Kind, Lines};
use super::text::{Text, TextRow};
use crate::Record;
use pursuit_geometry::{BBox, CocoMask, Size};
use pursuit_tracking::{Class, Doubt};
use serde_json::{Map, Value, json};

pub(super) const FORMAT: Format = Format(&Declared {
    name: "jsonl",
    summary: "A JSON object a line, with covariances, diagnostics and, where a mask was asked for, COCO's runs of it",
    file_name: "trajectory.jsonl",
    media_type: "application/jsonl",
    kind: Kind::Text(
        |size| Box::new(Jsonl { size }),
        Some(Lines { has_header: false, frame_of: |line| serde_json::from_str::<Value>(line).ok()?["frame"].as_u64() }),
    ),
});

/// The columns of the CSV grouped, the covariance, the mask and the tracker's own diagnostics.
struct Jsonl {
    size: Size,
}

impl Text for Jsonl {
    fn add(&mut self, row: &TextRow<'_>, out: &mut Vec<u8>) {
        for record in row.records {
            let mut object = object(record);
            if let Some(mask) = coco_mask(record, self.size) {
                object["mask"] = mask;
            }
            out.extend(object.to_string().into_bytes());
            out.push(b'\n');
        }
    }
}

/// The record as a JSON object; what is not there is `null`.
pub(crate) fn object(record: &Record) -> Value {
    let estimate = record.estimate.as_ref();
    let diagnostics: Map<String, Value> =
        estimate.into_iter().flat_map(|e| e.diagnostics.iter()).map(|(k, v)| (k.to_owned(), json!(v))).collect();
    json!({
        "frame": record.frame,
        "time_s": record.time_s,
        "target": record.target.0,
        "class": record.class.as_ref().map(Class::as_str),
        "state": estimate.map_or("lost", |e| e.state.as_str()),
        "doubt": estimate.and_then(|e| e.doubt).map(Doubt::as_str),
        "box": estimate.map(|e| ltwh(e.bbox)),
        "score": estimate.map(|e| e.score),
        "prediction": estimate.and_then(|e| e.prediction).map(ltwh),
        "measurement": estimate.and_then(|e| e.measurement).map(ltwh),
        "covariance": estimate.and_then(|e| e.covariance).map(|c| c.row_iter().map(|r| r.iter().copied().collect()).collect::<Vec<Vec<f64>>>()),
        "next": estimate.and_then(|e| e.next).map(|next| json!({
            "in_s": next.in_s,
            "center": next.center.map(|at| [at.x, at.y]),
        })),
        "diagnostics": diagnostics,
        "update_ms": record.update_ms,
    })
}

/// The mask of the target in a picture of `size` as COCO has it, `{"size": [height, width], "counts": "…"}`; none where there is none.
pub(super) fn coco_mask(record: &Record, size: Size) -> Option<Value> {
    let mask = record.estimate.as_ref()?.mask.as_ref()?;
    let CocoMask { size, counts } = mask.to_coco(size).ok()?;
    Some(json!({ "size": size, "counts": counts }))
}

fn ltwh(b: BBox) -> [f64; 4] {
    [b.left(), b.top(), b.width(), b.height()]
}
