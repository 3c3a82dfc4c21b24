//! The whole loop in simulation: walker, head, camera, an eye that errs, controller. The figures printed in
//! `docs/guide/pan-tilt.md` are those of 200 seeds (`pursuit ptz simulate --seeds 200`); here fewer are run.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use pursuit_ptz::control::{
    Controller, Follower, FollowerParams, LostParams, LostPolicy, PredictBy, Proportional, StopAndGo, ZoomParams,
};
use pursuit_ptz::simulation::{
    CameraParams, Contender, Figures, HeadParams, NoisyEye, Sample, Simulation, StatusHonesty, StatusParams, Study,
    Walk, Walker, overshoot, run, wandering_deg,
};
use pursuit_ptz::{Command, Still, Velocity};

/// Pictures 150 ms old, commands 150 ms late, 60°/s.
fn plain() -> Simulation {
    Simulation {
        head: HeadParams::default(),
        camera: CameraParams::usual().unwrap(),
        drone: None,
        duration_s: 30.0,
        tick_s: 0.02,
    }
}

/// The same with 5 % of the commands lost, up to 100 ms of jitter, and a status that lies.
fn rough() -> Simulation {
    let head = HeadParams {
        dropped: 0.05,
        jitter_s: 0.1,
        status: StatusParams { says: StatusHonesty::AlwaysMoving, ..StatusParams::default() },
        ..HeadParams::default()
    };
    Simulation { head, ..plain() }
}

fn params() -> FollowerParams {
    FollowerParams { command_delay_s: 0.15, frame_age_s: 0.15, ..FollowerParams::default() }
}

type Make = dyn Fn(&Simulation) -> Box<dyn Controller>;

fn follower(params: FollowerParams) -> Box<Make> {
    Box::new(move |s| {
        let params = FollowerParams { home: s.head.home, ..params.clone() };
        Box::new(Follower::new(params, s.camera.views.clone(), s.camera.size, 0.0).unwrap())
    })
}

fn stop_and_go() -> Box<Make> {
    Box::new(|s| Box::new(StopAndGo::new(s.camera.views.clone(), s.camera.size, 0.1, 10.0, 0.2).unwrap()))
}

fn walk(simulation: &Simulation, walk: Walk, seed: u64, make: &Make) -> Vec<Sample> {
    let walker = Walker::new(walk, seed, simulation.duration_s);
    let mut simulation = simulation.clone();
    simulation.head.home.direction = walker.first_view(walk);
    let mut eye = NoisyEye::new(2.0, 0.0, seed);
    let mut controller = make(&simulation);
    run(&simulation, seed, &|t| walker.at(t), &mut eye, &mut *controller).unwrap()
}

fn figures(simulation: &Simulation, kind: Walk, make: &Make) -> Figures {
    let runs: Vec<Figures> = (0..24).map(|seed| Figures::of(&walk(simulation, kind, seed, make), 3.0)).collect();
    Figures::mean(&runs)
}

#[test]
fn prediction_keeps_a_walker_in_the_middle_where_the_same_loop_without_it_does_not() {
    let with = figures(&plain(), Walk::Passing, &follower(params()));
    let without = FollowerParams { predict_by: PredictBy::Nothing, ..params() };
    let without = figures(&plain(), Walk::Passing, &follower(without));
    assert!(with.central >= 0.99, "{with:?}");
    assert!(with.rms_deg <= without.rms_deg * 0.5, "{with:?} {without:?}");
    let turning = figures(&plain(), Walk::Pacing, &follower(params()));
    assert!(turning.central >= 0.97 && turning.longest_absence_s == 0.0, "{turning:?}");
    let waiting = figures(&plain(), Walk::Pacing, &stop_and_go());
    assert!(waiting.central < 0.5 && turning.rms_deg < waiting.rms_deg / 3.0, "{waiting:?}");
    let proportional: Box<Make> =
        Box::new(|s| Box::new(Proportional::new(s.camera.views.clone(), s.camera.size, 2.5, 0.1).unwrap()));
    let proportional = figures(&plain(), Walk::Pacing, &proportional);
    assert!(proportional.central < turning.central - 0.1, "{proportional:?}");
}

#[test]
fn lost_commands_jitter_and_lies_are_borne() {
    let figures = figures(&rough(), Walk::Pacing, &follower(params()));
    assert!(figures.central >= 0.90 && figures.shown >= 0.999, "{figures:?}");
}

/// Commands up to 300 ms and pictures up to 200 ms later than assumed, a tenth of both lost.
fn wireless() -> Simulation {
    let mut simulation = plain();
    (simulation.head.jitter_s, simulation.head.dropped) = (0.3, 0.1);
    (simulation.camera.jitter_s, simulation.camera.dropped) = (0.2, 0.1);
    simulation
}

#[test]
fn delays_that_jitter_are_measured_and_borne() {
    for (kind, central) in [(Walk::Passing, 0.9), (Walk::Standing, 0.95), (Walk::Pacing, 0.70)] {
        let figures = figures(&wireless(), kind, &follower(params()));
        assert!(figures.central >= central && figures.shown >= 0.99, "{kind:?}: {figures:?}");
    }
}

#[test]
fn a_head_that_lies_about_itself_is_followed_by_its_commands() {
    let mut lies = wireless();
    lies.head.status.says = StatusHonesty::AlwaysMoving;
    for (kind, central) in [(Walk::Passing, 0.85), (Walk::Standing, 0.95), (Walk::Pacing, 0.55)] {
        let figures = figures(&lies, kind, &follower(params()));
        assert!(figures.central >= central && figures.shown >= 0.985, "{kind:?}: {figures:?}");
    }
}

#[test]
fn a_runner_is_not_predicted_where_predictions_do_not_come_true() {
    use pursuit_ptz::control::TrustParams;
    let judged = figures(&plain(), Walk::DogLeg, &follower(params()));
    assert!(judged.shown >= 0.985 && judged.rms_deg <= 12.0, "{judged:?}");
    let blind = FollowerParams { trust: TrustParams { judges: false, ..TrustParams::default() }, ..params() };
    let blind = figures(&plain(), Walk::DogLeg, &follower(blind));
    assert!(blind.rms_deg > judged.rms_deg + 2.0, "{blind:?} {judged:?}");
}

#[test]
fn a_walker_who_stands_is_met_without_overshoot_and_then_left_alone() {
    for simulation in [plain(), rough()] {
        for seed in 0..12 {
            let samples = walk(&simulation, Walk::Standing, seed, &follower(params()));
            let (past, wanders) = (overshoot(&samples), wandering_deg(&samples, 6.0));
            let rough = simulation.head.dropped > 0.0;
            assert!(past <= if rough { 0.10 } else { 0.05 }, "{seed}: {past}");
            assert!(wanders <= if rough { 1.5 } else { 0.8 }, "{seed}: {wanders}");
        }
    }
}

#[test]
fn before_the_delays_are_known_a_head_does_not_go_far_past_who_stands() {
    // Half of the commands act .3 s and more later than assumed, and nobody has said so.
    let mut past: Vec<f64> =
        (0..16).map(|seed| overshoot(&walk(&wireless(), Walk::Standing, seed, &follower(params())))).collect();
    past.sort_by(f64::total_cmp);
    assert!(past[8] <= 0.3 && past[15] <= 1.0, "{past:?}");
}

#[test]
fn a_head_with_play_and_steps_does_not_swing_about_a_walker_who_stands() {
    let mut simulation = plain();
    simulation.head.limits.pan.backlash_deg = 0.3;
    simulation.head.limits.tilt.backlash_deg = 0.3;
    (simulation.head.quantum_deg, simulation.head.speed_levels) = (0.1, 24);
    for seed in 0..12 {
        let samples = walk(&simulation, Walk::Standing, seed, &follower(params()));
        assert!(wandering_deg(&samples, 6.0) <= 0.8, "{seed}: {}", wandering_deg(&samples, 6.0));
    }
}

#[test]
fn delays_that_are_taken_for_shorter_than_they_are_are_corrected_while_following() {
    // 60 ms more than assumed, on the way there and on the way back together.
    let wrong = FollowerParams { command_delay_s: 0.12, frame_age_s: 0.12, ..params() };
    let figures = figures(&plain(), Walk::Pacing, &follower(wrong));
    assert!(figures.central >= 0.93 && figures.shown == 1.0, "{figures:?}");
}

#[test]
fn a_runner_who_turns_abruptly_is_found_again() {
    let searching =
        FollowerParams { when_lost: LostParams { policy: LostPolicy::Search, ..LostParams::default() }, ..params() };
    for seed in 0..24 {
        let figures = Figures::of(&walk(&plain(), Walk::DogLeg, seed, &follower(searching.clone())), 3.0);
        assert!(figures.shown >= 0.75 && figures.longest_absence_s <= 5.0, "{seed}: {figures:?}");
    }
}

#[test]
fn the_aim_point_is_where_the_target_is_kept() {
    use pursuit_ptz::control::AimPoint;
    let beside = FollowerParams { aim: AimPoint { right: 0.3, up: -0.2 }, dead_zone: 0.02, ..params() };
    let samples = walk(&plain(), Walk::Standing, 3, &follower(beside));
    let (right, down) = samples.last().unwrap().offset.unwrap();
    assert!((right - 0.3).abs() < 0.05 && (down - 0.2).abs() < 0.05, "{right} {down}");
}

#[test]
fn steps_keep_a_walker_too() {
    use pursuit_ptz::control::Scheme;
    let steps = FollowerParams { scheme: Scheme::Steps, ..params() };
    let figures = figures(&plain(), Walk::Passing, &follower(steps));
    assert!(figures.central >= 0.97, "{figures:?}");
}

#[test]
fn the_zoom_brings_a_walker_to_size_and_gives_way_where_the_place_is_uncertain() {
    let zooming =
        FollowerParams { zoom: Some(ZoomParams { target_fraction: 0.6, ..ZoomParams::default() }), ..params() };
    let samples = walk(&plain(), Walk::Standing, 1, &follower(zooming));
    let last = samples.last().unwrap();
    // 1.7 m at 5.25 m are 0.32 in tangents; 0.6 of the height of a picture 9:16 as high as wide.
    let tangent = CameraParams::usual().unwrap().views.half_fov_x_deg(last.position.zoom).to_radians().tan();
    let fills = 0.32 / (2.0 * tangent * 9.0 / 16.0);
    assert!((0.5..0.7).contains(&fills), "{fills}");
    assert!(last.shown && last.offset.unwrap().0.abs() < 0.2);
}

#[test]
fn surprises_zoom_out_and_steady_targets_zoom_in_again() {
    let zooming =
        FollowerParams { zoom: Some(ZoomParams { target_fraction: 0.8, ..ZoomParams::default() }), ..params() };
    let mean_zoom = |kind| {
        let samples = walk(&plain(), kind, 2, &follower(zooming.clone()));
        let late = samples.iter().filter(|s| s.time_s > 10.0);
        late.clone().map(|s| s.position.zoom).sum::<f64>() / late.count() as f64
    };
    let (standing, running) = (mean_zoom(Walk::Standing), mean_zoom(Walk::DogLeg));
    assert!(standing > 2.0 * running, "{standing} {running}");
}

#[test]
fn a_person_may_take_over_and_the_follower_waits() {
    let camera = CameraParams::usual().unwrap();
    let mut follower =
        Follower::new(FollowerParams { manual_s: 2.0, ..params() }, camera.views, camera.size, 0.0).unwrap();
    let box_at = |x: f64| {
        let bbox = pursuit_geometry::BBox::from_center_size(pursuit_geometry::Point::new(x, 180.0), 20.0, 40.0);
        Still(Some(pursuit_ptz::Aim { bbox, covariance: None, state: pursuit_tracking::TrackState::Tracking }))
    };
    follower.see(1.0, 1.0, &box_at(600.0)).unwrap();
    assert!(matches!(follower.act(1.0, None).unwrap(), Some(Command::Move(_))));
    let by_hand = Command::Move(Velocity { tilt_deg_s: 5.0, ..Velocity::ZERO });
    assert_eq!(follower.manual(1.2, by_hand), by_hand);
    follower.see(2.0, 2.0, &box_at(600.0)).unwrap();
    assert_eq!(follower.act(3.1, None).unwrap(), None);
    follower.see(3.2, 3.2, &box_at(600.0)).unwrap();
    assert!(follower.act(3.3, None).unwrap().is_some());
}

#[test]
fn losing_the_camera_or_the_target_stops_the_head() {
    use pursuit_ptz::control::Mode;
    let camera = CameraParams::usual().unwrap();
    let bbox = pursuit_geometry::BBox::from_center_size(pursuit_geometry::Point::new(600.0, 180.0), 20.0, 40.0);
    let aim = |state| Still(Some(pursuit_ptz::Aim { bbox, covariance: None, state }));
    let new = || Follower::new(params(), camera.views.clone(), camera.size, 0.0).unwrap();
    // Frames cease.
    let mut follower = new();
    assert_eq!(follower.act(0.5, None).unwrap(), None, "nothing seen, nothing done");
    follower.see(1.0, 1.0, &aim(pursuit_tracking::TrackState::Tracking)).unwrap();
    assert!(matches!(follower.act(1.0, None).unwrap(), Some(Command::Move(_))));
    let stopped = (1..40).find(|tick| {
        matches!(follower.act(1.0 + f64::from(*tick) * 0.1, None), Ok(Some(Command::Stop)))
            && follower.diagnosis(9.0).mode == Mode::Lost
    });
    assert!(stopped.is_some_and(|tick| tick <= 16), "{stopped:?}");
    // The tracker says that it has lost the target.
    let mut follower = new();
    follower.see(1.0, 1.0, &aim(pursuit_tracking::TrackState::Tracking)).unwrap();
    follower.act(1.0, None).unwrap();
    follower.see(1.1, 1.1, &aim(pursuit_tracking::TrackState::Lost)).unwrap();
    assert_eq!(follower.act(1.11, None).unwrap(), Some(Command::Stop));
    follower.see(1.2, 1.2, &aim(pursuit_tracking::TrackState::Tracking)).unwrap();
    assert!(matches!(follower.act(1.3, None).unwrap(), Some(Command::Move(_))), "found again");
}

fn study(text: &str) -> Study {
    toml::from_str(text).unwrap()
}

fn central(study: &Study, walk: Walk, contender: Contender) -> f64 {
    Figures::mean(&study.run(walk, contender, 0..4).unwrap()).central
}

#[test]
fn a_drone_keeps_what_it_looks_down_on_central() {
    let locked = study("drone = {}\nhead = { delay_s = 0.2 }");
    for walk in [Walk::Pacing, Walk::Passing, Walk::Standing, Walk::Crossing, Walk::Stopping] {
        let velocity = central(&locked, walk, Contender::Velocity);
        assert!(velocity > 0.97, "{}: {velocity}", walk.name());
    }
    let of = |contender| central(&locked, Walk::Hiding, contender);
    let (hiding, other) = (of(Contender::Velocity), of(Contender::Proportional));
    assert!(hiding > 0.93 && hiding > other, "{hiding} {other}");
}

#[test]
fn a_drone_that_flies_keeps_its_target() {
    for flight in ["transit", "orbit"] {
        let flying = study(&format!("drone = {{ flight = '{flight}' }}\nhead = {{ delay_s = 0.2 }}"));
        let of = |contender| central(&flying, Walk::Standing, contender);
        let (velocity, other) = (of(Contender::Velocity), of(Contender::Proportional));
        assert!(velocity > 0.97 && velocity > other + 0.05, "{flight}: {velocity} {other}");
    }
}

#[test]
fn a_gimbal_that_turns_along_is_turned_back() {
    let follow = study("drone = { yaw = 'follow' }\nhead = { delay_s = 0.2 }");
    let untold = study("drone = { yaw = 'follow', told = false }\nhead = { delay_s = 0.2 }");
    let of = |study: &Study| central(study, Walk::Crossing, Contender::Velocity);
    assert!(of(&follow) > 0.94 && of(&follow) > of(&untold) + 0.02, "{} {}", of(&follow), of(&untold));
}
