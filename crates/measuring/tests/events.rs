//! Events of worlds in which it is known what happens when; gaps, and what is refused.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may panic")]

mod common;

use common::{Camera, G, Normal, Place, WORLDS, World, seen, true_ruler};
use pursuit_measuring::events::{Event, Kind, Watched, find, stays};
use pursuit_measuring::{How, Measured, Options, Sighting, Track, measure};

fn measured(world: &World, noise: f64, seed: u64) -> Measured {
    let track = seen(world, noise, false, &mut Normal::new(seed));
    measure(&track, &true_ruler(world.camera), &Options::default()).unwrap()
}

fn of(events: &[Event], kind: Kind) -> Vec<&Event> {
    events.iter().filter(|e| e.kind == kind).collect()
}

/// A ball that falls from a metre, hits the floor at the true moments below, and rises again to half the height.
fn bouncing(t: f64) -> [Place; 3] {
    let fall = (2.0 / G).sqrt();
    let speed = G * fall * 0.5_f64.sqrt();
    let flight = 2.0 * speed / G;
    let (y, v) = if t < fall {
        (1.0 - 0.5 * G * t * t, -G * t)
    } else {
        let s = (t - fall) % flight;
        (speed * s - 0.5 * G * s * s, speed - G * s)
    };
    [Place::new(0.4 + 0.5 * t, 0.1 + y), Place::new(0.5, v), Place::new(0.0, -G)]
}

const BOUNCING: World = World { name: "bouncing", fps: 60.0, frames: 130, state: bouncing, camera: Camera::Stick };

#[test]
fn bounces_are_found_at_their_moments_and_nowhere_else() {
    let fall = (2.0 / G).sqrt();
    let flight = 2.0 * fall * 0.5_f64.sqrt();
    let (mut found, mut timed, mut false_alarms) = (0, 0, 0);
    for seed in 0..50 {
        let events = find(&measured(&BOUNCING, 0.4, seed), &Watched::default());
        let bounces = of(&events, Kind::Bounce);
        for k in 0..3 {
            let truth = fall + f64::from(k) * flight;
            let near = bounces.iter().find(|b| (b.time_s - truth).abs() < 0.5 / 60.0);
            found += usize::from(near.is_some());
            timed += usize::from(near.is_some_and(|b| (b.time_s - truth).abs() < 2.0 * b.time_error_s));
            assert!(near.is_none_or(|b| (b.at[1] - 0.1).abs() < 0.02), "{near:?}");
        }
        false_alarms += bounces.len().saturating_sub(3);
    }
    println!("{found} of 150 bounces found, {timed} within 2 σ of their moment, {false_alarms} false");
    assert!(found >= 147 && timed * 100 >= found * 93 && false_alarms <= 1, "{found} {timed} {false_alarms}");
    for world in &WORLDS {
        for seed in 0..10 {
            assert_eq!(measured(world, 0.4, seed).jumps, Vec::new(), "{}", world.name);
        }
    }
}

/// With the jumps known, velocity and acceleration are right up to them.
#[test]
fn flights_between_bounces_are_covered() {
    let (mut inside, mut all) = (0.0, 0.0);
    for seed in 0..40 {
        for moment in &measured(&BOUNCING, 0.4, seed).moments {
            let (state, truth) = (moment.state.as_ref().unwrap(), bouncing(moment.time_s));
            for i in 0..6 {
                let error = state.mean()[i] - truth[i / 2][i % 2];
                inside += f64::from(u8::from(error.abs() <= 2.0 * state.deviation(i)));
                all += 1.0;
            }
        }
    }
    println!("{:.1} % of {all} within 2 σ", 100.0 * inside / all);
    assert!(inside / all > 0.93, "{}", inside / all);
}

#[test]
fn a_pendulum_turns_twice_a_period() {
    let found = find(&measured(&WORLDS[1], 0.4, 1), &Watched::default());
    let turns = of(&found, Kind::TurnX);
    let half = std::f64::consts::PI / G.sqrt();
    assert_eq!(turns.len(), 7, "{turns:?}");
    for (k, turn) in turns.iter().enumerate() {
        let truth = half * (k + 1) as f64;
        assert!((turn.time_s - truth).abs() < 4.0 * turn.time_error_s && turn.time_error_s < 0.02, "{turn:?} {truth}");
    }
    assert!(of(&found, Kind::Stop).is_empty() && of(&found, Kind::Bounce).is_empty());
}

#[test]
fn lines_and_zones_are_passed_at_true_times() {
    let watched = Watched {
        lines: vec!["net=1.3,0,1.3,3".parse().unwrap(), "beside=1.3,5,1.3,9".parse().unwrap()],
        zones: vec!["box=0.9,0,1.7,0,1.7,3,0.9,3".parse().unwrap()],
    };
    let found = find(&measured(&WORLDS[0], 0.4, 2), &watched);
    let at = |kind: Kind| of(&found, kind).iter().map(|e| (e.name.clone().unwrap(), e.time_s)).collect::<Vec<_>>();
    let [(name, time)] = &at(Kind::Crossing)[..] else { panic!("{found:?}") };
    assert!(name == "net" && (time - 0.5).abs() < 0.005, "{time}");
    assert!((at(Kind::Entry)[0].1 - 0.3).abs() < 0.005 && (at(Kind::Exit)[0].1 - 0.7).abs() < 0.005, "{found:?}");
}

#[test]
fn time_in_zones_is_that_of_the_true_path() {
    // A target that goes to and fro: x = 1 − cos t, between 0 and 2, from rest at 0.
    fn swinging(t: f64) -> [Place; 3] {
        [Place::new(1.0 - t.cos(), 0.5), Place::new(t.sin(), 0.0), Place::new(t.cos(), 0.0)]
    }
    let world = World { name: "to and fro", fps: 60.0, frames: 640, state: swinging, camera: Camera::Stick };
    let names = ["near=-1,0,0.5,0,0.5,1,-1,1", "far=1.5,0,3,0,3,1,1.5,1", "elsewhere=5,0,6,0,6,1"];
    let zones = names.map(|zone| zone.parse().unwrap());
    let mut times = Vec::new();
    for seed in 0..20 {
        let [near, far, elsewhere] = &stays(&measured(&world, 0.4, seed), &zones)[..] else { panic!("three zones") };
        // cos t is above a half within a sixth of a period about each whole one, and below minus a half about each half one.
        let (sixth, end) = (std::f64::consts::TAU / 6.0, 639.0 / 60.0);
        assert_eq!((near.visits, far.visits, elsewhere.visits), (2, 2, 0), "{near:?} {far:?}");
        assert!(near.first_s == Some(0.0) && (far.first_s.unwrap() - 2.0 * sixth).abs() < 0.02, "{far:?}");
        assert!((near.share - near.inside_s / end).abs() < 1e-9 && near.zone == "near", "{near:?}");
        assert!((far.inside_s - 4.0 * sixth).abs() < 0.05 && (near.inside_s - 3.0 * sixth).abs() < 0.05, "{near:?}");
        // There and back over half a unit, twice.
        assert!(
            (far.path - 2.0).abs() < 0.05 && (far.speed.unwrap() - far.path / far.inside_s).abs() < 1e-9,
            "{far:?}"
        );
        assert_eq!((elsewhere.inside_s, elsewhere.first_s, elsewhere.speed), (0.0, None, None));
        times.push((far.inside_s - 4.0 * sixth, far.inside_error_s));
    }
    let within = times.iter().filter(|(off, error)| off.abs() <= 2.0 * error).count();
    assert!(within >= 15, "{within} of 20 within two standard deviations: {times:?}");
}

#[test]
fn rest_begins_and_ends() {
    fn going(t: f64) -> [Place; 3] {
        // A second ahead, a second and a half of rest, ahead again.
        let x = if t < 1.0 { t } else { 1.0 + (t - 2.5).max(0.0) };
        [Place::new(0.3 + x, 0.5), Place::zeros(), Place::zeros()]
    }
    let world = World { name: "stop and go", fps: 30.0, frames: 100, state: going, camera: Camera::Stick };
    let found = find(&measured(&world, 0.3, 5), &Watched::default());
    let (stops, starts) = (of(&found, Kind::Stop), of(&found, Kind::Start));
    assert_eq!((stops.len(), starts.len()), (1, 1), "{found:?}");
    assert!((stops[0].time_s - 1.0).abs() < 0.15 && (starts[0].time_s - 2.5).abs() < 0.15, "{found:?}");
}

#[test]
fn gaps_are_bridged_and_nothing_is_said_outside() {
    let world = &WORLDS[2];
    let mut track = seen(world, 0.4, false, &mut Normal::new(4));
    track.sightings.truncate(55);
    for k in [0, 1, 20, 21, 22, 23, 53, 54] {
        track.sightings[k].at = None;
    }
    let found = measure(&track, &true_ruler(world.camera), &Options::default()).unwrap();
    let how: Vec<How> = found.moments.iter().map(|m| m.how).collect();
    assert_eq!(how[0..3], [How::Outside, How::Outside, How::Measured]);
    assert_eq!((how[21], how[52], how[54]), (How::Bridged, How::Measured, How::Outside));
    for moment in &found.moments {
        assert_eq!(moment.state.is_none(), moment.how == How::Outside);
        assert_eq!(moment.path.is_none(), moment.how == How::Outside);
    }
    let deviation = |k: usize| found.moments[k].state.as_ref().unwrap().deviation(0);
    assert!(deviation(22) > 1.3 * deviation(17), "a gap is less certain");
}

#[test]
fn a_path_is_as_long_as_it_is() {
    let (mut inside, mut all) = (0.0, 0.0);
    for seed in 0..60 {
        let found = measured(&WORLDS[0], 0.4, seed);
        let (length, error) = found.moments.last().unwrap().path.unwrap();
        let steps = (1..5_401)
            .map(|k| (bouncing_free(f64::from(k) / 6000.0) - bouncing_free(f64::from(k - 1) / 6000.0)).norm());
        let truth: f64 = steps.sum();
        assert!((length / truth - 1.0).abs() < 0.01, "{length} {truth}");
        inside += f64::from(u8::from((length - truth).abs() <= 2.0 * error));
        all += 1.0;
    }
    assert!(inside / all > 0.9, "{}", inside / all);
}

fn bouncing_free(t: f64) -> Place {
    (WORLDS[0].state)(t)[0]
}

#[test]
fn what_says_nothing_is_refused() {
    let ruler = true_ruler(Camera::Stick);
    let sighting = |k: u64, time_s: f64| Sighting { frame: k, time_s, at: Some([5.0, 5.0]), size: None };
    let track = |times: &[f64]| Track {
        target: 7,
        sightings: times.iter().enumerate().map(|(k, t)| sighting(k as u64, *t)).collect(),
    };
    for (times, words) in [
        (&[0.0, 1.0, 2.0][..], "measured in 3 frames"),
        (&[], "measured in 0 frames"),
        (&[0.0, 1.0, 1.0, 2.0, 3.0, 4.0, 5.0], "times must rise"),
        (&[0.0, f64::NAN], "times must rise"),
    ] {
        let message = measure(&track(times), &ruler, &Options::default()).unwrap_err().to_string();
        assert!(message.contains("target 7") && message.contains(words), "{message}");
    }
    for window in [0, 4, 10, 1003] {
        let options = Options { window, ..Options::default() };
        assert!(measure(&track(&[0.0, 1.0]), &ruler, &options).unwrap_err().to_string().contains("window"));
    }
    // Something that does not move at all, to the last digit.
    let still = measure(&track(&[0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0]), &ruler, &Options::default()).unwrap();
    let state = still.moments[3].state.as_ref().unwrap();
    assert!(state.speed().0 < 1e-6 && state.covariance().iter().all(|v| v.is_finite()));
}
