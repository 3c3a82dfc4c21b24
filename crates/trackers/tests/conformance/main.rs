//! One suite over the whole registry: every tracker listed there is held to it, with nothing to add here for a new one.
//!
//! [`suite::CHECKS`] are functions of a `&TrackerEntry`; a toy tracker made of public parts passes through the same ones,
//! which shows that a tracker needs only its own folder and a line in the registry.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test may panic")]
#![allow(clippy::disallowed_methods, reason = "a test may be told by the environment where a library is")]

mod detectors;
mod suite;
mod toy;
mod world;

use pursuit_trackers::registry::{ready, trackers};
use pursuit_tracking::TrackerEntry;
use rayon::prelude::*;

/// Debts: trackers that do not yet conform, each with the check it fails. Held in both directions: a new failure fails the
/// test, and so does a debt that has been paid and not struck out here.
const DEBTS: &[&str] = &[];

/// Pages under `docs/papers` that are still to be written; struck out when they are.
const PAGES_TO_WRITE: &[&str] = &[];

#[test]
fn every_tracker_of_the_registry_conforms() {
    let entries: Vec<_> = ready().collect();
    let failed: Vec<String> = entries.into_par_iter().flat_map(failures).collect();
    assert_eq!(failed, DEBTS, "failures (reasons above) against known debts");
}

/// The checks that an entry fails: all of them, so that one run shows the whole list.
fn failures(entry: &TrackerEntry) -> Vec<String> {
    let fails = |check: suite::Check| std::panic::catch_unwind(|| check(entry)).is_err();
    let named = |(name, _): &(&str, suite::Check)| format!("{}: {name}", entry.name);
    suite::CHECKS.iter().filter(|(_, check)| fails(*check)).map(named).collect()
}

/// Trackers whose network is the user's are held to the same with the networks of the footage folder, by rten, or by the onnxruntime
/// that `PURSUIT_ONNXRUNTIME` names.
#[test]
#[cfg(any(feature = "rten", feature = "onnxruntime"))]
fn trackers_with_a_network_by_file_conform() {
    fn with_network<P: pursuit_tracking::LocalizerRecipe>(
        made: pursuit_tracking::TrackerRecipe<P>,
        folder: &str,
        layout: &str,
    ) -> Box<dyn pursuit_tracking::Recipe> {
        let model = format!("{MODELS}/{folder}");
        let library = std::env::var("PURSUIT_ONNXRUNTIME").unwrap_or_default();
        let text = format!("model = {model:?}\nlayout = {layout:?}\nruntime.onnxruntime = {library:?}");
        pursuit_tracking::Recipe::with(&made, &text.parse().unwrap()).unwrap()
    }
    const MODELS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data/models");
    if !std::path::Path::new(MODELS).is_dir() {
        println!("skipped: trackers with a network by file, for want of ../shared/data/models");
        return;
    }
    if cfg!(not(feature = "rten")) && std::env::var_os("PURSUIT_ONNXRUNTIME").is_none() {
        println!("skipped: trackers with a network by file, for want of the feature rten or of PURSUIT_ONNXRUNTIME");
        return;
    }
    let fear = TrackerEntry::new("fear-xs", "by file", "siamese", |name| {
        with_network(pursuit_trackers::siamese::fear_xs(name), "fear_xs", "fear-xs")
    });
    let nanotrack = TrackerEntry::new("siamese", "by file", "siamese", |name| {
        with_network(pursuit_trackers::siamese::siamese(name), "nanotrack_v3", "nanotrack-v3")
    });
    // FEAR's search, five times the box each way, takes in more than this whole world of noise: with the border its answer moves
    // (by 1.53 px of 1.5 allowed), and grey noise it cannot tell from grey noise (overlap .43).
    let excused = ["fear-xs: shifting the image shifts the answer", "fear-xs: grey and 16-bit frames"];
    let failed: Vec<String> = [fear, nanotrack].par_iter().flat_map(failures).collect();
    let unexpected: Vec<&String> = failed.iter().filter(|f| !excused.contains(&f.as_str())).collect();
    assert_eq!(unexpected, Vec::<&String>::new());
}

#[test]
fn a_toy_tracker_needs_one_file_and_entry() {
    let entry = toy::ENTRY;
    assert_eq!(failures(&entry), Vec::<String>::new());
}

#[test]
fn names_are_unique_and_papers_are_documented() {
    let pages = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/papers");
    for (i, entry) in trackers().iter().enumerate() {
        assert!(trackers()[..i].iter().all(|e| e.name != entry.name), "{}", entry.name);
        assert!(!entry.summary.is_empty(), "{}", entry.name);
        let page = pages.join(format!("{}.md", entry.paper));
        let written = !PAGES_TO_WRITE.contains(&entry.paper);
        assert_eq!(page.is_file(), written, "{} and its page {}", entry.name, page.display());
    }
}
