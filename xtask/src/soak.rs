//! A live source that breaks off again and again, followed for hours: what is held stays what it was.

use crate::run;
use anyhow::Result;

/// Seconds between two breaks in a long run.
const BETWEEN_S: u32 = 30;

/// Follows for this long; short runs break more often.
pub fn run(seconds: u32) -> Result<()> {
    run::build_programs()?;
    let between = BETWEEN_S.min(seconds / 6).max(1);
    run::program(run::product("examples/soak")?).args([seconds.to_string(), between.to_string()]).run()
}

/// Follows two cameras for so many hours of their own time, as fast as that goes.
pub fn days(hours: f64) -> Result<()> {
    run::build_programs()?;
    run::program(run::product("examples/days")?).arg(hours.to_string()).run()
}
