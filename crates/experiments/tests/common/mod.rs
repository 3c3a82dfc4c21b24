//! What the papers' experiments have in common.

use pursuit_experiments::{Options, Paper, run};

/// With all seeds no figure misses its bar.
pub fn check(paper: Paper) {
    let reproduction = run(paper, &Options::default()).unwrap();
    assert!(reproduction.rows.iter().any(|row| row.bar.is_some()), "nothing was judged");
    assert!(reproduction.rows.iter().all(|row| row.ours.value.is_finite()), "{reproduction}");
    assert_eq!(reproduction.missed().count(), 0, "{reproduction}");
}
