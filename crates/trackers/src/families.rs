//! Which trackers are of one kind: what they look by. The table stands beside that of the trackers, in `lib.rs`.

use crate::FAMILIES;
use crate::registry::trackers;

/// A family of trackers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Family {
    /// Its word.
    pub name: &'static str,
    /// One sentence on what its trackers look by, and what that is good for.
    pub sentence: &'static str,
    /// The names of its trackers, those of features that are not built in among them.
    pub(crate) trackers: &'static [&'static str],
}

impl Family {
    /// The names of its trackers that are built in.
    pub fn members(&self) -> impl Iterator<Item = &'static str> + use<> {
        self.trackers.iter().copied().filter(|name| trackers().iter().any(|t| t.name == *name))
    }
}

/// The families of which trackers are built in.
pub fn families() -> impl Iterator<Item = &'static Family> {
    FAMILIES.iter().filter(|family| family.members().next().is_some())
}

/// The family of the tracker called `tracker`, built in or not; `None` where there is no such tracker.
pub fn family_of(tracker: &str) -> Option<&'static Family> {
    FAMILIES.iter().find(|family| family.trackers.contains(&tracker))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_tracker_has_one_family() {
        for tracker in trackers() {
            let of: Vec<&str> =
                FAMILIES.iter().filter(|f| f.trackers.contains(&tracker.name)).map(|f| f.name).collect();
            assert_eq!(of.len(), 1, "{} is a member of {of:?}; add it to one family of lib.rs", tracker.name);
        }
        for name in FAMILIES.iter().flat_map(|f| f.trackers) {
            let built_in = trackers().iter().any(|t| t.name == *name);
            assert!(built_in || cfg!(not(feature = "zoo")), "{name} is no tracker");
        }
        assert_eq!(family_of("nobody"), None);
    }

    #[test]
    fn families_have_a_word_and_a_sentence() {
        for (i, family) in FAMILIES.iter().enumerate() {
            assert!(FAMILIES[..i].iter().all(|f| f.name != family.name), "{}", family.name);
            assert!(family.name.chars().all(|c| c.is_ascii_lowercase()) && family.sentence.ends_with('.'));
        }
        assert!(families().all(|f| f.members().next().is_some()));
    }
}
