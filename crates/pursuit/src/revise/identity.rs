//! Who is who, put right by hand: two numbers that are one target, one that is two, two that were mistaken for each other.

use super::{Edit, EditKind, Row};
use crate::RunError;
use pursuit_geometry::BBox;
use pursuit_tracking::TargetId;
use std::ops::RangeInclusive;

/// A change of the targets' numbers. What was followed stands as it is and is called otherwise; followed again, each target begins on the
/// box that it has where the change begins.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Identity {
    /// Both are one target, known by `into` from now on: the later of the two, from its first frame on, is where it is.
    Merge {
        /// The number that is given up.
        target: u64,
        /// The number that stays.
        into: u64,
    },
    /// From frame `at` on it is another target.
    Split {
        /// The number that stays up to there.
        target: u64,
        /// The first frame of the other.
        at: u64,
        /// The number of the other, which nobody has yet.
        new: u64,
    },
    /// In these frames each was taken for the other.
    Swap {
        /// The two numbers.
        targets: [u64; 2],
        /// The frames, both ends included.
        frames: RangeInclusive<u64>,
    },
}

impl Identity {
    /// The rows and the edits of the trajectory with this change.
    ///
    /// # Errors
    /// [`RunError::Usage`] for targets that there are not, or not there.
    pub fn apply(&self, rows: &[Row], edits: &[Edit]) -> Result<(Vec<Row>, Vec<Edit>), RunError> {
        match self {
            Self::Merge { target, into } => merge(*target, *into, rows, edits),
            Self::Split { target, at, new } => split(*target, *at, *new, rows, edits),
            Self::Swap { targets, frames } => swap(*targets, frames, rows, edits),
        }
    }
}

fn merge(target: u64, into: u64, rows: &[Row], edits: &[Edit]) -> Result<(Vec<Row>, Vec<Edit>), RunError> {
    if target == into {
        return Err(RunError::usage("a target is not merged with itself; name another"));
    }
    let (first, second) = (first_of(target, rows)?, first_of(into, rows)?);
    let ((early, _), (late, begins)) =
        if first < second { ((target, first), (into, second)) } else { ((into, second), (target, first)) };
    let rows = rows.iter().map(|row| {
        let mut row = row.clone();
        if row.frame >= begins {
            row.remove(early);
        }
        renumber(&mut row, |number| if number == late || number == early { into } else { number });
        row
    });
    let edits = edits.iter().filter(|e| !(e.frame >= begins && target_of(e) == Some(early))).map(|edit| {
        let kind = match &edit.kind {
            // It was begun there, and goes on there now.
            EditKind::Add { target, bbox } if *target == late && first != second => {
                EditKind::Correct { target: into, bbox: *bbox, backward: false }
            }
            kind => renumbered(kind, |number| if number == late || number == early { into } else { number }),
        };
        Edit { frame: edit.frame, kind }
    });
    Ok((rows.collect(), edits.collect()))
}

fn split(target: u64, at: u64, new: u64, rows: &[Row], edits: &[Edit]) -> Result<(Vec<Row>, Vec<Edit>), RunError> {
    if first_of(new, rows).is_ok() {
        return Err(RunError::usage(format!("there is a target {new} already")));
    }
    if first_of(target, rows)? >= at {
        return Err(RunError::usage(format!(
            "target {target} begins in this frame or later; split it after its first"
        )));
    }
    let bbox = box_at(target, at, rows)?;
    let rows = rows.iter().map(|row| {
        let mut row = row.clone();
        if row.frame >= at {
            renumber(&mut row, |number| if number == target { new } else { number });
        }
        row
    });
    // A box drawn here is the new one's beginning.
    let here = |e: &Edit| e.frame == at && e.drawn() == Some(target);
    let mut all: Vec<Edit> = edits.iter().filter(|e| !here(e)).cloned().collect();
    for edit in all.iter_mut().filter(|e| e.frame >= at) {
        edit.kind = renumbered(&edit.kind, |number| if number == target { new } else { number });
    }
    insert(&mut all, at, [EditKind::Remove { target }, EditKind::Add { target: new, bbox }]);
    Ok((rows.collect(), all))
}

fn swap(
    [a, b]: [u64; 2],
    frames: &RangeInclusive<u64>,
    rows: &[Row],
    edits: &[Edit],
) -> Result<(Vec<Row>, Vec<Edit>), RunError> {
    if a == b || frames.is_empty() {
        return Err(RunError::usage("two targets are swapped, from a frame to the same or a later one"));
    }
    let other = move |number: u64| match number {
        number if number == a => b,
        number if number == b => a,
        number => number,
    };
    // Where both are, in the first frame and in the one after the last: there each goes on from the other's place.
    let boxes = |frame: u64| Ok::<_, RunError>([box_at(a, frame, rows)?, box_at(b, frame, rows)?]);
    let [of_a, of_b] = boxes(*frames.start())?;
    let after = frames.end() + 1;
    let last = rows.last().map_or(0, |row| row.frame);
    let back = if after <= last { Some(boxes(after)?) } else { None };
    let swapped = rows.iter().map(|row| {
        let mut row = row.clone();
        if frames.contains(&row.frame) {
            renumber(&mut row, other);
        }
        row
    });
    let mut all: Vec<Edit> = edits.to_vec();
    for edit in all.iter_mut().filter(|e| frames.contains(&e.frame)) {
        // Where it was begun it stays: what begins is the same target.
        if !matches!(edit.kind, EditKind::Add { .. }) {
            edit.kind = renumbered(&edit.kind, other);
        }
    }
    let put = |target, bbox| EditKind::Correct { target, bbox, backward: false };
    insert(&mut all, *frames.start(), [put(a, of_b), put(b, of_a)]);
    if let Some([of_a, of_b]) = back {
        insert(&mut all, after, [put(a, of_a), put(b, of_b)]);
    }
    Ok((swapped.collect(), all))
}

/// Puts edits behind those of the same frame.
fn insert(edits: &mut Vec<Edit>, frame: u64, kinds: impl IntoIterator<Item = EditKind>) {
    let place = edits.partition_point(|e| e.frame <= frame);
    edits.splice(place..place, kinds.into_iter().map(|kind| Edit { frame, kind }));
}

fn first_of(target: u64, rows: &[Row]) -> Result<u64, RunError> {
    let has = |row: &&Row| row.records.iter().any(|r| r.target.0 == target);
    rows.iter().find(has).map(|row| row.frame).ok_or_else(|| RunError::usage(format!("there is no target {target}")))
}

fn box_at(target: u64, frame: u64, rows: &[Row]) -> Result<BBox, RunError> {
    let row = rows.iter().find(|row| row.frame == frame);
    let record = row.and_then(|row| row.records.iter().find(|r| r.target.0 == target));
    let estimate = record.and_then(|record| record.estimate.as_ref());
    estimate.map(|e| e.bbox).ok_or_else(|| RunError::usage(format!("target {target} is not there in frame {frame}")))
}

fn renumber(row: &mut Row, new: impl Fn(u64) -> u64) {
    for record in &mut row.records {
        record.target = TargetId(new(record.target.0));
    }
    row.records.sort_by_key(|r| r.target);
    row.backward.iter_mut().for_each(|target| *target = new(*target));
}

const fn target_of(edit: &Edit) -> Option<u64> {
    match edit.kind {
        EditKind::Add { target, .. } | EditKind::Correct { target, .. } | EditKind::Remove { target } => Some(target),
        EditKind::Change { .. } => None,
    }
}

fn renumbered(kind: &EditKind, new: impl Fn(u64) -> u64) -> EditKind {
    let mut kind = kind.clone();
    match &mut kind {
        EditKind::Add { target, .. } | EditKind::Correct { target, .. } | EditKind::Remove { target } => {
            *target = new(*target);
        }
        EditKind::Change { .. } => {}
    }
    kind
}
