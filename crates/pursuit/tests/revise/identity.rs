//! Who is who, put right by hand.

use pursuit::geometry::BBox;
use pursuit::revise::{Edit, EditKind, Identity, Row};

fn at(left: f64) -> BBox {
    BBox::from_ltwh(left, 5.0, 9.0, 9.0)
}

/// Ten frames: target 1 in all, at 0 + frame; target 2 from frame 4 on, at 100 + frame; put right in frame 6.
fn two() -> (Vec<Row>, Vec<Edit>) {
    let rows = (0..10).map(|frame| {
        let mut row = Row { frame, time_s: 0.0, records: Vec::new(), backward: Vec::new() };
        row.put(1, at(frame as f64), 0.0);
        if frame >= 4 {
            row.put(2, at(100.0 + frame as f64), 0.0);
        }
        row
    });
    let correct = EditKind::Correct { target: 2, bbox: at(106.0), backward: false };
    let edits = vec![
        Edit { frame: 0, kind: EditKind::Add { target: 1, bbox: at(0.0) } },
        Edit { frame: 4, kind: EditKind::Add { target: 2, bbox: at(104.0) } },
        Edit { frame: 6, kind: correct },
    ];
    (rows.collect(), edits)
}

fn lefts(rows: &[Row], target: u64) -> Vec<Option<f64>> {
    let left =
        |row: &Row| row.records.iter().find(|r| r.target.0 == target).map(|r| r.estimate.as_ref().unwrap().bbox.left());
    rows.iter().map(left).collect()
}

#[test]
fn two_numbers_become_one() {
    let (rows, edits) = two();
    let whole: Vec<_> = (0..10).map(|f| Some(if f < 4 { 0.0 } else { 100.0 } + f64::from(f))).collect();
    for (target, into) in [(2, 1), (1, 2)] {
        let (merged, edits) = Identity::Merge { target, into }.apply(&rows, &edits).unwrap();
        assert_eq!((lefts(&merged, into), lefts(&merged, target)), (whole.clone(), vec![None; 10]));
        let kinds: Vec<_> =
            edits.iter().map(|e| (e.frame, e.drawn(), matches!(e.kind, EditKind::Add { .. }))).collect();
        assert_eq!(kinds, [(0, Some(into), true), (4, Some(into), false), (6, Some(into), false)]);
    }
    assert!(Identity::Merge { target: 1, into: 1 }.apply(&rows, &edits).is_err());
    assert!(Identity::Merge { target: 1, into: 7 }.apply(&rows, &edits).is_err());
}

#[test]
fn one_number_becomes_two() {
    let (rows, edits) = two();
    let (split, after) = Identity::Split { target: 2, at: 6, new: 3 }.apply(&rows, &edits).unwrap();
    assert_eq!(lefts(&split, 2)[3..7], [None, Some(104.0), Some(105.0), None]);
    assert_eq!(lefts(&split, 3)[5..8], [None, Some(106.0), Some(107.0)]);
    let wanted = [EditKind::Remove { target: 2 }, EditKind::Add { target: 3, bbox: at(106.0) }];
    assert_eq!(after[2..].iter().map(|e| e.kind.clone()).collect::<Vec<_>>(), wanted);
    for (target, frame, new) in [(2, 4, 3), (2, 6, 1), (5, 6, 7)] {
        assert!(Identity::Split { target, at: frame, new }.apply(&rows, &edits).is_err(), "{target} {frame} {new}");
    }
    // Merged again they are what they were.
    let (again, _) = Identity::Merge { target: 3, into: 2 }.apply(&split, &after).unwrap();
    assert_eq!(lefts(&again, 2), lefts(&rows, 2));
}

#[test]
fn two_that_were_mistaken_are_swapped_over_a_range() {
    let (rows, edits) = two();
    let swap = Identity::Swap { targets: [1, 2], frames: 5..=7 };
    let (swapped, after) = swap.apply(&rows, &edits).unwrap();
    assert_eq!(lefts(&swapped, 1)[4..9], [Some(4.0), Some(105.0), Some(106.0), Some(107.0), Some(8.0)]);
    assert_eq!(lefts(&swapped, 2)[4..9], [Some(104.0), Some(5.0), Some(6.0), Some(7.0), Some(108.0)]);
    let drawn: Vec<_> = after.iter().map(|e| (e.frame, e.drawn())).collect();
    let wanted = [(0, 1), (4, 2), (5, 1), (5, 2), (6, 1), (8, 1), (8, 2)];
    assert_eq!(drawn, wanted.map(|(frame, target)| (frame, Some(target))));
    let (again, _) = swap.apply(&swapped, &after).unwrap();
    assert_eq!(lefts(&again, 1), lefts(&rows, 1));
    assert!(Identity::Swap { targets: [1, 2], frames: 2..=7 }.apply(&rows, &edits).is_err(), "2 is not there yet");
    let open = Identity::Swap { targets: [1, 2], frames: 5..=99 }.apply(&rows, &edits).unwrap();
    assert_eq!(lefts(&open.0, 1)[9], Some(109.0));
}
