//! Every sink: what it writes, that it closes its file, that it says when it cannot.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may panic")]

mod common;

use common::{Memory, at, blank};
use pursuit::geometry::Size;
use pursuit::sinks::{Format, Moment, OverlayStyle, Sink, TRAJECTORY_COLUMNS};
use pursuit::tracking::{BoxCovariance, Doubt, Estimate, TargetId, TrackState};
use pursuit::{Record, RunError};
use std::path::Path;
use std::sync::{Arc, Mutex};

pursuit::tracking::figures! {
    /// What the tracker says.
    struct PeakFigures {
        /// Peak-to-sidelobe ratio.
        psr;
    }
}

fn record(target: u64, estimate: Option<Estimate>) -> Record {
    Record { frame: 4, time_s: 0.16, target: TargetId(target), class: None, estimate, update_ms: Some(1.25) }
}

/// A measured target, a lost one, and one that is still sought.
fn records() -> Vec<Record> {
    let measured = Estimate {
        prediction: Some(at(1.5)),
        measurement: Some(at(2.5)),
        covariance: Some(BoxCovariance::identity() * 2.0),
        diagnostics: PeakFigures { psr: 9.5 }.into(),
        ..Estimate::started(0.16, at(2.0), 0.875)
    };
    let doubt = Some(Doubt::Gone);
    let lost = Estimate { state: TrackState::Lost, doubt, measurement: None, ..Estimate::started(0.16, at(7.0), 0.0) };
    vec![
        record(1, Some(measured)),
        record(2, Some(lost)),
        Record { update_ms: None, class: Some("dog".into()), ..record(3, None) },
    ]
}

const SIZE: Size = Size::new(64, 48);

fn format(name: &str) -> Format {
    name.parse().unwrap()
}

fn write(sink: &mut dyn Sink, frame: u64, records: &[Record]) -> Result<(), RunError> {
    sink.write(&Moment::recorded(&Arc::new(blank(frame)), records))
}

/// What a format leaves in its file after two frames.
fn text(name: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(format(name).file_name());
    let mut sink = format(name).create(folder.path(), SIZE).unwrap();
    assert_eq!(sink.files(), std::slice::from_ref(&path));
    write(&mut *sink, 4, &records()).unwrap();
    let after_one = std::fs::read(&path).unwrap();
    write(&mut *sink, 5, &[]).unwrap();
    sink.finish().unwrap();
    let bytes = std::fs::read(&path).unwrap();
    assert!(bytes.starts_with(&after_one));
    String::from_utf8(bytes).unwrap()
}

#[test]
fn csv_has_a_row_for_every_target_and_an_empty_cell_for_what_is_not_known() {
    let text = text("csv");
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines[0], TRAJECTORY_COLUMNS.join(","));
    assert_eq!(
        lines[1..],
        [
            "4,0.160000,1,tracking,2.000,10.000,8.000,8.000,0.8750,1.500,10.000,8.000,8.000,2.500,10.000,8.000,8.000,1.2500,,",
            "4,0.160000,2,lost,7.000,10.000,8.000,8.000,0.0000,,,,,,,,,1.2500,,gone",
            "4,0.160000,3,lost,,,,,,,,,,,,,,,dog,",
        ]
    );
}

#[test]
fn spreadsheets_of_half_europe_get_semicolons_and_decimal_commas() {
    let text = text("csv-semicolon");
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines[0], TRAJECTORY_COLUMNS.join(";"));
    assert!(lines[1].starts_with("4;0,160000;1;tracking;2,000;10,000;"), "{}", lines[1]);
    assert!(lines[3].ends_with(";;dog;"), "{}", lines[3]);
}

#[test]
fn words_with_separators_are_quoted() {
    let record = Record { class: Some("dog, \"big\"\nbrown".into()), ..record(1, None) };
    let of = |name: &str| {
        let folder = tempfile::tempdir().unwrap();
        let mut sink = format(name).create(folder.path(), SIZE).unwrap();
        write(&mut *sink, 4, std::slice::from_ref(&record)).unwrap();
        sink.finish().unwrap();
        std::fs::read_to_string(folder.path().join(format(name).file_name())).unwrap()
    };
    assert!(of("csv").ends_with(",\"dog, \"\"big\"\" brown\",\n"), "{}", of("csv"));
    assert!(of("csv-semicolon").ends_with(";\"dog, \"\"big\"\" brown\";\n"), "{}", of("csv-semicolon"));
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("t.csv"), of("csv")).unwrap();
    let back = pursuit::sinks::read_trajectory(&folder.path().join("t.csv")).unwrap().next().unwrap();
    assert_eq!(back.class.unwrap().as_str(), "dog, \"big\" brown");
}

#[cfg(feature = "xlsx")]
#[test]
fn a_spreadsheet_is_a_zip_with_a_sheet() {
    let folder = tempfile::tempdir().unwrap();
    let mut sink = format("xlsx").create(folder.path(), SIZE).unwrap();
    write(&mut *sink, 4, &records()).unwrap();
    sink.finish().unwrap();
    sink.finish().unwrap();
    let bytes = std::fs::read(folder.path().join("trajectory.xlsx")).unwrap();
    assert!(bytes.starts_with(b"PK") && bytes.windows(24).any(|w| w == b"xl/worksheets/sheet1.xml"));
}

#[test]
fn csv_goes_to_any_writer_and_is_flushed_frame_by_frame() {
    #[derive(Clone, Default)]
    struct Shared(Arc<Mutex<Vec<u8>>>);
    impl std::io::Write for Shared {
        fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
            self.0.lock().unwrap().extend_from_slice(bytes);
            Ok(bytes.len())
        }
        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }
    let out = Shared::default();
    let mut sink = Format::CSV.to_writer("here", Box::new(out.clone()), SIZE).unwrap();
    assert!(sink.files().is_empty(), "it is no file");
    let lines = || String::from_utf8(out.0.lock().unwrap().clone()).unwrap().lines().count();
    assert_eq!(lines(), 1);
    write(&mut *sink, 4, &records()).unwrap();
    assert_eq!(lines(), 4);
}

#[test]
fn json_lines_have_everything() {
    let text = text("jsonl");
    let lines: Vec<serde_json::Value> = text.lines().map(|l| serde_json::from_str(l).unwrap()).collect();
    assert_eq!(lines.len(), 3);
    assert_eq!(
        lines[0],
        serde_json::json!({
            "frame": 4, "time_s": 0.16, "target": 1, "class": null, "state": "tracking", "doubt": null, "box": [2.0, 10.0, 8.0, 8.0],
            "score": 0.875, "prediction": [1.5, 10.0, 8.0, 8.0], "measurement": [2.5, 10.0, 8.0, 8.0],
            "covariance": [[2.0, 0.0, 0.0, 0.0], [0.0, 2.0, 0.0, 0.0], [0.0, 0.0, 2.0, 0.0], [0.0, 0.0, 0.0, 2.0]],
            "next": null, "diagnostics": {"psr": 9.5}, "update_ms": 1.25
        })
    );
    assert_eq!((&lines[1]["state"], &lines[1]["measurement"]), (&"lost".into(), &serde_json::Value::Null));
    assert_eq!((&lines[1]["doubt"], &lines[2]["class"]), (&"gone".into(), &"dog".into()));
    assert_eq!(
        (&lines[2]["state"], &lines[2]["box"], &lines[2]["target"]),
        (&"lost".into(), &serde_json::Value::Null, &3.into())
    );
}

#[test]
fn mot_counts_from_one_and_has_measured_targets_alone() {
    let text = text("mot");
    assert_eq!(text, "5,1,3.000,11.000,8.000,8.000,0.8750,-1,-1,-1\n");
}

#[test]
fn coco_annotates_what_is_not_lost() {
    let coco: serde_json::Value = serde_json::from_str(&text("coco")).unwrap();
    let sizes: Vec<_> = coco["images"].as_array().unwrap().iter().map(|i| (&i["id"], &i["width"])).collect();
    assert_eq!(sizes, [(&5.into(), &64.into()), (&6.into(), &64.into())]);
    let annotations = coco["annotations"].as_array().unwrap();
    assert_eq!(annotations.len(), 1);
    assert_eq!(annotations[0]["bbox"], serde_json::json!([2.0, 10.0, 8.0, 8.0]));
    assert_eq!((&annotations[0]["image_id"], &annotations[0]["track_id"]), (&5.into(), &1.into()));
    assert_eq!(coco["categories"], serde_json::json!([{ "id": 1, "name": "target" }]));
}

#[test]
fn cvat_ends_a_stretch_where_the_target_is_lost() {
    let cvat = text("cvat");
    assert_eq!(cvat.matches("<track ").count(), 2, "{cvat}");
    assert!(cvat.contains("frame=\"4\" outside=\"0\" occluded=\"0\" keyframe=\"1\" xtl=\"2.000\""), "{cvat}");
    assert!(cvat.contains("frame=\"4\" outside=\"1\" occluded=\"0\" keyframe=\"1\" xtl=\"7.000\""), "{cvat}");
    assert!(cvat.ends_with("  </track>\n</annotations>\n"));
}

/// The grey values of the rows of the overlay's frames.
#[cfg(all(feature = "encode", feature = "h264"))]
fn overlay(frames: &[Vec<Record>]) -> Vec<Vec<Vec<u8>>> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("overlay.mp4");
    let mut sink = pursuit::sinks::OverlaySink::create(&path, Some(25.0), OverlayStyle::Full).unwrap();
    assert_eq!(sink.files(), std::slice::from_ref(&path));
    for (k, records) in frames.iter().enumerate() {
        write(&mut sink, k as u64, records).unwrap();
    }
    sink.finish().unwrap();
    sink.finish().unwrap();
    let mut video = pursuit::open(&path).unwrap();
    let mut seen = Vec::new();
    while let Some(frame) = video.next_frame().unwrap() {
        seen.push(frame.gray().rows().map(<[u8]>::to_vec).collect());
    }
    seen
}

#[cfg(all(feature = "encode", feature = "h264"))]
#[test]
fn the_overlay_shows_every_frame_and_marks_what_is_known() {
    let far = |left: f64, state| Estimate { state, measurement: None, ..Estimate::started(0.0, at(left), 0.5) };
    let frames =
        overlay(&[vec![], vec![record(1, Some(far(30.0, TrackState::Tracking)))], vec![record(1, None)], vec![]]);
    assert_eq!(frames.len(), 4);
    let marked = |frame: &[Vec<u8>]| frame.iter().flatten().filter(|v| v.abs_diff(30) > 40).count();
    assert_eq!((marked(&frames[0]), marked(&frames[3])), (0, 0), "nothing is known, nothing is drawn");
    assert!(marked(&frames[1]) > 20 && marked(&frames[2]) > 20);
    // The left edge of the box, in the middle of its height.
    let edge = (28..33).map(|x| frames[1][14][x]).max().unwrap();
    assert!(edge > 90, "{edge}");
}

#[test]
fn a_file_that_cannot_be_made_is_named() {
    let nowhere = Path::new("/nowhere/at/all");
    let failures: Vec<RunError> = vec![
        Format::CSV.create(nowhere, SIZE).err().unwrap(),
        Format::JSONL.create(nowhere, SIZE).err().unwrap(),
        format("coco").create(nowhere, SIZE).err().unwrap(),
        #[cfg(feature = "encode")]
        pursuit::sinks::OverlaySink::create(nowhere, None, OverlayStyle::Minimal).err().unwrap(),
    ];
    for failure in failures {
        assert_eq!(failure.exit_code(), 4);
        assert!(failure.to_string().contains("/nowhere/at/all"), "{failure}");
    }
}

#[cfg(unix)]
#[test]
fn a_full_disk_is_an_error_of_the_frame_that_did_not_fit() {
    let full = Path::new("/dev/full");
    if !full.exists() {
        eprintln!("skipped: there is no /dev/full here");
        return;
    }
    let open = || Box::new(std::fs::File::options().write(true).open(full).unwrap());
    assert!(Format::CSV.to_writer("full", open(), SIZE).is_err(), "the header does not fit");
    let mut sink = format("mot").to_writer("full", open(), SIZE).unwrap();
    let failure = write(&mut *sink, 4, &records()).unwrap_err();
    assert!(failure.to_string().contains("what was written before is kept"), "{failure}");
    let mut sink = Format::JSONL.to_writer("full", open(), SIZE).unwrap();
    assert!(write(&mut *sink, 4, &records()).is_err());
}

#[test]
fn a_sink_needs_no_file() {
    assert!(Memory::default().files().is_empty());
}
