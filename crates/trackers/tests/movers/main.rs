//! Whoever moves is followed through what leads a background astray, by motion alone: scenes with truth.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing, reason = "tests may panic")]

mod faults;
mod figures;

use faults::{Fault, Staged};
use figures::{Figures, Truth};
use pursuit_trackers::registry;
use pursuit_tracking::MultiTracker;
use pursuit_tracking::many::{Acquiring, AcquisitionParams, Associating, ManyParams};

fn targets(one: bool) -> Box<dyn MultiTracker> {
    let entry = registry::detector("motion").unwrap();
    let detector = entry.detector(&toml::Table::new()).unwrap();
    if one {
        let person = registry::tracker("person").unwrap().default_recipe();
        return Box::new(Acquiring::new(detector, person, AcquisitionParams::default()).unwrap());
    }
    Box::new(Associating::new(detector, ManyParams::counting(entry.motion())).unwrap())
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
fn holds(fault: Fault) {
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

#[test]
#[ignore = "release: renders and follows whole scenes"]
fn nothing_goes_wrong() {
    holds(Fault::None);
}

#[test]
#[ignore = "minutes: renders and follows whole scenes"]
fn exposure_goes_down_and_up() {
    holds(Fault::Ramp);
}

#[test]
#[ignore = "minutes: renders and follows whole scenes"]
fn the_light_is_switched() {
    holds(Fault::Switch);
}

#[test]
#[ignore = "minutes: renders and follows whole scenes"]
fn a_lamp_goes_out_over_half_the_picture() {
    holds(Fault::Lamp);
}

#[test]
#[ignore = "release: renders and follows whole scenes"]
fn the_camera_shakes() {
    holds(Fault::Shake);
}

#[test]
#[ignore = "minutes: renders and follows whole scenes"]
fn the_camera_sways() {
    holds(Fault::Sway);
}

#[test]
#[ignore = "minutes: renders and follows whole scenes"]
fn somebody_stands_for_a_minute_and_a_half() {
    holds(Fault::Stands);
}

#[test]
#[ignore = "open: too many identities"]
fn somebody_enters_slowly() {
    holds(Fault::Slow);
}

#[test]
#[ignore = "open: too many identities"]
fn two_meet_who_were_there_first() {
    holds(Fault::Crossing);
}

#[test]
#[ignore = "minutes: renders and follows whole scenes"]
fn shadows_take_two_thirds_of_the_light() {
    holds(Fault::Shadow);
}

#[test]
#[ignore = "minutes: renders and follows whole scenes"]
fn the_floor_reflects() {
    holds(Fault::Reflection);
}

#[test]
#[ignore = "minutes: renders and follows whole scenes"]
fn leaves_sway_in_a_window() {
    holds(Fault::Leaves);
}

#[test]
#[ignore = "minutes: renders and follows whole scenes"]
fn it_rains() {
    holds(Fault::Rain);
}

#[test]
#[ignore = "minutes: renders and follows whole scenes"]
fn the_sensor_is_noisy() {
    holds(Fault::Noise);
}
