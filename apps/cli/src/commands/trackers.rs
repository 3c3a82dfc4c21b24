use super::print;
use crate::args::Trackers;
use pursuit::trackers::registry;
use pursuit::tracking::parameters::template_at;
use std::fmt::Write;
use std::process::ExitCode;

/// `pursuit trackers [NAME]`.
pub fn run(args: &Trackers) -> anyhow::Result<ExitCode> {
    let text = match &args.name {
        Some(name) => template(name)?,
        None => list()?,
    };
    print(text.as_bytes())
}

fn list() -> anyhow::Result<String> {
    let mut text = String::from("Trackers (--tracker NAME):\n");
    for entry in registry::trackers() {
        let default = if entry.name == registry::DEFAULT_TRACKER { " (default)" } else { "" };
        writeln!(text, "  {:<12} {}{default}", entry.name, entry.summary)?;
    }
    text += "\nDetectors (--detect NAME):\n";
    for entry in registry::detectors() {
        writeln!(text, "  {:<12} {}", entry.name, entry.summary)?;
    }
    text += "\n`pursuit trackers NAME` prints the parameters as a configuration file for `pursuit track --config`.\n";
    Ok(text)
}

/// A configuration file with every parameter; a name that is a tracker and a detector starts the tracker by the detector.
fn template(name: &str) -> anyhow::Result<String> {
    let detector = registry::detectors().iter().find(|d| d.name == name);
    let tracker = match registry::tracker(name) {
        Ok(tracker) => Some(tracker),
        Err(e) if detector.is_none() => return Err(pursuit::RunError::from(e).into()),
        Err(_) => None,
    };
    let mut text = String::new();
    if let Some(tracker) = tracker {
        writeln!(text, "# {}\ntracker = \"{name}\"", tracker.summary)?;
    }
    if let Some(detector) = detector {
        writeln!(text, "# Finds the target where no box is given: {}\ndetect = \"{name}\"", detector.summary)?;
    }
    let parameters = match (tracker, detector) {
        (Some(tracker), _) => template_at(&tracker.default_recipe().schema(), "parameters"),
        (None, Some(detector)) => template_at(&detector.schema(), "parameters"),
        (None, None) => String::new(),
    };
    write!(text, "\n[parameters]\n{}", parameters.trim_end())?;
    text.push('\n');
    Ok(text)
}
