use super::*;
use pursuit_parameters::Parameters;

/// Whether a model follows smooth motion with noise that scales with the target.
const fn is_smooth(model: MotionModel) -> bool {
    match model {
        MotionModel::ConstantVelocity
        | MotionModel::ConstantAcceleration
        | MotionModel::CoordinatedTurn
        | MotionModel::Singer
        | MotionModel::CurrentStatistical
        | MotionModel::Imm
        | MotionModel::Gao2007
        | MotionModel::Zhu2014
        | MotionModel::InputEstimation
        | MotionModel::Bounce => true,
        MotionModel::Ball
        | MotionModel::Qu2010
        | MotionModel::Qu2010Simplified
        | MotionModel::PerFrame
        | MotionModel::None => false,
    }
}

fn smooth() -> impl Iterator<Item = MotionModel> {
    MotionModel::ALL.iter().copied().filter(|model| is_smooth(*model))
}

fn params(model: MotionModel) -> MotionParams {
    MotionParams { model, ..MotionParams::default() }
}

fn motion(model: MotionModel, bbox: BBox) -> Motion {
    Motion::new(params(model), bbox).unwrap()
}

fn at(x: f64, y: f64) -> BBox {
    BBox::from_center_size(Point::new(x, y), 20.0, 30.0)
}

fn sight(bbox: BBox) -> Sight {
    Sight::of(bbox, None)
}

/// Follows `path` (seconds to centre) at steps of `dt_s`; the predictions' errors in pixels.
fn errors(model: MotionModel, dt_s: f64, steps: usize, path: impl Fn(f64) -> (f64, f64)) -> Vec<f64> {
    let (x, y) = path(0.0);
    let mut motion = motion(model, at(x, y));
    (1..=steps)
        .map(|k| {
            let (x, y) = path(k as f64 * dt_s);
            let error = motion.predict(dt_s).unwrap().bbox.center().distance(Point::new(x, y));
            motion.correct(&sight(at(x, y))).unwrap();
            error
        })
        .collect()
}

#[test]
fn straight_motion_is_predicted_by_all_at_any_rate() {
    for model in smooth() {
        for dt_s in [0.01, 0.04, 0.2] {
            let errors = errors(model, dt_s, 60, |t| (100.0 + 40.0 * t, 80.0 - 25.0 * t));
            assert!(errors[40..].iter().all(|e| *e < 0.3), "{model:?} {dt_s}: {:?}", &errors[40..]);
            assert!(errors[0] > 40.0 * dt_s * 0.9, "nothing was known at the start");
        }
    }
}

#[test]
fn models_that_turn_predict_circles_better_than_a_constant_velocity() {
    let circle = |t: f64| (200.0 + 60.0 * (2.0 * t).cos(), 200.0 + 60.0 * (2.0 * t).sin());
    let mean = |model| errors(model, 0.1, 80, circle)[30..].iter().sum::<f64>() / 50.0;
    let plain = mean(MotionModel::ConstantVelocity);
    for model in [MotionModel::CoordinatedTurn, MotionModel::Imm, MotionModel::ConstantAcceleration] {
        assert!(mean(model) < 0.6 * plain, "{model:?}: {} of {plain}", mean(model));
    }
    assert!(mean(MotionModel::CoordinatedTurn) < 0.1 * plain);
}

#[test]
fn no_model_of_motion_expects_the_box_where_it_was() {
    let mut still = motion(MotionModel::None, at(10.0, 20.0));
    assert_eq!(still.predict(5.0).unwrap(), Prior { bbox: at(10.0, 20.0), innovation_covariance: None, dt_s: 5.0 });
    still.correct(&sight(at(30.0, 20.0))).unwrap();
    assert_eq!((still.bbox(), still.velocity(), still.covariance()), (at(30.0, 20.0), None, None));
    assert!(still.correct(&sight(at(f64::NAN, 0.0))).is_err());
    still.restart(at(f64::NAN, 0.0));
    assert_eq!(still.bbox(), at(30.0, 20.0));
    still.restart(at(1.0, 2.0));
    assert_eq!(still.bbox(), at(1.0, 2.0));
}

/// Noise is relative to the box: a scene three times as large is followed by boxes three times as large.
#[test]
fn the_scale_of_a_scene_changes_nothing() {
    // The patent's least change of velocity is in pixels.
    for model in smooth().filter(|m| *m != MotionModel::Zhu2014) {
        let beliefs = [1.0, 3.0].map(|scale| {
            let params = params(model);
            let params = MotionParams { noise_floor_px: scale * params.noise_floor_px, ..params };
            let at = |k: f64| {
                let center = Point::new(scale * (100.0 + 9.0 * k + k * k), scale * (80.0 - 7.0 * k));
                BBox::from_center_size(center, scale * 20.0, scale * (30.0 + k))
            };
            let mut motion = Motion::new(params, at(0.0)).unwrap();
            for k in 1..9 {
                motion.predict(0.1).unwrap();
                let sigma_px = (k % 3 == 0).then_some(scale * 4.0);
                motion.correct(&Sight::of(at(f64::from(k)), sigma_px)).unwrap();
            }
            let prior = motion.predict(0.1).unwrap();
            let covariances = [prior.innovation_covariance.unwrap(), motion.covariance().unwrap()];
            let speed = motion.velocity().unwrap();
            let lengths =
                [prior.bbox.left(), prior.bbox.top(), prior.bbox.width(), prior.bbox.height(), speed.x, speed.y];
            (lengths.map(|v| v / scale), covariances.map(|c| c / (scale * scale)))
        });
        let [(small, of_small), (large, of_large)] = &beliefs;
        let near = small.iter().zip(large).all(|(a, b)| (a - b).abs() < 1e-6 * a.abs().max(1.0));
        assert!(near, "{model:?}: {small:?} {large:?}");
        for (a, b) in of_small.iter().zip(of_large) {
            assert!((a - b).amax() < 1e-6 * a.amax(), "{model:?}: {a} {b}");
        }
    }
}

/// How much more uncertain sides are `dt_s` later: a random walk's variance.
#[test]
fn sizes_walk_at_random() {
    for model in smooth() {
        let mut motion = motion(model, at(50.0, 50.0));
        motion.predict(0.1).unwrap();
        let before = motion.covariance().unwrap();
        motion.predict(0.3).unwrap();
        let after = motion.covariance().unwrap();
        let growth = (motion.params().size_change * 600.0_f64.sqrt()).powi(2) * 0.3;
        for side in [2, 3] {
            let grown = after[(side, side)] - before[(side, side)];
            assert!((grown - growth).abs() < 1e-9 * growth, "{model:?}: {grown} {growth}");
        }
    }
}

#[test]
fn every_model_predicts_in_its_own_way() {
    let place = |model: MotionModel| {
        let mut motion = motion(model, at(100.0, 100.0));
        for k in 1..10 {
            let t = 0.1 * f64::from(k);
            motion.predict(0.1).unwrap();
            // It speeds up and, half way, turns at once: some models wait for that.
            let turned = 900.0 * (t - 0.5).max(0.0);
            motion.correct(&sight(at(100.0 + 80.0 * t + 150.0 * t * t - turned, 100.0 - turned))).unwrap();
        }
        motion.predict(0.3).unwrap().bbox.center()
    };
    let places: Vec<_> = smooth().map(|model| (model, place(model))).collect();
    for (k, (a, at_a)) in places.iter().enumerate() {
        for (b, at_b) in &places[..k] {
            assert!(at_a.distance(*at_b) > 1e-3, "{a:?} and {b:?}: {at_a:?}");
        }
    }
}

#[test]
fn what_is_measured_is_as_uncertain_as_the_place_and_the_measurement_together() {
    // Of jumps the gate lets pass more than is believed.
    for model in smooth().filter(|m| *m != MotionModel::Bounce) {
        let mut motion = motion(model, at(50.0, 50.0));
        let prior = motion.predict(0.1).unwrap();
        let p = motion.params();
        let variance = |share: f64| (share * 600.0_f64.sqrt()).powi(2) + p.noise_floor_px.powi(2);
        let (place, size) = (variance(p.position_noise), variance(p.size_noise));
        let want = BoxCovariance::from_diagonal(&[place, place, size, size].into());
        let added = prior.innovation_covariance.unwrap() - motion.covariance().unwrap();
        assert!((added - want).amax() < 1e-9 * want.amax(), "{model:?}: {added} {want}");
    }
}

#[test]
fn started_again_nothing_is_left_of_what_was() {
    for model in MotionModel::ALL {
        let mut motion = motion(*model, at(50.0, 50.0));
        for k in 1..6 {
            motion.predict(0.2).unwrap();
            motion.correct(&sight(at(50.0 + f64::from(k * k), 50.0))).unwrap();
        }
        motion.restart(at(20.0, 90.0));
        assert_eq!(motion, self::motion(*model, at(20.0, 90.0)), "{model:?}");
    }
}

#[test]
fn the_next_sample_is_said_where_the_camera_has_moved_the_picture_to() {
    let mut motion = motion(MotionModel::Qu2010, at(50.0, 70.0));
    for k in 1..6 {
        motion.predict(0.2).unwrap();
        motion.correct(&sight(at(50.0 + 3.0 * f64::from(k), 70.0))).unwrap();
    }
    let center = |motion: &Motion| motion.next_sample().unwrap().center.unwrap();
    let before = center(&motion);
    assert!((before.x - 68.0).abs() < 2.0 && (before.y - 70.0).abs() < 1.0, "{before:?}");
    motion.carry((7.0, -5.0));
    assert_eq!(center(&motion), Point::new(before.x + 7.0, before.y - 5.0));
}

#[test]
fn forecasts_change_nothing_and_agree_with_predictions() {
    for model in MotionModel::ALL {
        let mut motion = motion(*model, at(50.0, 50.0));
        for k in 1..12 {
            motion.predict(0.1).unwrap();
            motion.correct(&sight(at(50.0 + 3.0 * f64::from(k), 50.0))).unwrap();
        }
        let before = motion.clone();
        let now = motion.forecast(7.0, -1.0).unwrap();
        assert_eq!((now.time_s, now.bbox, now.velocity), (7.0, motion.bbox(), motion.velocity()), "{model:?}");
        let ahead = motion.forecast(7.0, 0.3).unwrap();
        assert_eq!(motion, before, "{model:?}");
        let prior = motion.predict(0.3).unwrap();
        assert_eq!((ahead.time_s, ahead.bbox), (7.3, prior.bbox), "{model:?}");
        if let (Some(now), Some(later)) = (now.covariance, ahead.covariance) {
            assert!(later[(0, 0)] > now[(0, 0)] && later[(2, 2)] > now[(2, 2)], "{model:?}");
        }
        if is_smooth(*model) {
            let velocity = ahead.velocity.unwrap();
            assert!((velocity.x - 30.0).abs() < 3.0 && velocity.y.abs() < 1.0, "{model:?}: {velocity:?}");
        }
    }
}

#[test]
fn sizes_follow_what_is_measured() {
    for model in smooth() {
        let mut motion = motion(model, at(50.0, 50.0));
        for _ in 0..20 {
            motion.predict(0.04).unwrap();
            motion.correct(&sight(BBox::from_center_size(Point::new(50.0, 50.0), 26.0, 39.0))).unwrap();
        }
        assert!((motion.bbox().width() - 26.0).abs() < 0.5 && (motion.bbox().height() - 39.0).abs() < 0.5, "{model:?}");
    }
}

#[test]
fn what_a_localizer_says_of_its_error_counts() {
    for model in smooth() {
        let gain = |sigma_px| {
            let mut motion = motion(model, at(50.0, 50.0));
            motion.predict(0.04).unwrap();
            motion.correct(&Sight::of(at(60.0, 50.0), sigma_px)).unwrap();
            motion.bbox().center().x - 50.0
        };
        assert!(gain(None) > 9.0 && gain(Some(200.0)) < 1.0, "{model:?}: {} {}", gain(None), gain(Some(200.0)));
    }
}

#[test]
fn saved_models_go_on_alike_and_changes_keep_the_box() {
    for model in MotionModel::ALL {
        let mut motion = motion(*model, at(50.0, 50.0));
        for k in 1..6 {
            motion.predict(0.04).unwrap();
            motion.correct(&sight(at(50.0 + f64::from(k * k), 50.0))).unwrap();
        }
        let bytes = postcard::to_stdvec(&motion).unwrap();
        let mut back: Motion = postcard::from_bytes(&bytes).unwrap();
        assert_eq!(back.predict(0.04).unwrap(), motion.predict(0.04).unwrap(), "{model:?}");
        let bbox = motion.bbox();
        motion.change(params(MotionModel::Singer)).unwrap();
        assert!(motion.bbox().iou(&bbox) > 0.999_999 && motion.params().model == MotionModel::Singer);
    }
}

#[test]
fn senseless_boxes_are_refused_and_change_nothing() {
    for model in MotionModel::ALL {
        assert!(Motion::new(params(*model), at(f64::NAN, 1.0)).is_err(), "{model:?}");
        let mut motion = motion(*model, at(5.0, 5.0));
        let before = motion.clone();
        assert!(motion.correct(&sight(at(f64::INFINITY, 1.0))).is_err(), "{model:?}");
        motion.restart(at(1.0, f64::NAN));
        assert_eq!(motion, before, "{model:?}");
    }
}

#[test]
fn every_model_has_its_word_in_the_schema() {
    let text = pursuit_parameters::template(&MotionParams::default().schema());
    MotionModel::ALL.iter().for_each(|m| assert!(text.contains(m.as_str())));
}
