//! The scenes of `movers` that would make the suite minutes longer: `cargo test --profile suite -p pursuit-trackers --test
//! movers_whole -- --ignored`.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing, reason = "tests may panic")]

#[path = "movers/faults.rs"]
mod faults;
#[path = "movers/figures.rs"]
mod figures;
#[path = "movers/scene.rs"]
mod scene;

use faults::Fault;
use scene::holds;

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
#[ignore = "minutes: renders and follows whole scenes"]
fn somebody_enters_slowly() {
    holds(Fault::Slow);
}

#[test]
#[ignore = "minutes: renders and follows whole scenes"]
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
