use super::format::{Declared, Format, Kind};
use super::text::{Text, TextRow};
use super::{annotated, label};
use pursuit_tracking::TrackState;
use std::collections::BTreeMap;
use std::io::Write;

pub(super) const FORMAT: Format = Format(&Declared {
    name: "cvat",
    summary: "CVAT for video 1.1, a track for every target; written at the end",
    file_name: "annotations.xml",
    media_type: "application/xml",
    kind: Kind::Text(|_| Box::<Cvat>::default(), None),
});

/// CVAT for video 1.1: a track for every target, a box for every frame. The first box of a target and those that a user drew
/// are key frames, and a box that is `outside` ends a stretch in which the target is in the picture.
#[derive(Default)]
struct Cvat(BTreeMap<u64, Track>);

struct Track {
    label: String,
    boxes: Vec<u8>,
}

impl Text for Cvat {
    fn add(&mut self, row: &TextRow<'_>, _: &mut Vec<u8>) {
        for record in row.records {
            let Some(e) = &record.estimate else { continue };
            let track = self.0.entry(record.target.0);
            let track = track.or_insert_with(|| Track { label: label(record).to_owned(), boxes: Vec::new() });
            let is_first = track.boxes.is_empty();
            let outside = u8::from(annotated(record).is_none());
            let occluded = u8::from(e.state == TrackState::Occluded);
            let key = u8::from(is_first || outside == 1 || row.drawn.contains(&record.target.0));
            let (b, frame) = (e.bbox, row.frame);
            // Writing to memory cannot fail.
            let _ = writeln!(
                track.boxes,
                "    <box frame=\"{frame}\" outside=\"{outside}\" occluded=\"{occluded}\" keyframe=\"{key}\" \
                 xtl=\"{:.3}\" ytl=\"{:.3}\" xbr=\"{:.3}\" ybr=\"{:.3}\" z_order=\"0\"></box>",
                b.left(),
                b.top(),
                b.right(),
                b.bottom()
            );
        }
    }

    fn end(&mut self, out: &mut Vec<u8>) {
        out.extend(b"<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<annotations>\n  <version>1.1</version>\n");
        for (target, Track { label, boxes }) in std::mem::take(&mut self.0) {
            let id = target.saturating_sub(1);
            let label = label.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;");
            let _ = writeln!(out, "  <track id=\"{id}\" label=\"{label}\" source=\"manual\">");
            out.extend(boxes);
            out.extend(b"  </track>\n");
        }
        out.extend(b"</annotations>\n");
    }
}
