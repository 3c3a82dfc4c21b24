//! What the listings of clips are asked: `SEEDS KEYS TRACKER[?KEY=VALUE&…]…`, as `1..20 'texture=3' tld 'kalman-tld?scan.turn_frames=0'`.

use pursuit_tracking::Recipe;
use std::ops::Range;

type Error = Box<dyn std::error::Error>;
/// A tracker as it was named.
type Named = (String, Box<dyn Recipe>);

/// The seeds, the keys of the scene, and the trackers.
pub fn arguments() -> Result<(Range<u64>, String, Vec<Named>), Error> {
    let mut arguments = std::env::args().skip(1);
    let (seeds, keys) = (arguments.next().ok_or("seeds, as 1..20")?, arguments.next().ok_or("keys of the scene")?);
    let (first, last) = seeds.split_once("..").ok_or("seeds as 1..20")?;
    let trackers = arguments.map(|said| Ok((said.clone(), recipe(&said)?)));
    Ok((first.parse()?..last.parse()?, keys, trackers.collect::<Result<_, Error>>()?))
}

fn recipe(said: &str) -> Result<Box<dyn Recipe>, Error> {
    let (name, settings) = said.split_once('?').unwrap_or((said, ""));
    let mut table = toml::Table::new();
    for setting in settings.split('&').filter(|s| !s.is_empty()) {
        let (key, value) = setting.split_once('=').ok_or("settings as key=value")?;
        let parsed = format!("v = {value}").parse::<toml::Table>().ok().and_then(|mut t| t.remove("v"));
        table.insert(key.to_owned(), parsed.unwrap_or_else(|| toml::Value::String(value.to_owned())));
    }
    Ok(pursuit_trackers::registry::tracker(name)?.recipe(&table)?)
}
