use super::Mark;
use crate::RunError;
use pursuit_geometry::BBox;
use pursuit_tracking::TrackState;
use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};
use std::collections::BTreeMap;

/// CVAT for video 1.1: tracks of boxes. Between two boxes that are farther than a frame apart the target goes straight from one to
/// the other, as CVAT shows it; a box that is `outside` says that it is not in the picture.
pub(super) fn read(text: &str) -> Result<Vec<Mark>, RunError> {
    let mut reader = Reader::from_str(text);
    let (mut marks, mut track, mut depth) = (Vec::new(), None::<Track>, 0_usize);
    loop {
        let event = reader.read_event().map_err(|e| wrong(&e.to_string()))?;
        match &event {
            Event::Start(element) | Event::Empty(element) => {
                let closes = matches!(event, Event::Empty(_));
                match (element.name().as_ref(), &mut track) {
                    ("track", None) if !closes => track = Some(Track::begin(element)?),
                    ("box", Some(track)) => track.boxes.push(Shown::read(element)?),
                    _ => {}
                }
                depth += usize::from(!closes);
            }
            Event::End(element) => {
                if element.name().as_ref() == "track"
                    && let Some(track) = track.take()
                {
                    marks.extend(track.marks());
                }
                depth = depth.saturating_sub(1);
            }
            Event::Eof if depth > 0 => return Err(wrong("it breaks off")),
            Event::Eof => return Ok(marks),
            _ => {}
        }
    }
}

fn wrong(problem: &str) -> RunError {
    RunError::usage(format!("CVAT for video 1.1: {problem}"))
}

struct Track {
    target: u64,
    label: String,
    boxes: Vec<Shown>,
}

#[derive(Clone, Copy)]
struct Shown {
    frame: u64,
    bbox: BBox,
    outside: bool,
    occluded: bool,
    key: bool,
}

fn attributes(element: &BytesStart<'_>) -> Result<BTreeMap<String, String>, RunError> {
    let all = element.attributes().map(|attribute| {
        let attribute = attribute.map_err(|e| wrong(&e.to_string()))?;
        let value = quick_xml::escape::unescape(&attribute.value).map_err(|e| wrong(&e.to_string()))?;
        Ok((attribute.key.as_ref().to_owned(), value.into_owned()))
    });
    all.collect()
}

fn number<T: std::str::FromStr>(all: &BTreeMap<String, String>, name: &str) -> Result<T, RunError> {
    let value = all.get(name).and_then(|value| value.parse().ok());
    value.ok_or_else(|| wrong(&format!("a track or a box has no number for `{name}`")))
}

impl Track {
    fn begin(element: &BytesStart<'_>) -> Result<Self, RunError> {
        let mut all = attributes(element)?;
        let id: u32 = number(&all, "id")?;
        Ok(Self { target: u64::from(id) + 1, label: all.remove("label").unwrap_or_default(), boxes: Vec::new() })
    }

    fn marks(mut self) -> impl Iterator<Item = Mark> {
        self.boxes.sort_by_key(|shown| shown.frame);
        let Self { target, label, boxes } = self;
        let class = Some(label).filter(|label| !label.is_empty() && label != "target");
        let all = (0..boxes.len()).flat_map(move |at| between(boxes[at], boxes.get(at + 1).copied()));
        all.map(move |shown| Mark {
            frame: shown.frame,
            target,
            bbox: shown.bbox,
            state: match (shown.outside, shown.occluded) {
                (true, _) => TrackState::Lost,
                (false, true) => TrackState::Occluded,
                (false, false) => TrackState::Tracking,
            },
            score: if shown.outside { 0.0 } else { 1.0 },
            class: class.clone(),
            key: shown.key && !shown.outside,
            backward: false,
        })
    }
}

impl Shown {
    fn read(element: &BytesStart<'_>) -> Result<Self, RunError> {
        let all = attributes(element)?;
        let [left, top, right, bottom] =
            [number(&all, "xtl")?, number(&all, "ytl")?, number(&all, "xbr")?, number::<f64>(&all, "ybr")?];
        let bbox = BBox::from_ltwh(left, top, right - left, bottom - top);
        if !(bbox.width() > 0.0 && bbox.height() > 0.0 && left.is_finite() && top.is_finite()) {
            return Err(wrong("a box has no size"));
        }
        let is = |name: &str| all.get(name).is_some_and(|value| value == "1");
        Ok(Self {
            frame: number::<u32>(&all, "frame")?.into(),
            bbox,
            outside: is("outside"),
            occluded: is("occluded"),
            key: is("keyframe"),
        })
    }
}

/// A box, and those between it and the next.
fn between(from: Shown, to: Option<Shown>) -> impl Iterator<Item = Shown> {
    let gap = to.filter(|_| !from.outside).map_or(1, |to| (to.frame - from.frame).max(1));
    let end = to.map_or(from.bbox, |to| to.bbox);
    (0..gap).map(move |k| {
        let share = k as f64 / gap as f64;
        let mix = |a: f64, b: f64| a + share * (b - a);
        let (a, b) = (from.bbox, end);
        let bbox = BBox::from_ltwh(
            mix(a.left(), b.left()),
            mix(a.top(), b.top()),
            mix(a.width(), b.width()),
            mix(a.height(), b.height()),
        );
        Shown { frame: from.frame + k, bbox: if k == 0 { a } else { bbox }, key: from.key && k == 0, ..from }
    })
}
