//! Which trackers are of one kind: what they look by. The table stands beside that of the trackers, in `lib.rs`.

use crate::FAMILIES;

/// A family of trackers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Family {
    /// Its word.
    pub name: &'static str,
    /// One sentence on what its trackers look by, and what that is good for.
    pub sentence: &'static str,
    /// The names of its trackers.
    pub members: &'static [&'static str],
}

/// The families that have trackers.
pub fn families() -> impl Iterator<Item = &'static Family> {
    FAMILIES.iter().filter(|family| !family.members.is_empty())
}

/// The family of the tracker called `tracker`; `None` of one that is not in the registry.
pub fn family_of(tracker: &str) -> Option<&'static Family> {
    FAMILIES.iter().find(|family| family.members.contains(&tracker))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::registry::trackers;

    #[test]
    fn every_tracker_has_one_family() {
        for tracker in trackers() {
            let of: Vec<&str> = FAMILIES.iter().filter(|f| f.members.contains(&tracker.name)).map(|f| f.name).collect();
            assert_eq!(of.len(), 1, "{} is a member of {of:?}; add it to one family of lib.rs", tracker.name);
        }
        for member in FAMILIES.iter().flat_map(|f| f.members) {
            assert!(trackers().iter().any(|t| t.name == *member), "{member} is no tracker");
        }
        assert_eq!(family_of("nobody"), None);
    }

    #[test]
    fn families_have_a_word_and_a_sentence() {
        for (i, family) in FAMILIES.iter().enumerate() {
            assert!(FAMILIES[..i].iter().all(|f| f.name != family.name), "{}", family.name);
            assert!(family.name.chars().all(|c| c.is_ascii_lowercase()) && family.sentence.ends_with('.'));
        }
        assert!(families().all(|f| !f.members.is_empty()));
    }
}
