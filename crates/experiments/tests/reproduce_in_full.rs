//! The two papers whose experiments take minutes with all their seeds: no figure may miss its bar.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;

use common::check;
use pursuit_experiments::Paper;

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
