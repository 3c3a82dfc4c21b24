//! Detections as ROS 2 writes messages: CDR, little-endian.

use super::super::{annotated, label};
use crate::Record;

/// The name that frames are given.
const FRAME_ID: &str = "camera";

/// The bytes of one message.
struct Cdr(Vec<u8>);

impl Cdr {
    fn new() -> Self {
        Self(vec![0, 1, 0, 0])
    }

    /// Numbers stand at multiples of their size, counted behind the first four bytes.
    fn number<const N: usize>(&mut self, bytes: [u8; N]) {
        let length = 4 + (self.0.len() - 4).next_multiple_of(N);
        self.0.resize(length, 0);
        self.0.extend(bytes);
    }

    fn u32(&mut self, value: u32) {
        self.number(value.to_le_bytes());
    }

    fn f64(&mut self, value: f64) {
        self.number(value.to_le_bytes());
    }

    fn text(&mut self, text: &str) {
        self.u32(u32::try_from(text.len() + 1).unwrap_or(u32::MAX));
        self.0.extend(text.bytes());
        self.0.push(0);
    }

    fn header(&mut self, time_ns: u64) {
        self.u32((time_ns / 1_000_000_000) as u32);
        self.u32((time_ns % 1_000_000_000) as u32);
        self.text(FRAME_ID);
    }
}

/// `vision_msgs/msg/Detection2DArray`: every target that is believed to be in the picture, under an id that stays.
pub(super) fn detections(time_ns: u64, records: &[Record]) -> Vec<u8> {
    let mut cdr = Cdr::new();
    cdr.header(time_ns);
    let seen: Vec<_> = records.iter().filter_map(|record| Some((record, annotated(record)?))).collect();
    cdr.u32(seen.len() as u32);
    for (record, estimate) in seen {
        cdr.header(time_ns);
        // One hypothesis: what it is and how sure that is. Where it is in space nobody says.
        cdr.u32(1);
        cdr.text(label(record));
        cdr.f64(estimate.score);
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0].into_iter().for_each(|value| cdr.f64(value));
        (0..36).for_each(|_| cdr.f64(0.0));
        let (center, bbox) = (estimate.bbox.center(), estimate.bbox);
        [center.x, center.y, 0.0, bbox.width(), bbox.height()].into_iter().for_each(|value| cdr.f64(value));
        cdr.text(&record.target.0.to_string());
    }
    cdr.0
}
