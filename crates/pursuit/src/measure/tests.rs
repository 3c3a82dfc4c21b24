//! A run on disk, measured and written in every format.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use super::*;
use std::fmt::Write as _;
use std::path::Path;

/// Two targets that go straight ahead at 10 and at −5 pixels a frame, 25 frames a second.
fn recorded(folder: &Path) {
    let mut text = crate::sinks::TRAJECTORY_COLUMNS.join(",") + "\n";
    for k in 0..40_u32 {
        for (target, x, y) in [(1, 10.0 * f64::from(k), 50.0), (2, 600.0 - 5.0 * f64::from(k), 150.0)] {
            let wobble = 0.2 * (f64::from((k * 37 + target * 11) % 29) / 14.0 - 1.0);
            let bbox = format!("{:.3},{:.3},20.000,10.000", x + wobble, y - wobble);
            let state = if k == 20 { "occluded" } else { "tracking" };
            let seen = if k == 20 { ",,," } else { bbox.as_str() };
            let time = f64::from(k) / 25.0;
            writeln!(text, "{k},{time:.6},{target},{state},{bbox},0.9000,,,,,{seen},0.1,,").unwrap();
        }
    }
    std::fs::write(folder.join("trajectory.csv"), text).unwrap();
}

fn options(text: &str) -> MeasureOptions {
    toml::from_str(text).unwrap()
}

fn stick() -> Calibration {
    Calibration::from_toml("stick = { from = [0.0, 0.0], to = [100.0, 0.0], length = '1m' }").unwrap()
}

#[test]
fn targets_are_measured_each_and_between() {
    let folder = tempfile::tempdir().unwrap();
    recorded(folder.path());
    let how = options("between = ['1,2']\nfits = ['line']\npoint = 'bottom'");
    let found = measure(folder.path(), Some(stick()), &how).unwrap();
    let table = found.table();
    assert_eq!((table.len(), found.targets.len(), found.fits.len()), (80, 2, 2));
    let speed = |k: usize| table.numbers("speed_m_per_s").unwrap()[k];
    assert!((speed(15) - 2.5).abs() < 0.05 && (speed(55) - 1.25).abs() < 0.05, "{} {}", speed(15), speed(55));
    assert!((table.numbers("y_m").unwrap()[15] + 0.6).abs() < 0.01, "the lower edge of the box");
    let apart = found.between[0].numbers("distance_m").unwrap();
    assert!((apart[0] - 6.0_f64.hypot(1.0)).abs() < 0.03, "{}", apart[0]);
    for (wrong, words) in [("between = ['1,9']", "there are 1, 2"), ("between = ['1']", "no pair")] {
        let error = measure(folder.path(), Some(stick()), &options(wrong)).unwrap_err();
        assert!(error.to_string().contains(words) && error.exit_code() == 2, "{error}");
    }
}

#[test]
fn json_lines_of_a_run_are_read_too() {
    let folder = tempfile::tempdir().unwrap();
    recorded(folder.path());
    let path = folder.path().join("trajectory.jsonl");
    let lines: Vec<String> = (0..20_u32)
        .map(|k| {
            let (t, x) = (f64::from(k) / 25.0, 10.0 * f64::from(k) + 0.1 * f64::from(k % 3));
            format!(r#"{{"frame":{k},"time_s":{t},"target":4,"state":"tracking","box":[{x},5,20,10],"measurement":[{x},5,20,10]}}"#)
        })
        .collect();
    std::fs::write(&path, lines.join("\n") + "\n{\"frame\": 21, \"tor").unwrap();
    let found = measure(&path, None, &MeasureOptions::default()).unwrap();
    assert_eq!((found.targets[0].target, found.targets[0].moments.len()), (4, 20));
    assert!((found.table().numbers("vx_px_per_s").unwrap()[10] - 250.0).abs() < 3.0);
}

#[test]
fn every_format_holds_the_same_rows() {
    let folder = tempfile::tempdir().unwrap();
    recorded(folder.path());
    let formats: Vec<String> = FORMATS.iter().map(|f| f.0.to_owned()).collect();
    let there = cfg!(all(feature = "parquet", feature = "xlsx"));
    let destination = Destination::new(folder.path(), &formats, true);
    if !there {
        assert!(destination.unwrap_err().to_string().contains("build with `--features"));
        return;
    }
    let how = options("between = ['1,2']\nfits = ['line']");
    let found = measure(folder.path(), Some(stick()), &how).unwrap();
    let files = destination.unwrap().write(&found).unwrap();
    let held = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
    assert!(files.iter().all(|f| f.exists()) && files.len() >= 14, "{files:?}");
    assert_eq!(String::from_utf8(held("measure.jsonl")).unwrap().lines().count(), 80);
    assert_eq!(String::from_utf8(held("measure-between-1-2.csv")).unwrap().lines().count(), 41);
    let sheet = held("measure.xlsx");
    assert!(sheet.starts_with(b"PK") && sheet.windows(24).any(|w| w == b"xl/worksheets/sheet3.xml"));
    #[cfg(feature = "parquet")]
    {
        use ::parquet::file::reader::{FileReader, SerializedFileReader};
        use ::parquet::record::RowAccessor;
        let file = std::fs::File::open(folder.path().join("measure.parquet")).unwrap();
        let rows: Vec<_> =
            SerializedFileReader::new(file).unwrap().get_row_iter(None).unwrap().map(Result::unwrap).collect();
        let x = found.table().numbers("x_m").unwrap()[7];
        assert_eq!(
            (rows.len(), rows[7].get_double(4).unwrap(), rows[7].get_string(3).unwrap().as_str()),
            (80, x, "measured")
        );
    }
    // Again: what is ours is replaced, and nothing is left over.
    let fewer = Destination::new(folder.path(), &[], false).unwrap().write(&found).unwrap();
    assert!(fewer.len() < files.len() && !folder.path().join("measure.xlsx").exists());
}
