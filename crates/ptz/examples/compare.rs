//! Prints the figures of every controller on every walk: `cargo run -p pursuit-ptz --example compare -- SEEDS [FILE.toml]`.

use pursuit_ptz::simulation::{Contender, Figures, Study, Walk};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut args = std::env::args().skip(1);
    let seeds = args.next().map_or(Ok(20), |seeds| seeds.parse())?;
    let study: Study = match args.next() {
        Some(path) => toml::from_str(&std::fs::read_to_string(path)?)?,
        None => Study::default(),
    };
    for walk in Walk::ALL {
        for contender in Contender::ALL {
            let f = Figures::mean(&study.run(walk, contender, 0..seeds)?);
            let (walk, name) = (walk.name(), contender.name());
            println!(
                "{walk:<9} {name:<13} central {:5.1} % rms {:5.2}° shown {:5.1} % absent {:5.2} s",
                100.0 * f.central,
                f.rms_deg,
                100.0 * f.shown,
                f.longest_absence_s
            );
        }
    }
    Ok(())
}
