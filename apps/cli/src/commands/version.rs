use super::print;
use pursuit::media::OpenOptions;
use std::fmt::Write;
use std::process::{Command, ExitCode};

/// `pursuit --version`; with `-v` also the commit, the features and the `ffmpeg` that would be used.
pub fn run(verbose: bool) -> anyhow::Result<ExitCode> {
    let mut text = format!("pursuit {}\n", env!("CARGO_PKG_VERSION"));
    if verbose {
        let all = pursuit::FEATURES.into_iter().chain([("reproduce", cfg!(feature = "reproduce"))]);
        let (with, without): (Vec<_>, Vec<_>) = all.partition(|f| f.1);
        let names = |features: Vec<(&'static str, bool)>| {
            let names: Vec<&str> = features.into_iter().map(|f| f.0).collect();
            if names.is_empty() { "none".to_owned() } else { names.join(", ") }
        };
        writeln!(text, "commit    {}", env!("PURSUIT_COMMIT"))?;
        writeln!(text, "features  {} (without: {})", names(with), names(without))?;
        writeln!(text, "ffmpeg    {}", ffmpeg())?;
    }
    print(text.as_bytes())
}

/// Where it is, and what it says of itself.
fn ffmpeg() -> String {
    let Some(path) = OpenOptions::from_env().find_ffmpeg() else {
        return "none found; it is needed for cameras, streams and formats that are not built in".to_owned();
    };
    let said = Command::new(&path).arg("-version").output().ok().filter(|o| o.status.success());
    let first = said.and_then(|o| String::from_utf8_lossy(&o.stdout).lines().next().map(str::to_owned));
    format!("{} ({})", path.display(), first.as_deref().unwrap_or("it does not start"))
}
