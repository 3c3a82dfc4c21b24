//! From a configuration to the files of a run.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may panic")]

use pursuit::media::OpenOptions;
use pursuit::run::RecipeFacts;
use pursuit::{Finished, Run, RunConfig, RunError};
use std::path::Path;

fn config(text: &str, out: &Path) -> RunConfig {
    let config: RunConfig = toml::from_str(text).unwrap();
    RunConfig { out: Some(out.to_owned()), ..config }
}

fn prepare(text: &str, out: &Path) -> Result<Run, RunError> {
    Run::prepare(config(text, out), &OpenOptions::default())
}

fn run(text: &str) -> (tempfile::TempDir, Finished) {
    let folder = tempfile::tempdir().unwrap();
    let finished = prepare(text, &folder.path().join("out")).unwrap().run(|_| {}).unwrap();
    (folder, finished)
}

fn names(finished: &Finished) -> Vec<String> {
    finished
        .files
        .iter()
        .map(|f| f.strip_prefix(finished.out.as_ref().unwrap()).unwrap().display().to_string())
        .collect()
}

const DRIFT: &str = "input = 'scene:drift?seed=7&duration=1'\ntracker = 'mosse'\nvideo = false\n";

#[test]
fn a_run_starts_on_the_truth_and_is_measured_against_it() {
    let (_folder, finished) = run(&format!("{DRIFT}formats = ['jsonl', 'mot']\nfrom = 5\nto = 24"));
    assert_eq!(names(&finished), ["trajectory.csv", "trajectory.jsonl", "trajectory.txt", "run.json"]);
    let facts = &finished.facts;
    assert_eq!((facts.status, facts.frame_count, facts.error.as_ref()), ("done", 20, None));
    assert_eq!(
        (facts.recipe.tracker.as_str(), facts.recipe.detector.as_ref(), facts.recipe.boxes.len()),
        ("mosse", None, 1)
    );
    assert_eq!(facts.states.tracking, 20);
    let accuracy = facts.accuracy.unwrap();
    assert_eq!((accuracy.visible_frames, accuracy.absent_frames), (20, 0));
    assert!(accuracy.mean_iou > 0.7 && accuracy.followed > 0.9, "{accuracy:?}");
    let written: serde_json::Value =
        serde_json::from_slice(&std::fs::read(finished.out.as_ref().unwrap().join("run.json")).unwrap()).unwrap();
    // As text: reading a number back may round its last digit.
    let expected: serde_json::Value = serde_json::from_str(&serde_json::to_string(facts).unwrap()).unwrap();
    assert_eq!(written, expected);
    assert!(written.get("seed").is_none());
    let rows = std::fs::read_to_string(finished.out.as_ref().unwrap().join("trajectory.csv")).unwrap();
    let frames: Vec<&str> = rows.lines().skip(1).map(|l| l.split(',').next().unwrap()).collect();
    assert_eq!((frames.len(), frames[0], frames[19]), (20, "5", "24"));
}

#[test]
fn truth_that_begins_later_starts_the_target_then() {
    let folder = tempfile::tempdir().unwrap();
    let images = folder.path().join("frames");
    film(&images);
    let rows: String =
        (0..31).map(|k| format!("{k},{k:03}.png,{}\n", if k < 7 { ",,," } else { "300,200,40,40" })).collect();
    std::fs::write(images.join("frames.csv"), format!("index,image,x,y,w,h\n{rows}")).unwrap();
    let text = format!("input = '{}'\ntracker = 'mosse'\nvideo = false\nto = 12", images.display());
    let finished = prepare(&text, &folder.path().join("out")).unwrap().run(|_| {}).unwrap();
    let rows = std::fs::read_to_string(finished.out.as_ref().unwrap().join("trajectory.csv")).unwrap();
    let frames: Vec<&str> = rows.lines().skip(1).map(|l| l.split(',').next().unwrap()).collect();
    assert_eq!(frames, ["7", "8", "9", "10", "11", "12"]);
    assert_eq!((finished.facts.frame_count, finished.facts.recipe.boxes[0]), (13, [300.0, 200.0, 40.0, 40.0]));
    assert_eq!(finished.facts.accuracy.unwrap().visible_frames, 6);
}

#[test]
fn boxes_given_come_before_the_truth() {
    let (_folder, finished) = run(&format!("{DRIFT}boxes = [[100, 80, 30, 30], [20, 20, 30, 30]]\nto = 3"));
    assert_eq!(finished.facts.recipe.boxes, [[100.0, 80.0, 30.0, 30.0], [20.0, 20.0, 30.0, 30.0]]);
    let states = finished.facts.states;
    assert_eq!(states.tracking + states.unsure + states.occluded + states.lost, 8);
}

const BALL: &str =
    "input = 'scene:table-tennis?seed=1'\ndetect = 'ball'\nvideo = false\n[parameters]\ncolor = 'yellow'\n";

#[test]
fn a_detector_finds_one_target_or_many() {
    let folder = tempfile::tempdir().unwrap();
    let with = |text: &str| {
        let mut config = config(BALL, &folder.path().join(text.len().to_string()));
        config.to = Some(30);
        // The truth that comes with a scene would start it.
        let image = folder.path().join("frames");
        if !image.exists() {
            film(&image);
        }
        config.input = Some(image.into());
        let more: RunConfig = toml::from_str(text).unwrap();
        Run::prepare(config.overridden_by(more), &OpenOptions::default()).unwrap().run(|_| {}).unwrap()
    };
    let one = with("");
    assert_eq!((one.facts.recipe.detector.as_deref(), one.facts.recipe.boxes.len()), (Some("ball"), 0));
    assert!(one.facts.states.tracking > 20, "{:?}", one.facts.states);
    let targets = |finished: &Finished| {
        let rows = std::fs::read_to_string(finished.out.as_ref().unwrap().join("trajectory.csv")).unwrap();
        let mut ids: Vec<String> = rows.lines().skip(1).map(|l| l.split(',').nth(2).unwrap().to_owned()).collect();
        ids.dedup();
        ids
    };
    assert_eq!(targets(&one), ["1"]);
    let many = with("many = true");
    assert!(many.facts.states.tracking > 15, "{:?}", many.facts.states);
    let rows = std::fs::read_to_string(many.out.as_ref().unwrap().join("trajectory.csv")).unwrap();
    let first = rows.lines().nth(1).unwrap();
    assert!(first.starts_with("2,"), "a target is confirmed by its third detection: {first}");
    // What was decided stands in the files, and nothing that took no part.
    let (one, many) = (one.facts.recipe, many.facts.recipe);
    let color =
        |recipe: &RecipeFacts| recipe.detector_parameters.as_ref().unwrap()["color"].as_str().map(str::to_owned);
    assert_eq!((color(&one), color(&many)), (Some("yellow".to_owned()), Some("yellow".to_owned())));
    assert!(one.acquire.is_some_and(|a| !a.is_empty()) && one.many.is_none());
    assert!(many.many.is_some_and(|m| m.contains_key("association")) && many.acquire.is_none());
}

fn film(folder: &Path) {
    let mut scene = pursuit::open("scene:table-tennis?seed=1").unwrap();
    std::fs::create_dir_all(folder).unwrap();
    for k in 0..31 {
        let frame = scene.next_frame().unwrap().unwrap();
        pursuit::media::wrappers::write_png(&frame, &folder.join(format!("{k:03}.png"))).unwrap();
    }
}

#[test]
fn a_run_that_is_stopped_keeps_what_it_has() {
    let folder = tempfile::tempdir().unwrap();
    let run = prepare(DRIFT, &folder.path().join("out")).unwrap();
    assert_eq!((run.frame_count(), run.truth().unwrap().len()), (Some(30), 30));
    let remote = run.remote();
    let finished = run
        .run(|progress| {
            if progress.frames == 10 {
                remote.stop();
            }
        })
        .unwrap();
    assert_eq!((finished.facts.status, finished.facts.frame_count), ("interrupted", 10));
    let rows = std::fs::read_to_string(finished.out.as_ref().unwrap().join("trajectory.csv")).unwrap();
    assert_eq!(rows.lines().count(), 11);
    let written = std::fs::read_to_string(finished.out.as_ref().unwrap().join("run.json")).unwrap();
    assert!(written.contains("\"status\": \"interrupted\""));
}

#[test]
fn what_breaks_a_run_is_told_and_the_rest_is_kept() {
    let folder = tempfile::tempdir().unwrap();
    let images = folder.path().join("frames");
    film(&images);
    std::fs::write(images.join("004.png"), b"no picture").unwrap();
    let text = format!(
        "input = '{}'\nboxes = [[300, 200, 40, 40]]\ntracker = 'mosse'\nvideo = false\nplots = true",
        images.display()
    );
    let finished = prepare(&text, &folder.path().join("out")).unwrap().run(|_| {}).unwrap();
    assert_eq!((finished.facts.status, finished.facts.frame_count), ("broken", 30), "the other images are looked at");
    assert!(finished.facts.error.as_ref().unwrap().contains("004.png"), "{:?}", finished.facts.error);
    assert_eq!((finished.facts.damage_count, finished.facts.damage.len()), (1, 1));
    assert_eq!(finished.outcome.failure.unwrap().exit_code(), 3);
    assert!(finished.facts.accuracy.is_none(), "there was no truth");
    assert!(
        finished.out.as_ref().unwrap().join("plots/x.svg").exists()
            && finished.files.iter().any(|f| f.ends_with("plots/x.svg"))
    );
}

#[test]
fn senseless_runs_are_refused_before_anything_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    for (text, words) in [
        ("tracker = 'mosse'", "no input"),
        ("input = 'scene:nothing'", "nothing"),
        (&format!("{DRIFT}from = 5\nto = 4"), "no frames from 5 to 4"),
        (&format!("{DRIFT}fps = -1.0"), "make no sense"),
        (&format!("{DRIFT}formats = ['xml']"), "there is no format `xml`"),
        (&format!("{DRIFT}parameters.nonsense = 1"), "nonsense"),
        (&format!("{DRIFT}parameters.detect.color = 'green'"), "no detector takes part"),
    ] {
        let refused = prepare(text, &out).err().unwrap();
        assert_eq!(refused.exit_code(), 2, "{refused}");
        assert!(refused.to_string().contains(words), "{refused}");
        assert!(!out.exists());
    }
    film(&folder.path().join("frames"));
    let nothing = prepare(&format!("input = '{}'", folder.path().join("frames").display()), &out).err().unwrap();
    assert!(nothing.to_string().contains("--box LEFT,TOP,WIDTH,HEIGHT"), "{nothing}");
}

#[test]
fn the_demo_takes_settings_too() {
    let folder = tempfile::tempdir().unwrap();
    let bad: toml::Table = "motion.modle = 'x'".parse().unwrap();
    assert_eq!(pursuit::Demo::prepare(1, &folder.path().join("a"), &bad).err().unwrap().exit_code(), 2);
    let settings: toml::Table = "ball.motion.model = 'imm'".parse().unwrap();
    let demo = pursuit::Demo::prepare(1, &folder.path().join("b"), &settings).unwrap();
    assert!(demo.frame_count().unwrap() > 10);
    let remote = demo.remote();
    let finished = demo
        .run(|p| {
            if p.frames == 5 {
                remote.stop()
            }
        })
        .unwrap();
    let parameters = &finished.facts.recipe.parameters;
    assert_eq!(parameters["motion"]["model"].as_str(), Some("imm"));
    assert_eq!(
        (parameters["color"].as_str(), finished.facts.recipe.detector.as_deref()),
        (Some("yellow"), Some("ball"))
    );
}

#[test]
fn frames_of_a_program_run_as_their_input_does() {
    let scene = "scene:drift?seed=7&duration=1";
    let mut source = pursuit::open(scene).unwrap();
    let made: Vec<pursuit::Frame> = std::iter::from_fn(|| source.next_frame().unwrap()).collect();
    let options = "tracker = 'mosse'\nboxes = [[145.5, 105.5, 30.0, 30.0]]\nregion = [20.0, 20.0, 260.0, 180.0]\n\
        resize = '0.5'\nto = 24\nstride = 2\nvideo = false\n";
    let followed = |run: Run| {
        let mut boxes = Vec::new();
        let finished =
            run.run(|p| boxes.extend(p.records.iter().map(|r| (r.frame, r.estimate.as_ref().unwrap().bbox))));
        (boxes, finished.unwrap().facts)
    };
    let folder = tempfile::tempdir().unwrap();
    let (named, _) = followed(prepare(&format!("input = '{scene}'\n{options}"), &folder.path().join("named")).unwrap());
    let given = config(options, &folder.path().join("given"));
    let given = Run::prepare_source(given, pursuit::frames(made.clone()).unwrap(), &OpenOptions::default()).unwrap();
    let (boxes, facts) = followed(given);
    assert_eq!((boxes.len(), &boxes), (13, &named));
    assert_eq!((facts.input.name.as_str(), facts.input.view.unwrap().size), ("frames", [130, 90]));
    let both = config(&format!("input = '{scene}'"), folder.path());
    let refused = Run::prepare_source(both, pursuit::frames(made).unwrap(), &OpenOptions::default());
    assert!(refused.err().unwrap().to_string().contains("leave the input scene:drift"));
}
