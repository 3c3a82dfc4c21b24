//! The brokers that the tests of messages speak to.

use crate::{browser, run};
use anyhow::Result;

/// What speaks to whom: programs, and the packages that bring them.
const BROKERS: [(&str, &[&str], &[&str]); 2] = [
    ("Mosquitto", &["mosquitto", "mosquitto_sub"], &["mosquitto", "mosquitto-clients"]),
    ("NATS server", &["nats-server"], &["nats-server"]),
];

/// Installs them where they are not and can be; else that is said, and those tests say `skipped:` themselves.
pub fn install_or_skip(skipped: &mut Vec<String>) -> Result<()> {
    for (name, programs, packages) in BROKERS {
        // They have no harmless call that succeeds; Debian puts brokers where only the superuser's path leads.
        let calls: Vec<String> = programs.iter().map(|program| format!("command -v {program}")).collect();
        let script = format!("PATH=$PATH:/usr/sbin; {}", calls.join(" && "));
        let there = || run::program("sh").args(["-c", &script]).works();
        if !(there() || browser::install(packages) && there()) {
            let packages = packages.join("` and `");
            skipped.push(format!(
                "messages to a real broker: there is no {name} and none can be installed; install `{packages}`"
            ));
        }
    }
    Ok(())
}
