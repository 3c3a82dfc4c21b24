//! One suite over the whole registry: every tracker listed there is held to it, with nothing to add here for a new one.
//!
//! [`suite::CHECKS`] are functions of a `&TrackerEntry`; a toy tracker made of public parts passes through the same ones,
//! which shows that a tracker needs only its own folder and a line in the registry.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test may panic")]

mod suite;
mod toy;
mod world;

use pursuit_tracking::registry::{TrackerEntry, trackers};

#[test]
fn every_tracker_of_the_registry_conforms() {
    for entry in trackers() {
        for (name, check) in suite::CHECKS {
            eprintln!("{}: {name}", entry.name);
            check(entry);
        }
    }
}

#[test]
fn a_toy_tracker_needs_only_its_own_file_and_an_entry() {
    let entry = TrackerEntry::of::<toy::ToyParams>();
    for (name, check) in suite::CHECKS {
        eprintln!("toy: {name}");
        check(&entry);
    }
}

#[test]
fn names_are_unique_and_papers_are_documented() {
    let pages = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/papers");
    for (i, entry) in trackers().iter().enumerate() {
        assert!(trackers()[..i].iter().all(|e| e.name != entry.name), "{}", entry.name);
        assert!(!entry.summary.is_empty(), "{}", entry.name);
        let page = pages.join(format!("{}.md", entry.paper));
        assert!(page.is_file(), "{} has no page {}", entry.name, page.display());
    }
}
