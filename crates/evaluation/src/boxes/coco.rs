//! COCO's results and annotations.

use super::rows::Builder;
use crate::Result;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::io::BufRead;

#[derive(Deserialize)]
#[serde(untagged)]
enum File {
    Results(Vec<Annotation>),
    Whole {
        #[serde(default)]
        images: Vec<Image>,
        annotations: Vec<Annotation>,
        #[serde(default)]
        categories: Vec<Category>,
    },
}

#[derive(Deserialize)]
struct Image {
    id: u64,
    frame_id: Option<u64>,
}

#[derive(Deserialize)]
struct Annotation {
    image_id: u64,
    bbox: [f64; 4],
    score: Option<f64>,
    category_id: Option<u64>,
    track_id: Option<u64>,
}

#[derive(Deserialize)]
struct Category {
    id: u64,
    name: String,
}

pub(super) fn read(bytes: &mut dyn BufRead, builder: &mut Builder) -> Result<()> {
    let file: File = serde_json::from_reader(bytes).map_err(|e| {
        let form = r#"[{"image_id": 0, "bbox": [left, top, width, height], "score": 0.9, "category_id": 1}, …]"#;
        builder.wrong((e.line() > 0).then_some(e.line()), format!("{e}; COCO's results are {form}"))
    })?;
    let (images, annotations, categories) = match file {
        File::Results(annotations) => (Vec::new(), annotations, Vec::new()),
        File::Whole { images, annotations, categories } => (images, annotations, categories),
    };
    let names: BTreeMap<u64, String> = categories.into_iter().map(|c| (c.id, c.name)).collect();
    let frames = frames(images);
    for annotation in annotations {
        let image = annotation.image_id;
        let frame = match &frames {
            Some(frames) => *frames.get(&image).ok_or_else(|| {
                builder.wrong(None, format!("a box is of image {image}, which `images` does not list"))
            })?,
            None => image,
        };
        let class = annotation.category_id.map(|id| names.get(&id).cloned().unwrap_or_else(|| id.to_string()));
        let class = class.map(|word| builder.class(&word));
        let score = annotation.score.unwrap_or(1.0);
        builder.add(None, (frame, annotation.track_id, class), annotation.bbox, score)?;
    }
    if frames.is_none() {
        builder.count_from_zero();
    }
    Ok(())
}

/// The frame of each image: as it says itself, else its place in the order of the ids. `None` where no image is listed.
fn frames(mut images: Vec<Image>) -> Option<BTreeMap<u64, u64>> {
    images.sort_by_key(|i| i.id);
    let numbered = |(place, image): (u64, Image)| (image.id, image.frame_id.unwrap_or(place));
    Some((0..).zip(images).map(numbered).collect()).filter(|frames: &BTreeMap<u64, u64>| !frames.is_empty())
}
