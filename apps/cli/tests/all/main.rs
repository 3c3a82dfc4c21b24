//! All tests of the command, in one program: it is linked once.

mod associate;
mod bad_input;
mod batch;
mod cameras;
mod careful;
mod common;
mod contract;
mod demo;
mod eval;
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
