#![allow(clippy::unwrap_used, reason = "a test may panic")]

use super::*;
use pursuit_geometry::Point;
use pursuit_vision::flow::dense::FlowField;
use pursuit_vision::flow::{GoodFeaturesParams, PointFollowerParams};
use std::collections::BTreeMap;
use std::path::Path;

const SCENE: &str = "scene:drift?seed=7&duration=1";

fn run(config: FlowConfig) -> Result<Finished, RunError> {
    Flow::prepare(config, &OpenOptions::default())?.run(&AtomicBool::new(false), |_| ())
}

fn config(out: &Path, wanted: Wanted) -> FlowConfig {
    FlowConfig { to: Some(9), out: Some(out.to_path_buf()), ..FlowConfig::new(SCENE, wanted) }
}

fn rows(path: &Path) -> Vec<Vec<String>> {
    let text = std::fs::read_to_string(path).unwrap();
    text.lines().map(|l| l.split(',').map(str::to_owned).collect()).collect()
}

#[test]
fn points_are_told_frame_by_frame_until_they_are_lost() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let finished = run(config(&out, Wanted::points(PointChoice::Corners(60)))).unwrap();
    let facts = finished.points.unwrap();
    assert_eq!((finished.frames, facts.started), (10, 60));
    assert_eq!(facts.tracked + facts.lost + facts.outside, 60, "{facts:?}");
    assert!(facts.tracked > 30, "{facts:?}");
    let rows = rows(&out.join("points.csv"));
    assert_eq!(rows[0].join(","), "frame,time_s,point,x_px,y_px,forward_backward_px,state");
    let mut by_point: BTreeMap<usize, Vec<&Vec<String>>> = BTreeMap::new();
    for row in &rows[1..] {
        by_point.entry(row[2].parse().unwrap()).or_default().push(row);
    }
    assert_eq!(by_point.len(), 60);
    for (point, rows) in by_point {
        for (k, row) in rows.iter().enumerate() {
            assert_eq!(row[0], k.to_string(), "every frame from the first on has a row: {point}");
            let last = k + 1 == rows.len();
            let tracked = row[6] == "tracked";
            assert!(tracked || (last && ["lost", "outside"].contains(&row[6].as_str())), "{row:?}");
            assert_eq!((row[3].is_empty(), row[4].is_empty()), (!tracked, !tracked), "{row:?}");
            assert_eq!(row[5].is_empty(), k == 0 || (row[5].is_empty() && !tracked), "{row:?}");
        }
        assert!(rows.len() == 10 || rows.last().unwrap()[6] != "tracked", "{point}");
    }
    let written: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(out.join("flow.json")).unwrap()).unwrap();
    assert_eq!((&written["flow"], &written["points"]["started"]), (&"points".into(), &60.into()));
}

#[test]
fn given_points_and_grids_are_followed_as_they_are() {
    let folder = tempfile::tempdir().unwrap();
    let given = vec![Point::new(100.5, 80.25), Point::new(282.0, 186.0)];
    let out = folder.path().join("given");
    run(config(&out, Wanted::points(PointChoice::Given(given)))).unwrap();
    let first: Vec<String> = rows(&out.join("points.csv"))[1..3].iter().map(|r| r[2..5].join(",")).collect();
    assert_eq!(first, ["0,100.500,80.250", "1,282.000,186.000"]);
    let outside = run(config(&out, Wanted::points(PointChoice::Given(vec![Point::new(-1.0, 9.0)])))).unwrap_err();
    assert!(outside.exit_code() == 2 && outside.to_string().contains("-1,9"), "{outside}");
    let grid = run(config(&folder.path().join("grid"), Wanted::points(PointChoice::Grid(100.0)))).unwrap();
    let size = Flow::prepare(config(&out, Wanted::points(PointChoice::Grid(9.0))), &OpenOptions::default());
    let size = size.unwrap().input().size;
    assert_eq!(grid.points.unwrap().started, (size.width / 100) * (size.height / 100));
    for step in [0.0, f64::NAN, -3.0] {
        assert_eq!(run(config(&out, Wanted::points(PointChoice::Grid(step)))).unwrap_err().exit_code(), 2);
    }
}

#[test]
fn lost_corners_are_renewed_under_new_numbers() {
    let folder = tempfile::tempdir().unwrap();
    // Hard to please, so that many are lost.
    let follower = PointFollowerParams { max_forward_backward_px: 0.02, ..PointFollowerParams::default() };
    let options = PointOptions { choice: PointChoice::Corners(50), renew: true, follower, ..PointOptions::default() };
    let finished = run(config(&folder.path().join("a"), Wanted::Points(options.clone()))).unwrap();
    let facts = finished.points.unwrap();
    assert!(facts.started > 50 && facts.lost > 0, "{facts:?}");
    assert_eq!(facts.tracked + facts.lost + facts.outside, facts.started, "{facts:?}");
    let given = PointOptions { choice: PointChoice::Grid(50.0), ..options };
    assert_eq!(run(config(&folder.path().join("b"), Wanted::Points(given))).unwrap_err().exit_code(), 2);
}

#[test]
fn fields_are_written_as_flo_and_on_a_grid() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let options = FieldOptions { flo: true, grid_px: Some(80.0), ..FieldOptions::default() };
    let finished = run(FlowConfig { to: Some(3), ..config(&out, Wanted::Field(options)) }).unwrap();
    let facts = finished.field.unwrap();
    assert_eq!((finished.frames, facts.fields), (4, 3));
    let rows = rows(&out.join("field.csv"));
    assert_eq!(rows[0].join(","), "frame,time_s,x_px,y_px,dx_px,dy_px,dt_s");
    let field = FlowField::from_flo(&std::fs::read(out.join("flo/000002.flo")).unwrap()).unwrap();
    let size = field.size();
    assert_eq!(rows.len() - 1, 3 * (size.width / 80) * (size.height / 80));
    assert!(!out.join("flo/000003.flo").exists(), "the last frame goes nowhere");
    for row in rows[1..].iter().filter(|r| r[0] == "2") {
        let number = |k: usize| row[k].parse::<f64>().unwrap();
        let [dx, dy] = field.at(Point::new(number(2), number(3)));
        assert!((number(4) - f64::from(dx)).abs() < 1e-3 && (number(5) - f64::from(dy)).abs() < 1e-3, "{row:?}");
        assert!(number(6) > 0.0);
    }
    // The target of the scene moves, and the field says so.
    assert!(facts.longest_px > 1.0, "{facts:?}");
}

#[test]
fn only_an_earlier_flow_is_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let wanted = || Wanted::points(PointChoice::Corners(5));
    let short = |out: &Path| FlowConfig { to: Some(1), ..config(out, wanted()) };
    run(short(&out)).unwrap();
    std::fs::create_dir(out.join("flo")).unwrap();
    for file in ["notes.txt", "flo/000007.flo", "field.csv"] {
        std::fs::write(out.join(file), "x").unwrap();
    }
    run(short(&out)).unwrap();
    assert!(out.join("notes.txt").is_file() && out.join("points.csv").is_file());
    assert!(!out.join("flo/000007.flo").exists() && !out.join("field.csv").exists());
    let mine = folder.path().join("mine");
    std::fs::create_dir(&mine).unwrap();
    std::fs::write(mine.join("points.csv"), "mine").unwrap();
    let refused = run(short(&mine)).unwrap_err();
    assert!(refused.exit_code() == 2 && refused.to_string().contains("no flow wrote it"), "{refused}");
    assert_eq!(std::fs::read_to_string(mine.join("points.csv")).unwrap(), "mine");
    let file = tempfile::NamedTempFile::new().unwrap();
    assert_eq!(run(short(file.path())).unwrap_err().exit_code(), 4);
}

#[test]
fn senseless_options_are_refused_before_anything_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let field = |options| Wanted::Field(options);
    let corners = GoodFeaturesParams { window_px: 4, ..GoodFeaturesParams::default() };
    for wanted in [
        Wanted::points(PointChoice::Corners(0)),
        Wanted::Points(PointOptions { corners, ..PointOptions::default() }),
        field(FieldOptions { shown: Shown::Arrows(0.0), ..FieldOptions::default() }),
        field(FieldOptions { grid_px: Some(f64::INFINITY), ..FieldOptions::default() }),
        field(FieldOptions { longest_px: Some(0.0), ..FieldOptions::default() }),
    ] {
        let refused = run(config(&out, wanted)).unwrap_err();
        assert_eq!(refused.exit_code(), 2, "{refused}");
    }
    assert!(!out.exists());
    let missing = FlowConfig::new("no/such/file.mp4", Wanted::points(PointChoice::Corners(9)));
    assert_eq!(run(missing).unwrap_err().exit_code(), 3);
}

#[test]
#[cfg(feature = "encode")]
fn overlays_show_points_and_fields() {
    let folder = tempfile::tempdir().unwrap();
    for (name, wanted, frames) in [
        ("points", Wanted::points(PointChoice::Corners(40)), 5),
        ("wheel", Wanted::Field(FieldOptions::default()), 4),
        ("arrows", Wanted::Field(FieldOptions { shown: Shown::Arrows(24.0), ..FieldOptions::default() }), 4),
    ] {
        let out = folder.path().join(name);
        run(FlowConfig { overlay: true, to: Some(4), ..config(&out, wanted) }).unwrap();
        let video = out.join("overlay.mp4");
        assert!(std::fs::metadata(&video).unwrap().len() > 1000, "{name}");
        #[cfg(feature = "h264")]
        {
            let mut source = pursuit_media::open(video.display().to_string(), &OpenOptions::default()).unwrap();
            let mut count = 0;
            while source.next_frame().unwrap().is_some() {
                count += 1;
            }
            assert_eq!(count, frames, "{name}");
        }
        let _ = frames;
    }
}

/// The rows of points of a run, by point and frame: place, and the whole row.
fn places(out: &Path) -> BTreeMap<(String, String), ([f64; 2], Vec<String>)> {
    let rows = rows(&out.join("points.csv")).into_iter().skip(1).filter(|r| r[6] == "tracked");
    let number = |text: &str| text.parse::<f64>().unwrap();
    rows.map(|r| ((r[2].clone(), r[0].clone()), ([number(&r[3]), number(&r[4])], r))).collect()
}

#[test]
fn points_of_a_part_stay_in_the_whole_pictures_pixels() {
    let folder = tempfile::tempdir().unwrap();
    // In the target, and on the ground.
    let given = vec![Point::new(282.0, 186.0), Point::new(150.5, 120.25), Point::new(200.0, 90.0)];
    let run_in = |name: &str, region: Option<[f64; 4]>, resize: Option<&str>| {
        let out = folder.path().join(name);
        let wanted = Wanted::points(PointChoice::Given(given.clone()));
        let resize = resize.map(|r| r.parse().unwrap());
        run(FlowConfig { region, resize, ..config(&out, wanted) }).unwrap();
        (
            places(&out),
            serde_json::from_str::<serde_json::Value>(&std::fs::read_to_string(out.join("flow.json")).unwrap())
                .unwrap(),
        )
    };
    let (whole, facts) = run_in("whole", None, None);
    assert!(whole.len() > 20 && facts["input"]["view"].is_null());
    let size = [facts["input"]["width"].clone(), facts["input"]["height"].clone()];
    for (name, region, resize, off_px) in [
        ("part", Some([101.0, 60.0, 219.0, 160.0]), None, 0.1),
        ("half", None, Some("0.5"), 0.4),
        ("stretched", Some([100.0, 60.0, 220.0, 160.0]), Some("440x160"), 0.4),
    ] {
        let (part, facts) = run_in(name, region, resize);
        assert_eq!([facts["input"]["width"].clone(), facts["input"]["height"].clone()], size, "{name}");
        assert!(!facts["input"]["view"].is_null(), "{name}");
        let both: Vec<_> = part.iter().filter_map(|(key, (at, _))| Some((at, whole.get(key)?.0))).collect();
        assert!(both.len() * 10 > 9 * whole.len(), "{name}: {} of {}", both.len(), whole.len());
        for (at, there) in both {
            assert!((at[0] - there[0]).hypot(at[1] - there[1]) < off_px, "{name}: {at:?} for {there:?}");
        }
        // Where points start is what was given.
        for (k, p) in given.iter().enumerate() {
            assert_eq!(part[&(k.to_string(), "0".to_owned())].0, [p.x, p.y], "{name}");
        }
    }
    let config_of = |region, choice| FlowConfig { region, ..config(&folder.path().join("no"), Wanted::points(choice)) };
    let outside = run(config_of(Some([0.0, 0.0, 100.0, 100.0]), PointChoice::Given(given))).unwrap_err();
    assert!(outside.exit_code() == 2 && outside.to_string().contains("282,186"), "{outside}");
    let wrong = run(config_of(Some([0.0, 0.0, 10_000.0, 100.0]), PointChoice::Corners(9))).unwrap_err();
    assert!(wrong.exit_code() == 2 && wrong.to_string().contains("LEFT,TOP,WIDTH,HEIGHT"), "{wrong}");
    assert!(!folder.path().join("no").exists());
}

#[test]
fn fields_and_grids_of_a_part_stay_in_the_whole_pictures_pixels() {
    let folder = tempfile::tempdir().unwrap();
    let run_in = |name: &str, region: Option<[f64; 4]>, resize: Option<&str>| {
        let out = folder.path().join(name);
        let options = FieldOptions { flo: true, grid_px: Some(20.0), ..FieldOptions::default() };
        let resize = resize.map(|r| r.parse().unwrap());
        let finished = run(FlowConfig { to: Some(2), region, resize, ..config(&out, Wanted::Field(options)) }).unwrap();
        (rows(&out.join("field.csv")), out, finished.field.unwrap())
    };
    let whole =
        FlowField::from_flo(&std::fs::read(run_in("whole", None, None).1.join("flo/000001.flo")).unwrap()).unwrap();
    for (name, resize, size) in
        [("part", None, (200, 120)), ("wide", Some("400x120"), (400, 120)), ("half", Some("0.5"), (100, 60))]
    {
        let (rows, out, facts) = run_in(name, Some([120.0, 120.0, 200.0, 120.0]), resize);
        let field = FlowField::from_flo(&std::fs::read(out.join("flo/000001.flo")).unwrap()).unwrap();
        assert_eq!(field.size(), Size::new(size.0, size.1), "a file is of what is seen");
        let number = |text: &str| text.parse::<f64>().unwrap();
        let of_frame: Vec<[f64; 4]> =
            rows[1..].iter().filter(|r| r[0] == "1").map(|r| [2, 3, 4, 5].map(|k| number(&r[k]))).collect();
        assert_eq!(of_frame.len(), 10 * 6, "{name}: twenty pixels of the input apart");
        assert_eq!([of_frame[0][0], of_frame[0][1]], [130.0, 130.0], "{name}");
        let mut off: Vec<f64> = of_frame
            .iter()
            .map(|[x, y, dx, dy]| {
                let there = whole.at(Point::new(*x, *y));
                (dx - f64::from(there[0])).hypot(dy - f64::from(there[1]))
            })
            .collect();
        off.sort_by(f64::total_cmp);
        assert!(off[off.len() / 2] < 0.25, "{name}: {off:?}");
        // The target moves, in the input's pixels.
        let longest = of_frame.iter().map(|m| m[2].hypot(m[3])).fold(0.0, f64::max);
        assert!(longest > 0.5 && facts.longest_px >= longest - 1e-3, "{name}: {longest}, {facts:?}");
    }
}
