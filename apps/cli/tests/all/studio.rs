//! `pursuit studio`, `pursuit track --pick`, and `--watch` of runs and of heads, as far as they go without a browser.
#![cfg(feature = "studio")]

use crate::common::{command, fails, pursuit, rows};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, Stdio};

/// The address in a line of a program's output.
fn address(line: &str) -> String {
    line.split("http://").nth(1).unwrap().trim_end().trim_end_matches('/').to_owned()
}

/// Sends a request and reads the whole answer.
fn ask(address: &str, method: &str, path: &str, body: &str) -> String {
    let mut stream = TcpStream::connect(address).unwrap();
    let length = body.len();
    write!(
        stream,
        "{method} {path} HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\nContent-Type: application/json\r\nContent-Length: {length}\r\n\r\n{body}"
    )
    .unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    answer
}

fn first_line(output: impl Read) -> String {
    let mut line = String::new();
    BufReader::new(output).read_line(&mut line).unwrap();
    line
}

struct Killed(Child);

impl Drop for Killed {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

#[test]
fn the_studio_prints_its_address_and_answers_there() {
    let mut child = command(&["studio", "scene:drift?duration=1", "--port", "0", "--no-open"]);
    let mut child = Killed(child.stdout(Stdio::piped()).spawn().unwrap());
    let address = address(&first_line(child.0.stdout.take().unwrap()));
    let page = ask(&address, "GET", "/", "");
    assert!(page.starts_with("HTTP/1.1 200") && page.contains("<title>pursuit studio</title>"), "{page}");
    let info = ask(&address, "GET", "/api/info", "");
    assert!(info.contains("\"input\":\"scene:drift?duration=1\""), "{info}");
    let opened = ask(&address, "POST", "/api/trials", "{}");
    assert!(
        opened.starts_with("HTTP/1.1 201"),
        "the input of the command line is opened without being named: {opened}"
    );
}

/// What the Dockerfile starts, on a port that is free here.
#[test]
fn the_image_starts_a_studio_that_wants_its_token() {
    let file = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../Dockerfile");
    let text = std::fs::read_to_string(file).unwrap();
    let words = |name: &str| -> Vec<String> {
        let line = text.lines().find_map(|line| line.strip_prefix(name)).unwrap();
        line.split('"').skip(1).step_by(2).map(str::to_owned).collect()
    };
    assert_eq!(words("ENTRYPOINT "), ["pursuit"]);
    let mut arguments = words("CMD ");
    let port = arguments.iter().position(|a| a == "--port").unwrap() + 1;
    assert!(text.contains(&format!("EXPOSE {}\n", arguments[port])), "the port that it listens at is another");
    arguments[port] = "0".to_owned();
    let mut child = command(&arguments.iter().map(String::as_str).collect::<Vec<_>>());
    let mut child = Killed(child.stdout(Stdio::piped()).spawn().unwrap());
    let line = first_line(child.0.stdout.take().unwrap());
    let (address, token) = line.trim().split_once("/?token=").unwrap_or_else(|| panic!("{line}"));
    assert!(address.starts_with("http://localhost:") && token.len() > 20, "{line}");
}

#[test]
fn what_the_studio_cannot_use_is_said_before_it_is_opened() {
    fails(&pursuit(&["studio", "nowhere.mp4", "--no-open"]), 3, &["nowhere.mp4"]);
    fails(&pursuit(&["studio", "-", "--no-open"]), 2, &["standard input"]);
    fails(&pursuit(&["studio", "--root", "nowhere", "--no-open"]), 2, &["--root nowhere"]);
    fails(&pursuit(&["studio", "--host", "192.0.2.1", "--no-open"]), 2, &["192.0.2.1", "--host"]);
}

#[test]
fn a_box_drawn_in_the_page_is_what_the_run_starts_from() {
    let out = tempfile::tempdir().unwrap();
    let folder = out.path().join("run");
    let mut child =
        command(&["track", "scene:drift?seed=7&duration=1", "--tracker", "mosse", "--pick", "--no-video", "--out"]);
    let mut child = Killed(child.arg(&folder).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap());
    let line = first_line(child.0.stderr.take().unwrap());
    assert!(line.starts_with("draw a box"), "{line}");
    let address = address(&line);
    let other = ask(&address, "POST", "/api/trials", r#"{ "source": "scene:static" }"#);
    assert!(other.starts_with("HTTP/1.1 422"), "{other}");
    let opened = ask(&address, "POST", "/api/trials", r#"{ "tracker": "mosse" }"#);
    let number: String = opened.split("\"trial\":").nth(1).unwrap().chars().take_while(char::is_ascii_digit).collect();
    let path = format!("/api/trials/{number}");
    let sought = ask(&address, "POST", &format!("{path}/orders"), r#"{ "order": "seek", "frame": 5 }"#);
    assert!(sought.starts_with("HTTP/1.1 200"), "{sought}");
    let drawn = ask(&address, "POST", &format!("{path}/targets"), r#"{ "box": [150, 100, 30, 32] }"#);
    assert!(drawn.starts_with("HTTP/1.1 200"), "{drawn}");
    assert!(child.0.wait().unwrap().success());
    let rows = rows(&folder.join("trajectory.csv"));
    assert_eq!(["frame", "x", "y", "w", "h"].map(|c| &*rows[0][c]), ["5", "150.000", "100.000", "30.000", "32.000"]);
    assert_eq!(rows.len(), 25);
}

#[test]
fn a_run_that_is_watched_is_shown_and_not_changed() {
    let out = tempfile::tempdir().unwrap();
    let folder = out.path().join("run");
    // Long enough to be asked while it runs, whatever the machine; it is stopped by its end of input all the same.
    let scene = "scene:drift?seed=7&duration=200";
    let mut child = command(&["track", scene, "--tracker", "mosse", "--watch", "--no-video", "--out"]);
    let mut child = Killed(child.arg(&folder).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap());
    let line = first_line(child.0.stderr.take().unwrap());
    assert!(line.starts_with(&format!("watch {scene} at http://127.0.0.1:")), "{line}");
    let address = address(&line);
    let info = ask(&address, "GET", "/api/info", "");
    assert!(info.starts_with("HTTP/1.1 200") && info.contains("\"read_only\":true"), "{info}");
    let number: String = info.split("\"trials\":[").nth(1).unwrap().chars().take_while(char::is_ascii_digit).collect();
    let path = format!("/api/trials/{number}");
    let facts = ask(&address, "GET", &path, "");
    assert!(facts.contains("\"read_only\":true") && facts.contains("\"tracker\":\"mosse\""), "{facts}");
    for (method, path, body) in [
        ("POST", format!("{path}/orders"), r#"{ "order": "stop" }"#),
        ("POST", format!("{path}/targets"), r#"{ "box": [1, 1, 30, 30] }"#),
        ("PUT", format!("{path}/targets/1"), r#"{ "box": [1, 1, 30, 30], "backward": true }"#),
        ("DELETE", path.clone(), ""),
        ("POST", "/api/trials".to_owned(), r#"{ "source": "scene:static" }"#),
        ("GET", "/api/files".to_owned(), ""),
    ] {
        let answer = ask(&address, method, &path, body);
        assert!(answer.starts_with("HTTP/1.1 403"), "{method} {path}: {answer}");
    }
    assert!(child.0.wait().unwrap().success());
    assert!(TcpStream::connect(&address).is_err(), "the page ends with the run");
    assert_eq!(rows(&folder.join("trajectory.csv")).len(), 6000);
}

#[test]
#[cfg(unix)]
fn a_head_that_is_watched_says_where_it_looks() {
    let out = tempfile::tempdir().unwrap();
    let scene = "scene:drift?seed=7&duration=200";
    let mut child =
        command(&["ptz", "follow", scene, "--tracker", "mosse", "--watch", "--head", "hook:cat > /dev/null", "--out"]);
    let mut child = Killed(
        child
            .env("PATH", "/usr/bin:/bin")
            .arg(out.path().join("run"))
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap(),
    );
    let line = first_line(child.0.stderr.take().unwrap());
    assert!(line.starts_with(&format!("watch {scene} at ")), "{line}");
    let address = address(&line);
    let info = ask(&address, "GET", "/api/info", "");
    let number: String = info.split("\"trials\":[").nth(1).unwrap().chars().take_while(char::is_ascii_digit).collect();
    let facts = || ask(&address, "GET", &format!("/api/trials/{number}"), "");
    let said = (0..500).map(|_| facts()).find(|facts| facts.contains("\"remark\":\"head follows: pan "));
    assert!(said.is_some(), "{}", facts());
    assert!(child.0.wait().unwrap().success());
}
