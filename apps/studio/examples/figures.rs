//! How quick the studio is with a clip: the first picture, a step, and what those who look cost the tracker.
//!
//!     cargo run --release -p pursuit-studio --example figures -- CLIP L,T,W,H [TRACKER] [ROUNDS]
//!
//! Throughputs are of whole passes of the clip as fast as can be, without viewers and with them by turns; quoted are medians.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a measurement may panic")]

use pursuit_studio::{Options, Server};
use serde_json::{Value, json};
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{sleep, spawn};
use std::time::{Duration, Instant};
use tungstenite::{Message, WebSocket, client};

/// Steps whose time is taken.
const STEPS: usize = 40;

struct Studio(SocketAddr);

impl Studio {
    fn send(&self, method: &str, path: &str, body: &Value) -> Value {
        let mut stream = TcpStream::connect(self.0).unwrap();
        let body = body.to_string();
        let head = format!("{method} {path} HTTP/1.1\r\nHost: {}\r\nConnection: close\r\n", self.0);
        let length = body.len();
        write!(stream, "{head}Content-Type: application/json\r\nContent-Length: {length}\r\n\r\n{body}").unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).unwrap();
        let (head, body) = answer.split_once("\r\n\r\n").unwrap();
        assert!(head.starts_with("HTTP/1.1 2"), "{method} {path}: {answer}");
        serde_json::from_str(body).unwrap_or_default()
    }

    fn look(&self, trial: &str) -> WebSocket<TcpStream> {
        let stream = TcpStream::connect(self.0).unwrap();
        client(format!("ws://{}{trial}/live?video=h264", self.0), stream).unwrap().0
    }

    /// One pass of the clip; frames a second.
    fn pass(&self, trial: &str) -> f64 {
        let orders = format!("{trial}/orders");
        self.send("POST", &orders, &json!({ "order": "seek", "frame": 0 }));
        // A correction at the first frame has everything followed anew.
        let first = self.send("GET", trial, &json!({}))["now"]["records"][0]["box"].clone();
        self.send("PUT", &format!("{trial}/targets/1"), &json!({ "box": first }));
        self.send("POST", &orders, &json!({ "order": "speed", "times": null }));
        let began = Instant::now();
        self.send("POST", &orders, &json!({ "order": "start" }));
        loop {
            sleep(Duration::from_millis(20));
            let facts = self.send("GET", trial, &json!({}));
            if facts["phase"] == "ended" {
                return facts["head"].as_f64().unwrap() / began.elapsed().as_secs_f64();
            }
            assert_eq!(facts["phase"], "running", "{facts}");
        }
    }
}

/// The next message that holds a picture.
fn picture(socket: &mut WebSocket<TcpStream>) -> Option<Value> {
    loop {
        if let Message::Binary(bytes) = socket.read().ok()? {
            let length = u32::from_le_bytes(bytes[..4].try_into().unwrap()) as usize;
            if bytes.len() > 4 + length {
                return serde_json::from_slice(&bytes[4..4 + length]).ok();
            }
        }
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Resident memory of this process, MB; 0 where it cannot be known.
fn resident() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix("VmRSS:")?.trim().strip_suffix(" kB")?.trim().parse().ok());
    line.unwrap_or(0_u64) / 1024
}

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [clip, given, rest @ ..] = args.as_slice() else { panic!("give CLIP L,T,W,H [TRACKER] [ROUNDS]") };
    let tracker = rest.first().map_or("kcf", String::as_str);
    let rounds: usize = rest.get(1).map_or(5, |n| n.parse().expect("a number of rounds"));
    let bbox: Vec<f64> = given.split(',').map(|v| v.parse().expect("L,T,W,H")).collect();
    let input = Some(clip.as_str().into());
    let server = Server::open(Options { input, ..Options::default() }).expect("a studio");
    let (studio, stop) = (Studio(server.address()), Arc::new(AtomicBool::new(false)));
    let stopped = stop.clone();
    let serving = spawn(move || server.run(|| stopped.load(Ordering::Relaxed)));

    let first = (0..rounds).map(|_| {
        let began = Instant::now();
        let opened = studio.send("POST", "/api/trials", &json!({ "tracker": tracker }));
        let trial = format!("/api/trials/{}", opened["trial"]);
        picture(&mut studio.look(&trial)).expect("a picture");
        let took = 1e3 * began.elapsed().as_secs_f64();
        studio.send("DELETE", &trial, &json!({}));
        took
    });
    println!("first picture        {:7.1} ms", median(first.collect()));

    let opened = studio.send("POST", "/api/trials", &json!({ "tracker": tracker }));
    let trial = format!("/api/trials/{}", opened["trial"]);
    studio.send("POST", &format!("{trial}/targets"), &json!({ "box": bbox }));
    let mut socket = studio.look(&trial);
    let steps = (0..STEPS).map(|_| {
        let began = Instant::now();
        let wanted =
            studio.send("POST", &format!("{trial}/orders"), &json!({ "order": "step" }))["now"]["frame"].clone();
        while picture(&mut socket).expect("a picture")["now"]["frame"] != wanted {}
        1e3 * began.elapsed().as_secs_f64()
    });
    let steps: Vec<f64> = steps.collect();
    let worst = steps.iter().copied().fold(0.0, f64::max);
    println!("step to its picture  {:7.1} ms, {worst:.1} at worst", median(steps));
    drop(socket);

    let (mut alone, mut one, mut twenty, mut before, mut after) = (vec![], vec![], vec![], 0, 0);
    for _ in 0..rounds {
        sleep(Duration::from_millis(300));
        alone.push(studio.pass(&trial));
        before = resident();
        for (count, stalled, speeds) in [(1, 0, &mut one), (20, 3, &mut twenty)] {
            let mut sockets: Vec<_> = (0..count).map(|_| studio.look(&trial)).collect();
            let _stalled = sockets.split_off(count - stalled);
            let open: Vec<TcpStream> = sockets.iter().map(|s| s.get_ref().try_clone().unwrap()).collect();
            let watching: Vec<_> =
                sockets.into_iter().map(|mut s| spawn(move || while picture(&mut s).is_some() {})).collect();
            speeds.push(studio.pass(&trial));
            after = resident().max(after);
            open.iter().for_each(|s| drop(s.shutdown(std::net::Shutdown::Both)));
            watching.into_iter().for_each(|thread| thread.join().unwrap());
        }
    }
    let ratio = |speeds: &[f64]| median(speeds.iter().zip(&alone).map(|(s, a)| s / a).collect());
    let (with_one, with_twenty) = (ratio(&one), ratio(&twenty));
    println!("nobody looks         {:7.1} frames a second", median(alone.clone()));
    println!("one viewer           {with_one:7.3} of that");
    println!("twenty, three stall  {with_twenty:7.3} of that");
    println!("memory               {after} MB, {before} before");
    stop.store(true, Ordering::Relaxed);
    serving.join().unwrap().unwrap();
}
