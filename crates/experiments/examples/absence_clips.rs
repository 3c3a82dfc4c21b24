//! Lists, clip by clip, what trackers say while the target is away and how soon they notice that it is back:
//! `cargo run --release -p pursuit-experiments --example absence_clips -- 1..20 '' tld 'kalman-tld?neighbor.as_before=1'`

mod common;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (seeds, keys, trackers) = common::arguments()?;
    for (tracker, recipe) in trackers {
        let clips = pursuit_experiments::absence_clips(&*recipe, seeds.clone(), &keys)?;
        for clip in clips.iter().filter(|c| !c.honest() || !c.found()) {
            println!("  seed {}: falsely alive {:.3}, back after {:?}", clip.seed, clip.false_alive, clip.back);
        }
        let share = |of: fn(&pursuit_experiments::AbsenceClip) -> bool| {
            clips.iter().filter(|c| of(c)).count() as f64 / clips.len().max(1) as f64
        };
        println!(
            "{tracker}: honest in {:.3}, back within five frames in {:.3} of {} clips",
            share(pursuit_experiments::AbsenceClip::honest),
            share(pursuit_experiments::AbsenceClip::found),
            clips.len()
        );
    }
    Ok(())
}
