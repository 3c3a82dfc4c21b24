use super::annotated;
use super::format::{Declared, Format, Kind};
use super::text::{Text, TextRow};
use pursuit_geometry::Mask;
use pursuit_tracking::TargetId;
use std::io::Write;

pub(super) const FORMAT: Format = Format(&Declared {
    name: "vot",
    summary: "VOT's regions of one target, a line a frame: its mask, or its box where there is none",
    file_name: "regions.txt",
    media_type: "text/plain; charset=utf-8",
    kind: Kind::Text(|_| Box::<Regions>::default(), None),
});

/// A line for every frame, as VOT's toolkit reads trajectories: `m` with the mask's runs, else left, top, width and height of the box; `0`,
/// nothing, in frames in which the target is not believed to be in the picture. The format knows one target: the first.
#[derive(Default)]
struct Regions {
    target: Option<TargetId>,
}

impl Text for Regions {
    fn add(&mut self, row: &TextRow<'_>, out: &mut Vec<u8>) {
        self.target = self.target.or_else(|| row.records.first().map(|r| r.target));
        let record = row.records.iter().find(|r| Some(r.target) == self.target);
        // Writing to memory cannot fail.
        let _ = match record.and_then(annotated) {
            None => writeln!(out, "0"),
            Some(e) => match e.mask.as_deref().map(Mask::to_vot) {
                Some(mask) => writeln!(out, "{mask}"),
                None => {
                    let (left, top, width, height) = e.bbox.ltwh();
                    writeln!(out, "{left:.4},{top:.4},{width:.4},{height:.4}")
                }
            },
        };
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use crate::Record;
    use crate::revise::Row;
    use pursuit_geometry::{BBox, Size};
    use pursuit_imaging::{Frame, Image};
    use pursuit_tracking::many::Elapsed;
    use pursuit_tracking::{Estimate, Track, TrackState};
    use std::sync::Arc;

    const SIZE: Size = Size::new(9, 7);

    fn rows() -> Vec<Row> {
        let bbox = BBox::from_ltwh(2.0, 1.0, 3.0, 2.0);
        let mask = Some(Arc::new(Mask::from_bbox(&bbox, SIZE)));
        let seen = Estimate { mask, ..Estimate::started(0.0, bbox, 1.0) };
        let boxed = Estimate::started(0.04, bbox, 1.0);
        let lost = Estimate { state: TrackState::Lost, ..boxed.clone() };
        let row = |(k, estimate): (u64, Estimate)| {
            let frame = Frame::new(k, 0.04 * k as f64, Image::filled(9, 7, 0_u8).unwrap());
            let track = |id, estimate| Track {
                id: TargetId(id),
                estimate,
                started: k == 0,
                elapsed: Elapsed::default(),
                class: None,
                detection: None,
            };
            let records = [track(3, Some(estimate)), track(4, Some(Estimate::started(0.0, bbox, 1.0)))];
            Row::new(&frame, records.into_iter().map(|track| Record::new(&frame, track)).collect())
        };
        (0..).zip([seen, boxed, lost]).map(row).collect()
    }

    #[test]
    fn a_line_is_a_mask_a_box_or_nothing() {
        let text = String::from_utf8(FORMAT.of_rows(&rows(), &[], SIZE).unwrap()).unwrap();
        assert_eq!(text, "m2,1,3,2,0,6\n2.0000,1.0000,3.0000,2.0000\n0\n");
    }

    #[test]
    fn coco_and_json_lines_hold_the_same_mask() {
        let coco: serde_json::Value =
            serde_json::from_slice(&super::super::coco::FORMAT.of_rows(&rows(), &[], SIZE).unwrap()).unwrap();
        let first = &coco["annotations"][0];
        assert_eq!((first["area"].as_u64(), &first["segmentation"]["size"]), (Some(6), &serde_json::json!([7, 9])));
        let read: pursuit_geometry::CocoMask = serde_json::from_value(first["segmentation"].clone()).unwrap();
        assert_eq!(read.mask().unwrap().to_vot(), "m2,1,3,2,0,6");
        assert!(coco["annotations"][1].get("segmentation").is_none());
        let lines = String::from_utf8(super::super::jsonl::FORMAT.of_rows(&rows(), &[], SIZE).unwrap()).unwrap();
        let lines: Vec<serde_json::Value> = lines.lines().map(|l| serde_json::from_str(l).unwrap()).collect();
        assert_eq!(lines[0]["mask"], first["segmentation"]);
        assert!(lines[1].get("mask").is_none());
    }
}
