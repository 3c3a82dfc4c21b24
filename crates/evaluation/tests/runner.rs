//! Running, keeping, going on, and what is scored.
#![allow(clippy::unwrap_used)]

mod common;
use common::{Scripted, write, write_images};
use pursuit_evaluation::{EvalOptions, EvaluationError, Given, Progress, Protocol, Results, evaluate, text_table};
use pursuit_tracking::TrackState::{Lost, Occluded, Tracking};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

/// Three sequences of ten frames; the target stays at (2,3) and is 4x5. In `away` it is absent in frames 4 and 5.
fn dataset(root: &Path) -> PathBuf {
    for name in ["away", "plain", "third"] {
        let folder = root.join("data").join(name);
        let images = write_images(&folder, 10, 1, 4);
        let mut text = "index,image,x,y,w,h\n".to_owned();
        for (i, image) in images.iter().enumerate() {
            let bbox = if name == "away" && (4..6).contains(&i) { "nan,nan,nan,nan" } else { "2,3,4,5" };
            text += &format!("{i},{image},{bbox}\n");
        }
        write(&folder.join("frames.csv"), &text);
    }
    root.join("data")
}

fn options(root: &Path, trackers: &[&Scripted]) -> EvalOptions {
    let mut options =
        EvalOptions::new(vec![dataset(root)], trackers.iter().map(|t| t.entry()).collect(), root.join("out"));
    options.report = false;
    options
}

fn run(options: &EvalOptions) -> Results {
    evaluate(options, &|_| (), &AtomicBool::new(false)).unwrap()
}

#[test]
fn a_perfect_tracker_scores_as_the_contract_says() {
    let root = tempfile::tempdir().unwrap();
    let still = Scripted::still();
    let results = run(&options(root.path(), &[&still]));
    let plain = &results.trackers["still"].sequences["plain"];
    // Overlap 1 is above every threshold but 1 itself.
    assert!((plain.auc - 20.0 / 21.0).abs() < 1e-12 && plain.frames == 10);
    assert_eq!((plain.precision20, plain.success50, plain.average_overlap), (1.0, 1.0, 1.0));
    let json: serde_json::Value =
        serde_json::from_slice(&std::fs::read(root.path().join("out/results.json")).unwrap()).unwrap();
    for key in ["auc", "precision20", "success50", "fps"] {
        assert!(json["trackers"]["still"]["mean"][key].is_number(), "{key}");
        assert!(json["trackers"]["still"]["sequences"]["plain"][key].is_number(), "{key}");
    }
    assert_eq!(json["trackers"]["still"]["sequences"]["plain"]["frames"], 10);
    for key in ["precision", "recall", "f", "false_alive"] {
        assert!(json["trackers"]["still"]["sequences"]["away"][key].is_number(), "{key}");
        assert!(json["trackers"]["still"]["sequences"]["plain"].get(key).is_none(), "{key}");
    }
    let boxes = std::fs::read_to_string(root.path().join("out/boxes/still/plain.csv")).unwrap();
    let lines: Vec<&str> = boxes.lines().collect();
    assert_eq!(lines[0], "frame,x,y,w,h,state,score");
    assert_eq!((lines.len(), lines[1]), (11, "0,2.0000,3.0000,4.0000,5.0000,tracking,1.000000"));
    assert!(text_table(&results).contains("still"));
}

#[test]
fn trackers_are_compared_with_stored_results() {
    let root = tempfile::tempdir().unwrap();
    let still = Scripted::still();
    let off = Scripted::new("off", |_, first| Some((first.translated(2.0, 0.0), Tracking, 0.8)));
    let stored = root.path().join("stored.json");
    let peer =
        r#"{"trackers": {"peer": {"sequences": {"away": {"auc": 0.5}, "plain": {"auc": 0.25}, "none": {"auc": 1}}}}}"#;
    std::fs::write(&stored, peer).unwrap();
    let options = EvalOptions { against: Some(stored), ..options(root.path(), &[&still, &off]) };
    let results = run(&options);
    let pairs: Vec<_> =
        results.comparisons.iter().map(|c| (c.tracker.as_str(), c.against.as_str(), c.sequences)).collect();
    assert_eq!(pairs, [("still", "off", 3), ("still", "peer", 2), ("off", "peer", 2)]);
    let (best, worse) = (results.trackers["still"].mean.auc, results.trackers["off"].mean.auc);
    assert!(best > worse && (results.comparisons[0].difference - (best - worse)).abs() < 1e-12);
    assert!((results.comparisons[1].against_auc - 0.375).abs() < 1e-12);
    let table = text_table(&results);
    assert!(table.contains("still against") && table.contains("peer") && table.contains("cannot tell"), "{table}");
    assert!(!table.contains("off against"), "only the best is compared in the table: {table}");
    let bad = EvalOptions { against: Some(root.path().join("none.json")), ..options };
    let error = evaluate(&bad, &|_| (), &AtomicBool::new(false)).unwrap_err().to_string();
    assert!(error.contains("none.json"), "{error}");
}

#[test]
fn second_calls_run_only_missing_passes() {
    let root = tempfile::tempdir().unwrap();
    let still = Scripted::still();
    let options = options(root.path(), &[&still]);
    let first = run(&options);
    assert_eq!(still.updates(), 27);
    let second = run(&options);
    assert_eq!((still.updates(), &first), (27, &second), "nothing was missing");

    let boxes = root.path().join("out/boxes/still");
    std::fs::remove_file(boxes.join("plain.csv")).unwrap();
    run(&options);
    assert_eq!(still.updates(), 36, "the boxes of one sequence were missing");
    std::fs::write(boxes.join("third.csv"), "frame,x,y,w,h,state,score\n0,1,").unwrap();
    std::fs::write(boxes.join("away.json"), "{").unwrap();
    run(&options);
    assert_eq!(still.updates(), 54, "damaged files are run again");

    let other = Scripted { setting: 1, ..still.clone() };
    run(&super_options(&options, &other));
    assert_eq!(still.updates(), 81, "other parameters are another run");
    let long_term = EvalOptions { protocol: Protocol::LongTerm, ..super_options(&options, &other) };
    assert!(run(&long_term).trackers["still"].sequences["plain"].long_term.is_some());
    assert_eq!(still.updates(), 81, "the long-term protocol scores the same run");
    run(&EvalOptions { build: "another".to_owned(), ..super_options(&options, &other) });
    assert_eq!(still.updates(), 108, "another build is another run");
}

fn super_options(options: &EvalOptions, tracker: &Scripted) -> EvalOptions {
    let mut again = EvalOptions::new(options.datasets.clone(), vec![tracker.entry()], options.out.clone());
    again.report = false;
    again
}

#[test]
fn stopped_evaluations_resume_where_they_ended() {
    let root = tempfile::tempdir().unwrap();
    let stop = std::sync::Arc::new(AtomicBool::new(false));
    let seen = stop.clone();
    let tracker = Scripted::new("stopper", move |frame, first| {
        // Stops in the middle of the second sequence.
        static CALLS: std::sync::atomic::AtomicUsize = std::sync::atomic::AtomicUsize::new(0);
        if CALLS.fetch_add(1, Ordering::Relaxed) == 12 {
            seen.store(true, Ordering::Relaxed);
        }
        let _ = frame;
        Some((first, Tracking, 0.8))
    });
    let options = options(root.path(), &[&tracker]);
    let results = evaluate(&options, &|_| (), &stop).unwrap();
    assert!(results.interrupted);
    assert_eq!(results.trackers["stopper"].sequences.keys().collect::<Vec<_>>(), ["away"]);
    let parts = walk(&root.path().join("out"));
    assert!(parts.iter().all(|p| !p.ends_with(".part")), "{parts:?}");
    let results = run(&options);
    assert_eq!((results.interrupted, results.trackers["stopper"].sequences.len()), (false, 3));
    assert_eq!(tracker.updates(), 13 + 18, "the finished sequence is not run again");
}

fn walk(folder: &Path) -> Vec<String> {
    let mut all = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap().flatten() {
        if entry.path().is_dir() {
            all.extend(walk(&entry.path()));
        } else {
            all.push(entry.path().display().to_string());
        }
    }
    all
}

#[test]
fn jobs_and_memory_change_nothing_but_time() {
    let root = tempfile::tempdir().unwrap();
    let wobble = Scripted::new("wobble", |frame, first| {
        Some((first.translated((frame % 3) as f64, 0.0), Tracking, 0.1 * (frame % 10) as f64))
    });
    let scores = |jobs, frame_memory_bytes, folder: &str| {
        let out = root.path().join(folder);
        let mut options = EvalOptions { jobs, frame_memory_bytes, out, ..options(root.path(), &[&wobble]) };
        options.report = false;
        run(&options);
        walk(&options.out.join("boxes"))
            .into_iter()
            .filter(|p| p.ends_with(".csv"))
            .map(|p| std::fs::read(p).unwrap())
            .collect::<Vec<_>>()
    };
    let mut all = [scores(1, 1 << 30, "a"), scores(3, 1 << 30, "b"), scores(2, 0, "c")];
    all.iter_mut().for_each(|s| s.sort());
    assert_eq!(all[0].len(), 3);
    assert!(all[0] == all[1] && all[0] == all[2]);
}

#[test]
fn tracker_failures_cost_one_sequence_only() {
    let root = tempfile::tempdir().unwrap();
    let failing = Scripted::new("failing", |frame, first| (frame < 5).then_some((first, Tracking, 1.0)));
    let panicking = Scripted::new("panicking", |frame, first| {
        assert!(frame < 5, "on purpose");
        Some((first, Tracking, 1.0))
    });
    let nowhere = Scripted::new("nowhere", |_, first| Some((first.translated(f64::NAN, 0.0), Tracking, 1.0)));
    let results = run(&options(root.path(), &[&failing, &panicking, &nowhere]));
    for (name, words, success) in
        [("failing", "frame 5: ", 0.5), ("panicking", "on purpose", 0.5), ("nowhere", "NaN", 0.1)]
    {
        let plain = &results.trackers[name].sequences["plain"];
        assert!(plain.error.as_ref().unwrap().contains(words), "{:?}", plain.error);
        assert!((plain.success50 - success).abs() < 1e-12, "{name}: {plain:?}");
        assert_eq!(results.trackers[name].sequences.len(), 3);
    }
}

#[test]
fn unopenable_sequences_are_left_out_and_named() {
    let root = tempfile::tempdir().unwrap();
    let still = Scripted::still();
    let options = options(root.path(), &[&still]);
    // As OTB has it: images are only opened when it is run.
    let broken = root.path().join("data/broken");
    (1..=9).for_each(|i| write(&broken.join(format!("img/000{i}.png")), "rubbish"));
    write(&broken.join("groundtruth_rect.txt"), &"2,3,4,5\n".repeat(9));
    let news = Mutex::new(Vec::new());
    let results = evaluate(&options, &|p| news.lock().unwrap().push(p), &AtomicBool::new(false)).unwrap();
    assert_eq!(results.trackers["still"].sequences.keys().collect::<Vec<_>>(), ["away", "plain", "third"]);
    assert!(results.problems.len() == 1 && results.problems[0].contains("sequence broken"), "{:?}", results.problems);
    let left_out = |p: &Progress| matches!(p, Progress::LeftOut { problem, .. } if problem == &results.problems[0]);
    assert!(news.into_inner().unwrap().iter().any(left_out));

    let only = EvalOptions { sequences: Some("broken".to_owned()), ..super_options(&options, &still) };
    let error = evaluate(&only, &|_| (), &AtomicBool::new(false)).unwrap_err();
    assert!(error.to_string().contains("sequence broken"), "{error}");
}

#[test]
fn only_lost_frames_have_no_box() {
    let root = tempfile::tempdir().unwrap();
    let honest = Scripted::new("honest", |frame, first| match frame {
        4 | 5 => Some((first, Lost, 0.0)),
        6 | 7 => Some((first, Occluded, 0.5)),
        _ => Some((first, Tracking, 0.9)),
    });
    let results = run(&options(root.path(), &[&honest]));
    let plain = &results.trackers["honest"].sequences["plain"];
    assert!((plain.success50 - 0.8).abs() < 1e-12 && (plain.lost - 0.2).abs() < 1e-12);
    let away = results.trackers["honest"].sequences["away"].long_term.as_ref().unwrap();
    assert_eq!((away.false_alive, away.returns, away.reacquired), (Some(0.0), 1, 1));
    assert_eq!(away.reacquire_frames, Some(0.0));
    // Seven visible frames after the start, five of them claimed.
    assert!((away.precision - 1.0).abs() < 1e-12 && (away.recall - 5.0 / 7.0).abs() < 1e-12);
}

#[test]
fn reset_protocol_restarts_five_frames_later() {
    let root = tempfile::tempdir().unwrap();
    let folder = root.path().join("data/drift");
    let images = write_images(&folder, 40, 1, 4);
    let rows: Vec<String> = images.iter().enumerate().map(|(i, n)| format!("{i},{n},2,3,4,5")).collect();
    write(&folder.join("frames.csv"), &format!("index,image,x,y,w,h\n{}\n", rows.join("\n")));
    let drifting = Scripted::new("drifting", |frame, first| {
        Some((if frame == 12 { first.translated(9.0, 0.0) } else { first }, Tracking, 1.0))
    });
    let mut options = EvalOptions::new(vec![root.path().join("data")], vec![drifting.entry()], root.path().join("out"));
    (options.protocol, options.report) = (Protocol::Reset, false);
    let results = run(&options);
    let score = results.trackers["drifting"].sequences["drift"].supervised.clone().unwrap();
    assert_eq!((score.failures, score.accuracy), (1.0, 1.0));
    assert!((score.robustness - (-30.0f64 / 40.0).exp()).abs() < 1e-12);
    let record: serde_json::Value =
        serde_json::from_slice(&std::fs::read(root.path().join("out/boxes/drifting/drift@reset.json")).unwrap())
            .unwrap();
    assert_eq!((&record["starts"], &record["failures"]), (&serde_json::json!([0, 17]), &serde_json::json!([12])));
}

#[test]
fn protocols_share_a_folder_without_conflict() {
    let root = tempfile::tempdir().unwrap();
    let still = Scripted::still();
    let all = [Protocol::Ope, Protocol::LongTerm, Protocol::Reset, Protocol::Sre, Protocol::Tre];
    let with = |protocol| EvalOptions { protocol, ..super_options(&options(root.path(), &[&still]), &still) };
    let read = |name: &str| std::fs::read_to_string(root.path().join("out").join(name)).unwrap();
    let first = all.map(|protocol| (protocol, run(&with(protocol)), read("results.json")));
    let updates = still.updates();
    for (protocol, results, text) in first {
        assert_eq!(read(&format!("results-{protocol}.json")), text);
        assert_eq!(run(&with(protocol)), results, "{protocol}");
        assert_eq!(read("results.json"), text, "the last call's");
    }
    assert_eq!(still.updates(), updates, "nothing had to be run again");
}

#[test]
fn other_footage_and_another_first_box_are_run_again() {
    let root = tempfile::tempdir().unwrap();
    let still = Scripted::still();
    let options = options(root.path(), &[&still]);
    let plain = root.path().join("data/plain");
    let added = || {
        let before = still.updates();
        run(&options);
        still.updates() - before
    };
    assert_eq!((added(), added()), (3 * 9, 0));
    let truth = std::fs::read_to_string(plain.join("frames.csv")).unwrap();
    write(&plain.join("frames.csv"), &truth.replacen("2,3,4,5", "2,3,4.5,5", 1));
    assert_eq!((added(), added()), (9, 0), "another first box");
    let truth = truth.replacen("2,3,4,5", "2,3,4.5,5", 1);
    write(&plain.join("frames.csv"), &truth.replace("8,0009.png,2,3,4,5", "8,0009.png,2,3,4,6"));
    assert_eq!(added(), 0, "what a later frame shows changes the score alone");
    let image = std::fs::read(plain.join("0003.png")).unwrap();
    std::fs::write(plain.join("0003.png"), [image, vec![0; 9]].concat()).unwrap();
    assert_eq!((added(), added()), (9, 0), "other images");
}

#[test]
fn robustness_protocols_average_their_passes() {
    let root = tempfile::tempdir().unwrap();
    let still = Scripted::still();
    let sre = EvalOptions { protocol: Protocol::Sre, ..options(root.path(), &[&still]) };
    let results = run(&sre);
    let plain = &results.trackers["still"].sequences["plain"];
    assert_eq!((plain.passes, plain.frames), (Some(12), 120));
    assert!(plain.auc < 20.0 / 21.0 && plain.auc > 0.5, "shifted and scaled starts overlap less: {}", plain.auc);
    assert!(root.path().join("out/boxes/still/plain@scale-80.csv").is_file());
    let tre = EvalOptions { protocol: Protocol::Tre, ..options(root.path(), &[&still]) };
    assert_eq!(run(&tre).trackers["still"].sequences["plain"].passes, None, "ten frames have one segment only");
}

#[test]
fn progress_counts_every_run() {
    let root = tempfile::tempdir().unwrap();
    let still = Scripted::still();
    let news = Mutex::new(Vec::new());
    let options = options(root.path(), &[&still]);
    evaluate(&options, &|p| news.lock().unwrap().push(p), &AtomicBool::new(false)).unwrap();
    let news = news.into_inner().unwrap();
    assert_eq!(news[0], Progress::Found { sequences: 3, runs: 3, problems: Vec::new() });
    assert!(matches!(&news[3], Progress::Finished { done: 3, runs: 3, reused: false, .. }), "{news:?}");
}

#[test]
fn results_of_before_score_alike() {
    let root = tempfile::tempdir().unwrap();
    let still = Scripted::still();
    let first = run(&options(root.path(), &[&still]));
    let mut again = options(root.path(), &[]);
    again.given = vec![Given { name: "before".to_owned(), path: root.path().join("out/boxes/still") }];
    let second = run(&again);
    for (name, score) in &first.trackers["still"].sequences {
        let scored = &second.trackers["before"].sequences[name];
        assert_eq!((scored.auc, scored.average_overlap), (score.auc, score.average_overlap), "{name}");
    }
    assert_eq!(still.updates(), 3 * 9, "nothing was run again");
}

#[test]
fn unusable_results_are_named() {
    let root = tempfile::tempdir().unwrap();
    let still = Scripted::still();
    let fails = |given: &[(&str, &Path)], protocol: Protocol| {
        let mut options = options(root.path(), &[&still]);
        options.given =
            given.iter().map(|(name, path)| Given { name: (*name).to_owned(), path: path.to_path_buf() }).collect();
        options.protocol = protocol;
        evaluate(&options, &|_| (), &AtomicBool::new(false)).unwrap_err()
    };
    let (empty, file) = (root.path().join("empty"), root.path().join("one.csv"));
    write(&file, "frame,x,y,w,h,state,score\n0,2,3,4,5,tracking,1\n");
    let error = fails(&[("mine", &empty)], Protocol::Ope);
    assert!(
        matches!(&error, EvaluationError::Dataset { .. }) && error.to_string().contains("no trajectory of"),
        "{error}"
    );
    assert!(fails(&[("mine", &file)], Protocol::Ope).to_string().contains("several sequences"));
    assert!(fails(&[("still", &file)], Protocol::Ope).to_string().contains("two results"));
    assert!(fails(&[("mine", &file)], Protocol::Sre).to_string().contains("one pass"));
}

/// Evaluates `given` alone on the data set of [`dataset`].
fn scored(root: &Path, given: &Path, protocol: Protocol) -> Result<Results, EvaluationError> {
    let mut options = options(root, &[]);
    options.given = vec![Given { name: "mine".to_owned(), path: given.to_owned() }];
    (options.protocol, options.sequences) = (protocol, Some("plain".to_owned()));
    evaluate(&options, &|_| (), &AtomicBool::new(false))
}

#[test]
fn result_files_of_otb_got10k_and_vot_are_scored() {
    let root = tempfile::tempdir().unwrap();
    let right = |n: usize| "2,3,4,5\n".repeat(n);
    let auc = |results: &Results| results.trackers["mine"].sequences["plain"].auc;
    // OTB's: a line a frame, any separator; nothing is said by nan and by a box without area.
    let folder = root.path().join("otb");
    write(&folder.join("plain.txt"), &format!("{}nan\tnan\tnan\tnan\n0 0 0 0\n", right(8)));
    let otb = scored(root.path(), &folder, Protocol::Ope).unwrap();
    let one = &otb.trackers["mine"].sequences["plain"];
    assert!((one.auc - 0.8 * 20.0 / 21.0).abs() < 1e-12 && (one.lost - 0.2).abs() < 1e-12, "{one:?}");
    assert_eq!(one.calibration_error, None, "no score was given");
    // GOT-10k's: repetitions, averaged over, and times; the first is of the start.
    let folder = root.path().join("got");
    write(&folder.join("plain/plain_001.txt"), &right(10));
    write(&folder.join("plain/plain_002.txt"), &format!("{}{}", right(5), "90,90,4,5\n".repeat(5)));
    write(&folder.join("plain/plain_time.txt"), &format!("9.0\n{}", "0.02\n".repeat(9)));
    let got = scored(root.path(), &folder, Protocol::Ope).unwrap();
    assert!((auc(&got) - 0.75 * 20.0 / 21.0).abs() < 1e-12);
    let one = &got.trackers["mine"].sequences["plain"];
    assert_eq!(one.passes, Some(2));
    assert!((one.fps.unwrap() - 50.0).abs() < 1e-9);
    // VOT's supervised experiment: started, polygons, failed, skipped, started again.
    let folder = root.path().join("vot");
    let lines = ["1", "2,3,6,3,6,8,2,8", "2,3,4,5", "2", "0", "0", "0", "0", "1", "2,3,4,5"];
    write(&folder.join("plain/plain_001.txt"), &lines.join("\n"));
    let vot = scored(root.path(), &folder, Protocol::Reset).unwrap();
    let supervised = vot.trackers["mine"].sequences["plain"].supervised.clone().unwrap();
    assert_eq!(supervised.failures, 1.0);
    // A repetition without a failure: half a failure a run, and the overlaps of both.
    write(&folder.join("plain/plain_002.txt"), &format!("1\n{}", "2,3,4,5\n".repeat(9)));
    let both = scored(root.path(), &folder, Protocol::Reset).unwrap();
    let repeated = both.trackers["mine"].sequences["plain"].supervised.clone().unwrap();
    assert_eq!((repeated.failures, both.trackers["mine"].sequences["plain"].passes), (0.5, Some(2)));
    assert!((repeated.robustness - (-30.0 * 0.5 / 10.0_f64).exp()).abs() < 1e-12, "{repeated:?}");
    std::fs::remove_file(folder.join("plain/plain_002.txt")).unwrap();
    let error = scored(root.path(), &folder, Protocol::Ope).unwrap_err().to_string();
    assert!(error.contains("plain_001.txt:4") && error.contains("`reset`"), "{error}");
    let error = scored(root.path(), &root.path().join("otb"), Protocol::Reset).unwrap_err().to_string();
    assert!(error.contains("marks no start"), "{error}");
}

#[test]
fn confidences_order_the_boxes_of_result_files() {
    let root = tempfile::tempdir().unwrap();
    let folder = root.path().join("vot");
    write(&folder.join("plain/plain_001.txt"), &format!("1\n{}{}", "2,3,4,5\n".repeat(6), "90,90,4,5\n".repeat(3)));
    let confidences = |high: f64| format!("\n{}{}", format!("{high}\n").repeat(6), "0.25\n".repeat(3));
    write(&folder.join("plain/plain_001_confidence.value"), &confidences(0.75));
    let read = scored(root.path(), &folder, Protocol::LongTerm).unwrap();
    let one = &read.trackers["mine"].sequences["plain"];
    // Six boxes with .75 are right, three with .25 wrong: each gap is .25.
    assert!((one.calibration_error.unwrap() - 0.25).abs() < 1e-12, "{one:?}");
    let (precision, recall) = (1.0, 6.0 / 9.0);
    let best = 2.0 * precision * recall / (precision + recall);
    assert!((one.long_term.as_ref().unwrap().f_best - best).abs() < 1e-12, "the wrong ones are below a threshold");
    write(&folder.join("plain/plain_001_confidence.value"), &confidences(750.0));
    let read = scored(root.path(), &folder, Protocol::LongTerm).unwrap();
    let one = &read.trackers["mine"].sequences["plain"];
    assert_eq!(one.calibration_error, None, "what exceeds 1 is no probability");
    assert!((one.long_term.as_ref().unwrap().f_best - best).abs() < 1e-12);
}

#[test]
fn damaged_result_files_are_named_with_their_line() {
    let root = tempfile::tempdir().unwrap();
    let folder = root.path().join("mine");
    for (text, expected) in [
        ("2,3,4,5\n".repeat(9), "has 9 lines for 10 frames"),
        ("2,3,4,5\n".repeat(9) + "2,3,x,5\n", "plain.txt:10: `x`"),
        ("2,3,4,5\n".repeat(9) + "2,3,4\n", "plain.txt:10: has 3 numbers"),
        ("2,3,4,5\n".repeat(9) + "7\n", "plain.txt:10: 7 is no code"),
        ("2,3,4,5\n".repeat(9) + "m3,4,5,6,7\n", "plain.txt:10: is a mask"),
    ] {
        write(&folder.join("plain.txt"), &text);
        let error = scored(root.path(), &folder, Protocol::Ope).unwrap_err().to_string();
        assert!(error.contains(expected), "{expected}: {error}");
    }
}

#[test]
fn figures_are_told_apart_by_attributes_and_left_as_tables_and_curves() {
    let root = tempfile::tempdir().unwrap();
    let off = Scripted::new("off", |_, first| Some((first.translated(2.0, 0.0), Tracking, 0.9)));
    let table = root.path().join("attributes.csv");
    write(&table, "sequence,IV,OCC\naway,0,1\nplain,1,1\nnowhere,1,0\n");
    let mut options = options(root.path(), &[&Scripted::still(), &off]);
    options.attributes = Some(table.clone());
    let results = run(&options);
    let still = &results.trackers["still"];
    assert_eq!(still.attributes.keys().collect::<Vec<_>>(), ["IV", "OCC"]);
    assert_eq!((still.attributes["IV"].sequences, still.attributes["OCC"].sequences), (1, 2));
    assert_eq!(still.attributes["IV"].auc, still.sequences["plain"].auc);
    let read = |file: &str| std::fs::read_to_string(root.path().join("out").join(file)).unwrap();
    let lines = |file: &str| read(file).lines().map(str::to_owned).collect::<Vec<_>>();
    assert!(lines("tables/trackers.csv")[0].starts_with("tracker,rank_low,rank_high,auc,"));
    assert_eq!((lines("tables/trackers.csv").len(), lines("tables/sequences-ope.csv").len()), (3, 7));
    assert_eq!(lines("tables/attributes.csv").len(), 5);
    assert!(lines("tables/comparisons.csv")[1].starts_with("still,off,3,"));
    assert!(read("tables/trackers.md").contains("| still | 1–2 | **0.952** |"), "{}", read("tables/trackers.md"));
    assert!(read("tables/attributes.tex").contains("IV & "));
    let success = lines("curves/success.csv");
    assert_eq!((success[0].as_str(), success.len()), ("tracker,overlap_threshold,success_rate", 1 + 2 * 21));
    assert!(read("curves/success.svg").starts_with("<svg"));
    write(&table, "sequence,IV\nnowhere,1\n");
    let error = evaluate(&options, &|_| (), &AtomicBool::new(false)).unwrap_err().to_string();
    assert!(error.contains("names no sequence that is there") && error.contains("nowhere"), "{error}");
    write(&table, "sequence,IV\nplain,maybe\n");
    let error = evaluate(&options, &|_| (), &AtomicBool::new(false)).unwrap_err().to_string();
    assert!(error.contains("attributes.csv:2") && error.contains("`maybe`"), "{error}");
}
