//! Whose parameter is it: one rule for every command.

use crate::RunError;
use pursuit_parameters::{Kind, Parameter, listed, merge, nested, similar};
use pursuit_trackers::registry;
use pursuit_tracking::{DetectorEntry, TrackerEntry};
use toml::{Table, Value};

/// The prefix of what is meant for the detector alone.
pub const DETECTOR_PREFIX: &str = "detect";
/// The prefix of [`AcquisitionParams`](pursuit_tracking::many::AcquisitionParams).
pub const ACQUIRE_PREFIX: &str = "acquire";
/// The prefix of [`ManyParams`](pursuit_tracking::many::ManyParams).
pub const MANY_PREFIX: &str = "many";

/// Who takes part in a run, and so may have parameters.
#[derive(Debug, Clone, Copy, Default)]
pub struct Participants<'a> {
    /// The trackers.
    pub trackers: &'a [&'static TrackerEntry],
    /// The detector.
    pub detector: Option<&'static DetectorEntry>,
    /// Whether everything that the detector finds is followed.
    pub many: bool,
}

/// Parameters by whom they belong to.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Settings {
    /// Of each tracker, in the order of [`Participants::trackers`].
    pub trackers: Vec<Table>,
    /// Of the detector.
    pub detector: Table,
    /// How one target found is made sure of.
    pub acquire: Table,
    /// How many targets are told apart.
    pub many: Table,
}

impl Settings {
    /// Splits settings. `KEY` belongs to every tracker that knows it, and to the detector if it knows it; `TRACKER.KEY` to
    /// that tracker alone, `detect.KEY` to the detector alone, `acquire.KEY` and `many.KEY` to how targets are made of what
    /// the detector finds. What is said for one alone counts more than what is said for all.
    ///
    /// # Errors
    /// [`RunError::Usage`] for a key that nobody knows who takes part.
    pub fn split(settings: &Table, who: &Participants<'_>) -> Result<Self, RunError> {
        let mut split = Self { trackers: vec![Table::new(); who.trackers.len()], ..Self::default() };
        let mut leaves = Vec::new();
        gather(&nested(settings), "", &mut leaves);
        let (own, shared): (Vec<_>, Vec<_>) = leaves.into_iter().partition(|(path, _)| is_prefixed(path));
        for (path, value) in shared {
            split.share(&path, &value, who)?;
        }
        for (path, value) in own {
            let (prefix, key) = path.split_once('.').unwrap_or((path.as_str(), ""));
            put(split.of(prefix, &path, who)?, key, value);
        }
        Ok(split)
    }

    /// Gives a key without prefix to all who know it.
    fn share(&mut self, path: &str, value: &Value, who: &Participants<'_>) -> Result<(), RunError> {
        let mut known = false;
        for (tracker, table) in who.trackers.iter().zip(&mut self.trackers) {
            let recipe = tracker.default_recipe();
            if knows(&recipe.schema(), path) || recipe.renamed(path).is_some() {
                put(table, path, value.clone());
                known = true;
            }
        }
        if who.detector.is_some_and(|d| knows(&d.schema(), path) || d.renamed(path).is_some()) {
            put(&mut self.detector, path, value.clone());
            known = true;
        }
        if known { Ok(()) } else { Err(RunError::usage(unknown(path, who))) }
    }

    /// The table of whom `prefix` names.
    fn of(&mut self, prefix: &str, path: &str, who: &Participants<'_>) -> Result<&mut Table, RunError> {
        let missing = |what: &str| Err(RunError::usage(format!("`{path}` is of no use here: {what}")));
        match prefix {
            DETECTOR_PREFIX if who.detector.is_some() => Ok(&mut self.detector),
            DETECTOR_PREFIX => missing("no detector takes part; name one with `--detect`"),
            ACQUIRE_PREFIX if who.detector.is_some() && !who.many => Ok(&mut self.acquire),
            ACQUIRE_PREFIX => missing("it is about one target that a detector finds"),
            MANY_PREFIX if who.many => Ok(&mut self.many),
            MANY_PREFIX => missing("it is about following everything that a detector finds, `--many`"),
            name => match who.trackers.iter().position(|t| t.name == name) {
                Some(i) => Ok(&mut self.trackers[i]),
                None => {
                    let names: Vec<_> = who.trackers.iter().map(|t| t.name).collect();
                    missing(&format!("tracker `{name}` takes no part, only {}", names.join(", ")))
                }
            },
        }
    }
}

fn is_prefixed(path: &str) -> bool {
    path.split_once('.').is_some_and(|(first, _)| {
        [DETECTOR_PREFIX, ACQUIRE_PREFIX, MANY_PREFIX].contains(&first)
            || registry::trackers().iter().any(|t| t.name == first)
    })
}

/// Every plain value with its dotted path.
fn gather(table: &Table, path: &str, leaves: &mut Vec<(String, Value)>) {
    for (key, value) in table {
        let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
        match value {
            Value::Table(table) => gather(table, &path, leaves),
            value => leaves.push((path, value.clone())),
        }
    }
}

fn put(table: &mut Table, path: &str, value: Value) {
    merge(table, nested(&Table::from_iter([(path.to_owned(), value)])));
}

/// Whether a dotted path leads to a parameter.
fn knows(schema: &[Parameter], path: &str) -> bool {
    let (first, rest) = path.split_once('.').map_or((path, None), |(first, rest)| (first, Some(rest)));
    match (schema.iter().find(|p| p.name == first).map(|p| &p.kind), rest) {
        (Some(Kind::Group { parameters }), Some(rest)) => knows(parameters, rest),
        // A value given for a whole group is refused by whom it is given to, with the names of its parameters.
        (Some(_), None) => true,
        _ => false,
    }
}

/// Names of parameters; groups as `NAME.…`, or the parameters of the group that `path` is in.
fn names(schema: &[Parameter], path: &str) -> String {
    if let Some((first, rest)) = path.split_once('.')
        && let Some(Kind::Group { parameters }) = schema.iter().find(|p| p.name == first).map(|p| &p.kind)
    {
        return format!("in `{first}` {}", names(parameters, rest));
    }
    listed(schema)
}

fn unknown(path: &str, who: &Participants<'_>) -> String {
    let schemas = who.trackers.iter().map(|t| t.default_recipe().schema()).chain(who.detector.map(|d| d.schema()));
    let mut meant: Vec<String> = schemas.flat_map(|schema| similar(&schema, path)).map(|p| format!("`{p}`")).collect();
    meant.dedup();
    let meant = if meant.is_empty() { String::new() } else { format!("; did you mean {}?", meant.join(" or ")) };
    let mut message = match who.trackers {
        [tracker] => {
            let names = names(&tracker.default_recipe().schema(), path);
            format!("tracker `{}` has no parameter `{path}`; it has: {names}", tracker.name)
        }
        trackers => {
            let names: Vec<_> = trackers.iter().map(|t| t.name).collect();
            format!("none of the trackers {} has a parameter `{path}`", names.join(", "))
        }
    };
    if let Some(d) = who.detector {
        message += &format!("; detector `{}` has: {}", d.name, names(&d.schema(), path));
    }
    message + &meant
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trackers(names: &[&str]) -> Vec<&'static TrackerEntry> {
        names.iter().map(|n| registry::tracker(n).unwrap()).collect()
    }

    fn split(settings: &str, names: &[&str], detector: Option<&str>, many: bool) -> Result<Settings, RunError> {
        let trackers = trackers(names);
        let detector = detector.map(|d| registry::detector(d).unwrap());
        Settings::split(&settings.parse().unwrap(), &Participants { trackers: &trackers, detector, many })
    }

    fn table(text: &str) -> Table {
        text.parse().unwrap()
    }

    fn refusal(settings: &str, names: &[&str], detector: Option<&str>) -> String {
        let error = split(settings, names, detector, false).unwrap_err();
        assert_eq!(error.exit_code(), 2);
        error.to_string()
    }

    #[test]
    fn who_remembers_the_last_part_is_told_the_whole() {
        let error = split("paddin = 3", &["kcf"], None, false).err().unwrap().to_string();
        assert!(error.contains("did you mean `window.padding`?"), "{error}");
        let error = split("nothing_like_it = 3", &["kcf"], None, false).err().unwrap().to_string();
        assert!(!error.contains("did you mean"), "{error}");
    }

    #[test]
    fn a_plain_key_goes_to_all_who_know_it() {
        let s = split("motion.model = 'imm'", &["kcf", "mosse"], None, false).unwrap();
        assert_eq!(s.trackers, [table("motion.model = 'imm'"), table("motion.model = 'imm'")]);
        let s = split("color = 'orange'", &["ball"], Some("ball"), false).unwrap();
        assert_eq!((&s.trackers[0], &s.detector), (&table("color = 'orange'"), &table("color = 'orange'")));
        let s = split("color = 'orange'", &["kcf"], Some("ball"), false).unwrap();
        assert_eq!((&s.trackers[0], &s.detector), (&Table::new(), &table("color = 'orange'")));
        let s = split("motion.model = 'imm'\nmotion.acceleration = 3.0", &["kcf"], Some("ball"), false).unwrap();
        assert_eq!(s.trackers[0], table("motion.model = 'imm'\nmotion.acceleration = 3.0"));
        assert!(s.detector.is_empty() && s.acquire.is_empty() && s.many.is_empty());
    }

    #[test]
    fn former_names_are_known() {
        let s = split("motion.turn_rate = 3.0\nmany.motion.jerk = 9.0", &["kcf"], Some("ball"), true).unwrap();
        assert_eq!((&s.trackers[0], &s.many), (&table("motion.turn_rate = 3.0"), &table("motion.jerk = 9.0")));
    }

    #[test]
    fn a_prefix_names_one_alone_and_counts_more() {
        let s = split("'motion.model' = 'imm'\nkcf.motion.model = 'none'", &["kcf", "mosse"], None, false).unwrap();
        assert_eq!(s.trackers, [table("motion.model = 'none'"), table("motion.model = 'imm'")]);
        let s = split("color = 'orange'\ndetect.color = 'green'", &["ball"], Some("ball"), false).unwrap();
        assert_eq!((&s.trackers[0], &s.detector), (&table("color = 'orange'"), &table("color = 'green'")));
        let s = split("ball.color = 'green'", &["ball"], Some("ball"), false).unwrap();
        assert_eq!((&s.trackers[0], &s.detector), (&table("color = 'green'"), &Table::new()));
        let s = split("acquire.trial_s = 2.0", &["ball"], Some("ball"), false).unwrap();
        assert_eq!((s.acquire, s.many), (table("trial_s = 2.0"), Table::new()));
        let s = split("many.gate = 9.0\nmany.motion.model = 'imm'", &["ball"], Some("ball"), true).unwrap();
        assert_eq!((s.many, s.acquire), (table("gate = 9.0\nmotion.model = 'imm'"), Table::new()));
    }

    #[test]
    fn what_nobody_knows_is_refused_with_what_there_is() {
        let message = refusal("colour = 'x'", &["kcf"], Some("ball"));
        assert!(message.starts_with("tracker `kcf` has no parameter `colour`; it has: "), "{message}");
        assert!(message.contains("motion.…") && message.contains("; detector `ball` has: color"), "{message}");
        let message = refusal("motion.modle = 'x'", &["kcf"], None);
        assert!(message.contains("`motion.modle`; it has: in `motion` model, camera, acceleration"), "{message}");
        let message = refusal("colour = 'x'", &["kcf", "mosse"], None);
        assert_eq!(message, "none of the trackers kcf, mosse has a parameter `colour`; did you mean `score.color`?");
        for (settings, words) in [
            ("mosse.motion.model = 'imm'", "tracker `mosse` takes no part, only kcf"),
            ("detect.color = 'green'", "no detector takes part"),
            ("acquire.trial_s = 1.0", "one target that a detector finds"),
            ("many.gate = 1.0", "`--many`"),
        ] {
            let message = refusal(settings, &["kcf"], None);
            assert!(message.contains(words), "{message}");
        }
        assert!(refusal("many.gate = 1.0", &["kcf"], Some("ball")).contains("--many"));
        let error = split("acquire.trial_s = 1.0", &["kcf"], Some("ball"), true).unwrap_err();
        assert!(error.to_string().contains("one target"));
    }
}
