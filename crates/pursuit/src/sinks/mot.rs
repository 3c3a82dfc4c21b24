use super::format::{Declared, Format, Kind, Lines};
use super::text::{Text, TextRow};
use pursuit_tracking::TrackState;
use std::io::Write;

pub(super) const FORMAT: Format = Format(&Declared {
    name: "mot",
    summary: "MOTChallenge: measured targets only, counted from 1",
    file_name: "trajectory.txt",
    media_type: "text/plain; charset=utf-8",
    kind: Kind::Text(
        |_| Box::new(Mot),
        Some(Lines {
            has_header: false,
            frame_of: |line| line.split(',').next()?.trim().parse::<u64>().ok()?.checked_sub(1),
        }),
    ),
});

/// `frame,id,left,top,width,height,conf,-1,-1,-1`, frames and boxes' corners from 1; only targets that are being measured
/// have a line.
struct Mot;

impl Text for Mot {
    fn add(&mut self, row: &TextRow<'_>, out: &mut Vec<u8>) {
        for record in row.records {
            let Some(e) = record.estimate.as_ref().filter(|e| e.state == TrackState::Tracking) else { continue };
            let (left, top, width, height) = e.bbox.ltwh();
            let (frame, id, left, top) = (row.frame + 1, record.target, left + 1.0, top + 1.0);
            // Writing to memory cannot fail.
            let _ = writeln!(out, "{frame},{id},{left:.3},{top:.3},{width:.3},{height:.3},{:.4},-1,-1,-1", e.score);
        }
    }
}
