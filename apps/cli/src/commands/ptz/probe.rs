use crate::args::PtzProbe;
use crate::commands::print;
use anyhow::Context;
use pursuit::ptz::drivers::{HeadAddress, Timeouts, certificate};
use std::fmt::Write;
use std::fs::File;
use std::path::Path;
use std::process::ExitCode;

/// `pursuit ptz probe`.
pub fn run(args: &PtzProbe) -> anyhow::Result<ExitCode> {
    if let Some(path) = &args.save_certificate {
        return save_certificate(&args.head, path);
    }
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

/// Keeps the certificate that a camera shows, for people to compare and to trust from then on.
fn save_certificate(head: &str, path: &Path) -> anyhow::Result<ExitCode> {
    let address: HeadAddress = head.parse().map_err(super::said)?;
    let (pem, fingerprint) = certificate(&address, Timeouts::default()).map_err(super::said)?;
    // What is trusted already is not replaced by what happens to answer now.
    let mut file = File::create_new(path).with_context(|| format!("cannot write {}", path.display()))?;
    std::io::Write::write_all(&mut file, pem.as_bytes())?;
    let text = format!(
        "SHA-256 {fingerprint}\nWritten to {path}. Compare it with what the camera's own page shows, then: --head-ca {path}\n",
        path = path.display()
    );
    print(text.as_bytes())
}
