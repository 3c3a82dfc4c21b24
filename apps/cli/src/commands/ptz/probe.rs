use crate::args::PtzProbe;
use crate::commands::print;
use std::fmt::Write;
use std::process::ExitCode;

/// `pursuit ptz probe`.
pub fn run(args: &PtzProbe) -> anyhow::Result<ExitCode> {
    let mut head = super::reach(&args.head, &args.secret)?;
    let said = serde_json::json!({ "head": head.name(), "capabilities": head.capabilities() });
    let mut text = serde_json::to_string_pretty(&said)? + "\n";
    match head.status() {
        Ok(Some(status)) => writeln!(text, "It says of itself: {status:?}")?,
        Ok(None) => writeln!(text, "It says nothing of itself.")?,
        Err(error) => {
            print(text.as_bytes())?;
            return Err(super::said(error).context("it does not say how it stands"));
        }
    }
    print(text.as_bytes())
}
