//! A studio that listens on a free port, and a small HTTP client that sends exactly what it is told.
#![allow(
    dead_code,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "not every test uses everything; a test may panic"
)]

use pursuit_studio::{Options, Server};
use serde_json::{Value, json};
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

pub struct Opened {
    pub address: SocketAddr,
    pub url: String,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Drop for Opened {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            thread.join().unwrap();
        }
    }
}

pub fn open(options: Options) -> Opened {
    let server = Server::open(options).unwrap();
    let (address, url, stop) = (server.address(), server.url(), Arc::new(AtomicBool::new(false)));
    let flag = stop.clone();
    let thread = std::thread::spawn(move || server.run(|| flag.load(Ordering::Relaxed)).unwrap());
    Opened { address, url, stop, thread: Some(thread) }
}

/// On the loopback, with an empty root of its own.
pub fn studio() -> (Opened, tempfile::TempDir) {
    let root = tempfile::tempdir().unwrap();
    (open(Options { root: root.path().to_owned(), ..Options::default() }), root)
}

pub struct Answer {
    pub status: u16,
    pub head: String,
    pub body: Vec<u8>,
}

impl Answer {
    pub fn json(&self) -> Value {
        serde_json::from_slice(&self.body).unwrap_or_else(|_| panic!("no JSON: {}", self.text()))
    }

    pub fn text(&self) -> String {
        String::from_utf8_lossy(&self.body).into_owned()
    }

    pub fn header(&self, name: &str) -> Option<String> {
        let find = |line: &str| {
            let (own, value) = line.split_once(':')?;
            own.eq_ignore_ascii_case(name).then(|| value.trim().to_owned())
        };
        self.head.lines().find_map(find)
    }
}

impl Opened {
    pub fn host(&self) -> String {
        format!("127.0.0.1:{}", self.address.port())
    }

    /// Sends these bytes and reads the answer.
    pub fn raw(&self, request: &[u8]) -> Answer {
        let mut stream = TcpStream::connect(("127.0.0.1", self.address.port())).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
        stream.write_all(request).unwrap();
        let mut bytes = Vec::new();
        // A connection that was refused may be cut off by the other side.
        let _ = stream.read_to_end(&mut bytes);
        let at = bytes.windows(4).position(|w| w == b"\r\n\r\n").map_or(bytes.len(), |at| at + 4);
        let head = String::from_utf8_lossy(&bytes[..at]).into_owned();
        let status = head.split(' ').nth(1).and_then(|s| s.parse().ok()).unwrap_or(0);
        Answer { status, head, body: bytes[at..].to_vec() }
    }

    /// A request with these headers beside those that every request needs.
    pub fn request(&self, method: &str, path: &str, headers: &[(&str, &str)], body: &[u8]) -> Answer {
        let mut head = format!("{method} {path} HTTP/1.1\r\nConnection: close\r\nContent-Length: {}\r\n", body.len());
        if !headers.iter().any(|(name, _)| name.eq_ignore_ascii_case("host")) {
            head += &format!("Host: {}\r\n", self.host());
        }
        headers.iter().for_each(|(name, value)| head += &format!("{name}: {value}\r\n"));
        self.raw(&[head.as_bytes(), b"\r\n", body].concat())
    }

    pub fn get(&self, path: &str) -> Answer {
        self.request("GET", path, &[], b"")
    }

    pub fn send(&self, method: &str, path: &str, body: &Value) -> Answer {
        self.request(method, path, &[("Content-Type", "application/json")], body.to_string().as_bytes())
    }

    /// The same, which must go well.
    pub fn ok(&self, method: &str, path: &str, body: &Value) -> Value {
        let answer = self.send(method, path, body);
        assert!((200..300).contains(&answer.status), "{method} {path}: {} {}", answer.status, answer.text());
        if answer.body.is_empty() { Value::Null } else { answer.json() }
    }

    /// Opens a trial; its path.
    pub fn trial(&self, opening: &Value) -> String {
        let answer = self.ok("POST", "/api/trials", opening);
        format!("/api/trials/{}", answer["trial"])
    }

    pub fn order(&self, trial: &str, order: &str) -> Value {
        self.ok("POST", &format!("{trial}/orders"), &json!({ "order": order }))
    }

    /// Goes on at full speed until the input has ended.
    pub fn follow_to_the_end(&self, trial: &str) -> Value {
        self.ok("POST", &format!("{trial}/orders"), &json!({ "order": "speed", "times": null }));
        self.order(trial, "start");
        let began = Instant::now();
        loop {
            let facts = self.get(trial).json();
            match facts["phase"].as_str() {
                Some("running") => assert!(began.elapsed() < Duration::from_secs(120), "{facts}"),
                Some("ended") => return facts,
                _ => panic!("{facts}"),
            }
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}

/// Lines of a trajectory without the time that an update took, which no two runs share.
pub fn without_times(csv: &str) -> Vec<String> {
    let untimed = |line: &str| {
        let mut cells: Vec<&str> = line.split(',').collect();
        cells.remove(17);
        cells.join(",")
    };
    csv.lines().map(untimed).collect()
}
