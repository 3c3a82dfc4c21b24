//! A scene whose people are followed, and what has to hold of that.

use crate::faults::{Fault, Staged};
use crate::figures::{Figures, Truth};
use pursuit_trackers::registry;
use pursuit_tracking::MultiTracker;
use pursuit_tracking::many::{Acquiring, AcquisitionParams, Associating};

fn targets(one: bool) -> Box<dyn MultiTracker> {
    let entry = registry::detector("motion").unwrap();
    let detector = entry.detector(&toml::Table::new()).unwrap();
    if one {
        let person = registry::tracker("person").unwrap().default_recipe();
        return Box::new(Acquiring::new(detector, person, AcquisitionParams::default()).unwrap());
    }
    Box::new(Associating::new(detector, registry::many(entry)).unwrap())
}

/// Follows the people of a scene.
fn followed(fault: Fault, seed: u64, one: bool) -> Figures {
    let staged = Staged::new(fault, seed);
    let mut targets = targets(one);
    let (mut seen, mut half, mut said) = (Truth::new(), Truth::new(), Vec::new());
    for k in 0..staged.frames() {
        let moment = staged.moment(k);
        seen.insert(k, moment.seen);
        half.insert(k, moment.half_seen);
        let mut tracks = Vec::new();
        targets.step(&moment.frame, &mut tracks).unwrap();
        said.push(tracks);
    }
    let mut figures = Figures::default();
    for (k, tracks) in (0..).zip(&said) {
        figures.count(k, tracks, (&seen, &half), one);
    }
    figures
}

/// Over two seeds: at most 2 % of what is told stares, at least 85 % is followed, and nobody has more than one id too many.
pub fn holds(fault: Fault) {
    for one in [true, false] {
        let (mut told, mut stares, mut truth, mut covered) = (0, 0, 0, 0);
        for seed in 11..13 {
            let figures = followed(fault, seed, one);
            println!("{} {seed} one={one}: {}", fault.name(), figures.line());
            assert!(figures.ids.len() <= fault.people() + 1, "{fault:?} {seed}: {}", figures.line());
            (told, stares) = (told + figures.told, stares + figures.stares);
            (truth, covered) = (truth + figures.truth, covered + figures.covered);
        }
        let (stared, coverage) = (stares as f64 / told as f64, covered as f64 / truth as f64);
        assert!(stared <= 0.02 && coverage >= 0.85, "{fault:?}, one={one}: stares {stared:.3}, coverage {coverage:.3}");
    }
}
