//! Which trackers are of one kind: what they look by.

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

/// Every family. A new tracker is a name among the members of one of them.
const FAMILIES: &[Family] = &[
    Family {
        name: "own",
        sentence: "Several kinds of looks at once, and one judge who says when the target is hidden: this program's own.",
        members: &["pursuit", "pursuit-light", "person"],
    },
    Family {
        name: "siamese",
        sentence: "A network trained beforehand compares the first picture of the target with what is around it: bears changes of \
                   shape, and takes what is like the target for it.",
        members: &["nanotrack", "lightfc", "vittrack", "fear-xs", "siamese"],
    },
    Family {
        name: "correlation",
        sentence: "A filter learnt from the target answers with a peak where it is, computed by Fourier transforms: very fast, and \
                   learns what is in the box, whatever it is.",
        members: &["bacf", "strcf", "kcf", "kcf-fixed", "csk", "mosse", "staple", "dsst", "fdsst"],
    },
    Family {
        name: "colour",
        sentence: "The colours of the target, wherever in it they are: bears any deformation, and needs colours that the \
                   surroundings do not have.",
        members: &["ball", "meanshift", "camshift", "condensation"],
    },
    Family {
        name: "classifiers",
        sentence: "A classifier that learns from frame to frame tells windows of the target from windows beside it: bears clutter, \
                   and keeps the size.",
        members: &["struck", "mil", "boosting", "online-forest"],
    },
    Family {
        name: "sparse",
        sentence: "The target is a sum of few templates, and what does not fit lies in front of it: bears partial occlusion, slow.",
        members: &[],
    },
    Family {
        name: "flow",
        sentence: "Points are followed from frame to frame, and with detection what was learnt is looked for all over the picture: \
                   exact on smooth motion, comes back.",
        members: &["kalman-tld", "tld", "median-flow"],
    },
    Family {
        name: "depth",
        sentence: "How far away the target is, from a depth camera: knows what is in front of what, in any light.",
        members: &["depth-occlusion", "depth-occlusion-fused", "kcf-depth", "acpf"],
    },
];

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
            assert_eq!(of.len(), 1, "{} is a member of {of:?}; add it to one family of families.rs", tracker.name);
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
