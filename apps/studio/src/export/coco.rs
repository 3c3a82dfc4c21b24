use super::annotated;
use crate::trial::Told;
use serde_json::{Value, json};

/// COCO's object detection: an image for every frame, an annotation for every target in it. Boxes are left, top, width,
/// height in pixels from 0, as COCO has them.
pub(super) fn write(told: &Told) -> String {
    let (width, height) = (told.info.size.width, told.info.size.height);
    let images: Vec<Value> = (told.version.rows.iter())
        .map(|row| {
            let name = format!("{:06}.jpg", row.frame);
            json!({ "id": row.frame + 1, "file_name": name, "width": width, "height": height })
        })
        .collect();
    let records = told.version.rows.iter().flat_map(|row| row.records.iter().map(move |record| (row, record)));
    let annotations: Vec<Value> = records
        .filter_map(|(row, record)| Some((row, record, annotated(record)?)))
        .zip(1..)
        .map(|((row, record, e), id)| {
            let (occluded, backward) =
                (e.state == pursuit::TrackState::Occluded, row.backward.contains(&record.target.0));
            let (l, t, w, h) = e.bbox.ltwh();
            json!({
                "id": id, "image_id": record.frame + 1, "category_id": 1, "track_id": record.target.0,
                "bbox": [l, t, w, h], "area": e.bbox.area(), "iscrowd": 0, "score": e.score,
                "attributes": { "occluded": occluded, "backward": backward },
            })
        })
        .collect();
    let categories = json!([{ "id": 1, "name": "target" }]);
    json!({ "images": images, "annotations": annotations, "categories": categories }).to_string() + "\n"
}
