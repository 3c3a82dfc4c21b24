//! Compares `velocity` with `unpredicted` over delays, jitter, losses and walks, on all cores:
//! `cargo run --release -p pursuit-ptz --example grid -- FIRST_SEED SEEDS [FILE.toml]`.

use pursuit_ptz::simulation::{Contender, Grid, Study};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut args = std::env::args().skip(1);
    let first = args.next().map_or(Ok(0), |first| first.parse())?;
    let seeds: u64 = args.next().map_or(Ok(3), |seeds| seeds.parse())?;
    let study: Study = match args.next() {
        Some(path) => toml::from_str(&std::fs::read_to_string(path)?)?,
        None => Study::default(),
    };
    let pairs = Grid::default().run(&study, Contender::Velocity, Contender::Unpredicted, &(first..first + seeds))?;
    let percent = |part: f64| 100.0 * part;
    for pair in &pairs {
        let (central, shown) = pair.gains();
        println!(
            "{:<9} delay {:.1} s jitter {:.1} s lost {:4.1} %: central {:5.1} % ({:+6.1}) shown {:5.1} % ({:+6.1}){}",
            pair.cell.walk.name(),
            pair.cell.delay_s,
            pair.cell.jitter_s,
            percent(pair.cell.loss),
            percent(pair.judged.central),
            percent(central),
            percent(pair.judged.shown),
            percent(shown),
            if central.min(shown) < -0.02 { "  worse" } else { "" }
        );
    }
    let worse = pairs.iter().filter(|pair| pair.gains().0.min(pair.gains().1) < -0.02).count();
    println!("{worse} of {} cells are worse than without prediction by more than 2 points", pairs.len());
    Ok(())
}
