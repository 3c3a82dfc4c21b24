//! Compares trackers on clips with depth in which something nearer hides the target, and names the clips in which it was
//! lost, called hidden in sight or found late:
//! `cargo run --release -p pursuit-experiments --example depth_clips -- 1..20 'hidden=22' depth-occlusion kcf-depth?policy.model=always`

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let (seeds, keys) = (arguments.next().ok_or("seeds, as 1..20")?, arguments.next().ok_or("keys of the scene")?);
    let (first, last) = seeds.split_once("..").ok_or("seeds as 1..20")?;
    let seeds = first.parse()?..last.parse()?;
    for tracker in arguments {
        let (name, settings) = tracker.split_once('?').unwrap_or((&tracker, ""));
        let mut table = toml::Table::new();
        for setting in settings.split('&').filter(|s| !s.is_empty()) {
            let (key, value) = setting.split_once('=').ok_or("settings as key=value")?;
            let parsed = format!("v = {value}").parse::<toml::Table>().ok().and_then(|mut t| t.remove("v"));
            table.insert(key.to_owned(), parsed.unwrap_or_else(|| toml::Value::String(value.to_owned())));
        }
        let recipe = pursuit_trackers::registry::tracker(name)?.recipe(&table)?;
        let clips = pursuit_experiments::depth_clips(&*recipe, seeds.clone(), &keys)?;
        println!("{tracker:60} {}", clips.all);
        let fails = |f: &pursuit_experiments::ClipFigures| f.missed > 0.0 || f.false_alarms > 0.01 || f.relocked < 1.0;
        for (seed, figures) in clips.each.iter().filter(|(_, figures)| fails(figures)) {
            println!("    seed {seed}: {figures}");
        }
    }
    Ok(())
}
