//! The examples do what they say; each asserts it itself.

#[path = "../../examples/fit_noise.rs"]
mod fit_noise;
#[path = "../../examples/follow_a_point.rs"]
mod follow_a_point;
#[path = "../../examples/many_targets.rs"]
mod many_targets;
#[path = "../../examples/smooth_a_turn.rs"]
mod smooth_a_turn;

#[test]
fn all_run() {
    follow_a_point::main().unwrap();
    many_targets::main().unwrap();
    fit_noise::main().unwrap();
    smooth_a_turn::main().unwrap();
}
