//! The folder of a trajectory that is put right by hand.

use pursuit::geometry::{BBox, Size};
use pursuit::revise::{EDITS, Edit, EditKind, Label, Revised, Row, RunWriter, Trajectory};
use pursuit::sinks::read_trajectory;
use std::path::Path;

fn row(frame: u64, left: f64) -> Row {
    let mut row = Row { frame, time_s: frame as f64 / 25.0, records: Vec::new(), backward: Vec::new() };
    row.put(1, BBox::from_ltwh(left, 5.0, 9.0, 9.0), 0.0);
    row
}

fn lefts(folder: &Path) -> Vec<(u64, f64)> {
    let path = folder.join("trajectory.csv");
    let records = read_trajectory(&path).unwrap();
    records.map(|r| (r.frame, r.estimate.unwrap().bbox.left())).collect()
}

#[test]
fn the_file_is_what_the_trajectory_is_after_every_call() {
    let root = tempfile::tempdir().unwrap();
    let size = Size::new(64, 48);
    let mut writer = RunWriter::create(&root.path().join("pursuit-out"), &"a/clip.mp4".into(), size).unwrap();
    let folder = writer.path().to_path_buf();
    assert!(folder.ends_with("pursuit-out/clip"));
    let mut trajectory = Trajectory::holding(6);
    for frame in 0..4 {
        trajectory.push(row(frame, 1.0));
        writer.update(&trajectory).unwrap();
        assert_eq!(lefts(&folder).len() as u64, frame + 1);
    }
    trajectory.branch(2, "corrected", "kcf");
    trajectory.push(row(2, 7.0));
    writer.update(&trajectory).unwrap();
    assert_eq!(lefts(&folder), [(0, 1.0), (1, 1.0), (2, 7.0)]);
    // What the trajectory has lost for want of room is still in the file, also after a change.
    (3..9).for_each(|frame| trajectory.push(row(frame, 2.0)));
    trajectory.replace_last(row(8, 3.0));
    writer.update(&trajectory).unwrap();
    let all = lefts(&folder);
    assert_eq!((all.len(), all[0], all[8]), (9, (0, 1.0), (8, 3.0)));
    // It is one run's at a time, and gone on with by the next.
    assert!(RunWriter::reopen(&folder, size).is_err());
    drop(writer);
    let mut again = RunWriter::reopen(&folder, size).unwrap();
    again.update(&trajectory).unwrap();
    assert_eq!(lefts(&folder), all);
}

#[test]
fn edits_are_read_back_as_they_were_written() {
    let bbox = BBox::from_ltwh(1.25, 0.1 + 0.2, 30.0, 40.5);
    let kinds = [
        EditKind::Add { target: 1, bbox },
        EditKind::Correct { target: 1, bbox, backward: true },
        EditKind::Change { parameters: "[motion]\nmodel = 'imm'\nnoise = 0.25".parse().unwrap() },
        EditKind::Remove { target: 1 },
    ];
    let revised = Revised {
        edits: (0..).step_by(7).zip(kinds).map(|(frame, kind)| Edit { frame, kind }).collect(),
        backward: vec![(1, 3, 7)],
        labels: [(1, Label { name: Some("queen".to_owned()), color: None })].into(),
        last_target: 3,
    };
    let folder = tempfile::tempdir().unwrap();
    assert_eq!(Revised::read(folder.path()).unwrap(), None);
    std::fs::write(folder.path().join(EDITS), revised.to_json().unwrap()).unwrap();
    assert_eq!(Revised::read(folder.path()).unwrap(), Some(revised));
    std::fs::write(folder.path().join(EDITS), "{\"edits\": [{}]}").unwrap();
    let error = Revised::read(folder.path()).unwrap_err().to_string();
    assert!(error.contains(EDITS), "{error}");
}
