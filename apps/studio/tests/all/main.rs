//! All tests of the studio but those that measure memory, in one program: it is linked once.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test may panic")]

mod backward;
mod calls;
mod common;
mod detector;
mod live;
mod looks;
mod measuring;
mod runs;
mod safety;
mod trajectory;
mod work;
