//! The two papers whose experiments take minutes with all their seeds: no figure may miss its bar.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use pursuit_experiments::{Options, Paper, run};

fn check(paper: Paper) {
    let reproduction = run(paper, &Options::default()).unwrap();
    assert!(reproduction.rows.iter().any(|row| row.bar.is_some()), "nothing was judged");
    assert!(reproduction.rows.iter().all(|row| row.ours.value.is_finite()), "{reproduction}");
    assert_eq!(reproduction.missed().count(), 0, "{reproduction}");
}

#[test]
#[ignore = "whole: 1000 seeds, and 100 of the particle filter"]
fn zhai2024_reaches_its_bars() {
    check(Paper::Zhai2024);
}

#[test]
#[ignore = "whole: 300 seeds"]
fn zhu2014_reaches_its_bars() {
    check(Paper::Zhu2014);
}
