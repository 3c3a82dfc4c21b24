//! Whoever moves is followed through what leads a background astray, by motion alone: scenes with truth. The other scenes are
//! in `movers_whole`, apart from the suite.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing, reason = "tests may panic")]

mod faults;
mod figures;
mod scene;

use faults::Fault;
use scene::holds;

#[test]
#[ignore = "release: renders and follows whole scenes"]
fn nothing_goes_wrong() {
    holds(Fault::None);
}

#[test]
#[ignore = "release: renders and follows whole scenes"]
fn the_camera_shakes() {
    holds(Fault::Shake);
}
