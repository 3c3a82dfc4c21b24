//! Nothing of the user's is destroyed: inputs are no outputs, earlier results stay until a run has begun, a run has a
//! folder of its own.

use crate::common::{command, fails, pursuit, rows};
use std::path::Path;
use std::process::Output;

const BALL: [&str; 7] = ["track", "scene:table-tennis", "--detect", "ball", "--set", "color=yellow", "--to"];

fn ball(to: &str, more: &[&str]) -> Output {
    pursuit(&[&BALL[..], &[to], more].concat())
}

/// Every file below a folder with what it holds.
fn files(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let mut all: Vec<(String, Vec<u8>)> = std::fs::read_dir(folder)
        .unwrap()
        .map(|e| e.unwrap().path())
        .filter(|p| p.is_file())
        .map(|p| (p.file_name().unwrap().to_str().unwrap().to_owned(), std::fs::read(p).unwrap()))
        .collect();
    all.sort();
    all
}

#[test]
fn an_output_is_never_the_input() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("run");
    let out_text = out.to_str().unwrap();
    assert_eq!(ball("12", &["--out", out_text]).status.code(), Some(0));
    let before = files(&out);
    let film = out.join("overlay.mp4");
    let mut names = vec![film.clone(), out.join("../run/overlay.mp4")];
    #[cfg(unix)]
    {
        let link = folder.path().join("link.mp4");
        std::os::unix::fs::symlink(&film, &link).unwrap();
        names.push(link);
    }
    for name in names {
        let args = ["track", name.to_str().unwrap(), "--box", "300,200,40,40", "--out", out_text];
        fails(&pursuit(&args), 2, &["overlay.mp4", "input", "--out"]);
        assert_eq!(files(&out), before);
    }
    // The configuration is an input too.
    let config = folder.path().join("configuration");
    std::fs::create_dir(&config).unwrap();
    std::fs::write(config.join("run.json"), std::fs::read(out.join("run.json")).unwrap()).unwrap();
    std::fs::write(config.join("trajectory.txt"), "tracker = 'mosse'").unwrap();
    let file = config.join("trajectory.txt");
    let args = ["track", "scene:drift", "--config", file.to_str().unwrap(), "--out", config.to_str().unwrap()];
    fails(&pursuit(&args), 2, &["trajectory.txt", "input"]);
}

#[test]
fn earlier_results_stay_until_a_run_has_begun() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().to_str().unwrap();
    assert_eq!(ball("12", &["--out", out, "--plots", "--format", "jsonl"]).status.code(), Some(0));
    let before = files(folder.path());
    let start = ["track", "scene:table-tennis", "--out", out];
    for wrong in
        [["--box", "9000,0,5,5"], ["--box", "1,2,0,0"], ["--box", "x"], ["--set", "nonsense=1"], ["--fps", "0"]]
    {
        assert_eq!(pursuit(&[&start[..], &wrong].concat()).status.code(), Some(2), "{wrong:?}");
        assert_eq!(files(folder.path()), before, "{wrong:?}");
    }
    fails(&pursuit(&["track", "absent.mp4", "--box", "1,1,9,9", "--out", out]), 3, &["absent.mp4"]);
    assert_eq!(files(folder.path()), before);
    // One that has begun replaces the earlier one whole: nothing stale stays beside it.
    assert_eq!(ball("5", &["--out", out, "--no-video"]).status.code(), Some(0));
    let names: Vec<String> = files(folder.path()).into_iter().map(|f| f.0).collect();
    assert_eq!(names, ["run.json", "trajectory.csv"]);
    assert!(!folder.path().join("plots/x.svg").exists());
    assert_eq!(rows(&folder.path().join("trajectory.csv")).len(), 6);
}

#[test]
fn what_no_run_wrote_is_not_touched() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("trajectory.csv"), "years of work").unwrap();
    let out = folder.path().to_str().unwrap();
    for more in [&["--out", out][..], &["--out", out, "--overwrite"]] {
        fails(&ball("5", more), 2, &["trajectory.csv", "no run wrote it", "--out"]);
        assert_eq!(files(folder.path()), [("trajectory.csv".to_owned(), b"years of work".to_vec())]);
    }
}

#[test]
fn clips_of_one_name_have_folders_of_their_own() {
    let folder = tempfile::tempdir().unwrap();
    let run = |more: &[&str]| {
        let args = [&BALL[..], &["3", "--no-video"], more].concat();
        let output = command(&args).current_dir(folder.path()).output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{}", crate::common::stderr(&output));
    };
    let frames = |name: &str| rows(&folder.path().join("pursuit-out").join(name).join("trajectory.csv")).len();
    run(&[]);
    run(&["--from", "1"]);
    run(&["--from", "2"]);
    assert_eq!((frames("scene-table-tennis"), frames("scene-table-tennis-2")), (4, 3));
    assert_eq!(frames("scene-table-tennis-3"), 2);
    #[cfg(unix)]
    assert_eq!(frames("latest"), 2);
    run(&["--from", "3", "--overwrite"]);
    assert_eq!((frames("scene-table-tennis"), frames("scene-table-tennis-2")), (1, 3));
}

/// Two runs at once: the second is told, and the first's files are whole.
#[cfg(unix)]
#[test]
fn two_runs_do_not_write_into_one_folder() {
    use std::io::Write;
    use std::process::Stdio;
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().to_str().unwrap();
    let mut first = command(&["track", "-", "--tracker", "mosse", "--box", "4,4,16,16", "--no-video", "--out", out])
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let mut input = first.stdin.take().unwrap();
    input.write_all(b"YUV4MPEG2 W64 H48 F30:1 Ip C420jpeg\n").unwrap();
    let mut frame = |n: u8| {
        input.write_all(b"FRAME\n").unwrap();
        let pixels: Vec<u8> = (0..64 * 48 * 3 / 2).map(|p| (p as u8).wrapping_mul(31).wrapping_add(n)).collect();
        input.write_all(&pixels).unwrap();
        input.flush().unwrap();
    };
    (0..20).for_each(&mut frame);
    let facts = folder.path().join("run.json");
    (0..600).take_while(|_| !facts.exists()).for_each(|_| std::thread::sleep(std::time::Duration::from_millis(50)));
    fails(&ball("3", &["--no-video", "--out", out]), 4, &["another run is writing", out]);
    frame(20);
    drop(input);
    assert_eq!(first.wait().unwrap().code(), Some(0));
    assert_eq!(rows(&folder.path().join("trajectory.csv")).len(), 21);
    assert_eq!(ball("3", &["--no-video", "--out", out]).status.code(), Some(0));
}

#[test]
fn results_go_to_standard_output_too() {
    let folder = tempfile::tempdir().unwrap();
    let run = |more: &[&str]| {
        let args = [&BALL[..], &["12", "--out", "-"], more].concat();
        command(&args).current_dir(folder.path()).output().unwrap()
    };
    let output = run(&[]);
    assert_eq!((output.status.code(), crate::common::stderr(&output)), (Some(0), String::new()));
    let lines: Vec<serde_json::Value> =
        crate::common::stdout(&output).lines().map(|l| serde_json::from_str(l).unwrap()).collect();
    let last = lines.last().unwrap();
    assert_eq!((last["frame"].as_u64(), last["state"].as_str()), (Some(12), Some("tracking")));
    assert_eq!(last["box"].as_array().unwrap().len(), 4);
    assert!(lines.len() > 8, "a line for every frame of a target");
    fails(&run(&["--plots"]), 2, &["standard output", "--out DIR"]);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}
