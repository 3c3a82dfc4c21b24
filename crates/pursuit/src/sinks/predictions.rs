use super::format::{Declared, Format, Kind};
use super::text::{Text, TextRow};
use crate::Record;
use pursuit_geometry::Point;
use pursuit_tracking::{Estimate, TargetId, TrackState};
use std::collections::BTreeMap;
use std::io::Write;

pub(super) const FORMAT: Format = Format(&Declared {
    name: "predictions",
    summary: "A text table of actual positions beside those predicted a sample before",
    file_name: "predictions.txt",
    media_type: "text/plain; charset=utf-8",
    kind: Kind::Text(|_| Box::<Predictions>::default(), None),
});

/// The table of qu2010, the actual position of a target beside what was predicted for it a sample before, in whole pixels. Where the
/// target was not seen when a prediction fell due, its row says `missed` for the actual position.
///
/// Of motion models that sample (`qu2010`, `qu2010-simplified`) there is a row a sample; of all others a row a frame, with the
/// prediction made before the frame was seen.
#[derive(Default)]
struct Predictions {
    /// When a prediction falls due, and what it is.
    due: BTreeMap<TargetId, (f64, Point)>,
}

/// A frame this much before its time, in seconds, is the one meant: clocks round.
const EARLY_S: f64 = 1e-3;

impl Predictions {
    /// The prediction that this frame's position is to be compared with; notes the next one.
    fn predicted(&mut self, record: &Record, estimate: &Estimate) -> Option<Point> {
        let Some(next) = estimate.next else { return estimate.prediction.map(|b| b.center()) };
        // Too few samples yet.
        let center = next.center?;
        let due = self.due.get(&record.target).copied();
        let is_due = due.is_none_or(|(time_s, _)| record.time_s >= time_s - EARLY_S);
        if is_due {
            self.due.insert(record.target, (record.time_s + next.in_s, center));
        }
        due.filter(|_| is_due).map(|(_, at)| at)
    }
}

impl Text for Predictions {
    fn begin(&mut self, out: &mut Vec<u8>) {
        let _ = writeln!(out, "{:>8} {:>7} {:>15} {:>15}", "frame", "target", "actual", "predicted");
    }

    fn add(&mut self, row: &TextRow<'_>, out: &mut Vec<u8>) {
        for record in row.records {
            let Some(estimate) = &record.estimate else { continue };
            let Some(predicted) = self.predicted(record, estimate) else { continue };
            let cell = |p: Point| format!("({:.0}, {:.0})", p.x, p.y);
            let seen = estimate.state == TrackState::Tracking;
            let actual = if seen { cell(estimate.bbox.center()) } else { "missed".to_owned() };
            let predicted = cell(predicted);
            // Writing to memory cannot fail.
            let _ = writeln!(out, "{:>8} {:>7} {actual:>15} {predicted:>15}", record.frame, record.target);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::revise::Row;
    use pursuit_geometry::{BBox, Size};
    use pursuit_imaging::{Frame, Image};
    use pursuit_tracking::Track;
    use pursuit_tracking::many::Elapsed;
    use pursuit_tracking::motion::{Motion, MotionFilter, MotionModel, MotionParams, Sight};

    fn frame(k: u64) -> Frame {
        Frame::new(k, k as f64 * 0.04, Image::filled(9, 9, 0u8).unwrap())
    }

    fn bbox([x, y]: [f64; 2]) -> BBox {
        BBox::from_center_size(Point::new(x, y), 20.0, 50.0)
    }

    /// What is written of one target that goes along `path`, five frames to each position.
    fn written(model: MotionModel, path: &[[f64; 2]]) -> String {
        written_without(model, path, 0..0)
    }

    /// The same, where the target is not seen in the frames `missed`.
    fn written_without(model: MotionModel, path: &[[f64; 2]], missed: std::ops::Range<u64>) -> String {
        let mut rows = Vec::new();
        let mut motion = Motion::new(MotionParams { model, ..MotionParams::default() }, bbox(path[0])).unwrap();
        for k in 0..5 * path.len() as u64 - 4 {
            let frame = frame(k);
            let seen = bbox(path[k as usize / 5]);
            let mut estimate = Estimate::started(frame.time_s(), seen, 1.0);
            if k > 0 {
                estimate.prediction = Some(motion.predict(0.04).unwrap().bbox);
                if missed.contains(&k) {
                    estimate.state = TrackState::Occluded;
                } else {
                    motion.correct(&Sight::of(seen, None)).unwrap();
                }
                estimate.next = motion.next_sample();
            }
            let track = Track {
                id: TargetId(1),
                estimate: Some(estimate),
                started: k == 0,
                elapsed: Elapsed::default(),
                class: None,
                detection: None,
            };
            rows.push(Row::new(&frame, vec![Record::new(&frame, track)]));
        }
        String::from_utf8(FORMAT.of_rows(&rows, &[], Size::new(9, 9)).unwrap()).unwrap()
    }

    #[test]
    fn the_papers_table_is_written() {
        // Table 1: the positions of frames 1 to 4 and 5 to 8; its predictions are those of the third and fourth.
        let early =
            written(MotionModel::Qu2010Simplified, &[[12.0, 119.0], [16.0, 116.0], [34.0, 120.0], [59.0, 113.0]]);
        let rows: Vec<Vec<&str>> = early.lines().map(|l| l.split_whitespace().collect()).collect();
        assert_eq!(rows[0], ["frame", "target", "actual", "predicted"]);
        assert_eq!(rows[1], ["10", "1", "(34,", "120)", "(20,", "113)"], "{early}");
        assert_eq!(rows[2], ["15", "1", "(59,", "113)", "(52,", "124)"], "{early}");
        assert_eq!(rows.len(), 3, "{early}");
    }

    #[test]
    fn missed_frames_are_kept_and_said() {
        let path = [[12.0, 119.0], [16.0, 116.0]];
        let text = written_without(MotionModel::None, &path, 2..4);
        let actual: Vec<&str> = text.lines().skip(1).map(|l| l[16..32].trim()).collect();
        assert_eq!(actual, ["(12, 119)", "missed", "missed", "(12, 119)", "(16, 116)"], "{text}");
    }

    #[test]
    fn a_sample_that_was_missed_has_its_row() {
        let path = [[12.0, 119.0], [16.0, 116.0], [34.0, 120.0], [59.0, 113.0]];
        let text = written_without(MotionModel::Qu2010Simplified, &path, 10..11);
        let row = text.lines().find(|l| l.split_whitespace().next() == Some("10")).unwrap_or_else(|| panic!("{text}"));
        assert!(row.contains("missed") && row.trim_end().ends_with("(20, 113)"), "{text}");
    }

    #[test]
    fn other_models_have_a_row_a_frame() {
        let text = written(MotionModel::None, &[[12.0, 119.0], [16.0, 116.0]]);
        assert_eq!(text.lines().count(), 1 + 5, "{text}");
        assert!(text.lines().last().unwrap().trim_end().ends_with("(16, 116)       (12, 119)"), "{text}");
    }
}
