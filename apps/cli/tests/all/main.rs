//! All tests of the command, in one program: it is linked once.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test may panic")]

mod associate;
mod bad_input;
mod batch;
#[path = "../../../../crates/publish/tests/common/mod.rs"]
mod broker;
mod cameras;
mod careful;
mod common;
mod contract;
mod demo;
mod eval;
mod flow;
mod mavlink;
mod measure;
mod networks;
mod outputs;
mod ptz;
mod publish;
mod publish_nats;
mod real_footage;
mod reproduce;
mod studio;
mod survey;
