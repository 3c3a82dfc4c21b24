//! The broker that the tests of messages speak to.

use crate::{browser, run};
use anyhow::Result;

/// Installs Mosquitto where it is not and can be; else that is said, and those tests say `skipped:` themselves.
pub fn install_or_skip(skipped: &mut Vec<String>) -> Result<()> {
    // Its programs have no harmless call that succeeds; Debian puts the broker where only the superuser's path leads.
    let there = || {
        run::program("sh")
            .args(["-c", "PATH=$PATH:/usr/sbin; command -v mosquitto && command -v mosquitto_sub"])
            .works()
    };
    if !(there() || browser::install(&["mosquitto", "mosquitto-clients"]) && there()) {
        skipped.push("messages to a real broker: there is no Mosquitto and none can be installed; install `mosquitto` and `mosquitto-clients`".into());
    }
    Ok(())
}
