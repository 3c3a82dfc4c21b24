use super::*;
use std::fmt::Write as _;

/// Two things that pass each other, ten frames a second, and clutter now and then; MOTChallenge's form.
fn crossing() -> String {
    let mut text = String::new();
    for frame in 0..40 {
        let x = 10.0 * f64::from(frame);
        let _ = writeln!(text, "{},-1,{:.2},51,40,80,0.9,-1,-1,-1", frame + 1, 1.0 + x);
        let _ = writeln!(text, "{},-1,{:.2},201,40,80,0.8,-1,-1,-1", frame + 1, 501.0 - x);
        if frame % 7 == 0 {
            let _ = writeln!(text, "{},-1,{},351,30,30,0.3,-1,-1,-1", frame + 1, 40 * frame + 1);
        }
    }
    text
}

fn sequence(folder: &Path) {
    std::fs::create_dir_all(folder).unwrap();
    std::fs::write(folder.join("det.txt"), crossing()).unwrap();
    std::fs::write(folder.join("seqinfo.ini"), "[Sequence]\nframeRate=10\nseqLength=45\nimWidth=640\nimHeight=480\n")
        .unwrap();
}

fn run(options: &Associate, input: &Path, out: &Path) -> Result<Vec<Associated>, RunError> {
    options.run(input, out, &AtomicBool::new(false))
}

#[test]
fn a_folder_of_sequences_is_a_batch() {
    let root = tempfile::tempdir().unwrap();
    let (set, out) = (root.path().join("set"), root.path().join("out"));
    sequence(&set.join("a"));
    sequence(&set.join("b"));
    let options = Associate { formats: vec![Format::CSV], ..Associate::default() };
    let done = run(&options, &set, &out).unwrap();
    assert_eq!(
        done.iter().map(|d| (d.sequence.as_str(), d.frames, d.targets)).collect::<Vec<_>>(),
        [("a", 45, 2), ("b", 45, 2)]
    );
    assert!(done.iter().all(|d| d.assumed_fps.is_none()));
    let times = std::fs::read_to_string(out.join("times.csv")).unwrap();
    assert!(times.starts_with("sequence,frames,seconds\na,45,0.") && times.lines().count() == 3, "{times}");
    let tracks = std::fs::read_to_string(out.join("a.txt")).unwrap();
    assert_eq!(tracks, std::fs::read_to_string(out.join("b.txt")).unwrap());
    let ids: std::collections::BTreeSet<&str> = tracks.lines().filter_map(|l| l.split(',').nth(1)).collect();
    assert_eq!(ids.len(), 2, "what passes stays who it is");
    assert!(std::fs::read_to_string(out.join("csv/a.csv")).unwrap().starts_with("frame,time_s,target"));
    let by_set = options.sequences(&CrowdSequence::discover(&set).unwrap(), &out, &AtomicBool::new(false)).unwrap();
    assert_eq!(by_set[0].file, out.join("set/a.txt"));
}

#[test]
fn a_file_alone_is_a_sequence() {
    let root = tempfile::tempdir().unwrap();
    sequence(&root.path().join("a"));
    let out = root.path().join("out");
    let known = run(&Associate::default(), &root.path().join("a/det.txt"), &out).unwrap();
    assert_eq!((known[0].sequence.as_str(), known[0].frames, known[0].assumed_fps), ("a", 45, None));
    let file = root.path().join("clip.txt");
    std::fs::write(&file, crossing()).unwrap();
    let alone = run(&Associate::default(), &file, &out).unwrap();
    assert_eq!((alone[0].sequence.as_str(), alone[0].frames, alone[0].assumed_fps), ("clip", 40, Some(25.0)));
    let error = run(&Associate::default(), &file, root.path()).unwrap_err();
    assert!(error.to_string().contains("is the input") && error.exit_code() == 2, "{error}");
    assert_eq!(std::fs::read_to_string(&file).unwrap(), crossing());
}

#[test]
fn a_video_beside_gives_times_and_size() {
    let root = tempfile::tempdir().unwrap();
    let file = root.path().join("clip.jsonl");
    let lines: String = (0..20)
        .map(|f| format!("{{\"frame\":{f},\"box\":[{},60,30,30],\"score\":0.9,\"class\":\"ball\"}}\n", 50 + f))
        .collect();
    std::fs::write(&file, lines).unwrap();
    let options = Associate {
        video: Some("scene:drift?seed=7&duration=1".into()),
        formats: vec![Format::JSONL],
        ..Associate::default()
    };
    let done = run(&options, &file, &root.path().join("out")).unwrap();
    assert_eq!((done[0].targets, done[0].assumed_fps), (1, None));
    let lines = std::fs::read_to_string(root.path().join("out/jsonl/clip.jsonl")).unwrap();
    let line: serde_json::Value = serde_json::from_str(lines.lines().nth(5).unwrap()).unwrap();
    assert_eq!((&line["class"], &line["target"]), (&"ball".into(), &1.into()));
    sequence(&root.path().join("set/a"));
    sequence(&root.path().join("set/b"));
    let error = run(&options, &root.path().join("set"), &root.path().join("out")).unwrap_err();
    assert!(error.to_string().contains("one sequence"), "{error}");
}

#[test]
fn what_cannot_be_associated_is_named() {
    let root = tempfile::tempdir().unwrap();
    let out = root.path().join("out");
    let file = root.path().join("det.txt");
    for (text, options, code, words) in [
        ("1,-1,1,1,9,9,67.5\n", Associate::default(), 2, "67.5"),
        ("1,-1,1,1,9,wide,1\n", Associate::default(), 3, "det.txt:1"),
        ("1,-1,1,1,9,9,1\n", Associate { fps: Some(0.0), ..Associate::default() }, 2, "--fps"),
        (
            "1,-1,1,1,9,9,1\n",
            Associate { parameters: "many.nonsense = 1".parse().unwrap(), ..Associate::default() },
            2,
            "nonsense",
        ),
        ("1,-1,1,1,9,9,1\n", Associate { parameters: "gate = 1".parse().unwrap(), ..Associate::default() }, 2, "gate"),
        ("0 .5 .5 .1 .1\n", Associate { format: Some(BoxFormat::Yolo), ..Associate::default() }, 3, "det.txt"),
    ] {
        std::fs::write(&file, text).unwrap();
        let error = run(&options, &file, &out).unwrap_err();
        assert!(error.to_string().contains(words), "{text}: {error}");
        assert_eq!(error.exit_code(), code, "{text}: {error}");
    }
    assert!(
        run(&Associate::default(), &root.path().join("nowhere"), &out).unwrap_err().to_string().contains("nowhere")
    );
    std::fs::create_dir(root.path().join("empty")).unwrap();
    let error = run(&Associate::default(), &root.path().join("empty"), &out).unwrap_err();
    assert!(error.to_string().contains("det.txt"), "{error}");
}
