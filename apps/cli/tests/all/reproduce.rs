//! `pursuit reproduce`: every paper's experiment writes its table, results and pictures; wrong usage is told.
#![cfg(feature = "reproduce")]

use crate::common::{fails, pursuit, stderr, stdout};
use pursuit_experiments::Paper;
use std::path::Path;
use std::process::Output;

fn reproduce(paper: &str, folder: &Path, more: &[&str]) -> Output {
    pursuit(&[&["reproduce", paper, "--out", folder.to_str().unwrap()], more].concat())
}

#[test]
fn every_paper_leaves_a_table_results_and_pictures() {
    for paper in Paper::ALL.map(Paper::name) {
        let folder = tempfile::tempdir().unwrap();
        let output = reproduce(paper, folder.path(), &["--seeds", "2"]);
        let text = stdout(&output);
        assert!(output.status.success() && stderr(&output).is_empty(), "{paper}: {}", stderr(&output));
        assert!(text.starts_with(&format!("{paper}: ")) && text.contains("(2 seeds)"), "{text}");
        for column in ["paper", "reference", "ours", "plain, tuned", "IMM", "bar"] {
            assert!(text.contains(column), "{paper}: no column {column}");
        }
        // What the paper says, and whether it does.
        assert!(text.contains("HOLD:") || text.contains("holds:"), "{text}");
        assert!(text.contains("bars reached") && text.contains(folder.path().to_str().unwrap()), "{text}");

        let results: serde_json::Value =
            serde_json::from_slice(&std::fs::read(folder.path().join("results.json")).unwrap()).unwrap();
        assert_eq!((results["paper"].as_str(), results["seeds"].as_u64()), (Some(paper), Some(2)));
        assert!(results["rows"].as_array().is_some_and(|rows| rows.len() > 10));
        let pictures: Vec<String> = std::fs::read_dir(folder.path())
            .unwrap()
            .map(|entry| entry.unwrap().path())
            .filter(|path| path.extension().is_some_and(|extension| extension == "svg"))
            .map(|path| std::fs::read_to_string(path).unwrap())
            .collect();
        assert!(pictures.len() >= 2, "{paper}: {} pictures", pictures.len());
        assert!(pictures.iter().all(|svg| svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>")), "{paper}");
    }
}

#[test]
fn the_same_seeds_give_the_same_results_in_either_form() {
    let folders = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
    let first = reproduce("qu2010", folders[0].path(), &["--seeds", "3", "--threads", "1"]);
    let second = reproduce("qu2010", folders[1].path(), &["--seeds", "3", "--json"]);
    assert!(first.status.success() && second.status.success());
    let read = |folder: &tempfile::TempDir| std::fs::read_to_string(folder.path().join("results.json")).unwrap();
    assert_eq!(read(&folders[0]), read(&folders[1]));
    assert_eq!(stdout(&second), read(&folders[1]));
}

#[test]
fn too_few_seeds_to_check_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let output = reproduce("qu2010", folder.path(), &["--seeds", "2", "--check"]);
    let text = stderr(&output);
    assert!(text.contains("1000 seeds") && text.contains("WARN"), "{text}");
    let missed = stdout(&output).contains("MISS");
    assert_eq!(output.status.code(), Some(i32::from(missed)), "{text}");
    assert_eq!(text.contains("miss their bar"), missed, "{text}");
    // The results are there all the same.
    assert!(folder.path().join("results.json").is_file());
}

#[test]
fn wrong_usage_and_a_folder_that_cannot_be_written() {
    let folder = tempfile::tempdir().unwrap();
    let unknown = reproduce("nobody1999", folder.path(), &[]);
    let text = stderr(&unknown);
    assert_eq!(unknown.status.code(), Some(2), "{text}");
    assert!(text.contains("nobody1999"), "{text}");
    for paper in Paper::ALL.map(Paper::name) {
        assert!(text.contains(paper), "{paper} is not offered: {text}");
    }
    for seeds in ["0", "-1", "many"] {
        assert_eq!(reproduce("ball", folder.path(), &["--seeds", seeds]).status.code(), Some(2), "{seeds}");
    }
    assert_eq!(pursuit(&["reproduce"]).status.code(), Some(2));

    let file = folder.path().join("taken");
    std::fs::write(&file, "here already").unwrap();
    fails(&reproduce("qu2010", &file, &["--seeds", "1"]), 4, &["taken"]);
    assert_eq!(std::fs::read_to_string(&file).unwrap(), "here already");
}
