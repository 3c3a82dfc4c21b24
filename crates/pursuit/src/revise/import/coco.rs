use super::Mark;
use crate::RunError;
use pursuit_geometry::BBox;
use pursuit_tracking::TrackState;
use serde::Deserialize;
use std::collections::BTreeMap;

#[derive(Deserialize)]
struct File {
    images: Vec<Image>,
    annotations: Vec<Annotation>,
    #[serde(default)]
    categories: Vec<Category>,
}

#[derive(Deserialize)]
struct Image {
    id: u64,
    #[serde(default)]
    file_name: String,
}

#[derive(Deserialize)]
struct Annotation {
    image_id: u64,
    #[serde(default)]
    category_id: u64,
    track_id: Option<u64>,
    bbox: [f64; 4],
    score: Option<f64>,
    #[serde(default)]
    attributes: Attributes,
}

#[derive(Deserialize, Default)]
struct Attributes {
    track_id: Option<u64>,
    #[serde(default)]
    occluded: bool,
    #[serde(default)]
    backward: bool,
}

#[derive(Deserialize)]
struct Category {
    id: u64,
    name: String,
}

/// COCO's object detection with `track_id`. An image is the frame that its name counts, where its number is one more, as in our own
/// files; else images are frames in the order of their numbers.
pub(super) fn read(text: &str) -> Result<Vec<Mark>, RunError> {
    let wrong = |problem: String| RunError::usage(format!("COCO: {problem}"));
    let File { mut images, annotations, categories } = serde_json::from_str(text).map_err(|e| wrong(e.to_string()))?;
    images.sort_by_key(|image| image.id);
    let named = |image: &Image| image.file_name.split('.').next()?.parse::<u64>().ok();
    let counts = images.iter().all(|image| named(image).is_some_and(|name| name + 1 == image.id));
    let frame_of = |(at, image): (u64, &Image)| (image.id, named(image).filter(|_| counts).unwrap_or(at));
    let frames: BTreeMap<u64, u64> = (0..).zip(&images).map(frame_of).collect();
    let classes: BTreeMap<u64, String> = categories.into_iter().map(|c| (c.id, c.name)).collect();
    let mark = |(at, a): (usize, Annotation)| {
        let frame = frames.get(&a.image_id).ok_or_else(|| wrong(format!("there is no image {}", a.image_id)))?;
        let target = a.track_id.or(a.attributes.track_id);
        let target = target.ok_or_else(|| wrong(format!("annotation {at} has no track_id: which target is it?")))?;
        let [left, top, width, height] = a.bbox;
        if !(width > 0.0 && height > 0.0 && left.is_finite() && top.is_finite()) {
            return Err(wrong(format!("annotation {at} has no box: {:?}", a.bbox)));
        }
        let state = if a.attributes.occluded { TrackState::Occluded } else { TrackState::Tracking };
        Ok(Mark {
            frame: *frame,
            target,
            bbox: BBox::from_ltwh(left, top, width, height),
            state,
            score: a.score.unwrap_or(1.0),
            class: classes.get(&a.category_id).filter(|name| *name != "target").cloned(),
            key: false,
            backward: a.attributes.backward,
        })
    };
    annotations.into_iter().enumerate().map(mark).collect()
}
