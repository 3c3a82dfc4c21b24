//! Eleven small programs, each a file of this folder that stands by itself.
//!
//! `cargo run --release -p pursuit --features ptz --example tour -- NAME`; without a name all of them, in the order in which they are best read.
//! Some leave a chart in the folder that they are run in.

mod associate;
mod dataset;
mod follow;
mod frames;
mod honesty;
mod imm;
mod kalman;
mod many;
mod noise;
mod own_tracker;
mod smooth;
#[cfg(feature = "ptz")]
mod steer;

/// What all of them are.
type Program = fn() -> Result<(), Box<dyn std::error::Error>>;

/// Their names, in the order in which they are best read.
const PROGRAMS: &[(&str, Program)] = &[
    ("follow", follow::main),
    ("frames", frames::main),
    ("many", many::main),
    ("associate", associate::main),
    ("kalman", kalman::main),
    ("imm", imm::main),
    ("smooth", smooth::main),
    ("honesty", honesty::main),
    ("own_tracker", own_tracker::main),
    ("dataset", dataset::main),
    #[cfg(feature = "ptz")]
    ("steer", steer::main),
];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let wanted: Vec<String> = std::env::args().skip(1).collect();
    if let Some(unknown) = wanted.iter().find(|w| PROGRAMS.iter().all(|(name, _)| name != w)) {
        let names: Vec<&str> = PROGRAMS.iter().map(|(name, _)| *name).collect();
        return Err(format!("there is no program `{unknown}`; there are {}", names.join(", ")).into());
    }
    for (name, program) in PROGRAMS.iter().filter(|(name, _)| wanted.is_empty() || wanted.iter().any(|w| w == name)) {
        println!("-- {name}");
        program()?;
    }
    Ok(())
}
