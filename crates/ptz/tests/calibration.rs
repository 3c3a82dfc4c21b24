//! A simulated head is measured, and what is measured is what it was made with.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use pursuit_ptz::calibration::{CalibrationParams, Calibrator, Shift, Step};
use pursuit_ptz::simulation::{CameraParams, HeadParams, SimulatedCamera, SimulatedHead};
use pursuit_ptz::{Direction, Result};

/// Measures a head by how the middle of its picture shifts; the place of each picture errs by up to `noise_px`.
fn measure(head: HeadParams, age_s: f64, noise_px: f64) -> Result<pursuit_ptz::calibration::Calibration> {
    measure_by(head, age_s, noise_px, 1)
}

fn measure_by(head: HeadParams, age_s: f64, noise_px: f64, seed: u64) -> Result<pursuit_ptz::calibration::Calibration> {
    measure_with(head, CameraParams { age_s, ..CameraParams::usual().unwrap() }, noise_px, seed)
}

fn measure_with(
    head: HeadParams,
    camera: CameraParams,
    noise_px: f64,
    seed: u64,
) -> Result<pursuit_ptz::calibration::Calibration> {
    let mut camera = SimulatedCamera::new(camera, seed).unwrap();
    let mut head = SimulatedHead::new(head, seed).unwrap();
    let mut calibrator = Calibrator::new(CalibrationParams::default(), 0.0).unwrap();
    let mut under_way = std::collections::VecDeque::new();
    let mut before: Option<(f64, f64)> = None;
    for tick in 0..9000_u32 {
        let now = f64::from(tick) * 0.01;
        while camera.next_s() <= now {
            head.advance_to(camera.next_s());
            under_way.push_back(camera.take(head.position(), 0.0, (Direction::AHEAD, 0.1, 0.1)).unwrap().0);
        }
        while under_way.front().is_some_and(|e| e.arrival_s <= now) {
            let exposure = under_way.pop_front().unwrap();
            let (px_x, px_y) = exposure.lens.px_per_deg();
            let noise = noise_px * (f64::from(tick * 7919 % 13) / 6.5 - 1.0);
            let looks = exposure.position.direction;
            let place = (-looks.pan_deg * px_x + noise, looks.tilt_deg * px_y - noise);
            let (x, y) = before.replace(place).unwrap_or(place);
            let (right_px, down_px) = (place.0 - x, place.1 - y);
            calibrator.see(&Shift { stamp_s: exposure.arrival_s, right_px, down_px });
        }
        head.advance_to(now);
        match calibrator.step(now)? {
            Step::Wait => {}
            Step::Send(command) => head.command(now, command),
            Step::Done(calibration) => return Ok(calibration),
        }
    }
    panic!("not done within 90 s")
}

#[test]
fn a_head_is_measured_in_under_a_minute() {
    let mut head = HeadParams { delay_s: 0.18, ..HeadParams::default() };
    head.limits.pan.backlash_deg = 0.6;
    head.limits.pan.max_acceleration_deg_s2 = 60.0;
    let found = measure(head, 0.12, 0.0).unwrap();
    assert!(found.took_s < 60.0, "{found:?}");
    assert!((found.pan.delay_s - 0.30).abs() < 0.03 && (found.tilt.delay_s - 0.30).abs() < 0.03, "{found:?}");
    assert!((found.delay_s() - 0.30).abs() < 0.02, "{found:?}");
    // 320 px / tan 30° are 9.674 px a degree in the middle.
    assert!((found.pan.px_per_deg - 9.674).abs() < 0.1 && (found.tilt.px_per_deg - 9.674).abs() < 0.1, "{found:?}");
    assert!((found.pan.backlash_deg - 0.6).abs() < 0.05 && found.tilt.backlash_deg < 0.05, "{found:?}");
    let (pan, tilt) = (found.pan.acceleration_deg_s2.unwrap(), found.tilt.acceleration_deg_s2.unwrap());
    assert!((50.0..70.0).contains(&pan) && (90.0..160.0).contains(&tilt), "{pan} {tilt}");
}

#[test]
fn noise_and_a_head_that_turns_the_other_way_are_borne() {
    let head = HeadParams { delay_s: 0.18, ..HeadParams::default() };
    let found = measure(head, 0.12, 0.1).unwrap();
    assert!((found.delay_s() - 0.30).abs() < 0.04, "{found:?}");
}

#[test]
fn a_head_that_does_not_move_or_stop_is_given_up() {
    let dead = HeadParams { dropped: 1.0, ..HeadParams::default() };
    let error = measure(dead, 0.1, 0.0).unwrap_err().to_string();
    assert!(error.contains("does not shift"), "{error}");
    let error = measure(HeadParams::default(), 0.1, 9.0).unwrap_err().to_string();
    assert!(error.contains("stand still"), "{error}");
}

#[test]
fn jitter_and_loss_are_measured_apart_from_the_delay() {
    let steady = measure(HeadParams { delay_s: 0.18, ..HeadParams::default() }, 0.12, 0.0).unwrap();
    assert!(steady.jitter_s() < 0.01 && steady.loss == 0.0, "{steady:?}");
    // Uniform from 0 to 0.3 s: 0.087 s of deviation; few moves tell that to a half.
    let jitters = HeadParams { delay_s: 0.18, jitter_s: 0.3, ..HeadParams::default() };
    let found: Vec<_> = (0..12).map(|seed| measure_by(jitters.clone(), 0.12, 0.0, seed).unwrap()).collect();
    let mean = |of: fn(&pursuit_ptz::calibration::Calibration) -> f64| found.iter().map(of).sum::<f64>() / 12.0;
    let jitter_s = (mean(|c| c.jitter_s().powi(2))).sqrt();
    assert!((0.06..0.12).contains(&jitter_s), "{jitter_s}");
    assert!((mean(|c| c.delay_s()) - 0.45).abs() < 0.05, "{}", mean(|c| c.delay_s()));
    let lossy = HeadParams { dropped: 0.15, ..HeadParams::default() };
    let losses: Vec<f64> =
        (0..20).filter_map(|seed| Some(measure_by(lossy.clone(), 0.12, 0.0, seed).ok()?.loss)).collect();
    let loss = losses.iter().sum::<f64>() / losses.len() as f64;
    assert!(losses.len() >= 12 && (0.05..0.25).contains(&loss), "{loss} {losses:?}");
}

#[test]
fn jitter_of_pictures_is_measured_apart_from_that_of_commands() {
    let head = HeadParams { delay_s: 0.18, ..HeadParams::default() };
    let found = |head_jitter_s: f64, camera_jitter_s: f64| {
        let head = HeadParams { jitter_s: head_jitter_s, ..head.clone() };
        let camera = CameraParams { age_s: 0.12, jitter_s: camera_jitter_s, ..CameraParams::usual().unwrap() };
        let all: Vec<_> = (0..12).map(|s| measure_with(head.clone(), camera.clone(), 0.05, s).unwrap()).collect();
        let root = |of: &dyn Fn(&pursuit_ptz::calibration::Calibration) -> f64| {
            (all.iter().map(|c| of(c).powi(2)).sum::<f64>() / 12.0).sqrt()
        };
        println!("{head_jitter_s} {camera_jitter_s}: {} {}", root(&|c| c.jitter_s()), root(&|c| c.picture_jitter_s()));
        (root(&|c| c.jitter_s()), root(&|c| c.picture_jitter_s()))
    };
    let (commands_s, pictures_s) = found(0.0, 0.0);
    assert!(commands_s < 0.01 && pictures_s < 0.01, "{commands_s} {pictures_s}");
    // Uniform: a deviation of .29 times the width.
    let (commands_s, pictures_s) = found(0.0, 0.1);
    assert!(commands_s < 0.02 && (0.02..0.04).contains(&pictures_s), "{commands_s} {pictures_s}");
    let (commands_s, pictures_s) = found(0.3, 0.1);
    assert!((0.06..0.12).contains(&commands_s) && (0.02..0.04).contains(&pictures_s), "{commands_s} {pictures_s}");
}
