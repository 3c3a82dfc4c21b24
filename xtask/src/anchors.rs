//! The headings of a document, as links lead to them.

use std::collections::HashMap;
use std::collections::HashSet;

/// What links to the headings of a document say behind `#`; of headings that say the same the second has `-1` and so on, as forges and
/// the book have it.
pub fn anchors(document: &str) -> HashSet<String> {
    let (mut seen, mut anchors, mut fenced): (HashMap<String, usize>, _, _) = (HashMap::new(), HashSet::new(), false);
    for line in document.lines() {
        fenced ^= line.trim_start().starts_with("```");
        let Some(heading) = line.strip_prefix('#').filter(|_| !fenced).map(|rest| rest.trim_start_matches('#')) else {
            continue;
        };
        let slug = slug(heading.trim());
        let count = seen.entry(slug.clone()).or_default();
        anchors.insert(if *count == 0 { slug } else { format!("{slug}-{count}") });
        *count += 1;
    }
    anchors
}

/// Small letters, digits, `_` and `-`; a space becomes `-`, all else goes.
fn slug(heading: &str) -> String {
    let kept = heading.to_lowercase().replace(' ', "-");
    kept.chars().filter(|c| c.is_alphanumeric() || "_-".contains(*c)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headings_are_found_as_links_name_them() {
        let text = "# `ball`: colour, and more\n\n```sh\n# no heading\n```\n## Measured\n## Measured\n";
        let found = anchors(text);
        assert_eq!(found, ["ball-colour-and-more", "measured", "measured-1"].map(str::to_owned).into());
    }
}
