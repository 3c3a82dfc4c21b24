//! Compares trackers on clips with depth in which something nearer hides the target, and names the clips in which it was
//! lost, called hidden in sight or found late:
//! `cargo run --release -p pursuit-experiments --example depth_clips -- 1..20 'hidden=22' depth-occlusion kcf-depth?policy.model=always`

mod common;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (seeds, keys, trackers) = common::arguments()?;
    for (tracker, recipe) in trackers {
        let clips = pursuit_experiments::depth_clips(&*recipe, seeds.clone(), &keys)?;
        println!("{tracker:60} {}", clips.all);
        let fails = |f: &pursuit_experiments::ClipFigures| f.missed > 0.0 || f.false_alarms > 0.01 || f.relocked < 1.0;
        for (seed, figures) in clips.each.iter().filter(|(_, figures)| fails(figures)) {
            println!("    seed {seed}: {figures}");
        }
    }
    Ok(())
}
