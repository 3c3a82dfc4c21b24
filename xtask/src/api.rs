//! The studio's calls, made up from their description by a tool that we did not write (schemathesis): whatever comes, the
//! studio refuses it or does it, and never fails.

use crate::{peers, run};
use anyhow::{Context, Result, bail};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

/// How long requests are made up, each time.
const SECONDS: &str = "25";
/// What is opened, so that there is a trial to be told something.
const OPENING: &str = r#"{"source":"scene:drift?duration=2","tracker":"mosse"}"#;
const TARGET: &str = r#"{"box":[145,105,30,30]}"#;

/// As [`test_or_fail`], but a machine without Python or without access to its packages is no failure: it is said.
pub fn test_or_skip(skipped: &mut Vec<String>) -> Result<()> {
    match peers::environment("peers-api", "api.txt") {
        Ok(python) => test(&python),
        Err(why) => {
            skipped.push(format!("the studio's calls made up by schemathesis: {why:#}"));
            Ok(())
        }
    }
}

/// Every call with made-up requests, twice: with numbers of trials that there are not, and with one that there is.
pub fn test_or_fail() -> Result<()> {
    test(&peers::environment("peers-api", "api.txt")?)
}

fn test(python: &Path) -> Result<()> {
    run::build_programs()?;
    let folder = std::path::absolute(run::target_dir().join("api"))?;
    std::fs::create_dir_all(folder.join("root"))?;
    let studio = Studio::start(&folder.join("root"))?;
    let opened = studio.ask("POST", "/api/trials", OPENING)?;
    let number: String =
        opened.split("\"trial\":").nth(1).unwrap_or_default().chars().take_while(char::is_ascii_digit).collect();
    studio.ask("POST", &format!("/api/trials/{number}/targets"), TARGET)?;
    // What closes it would be found at once, and everything after it would be asked of nobody.
    let config = format!("[parameters]\n\"path.trial\" = {number}\n\"path.target\" = 1\n");
    std::fs::write(folder.join("one.toml"), config)?;
    std::fs::write(folder.join("any.toml"), "")?;
    let tool = python.with_file_name("schemathesis");
    studio.is_asked(&tool, &folder.join("one.toml"), &["--exclude-method", "DELETE"])?;
    studio.is_asked(&tool, &folder.join("any.toml"), &[])?;
    // Whatever it was told, it is still there, and what it says of itself can be read.
    studio.ask("GET", "/api/info", "").map(drop)
}

struct Studio {
    child: Child,
    address: String,
    log: PathBuf,
}

impl Drop for Studio {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Studio {
    fn start(root: &Path) -> Result<Self> {
        let log = root.with_file_name("studio.log");
        let mut child = Command::new(run::product("pursuit")?)
            .args(["studio", "--no-open", "--port", "0", "--root"])
            .arg(root)
            .current_dir(root)
            .stdout(Stdio::piped())
            .stderr(std::fs::File::create(&log)?)
            .spawn()
            .context("cannot start `pursuit studio`")?;
        let mut line = String::new();
        let out = child.stdout.take().context("the studio has no output")?;
        BufReader::new(out).read_line(&mut line)?;
        let address = line.trim().trim_start_matches("http://").trim_end_matches('/').to_owned();
        Ok(Self { child, address, log })
    }

    /// The answer to a request, which must be a good one.
    fn ask(&self, method: &str, path: &str, body: &str) -> Result<String> {
        let mut stream = TcpStream::connect(&self.address).context("the studio is gone")?;
        stream.set_read_timeout(Some(Duration::from_secs(60)))?;
        let (host, length) = (&self.address, body.len());
        let head = format!("{method} {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n");
        write!(stream, "{head}Content-Type: application/json\r\nContent-Length: {length}\r\n\r\n{body}")?;
        let mut answer = String::new();
        stream.read_to_string(&mut answer)?;
        if !answer.starts_with("HTTP/1.1 2") {
            bail!("{method} {path}: {}", answer.lines().next().unwrap_or("no answer"));
        }
        Ok(answer)
    }

    fn is_asked(&self, tool: &Path, config: &Path, further: &[&str]) -> Result<()> {
        let outcome = run::program(tool)
            .arg("--config-file")
            .arg(config)
            .arg("--no-color")
            .args(["run", "--checks", "not_a_server_error", "--max-time", SECONDS, "--seed", "1"])
            // One worker: two threads that parse at once break the parser of Python 3.11 ("recursion depth mismatch").
            .args(["--phases", "coverage,fuzzing", "--request-timeout", "60", "--workers", "1"])
            .args(further)
            .arg(format!("http://{}/api/openapi.json", self.address))
            .run();
        let said = std::fs::read_to_string(&self.log).unwrap_or_default();
        if said.contains("panicked") {
            bail!("the studio panicked:\n{said}");
        }
        outcome
    }
}
