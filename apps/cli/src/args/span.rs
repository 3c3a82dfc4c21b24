use clap::Args;
use std::num::NonZeroU64;

/// Which frames of the input are looked at, and when they are.
#[derive(Debug, Args)]
pub struct Span {
    /// First frame to look at, from 0
    #[arg(long, value_name = "N")]
    pub from: Option<u64>,
    /// Last frame to look at
    #[arg(long, value_name = "N")]
    pub to: Option<u64>,
    /// Look at one of so many frames; numbers and times stay those of the input
    #[arg(long, value_name = "N")]
    pub stride: Option<NonZeroU64>,
    /// Assume this many frames a second instead of the input's own times
    #[arg(long, value_name = "F", allow_negative_numbers = true)]
    pub fps: Option<f64>,
}
