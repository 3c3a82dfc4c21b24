//! All tests that need nothing but the public interface, in one program: it is linked once.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test may panic")]

mod association;
mod audit;
mod bad_input;
mod bad_input_everywhere;
mod common;
mod consistency;
mod examples;
mod fitting;
mod imm_fixture;
mod imm_modes;
mod kept_back;
mod linear_fixtures;
mod nonlinear_fixtures;
mod paper_fixtures;
mod particles;
mod points;
mod robust;
mod round_trips;
mod smoothing;
mod variations;
