use super::format::{Declared, Format, Kind};
use super::jsonl::coco_mask;
use super::text::{Text, TextRow};
use super::{annotated, label};
use pursuit_geometry::Size;
use pursuit_tracking::TrackState;
use serde_json::{Value, json};

pub(super) const FORMAT: Format = Format(&Declared {
    name: "coco",
    summary: "COCO's object detection, with the target's number as `track_id`; written at the end",
    file_name: "annotations.json",
    media_type: "application/json",
    kind: Kind::Text(
        |size| Box::new(Coco { size, images: Vec::new(), annotations: Vec::new(), labels: Vec::new() }),
        None,
    ),
});

/// COCO's object detection: an image for every frame, an annotation for every target in it. Boxes are left, top, width,
/// height in pixels from 0, as COCO has them; where there is a mask, `segmentation` holds its compressed runs and `area` its pixels.
struct Coco {
    size: Size,
    images: Vec<Value>,
    annotations: Vec<Value>,
    labels: Vec<String>,
}

impl Text for Coco {
    fn add(&mut self, row: &TextRow<'_>, _: &mut Vec<u8>) {
        let (image, Size { width, height }) = (row.frame + 1, self.size);
        let name = format!("{:06}.jpg", row.frame);
        self.images.push(json!({ "id": image, "file_name": name, "width": width, "height": height }));
        for record in row.records {
            let Some(e) = annotated(record) else { continue };
            let label = label(record);
            let known = self.labels.iter().position(|known| known == label);
            let category = known.unwrap_or_else(|| {
                self.labels.push(label.to_owned());
                self.labels.len() - 1
            });
            let (left, top, width, height) = e.bbox.ltwh();
            let (occluded, backward) = (e.state == TrackState::Occluded, row.backward.contains(&record.target.0));
            let mut annotation = json!({
                "id": self.annotations.len() + 1, "image_id": image, "category_id": category + 1, "track_id": record.target.0,
                "bbox": [left, top, width, height], "area": e.bbox.area(), "iscrowd": 0, "score": e.score,
                "attributes": { "occluded": occluded, "backward": backward },
            });
            if let (Some(segmentation), Some(mask)) = (coco_mask(record, self.size), &e.mask) {
                annotation["segmentation"] = segmentation;
                annotation["area"] = json!(mask.area());
            }
            self.annotations.push(annotation);
        }
    }

    fn end(&mut self, out: &mut Vec<u8>) {
        let categories: Vec<Value> =
            (1..).zip(&self.labels).map(|(id, name)| json!({ "id": id, "name": name })).collect();
        let (images, annotations) = (std::mem::take(&mut self.images), std::mem::take(&mut self.annotations));
        let text = json!({ "images": images, "annotations": annotations, "categories": categories }).to_string() + "\n";
        out.extend_from_slice(text.as_bytes());
    }
}
