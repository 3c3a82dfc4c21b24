use super::annotated;
use crate::trial::Told;
use std::collections::BTreeMap;
use std::fmt::Write;

/// CVAT for video 1.1: a track for every target, a box for every frame; boxes that the user drew are its key frames, and a
/// box that is `outside` ends a stretch in which the target is in the picture.
pub(super) fn write(told: &Told) -> String {
    let drawn = |frame: u64, target: u64| told.edits.iter().any(|e| e.frame == frame && e.drawn() == Some(target));
    let mut tracks = BTreeMap::<u64, String>::new();
    for record in told.version.rows.iter().flat_map(|row| row.records.iter()) {
        let Some(e) = &record.estimate else { continue };
        let outside = u8::from(annotated(record).is_none());
        let occluded = u8::from(e.state == pursuit::TrackState::Occluded);
        let key = u8::from(drawn(record.frame, record.target.0) || outside == 1);
        let (b, frame) = (e.bbox, record.frame);
        // Writing to a string cannot fail.
        let _ = writeln!(
            tracks.entry(record.target.0).or_default(),
            "    <box frame=\"{frame}\" outside=\"{outside}\" occluded=\"{occluded}\" keyframe=\"{key}\" \
             xtl=\"{:.3}\" ytl=\"{:.3}\" xbr=\"{:.3}\" ybr=\"{:.3}\" z_order=\"0\"></box>",
            b.left(),
            b.top(),
            b.right(),
            b.bottom()
        );
    }
    let mut text = "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<annotations>\n  <version>1.1</version>\n".to_owned();
    for (target, boxes) in tracks {
        let id = target.saturating_sub(1);
        let _ = write!(text, "  <track id=\"{id}\" label=\"target\" source=\"manual\">\n{boxes}  </track>\n");
    }
    text + "</annotations>\n"
}
