//! The papers' experiments with all their seeds: no figure may miss its bar. Those of two papers take minutes: with few seeds here,
//! with all in `reproduce_in_full`.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;

use common::check;
use pursuit_experiments::{Options, Paper, run};

#[test]
#[ignore = "release: 200 seeds"]
fn ball_reaches_its_bars() {
    check(Paper::Ball);
}

#[test]
#[ignore = "release: 1000 seeds"]
fn qu2010_reaches_its_bars() {
    check(Paper::Qu2010);
}

#[test]
#[ignore = "release: 1000 seeds"]
fn gao2007_reaches_its_bars() {
    check(Paper::Gao2007);
}

/// Of few seeds a figure may miss its bar by chance; a defect misses more.
#[test]
#[ignore = "release: 80 and 20 seeds of the slow papers"]
fn slow_papers_reach_most_bars_with_few_seeds() {
    for (paper, by_chance) in [(Paper::Zhai2024, 2), (Paper::Zhu2014, 1)] {
        let seeds = Some(paper.quick_seeds());
        let reproduction = run(paper, &Options { seeds, ..Options::default() }).unwrap();
        let judged = reproduction.rows.iter().filter(|row| row.bar.is_some()).count();
        assert!(judged > 10, "{judged} figures of {} are judged", paper.name());
        assert!(reproduction.missed().count() <= by_chance, "{reproduction}");
    }
}

#[test]
fn no_seeds_are_wrong_usage() {
    let error = run(Paper::Ball, &Options { seeds: Some(0), ..Options::default() }).unwrap_err();
    assert_eq!(error.exit_code(), 2);
}

#[test]
fn only_one_paper_takes_a_data_set() {
    let options = Options { seeds: Some(1), dataset: Some("somewhere".into()) };
    let error = run(Paper::Ball, &options).unwrap_err();
    assert_eq!(error.exit_code(), 2);
    assert!(error.to_string().contains("zhai2024"), "{error}");
}

#[test]
fn results_pictures_and_the_table_agree() {
    let folder = tempfile::tempdir().unwrap();
    let reproduction = run(Paper::Qu2010, &Options { seeds: Some(3), ..Options::default() }).unwrap();
    reproduction.write(folder.path()).unwrap();
    let json: serde_json::Value =
        serde_json::from_slice(&std::fs::read(folder.path().join("results.json")).unwrap()).unwrap();
    assert_eq!(json["rows"].as_array().unwrap().len(), reproduction.rows.len());
    assert_eq!((json["paper"].as_str(), json["seeds"].as_u64()), (Some("qu2010"), Some(3)));
    for name in ["fig3a_x", "fig3b_y", "path", "error"] {
        let svg = std::fs::read_to_string(folder.path().join(format!("{name}.svg"))).unwrap();
        assert!(svg.starts_with("<svg") && svg.contains("predicted"), "{name}");
    }
    assert!(reproduction.to_string().contains("DOES NOT HOLD: §4"), "{reproduction}");
    // The same seeds give the same numbers, on any number of threads.
    let again =
        rayon_pool(1).install(|| run(Paper::Qu2010, &Options { seeds: Some(3), ..Options::default() })).unwrap();
    assert_eq!(again.to_json().unwrap(), reproduction.to_json().unwrap());
}

fn rayon_pool(threads: usize) -> rayon::ThreadPool {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap()
}
