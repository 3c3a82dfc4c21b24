//! Where a head may look, how fast it turns near to people, and that several are kept in the picture, in simulation.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use pursuit_geometry::Point;
use pursuit_ptz::control::{
    Follower, FollowerParams, LostParams, LostPolicy, NearParams, Scheme, ZoneList, ZoomParams,
};
use pursuit_ptz::geometry::{AngleFormula, FieldOfView, FieldsOfView, direction_of};
use pursuit_ptz::simulation::{CameraParams, HeadParams, NoisyEye, Sample, Simulation, Walk, Walker, run};
use pursuit_ptz::{Direction, Position};

/// Commands and pictures 150 ms late, 60°/s.
fn simulation() -> Simulation {
    Simulation {
        head: HeadParams::default(),
        camera: CameraParams::usual().unwrap(),
        drone: None,
        duration_s: 30.0,
        tick_s: 0.02,
    }
}

fn follow(
    simulation: &Simulation,
    params: FollowerParams,
    seed: u64,
    target: &dyn Fn(f64) -> (Direction, f64, f64),
) -> Vec<Sample> {
    let params = FollowerParams { command_delay_s: 0.15, frame_age_s: 0.15, home: simulation.head.home, ..params };
    let mut follower = Follower::new(params, simulation.camera.views.clone(), simulation.camera.size, 0.0).unwrap();
    let mut eye = NoisyEye::new(2.0, 0.0, seed);
    run(simulation, seed, target, &mut eye, &mut follower).unwrap()
}

fn zones(texts: &[&str]) -> FollowerParams {
    let zones = ZoneList(texts.iter().map(|text| text.parse().unwrap()).collect());
    FollowerParams { zones, ..FollowerParams::default() }
}

/// Goes steadily from 30° left to 50° right and back.
fn sweeping(time_s: f64) -> (Direction, f64, f64) {
    let along = (time_s / 12.0).fract() * 2.0;
    let pan = -30.0 + 80.0 * if along < 1.0 { along } else { 2.0 - along };
    (Direction::new(pan, 0.0), 0.1, 0.3)
}

#[test]
fn a_forbidden_zone_is_gone_around() {
    let mut simulation = simulation();
    simulation.head.home.direction = Direction::new(-30.0, 0.0);
    for seed in 0..8 {
        let samples = follow(&simulation, zones(&["forbidden pan 0..12 tilt -15..10"]), seed, &sweeping);
        for Sample { position: Position { direction, .. }, time_s, .. } in &samples {
            let inside = (0.3..11.7).contains(&direction.pan_deg) && (-14.7..9.7).contains(&direction.tilt_deg);
            assert!(!inside, "seed {seed}, {time_s} s: {direction:?}");
        }
        let right = samples.iter().filter(|s| s.target.pan_deg > 25.0 && s.shown).count();
        let there = samples.iter().filter(|s| s.target.pan_deg > 25.0).count();
        assert!(right * 10 > there * 9, "it comes around: {right} of {there}");
    }
}

#[test]
fn nothing_private_is_ever_shown() {
    let mut simulation = simulation();
    let entry = |zoom, half_fov_x_deg| FieldOfView { zoom, half_fov_x_deg };
    simulation.camera.views = FieldsOfView::new(vec![entry(0.0, 30.0), entry(1.0, 3.0)]).unwrap();
    simulation.head.home.direction = Direction::new(-30.0, 0.0);
    for (seed, zoom) in (0..6).zip([None, Some(ZoomParams::default())].into_iter().cycle()) {
        let params = FollowerParams { zoom, ..zones(&["private pan 20..60 tilt -60..60"]) };
        let samples = follow(&simulation, params, seed, &sweeping);
        let size = simulation.camera.size;
        for sample in &samples {
            let lens = simulation.camera.views.lens(sample.position.zoom, size).unwrap();
            let right = Point::new(size.width as f64, size.height as f64 / 2.0);
            let edge = direction_of(&lens, sample.position.direction, right, AngleFormula::PanThenTilt);
            assert!(edge.pan_deg < 20.5, "seed {seed}, {} s: {edge:?}", sample.time_s);
        }
        let left = samples.iter().filter(|s| s.target.pan_deg < 5.0);
        assert!(left.clone().filter(|s| s.shown).count() * 10 > left.count() * 9, "who walks elsewhere is followed");
    }
}

#[test]
fn a_search_keeps_to_what_is_allowed() {
    let mut simulation = simulation();
    simulation.head.home.direction = Direction::new(-30.0, 0.0);
    let when_lost = LostParams { policy: LostPolicy::Search, ..LostParams::default() };
    let params = FollowerParams { when_lost, ..zones(&["allowed pan -50..20 tilt -20..20"]) };
    // Gone after three seconds.
    let target = |time_s: f64| if time_s < 3.0 { sweeping(time_s) } else { (Direction::new(180.0, 0.0), 0.1, 0.3) };
    let samples = follow(&simulation, params, 1, &target);
    let pans = || samples.iter().map(|s| s.position.direction.pan_deg);
    assert!(
        pans().all(|pan| (-50.5..20.5).contains(&pan)),
        "{:?}",
        pans().fold((0.0f64, 0.0f64), |(a, b), p| (a.min(p), b.max(p)))
    );
    assert!(pans().fold(0.0, f64::max) > 15.0, "it does search");
}

#[test]
fn a_head_whose_target_has_gone_waits_and_goes_back_to_where_it_began() {
    let mut simulation = simulation();
    simulation.head.home.direction = Direction::new(-30.0, 0.0);
    let target = |time_s: f64| if time_s < 4.0 { sweeping(time_s) } else { (Direction::new(180.0, 0.0), 0.1, 0.3) };
    for scheme in [Scheme::Velocity, Scheme::Steps] {
        let when_lost = LostParams { policy: LostPolicy::Return, after_s: 3.0, ..LostParams::default() };
        let samples =
            follow(&simulation, FollowerParams { scheme, when_lost, ..FollowerParams::default() }, 1, &target);
        let pan =
            |time_s: f64| samples.iter().find(|s| s.time_s >= time_s).map(|s| s.position.direction.pan_deg).unwrap();
        assert!(pan(3.9) > 10.0, "{scheme:?} follows: {}", pan(3.9));
        // It is given up after 1.5 s, and stops within another.
        assert!((pan(6.8) - pan(8.3)).abs() < 0.2, "{scheme:?} waits: {} {}", pan(6.8), pan(8.3));
        assert!((pan(20.0) + 30.0).abs() < 0.3 && pan(20.0) == pan(29.0), "{scheme:?} is back: {}", pan(20.0));
    }
}

#[test]
fn a_head_turns_slowly_near_to_people() {
    let mut simulation = simulation();
    let walker = Walker::new(Walk::DogLeg, 3, simulation.duration_s);
    simulation.head.home.direction = walker.first_view(Walk::DogLeg);
    let fastest = |near: Option<NearParams>, larger: f64| {
        let target = |time_s: f64| {
            let (direction, width, height) = walker.at(time_s);
            (direction, larger * width, larger * height)
        };
        let samples = follow(&simulation, FollowerParams { near, ..FollowerParams::default() }, 3, &target);
        let speed = |pair: &[Sample]| {
            let turned = pair[1].position.direction.from(pair[0].position.direction);
            turned.pan_deg.abs() / (pair[1].time_s - pair[0].time_s)
        };
        samples.windows(2).map(speed).fold(0.0, f64::max)
    };
    let near = Some(NearParams { fills: 0.5, max_speed_deg_s: 15.0 });
    assert!(fastest(near, 4.0) < 16.0 && fastest(None, 4.0) > 30.0);
    assert!(fastest(near, 1.0) > 30.0, "who is far is followed as fast as ever");
}
