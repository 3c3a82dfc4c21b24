use super::print;
use crate::args::Trackers;
use pursuit::RunError;
use pursuit::config::{DETECTOR_PREFIX, catalogue};
use pursuit::parameters::{Parameter, template_at};
use pursuit::scenes::{SCENES, SceneQuery};
use pursuit::trackers::{families, registry};
use pursuit::tracking::{DetectorEntry, TrackerEntry};
use std::fmt::Write;
use std::process::ExitCode;

/// `pursuit trackers [NAME]`.
pub fn run(args: &Trackers) -> anyhow::Result<ExitCode> {
    let text = match (&args.name, args.json) {
        (Some(name), false) => template(name)?,
        (None, false) => list()?,
        (name, true) => serde_json::to_string_pretty(&catalogue(name.as_deref())?)? + "\n",
    };
    print(text.as_bytes())
}

fn list() -> anyhow::Result<String> {
    let methods = registry::trackers().iter().map(|e| e.name).chain(registry::detectors().iter().map(|e| e.name));
    let width = methods.chain(SCENES.iter().map(|e| e.name)).map(str::len).max().unwrap_or(0);
    let mut text = String::from("Trackers (--tracker NAME):\n");
    for entry in registry::trackers() {
        let default = if entry.name == registry::DEFAULT_TRACKER { " (default)" } else { "" };
        writeln!(text, "  {:<width$}  {}{default}", entry.name, entry.summary)?;
    }
    text += "\nFamilies of trackers, and what they look by:\n";
    for family in families::families() {
        writeln!(text, "  {:<width$}  {}", family.name, family.sentence)?;
        writeln!(text, "  {:<width$}  {}", "", family.members().collect::<Vec<_>>().join(", "))?;
    }
    text += "\nDetectors (--detect NAME):\n";
    for entry in registry::detectors() {
        writeln!(text, "  {:<width$}  {}", entry.name, entry.summary)?;
    }
    text += "\nScenes, inputs with ground truth (scene:NAME?KEY=VALUE&...):\n";
    for entry in SCENES {
        writeln!(text, "  {:<width$}  {}", entry.name, entry.summary)?;
    }
    text += "\n`pursuit trackers scene:NAME` prints the keys of a scene; `pursuit trackers NAME` prints the parameters as a configuration file for `pursuit track --config`.\n";
    Ok(text)
}

/// The tracker and the detector of that name; there is one of them at least.
fn find(name: &str) -> Result<(Option<&'static TrackerEntry>, Option<&'static DetectorEntry>), RunError> {
    let detector = registry::detector(name).ok();
    match registry::tracker(name) {
        Ok(tracker) => Ok((Some(tracker), detector)),
        Err(e) if detector.is_none() => Err(e.into()),
        Err(_) => Ok((None, detector)),
    }
}

/// A configuration file with every parameter; a name that is a tracker and a detector starts the tracker by the detector.
fn template(name: &str) -> anyhow::Result<String> {
    if let Some(scene) = name.strip_prefix(SceneQuery::PREFIX) {
        let scene = pursuit::scenes::find(scene).map_err(|e| RunError::usage(e.to_string()))?;
        return Ok(format!("# {}\n\n{}", scene.summary, template_at(&scene.schema(), "")));
    }
    let (tracker, detector) = find(name)?;
    let mut text = String::new();
    if let Some(tracker) = tracker {
        writeln!(text, "# {}\ntracker = \"{name}\"", tracker.summary)?;
    }
    if let Some(detector) = detector {
        writeln!(text, "# Finds the target where no box is given: {}\ndetect = \"{name}\"", detector.summary)?;
    }
    let mut section =
        |path: &str, schema: &[Parameter]| writeln!(text, "\n[{path}]\n\n{}", template_at(schema, path).trim_end());
    if let Some(tracker) = tracker {
        section("parameters", &tracker.default_recipe().schema())?;
    }
    if let Some(detector) = detector {
        section(&format!("parameters.{DETECTOR_PREFIX}"), &detector.schema())?;
    }
    Ok(text)
}
