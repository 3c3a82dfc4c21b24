//! Files of other programs, and our own, read back.

use pursuit::TrackState;
use pursuit::geometry::{BBox, Size};
use pursuit::media::SourceInfo;
use pursuit::revise::{Edit, EditKind, Imported, Row};
use pursuit::sinks::Format;

fn info() -> SourceInfo {
    SourceInfo { fps: Some(25.0), frame_count: Some(12), ..SourceInfo::new("clip", Size::new(64, 48), "test") }
}

/// Two targets: the first from frame 2 on and put right in frame 5, the second in three frames, hidden in one.
fn drawn() -> (Vec<Row>, Vec<Edit>) {
    let mut rows: Vec<Row> = (0..8)
        .map(|frame| Row { frame, time_s: frame as f64 / 25.0, records: Vec::new(), backward: Vec::new() })
        .collect();
    let own = |frame: u64| BBox::from_ltwh(3.0 + frame as f64, 4.5, 10.0, 8.25);
    for row in &mut rows[2..] {
        row.put(1, own(row.frame), 0.1);
    }
    for row in &mut rows[4..7] {
        row.put(3, BBox::from_ltwh(30.0, 20.0, 5.0, 6.0), 0.1);
    }
    rows[4].backward = vec![1];
    let hidden = rows[5].records.iter_mut().find(|r| r.target.0 == 3).unwrap().estimate.as_mut().unwrap();
    (hidden.state, hidden.measurement) = (TrackState::Occluded, None);
    let edits = vec![
        Edit { frame: 2, kind: EditKind::Add { target: 1, bbox: own(2) } },
        Edit { frame: 4, kind: EditKind::Add { target: 3, bbox: BBox::from_ltwh(30.0, 20.0, 5.0, 6.0) } },
        Edit { frame: 5, kind: EditKind::Correct { target: 1, bbox: own(5), backward: false } },
    ];
    (rows, edits)
}

fn boxes(rows: &[Row]) -> Vec<(u64, u64, BBox, TrackState)> {
    let all = rows.iter().flat_map(|row| row.records.iter().map(move |r| (row.frame, r)));
    all.map(|(frame, r)| (frame, r.target.0, r.estimate.as_ref().unwrap().bbox, r.estimate.as_ref().unwrap().state))
        .collect()
}

#[test]
fn what_was_exported_is_read_back() {
    let (rows, edits) = drawn();
    for (name, keeps_hidden, keeps_corrections) in
        [("csv", true, false), ("mot", false, false), ("coco", true, false), ("cvat", true, true)]
    {
        let format: Format = name.parse().unwrap();
        let text = format.of_rows(&rows, &edits, info().size).unwrap();
        let read = Imported::read(&text, &info()).unwrap_or_else(|e| panic!("{name}: {e}"));
        let wanted: Vec<_> = boxes(&rows).into_iter().filter(|b| keeps_hidden || b.3 == TrackState::Tracking).collect();
        assert_eq!(boxes(&read.rows), wanted, "{name}");
        assert_eq!(read.rows.iter().map(|r| r.frame).collect::<Vec<_>>(), (0..8).collect::<Vec<_>>(), "{name}");
        let wanted = if keeps_corrections { &edits[..] } else { &edits[..2] };
        assert_eq!(read.edits, wanted, "{name}");
        assert_eq!(read.rows[4].backward, if name == "coco" { vec![1] } else { vec![] }, "{name}");
    }
}

#[test]
fn key_frames_of_other_programs_are_joined() {
    let text = r#"<?xml version="1.0"?><annotations><version>1.1</version><meta><task/></meta>
        <track id="4" label="bee &amp; co"><box frame="2" outside="0" occluded="0" keyframe="1" xtl="0" ytl="0" xbr="10" ybr="10"/>
        <box frame="6" outside="0" occluded="1" keyframe="1" xtl="8" ytl="4" xbr="22" ybr="14"><attribute name="x">1</attribute></box>
        <box frame="7" outside="1" occluded="0" keyframe="1" xtl="8" ytl="4" xbr="22" ybr="14"/></track></annotations>"#;
    let read = Imported::read(text.as_bytes(), &info()).unwrap();
    let own: Vec<_> = boxes(&read.rows).into_iter().map(|(frame, _, bbox, _)| (frame, bbox)).collect();
    assert_eq!(own[1], (3, BBox::from_ltwh(2.0, 1.0, 11.0, 10.0)));
    assert_eq!((own.len(), read.edits.len(), read.rows[2].records[0].target.0), (6, 2, 5));
    assert_eq!(read.rows[2].records[0].class.as_ref().unwrap().as_str(), "bee & co");
}

#[test]
fn what_is_none_of_them_is_said() {
    for (text, says) in [
        ("", "says nothing"),
        ("hello", "line 1"),
        ("1,2,3\n", "line 1"),
        ("{\"images\": 3}", "COCO"),
        (
            "{\"images\": [{\"id\": 1}], \"annotations\": [{\"id\": 1, \"image_id\": 1, \"bbox\": [1,2,3,4]}]}",
            "track_id",
        ),
        ("<annotations><image/></annotations>", "says nothing"),
        ("<annotations><track id=\"x\">", "CVAT"),
        ("13,1,1,1,5,5,1,-1,-1,-1\n", "beyond the end"),
        ("1,1,1,1,-5,5,1,-1,-1,-1\n", "line 1"),
    ] {
        let error = Imported::read(text.as_bytes(), &info()).err().map(|e| e.to_string()).unwrap_or_default();
        assert!(error.contains(says), "{text}: {error:?}");
    }
    assert!(Imported::read(&[0xff, 0xfe, 0], &info()).is_err());
}
