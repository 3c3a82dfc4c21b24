use crate::RunError;
use pursuit_trackers::registry;
use serde_json::{Value, json};

/// Everything that is known of the trackers and detectors, or of those of one name, as JSON: names, summaries, papers, and
/// every parameter with type, range, unit, source, meaning and default.
///
/// # Errors
/// A name that is neither a tracker's nor a detector's.
pub fn catalogue(name: Option<&str>) -> Result<Value, RunError> {
    if let Some(name) = name
        && registry::detector(name).is_err()
    {
        registry::tracker(name)?;
    }
    let asked = |entry: &str| name.is_none_or(|name| name == entry);
    let trackers = registry::trackers().iter().filter(|t| asked(t.name)).map(|t| {
        let recipe = t.default_recipe();
        let needs = recipe.needs();
        json!({ "name": t.name, "summary": t.summary, "paper": t.paper, "needs_color": needs.color, "needs_file": needs.file,
            "parameters": recipe.schema() })
    });
    let detectors = registry::detectors().iter().filter(|d| asked(d.name)).map(|d| {
        json!({ "name": d.name, "summary": d.summary, "default_tracker": d.default_tracker, "parameters": d.schema() })
    });
    Ok(json!({ "trackers": trackers.collect::<Vec<_>>(), "detectors": detectors.collect::<Vec<_>>() }))
}
