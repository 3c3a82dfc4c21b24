use crate::RunError;
use pursuit_scenes::{SCENES, SceneQuery};
use pursuit_trackers::families::{families, family_of};
use pursuit_trackers::registry;
use pursuit_tracking::Figure;
use serde_json::{Value, json};

/// Everything that is known of the trackers, detectors and scenes, or of those of one name, as JSON: names, summaries, papers,
/// and every parameter with type, range, unit, source, meaning and default, and every figure of
/// their diagnostics; and the families of trackers. Scenes are named as inputs, `scene:NAME`.
///
/// # Errors
/// A name that is none of theirs.
pub fn catalogue(name: Option<&str>) -> Result<Value, RunError> {
    let scene = name.and_then(|name| name.strip_prefix(SceneQuery::PREFIX));
    match (scene, name) {
        (Some(scene), _) => drop(pursuit_scenes::find(scene).map_err(|e| RunError::usage(e.to_string()))?),
        (None, Some(name)) if registry::detector(name).is_err() => drop(registry::tracker(name)?),
        _ => {}
    }
    let asked = |entry: &str| name.is_none_or(|name| name == entry);
    let trackers = registry::trackers().iter().filter(|t| asked(t.name)).map(|t| {
        let recipe = t.default_recipe();
        let needs = recipe.needs();
        json!({ "name": t.name, "summary": t.summary, "paper": t.paper, "family": family_of(t.name).map(|f| f.name),
            "needs_color": needs.color, "needs_file": needs.file, "parameters": recipe.schema(), "figures": figures(recipe.figures()) })
    });
    let detectors = registry::detectors().iter().filter(|d| asked(d.name)).map(|d| {
        json!({ "name": d.name, "summary": d.summary, "default_tracker": d.default_tracker, "needs_color": d.needs.color,
            "needs_file": d.needs.file, "parameters": d.schema(),
            "figures": figures(d.figures()) })
    });
    let scenes = SCENES.iter().filter(|s| name.is_none() || scene == Some(s.name));
    let kinds = families().filter(|f| name.is_none_or(|name| f.members().any(|m| m == name)));
    let kinds =
        kinds.map(|f| json!({ "name": f.name, "sentence": f.sentence, "members": f.members().collect::<Vec<_>>() }));
    let scenes = scenes.map(|s| json!({ "name": s.name, "summary": s.summary, "parameters": s.schema() }));
    Ok(json!({
        "trackers": trackers.collect::<Vec<_>>(),
        "detectors": detectors.collect::<Vec<_>>(),
        "scenes": scenes.collect::<Vec<_>>(),
        "families": kinds.collect::<Vec<_>>(),
    }))
}

/// Figures with unit, meaning and, of what is evidence, the parameter that weighs it and how it is taken.
fn figures<'a>(all: impl IntoIterator<Item = &'a Figure>) -> Vec<Value> {
    let weight = |f: &Figure| f.weight.map(|w| json!({ "parameter": w.parameter, "taken": w.taken.as_str() }));
    let figure = |f: &Figure| json!({ "name": f.name, "unit": f.unit, "text": f.text, "weight": weight(f) });
    all.into_iter().map(figure).collect()
}
