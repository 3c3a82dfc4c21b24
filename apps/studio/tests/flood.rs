//! Many connections, and frames that are none: refused, while everybody else goes on. A program of its own, because it measures the
//! memory of all that it does.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test may panic")]

#[path = "all/common/mod.rs"]
mod common;

use common::{Opened, studio};
use serde_json::{Value, json};
use std::collections::VecDeque;
use std::io::{ErrorKind, Read, Write};
use std::net::TcpStream;
use std::time::Duration;

/// Connections that are open at once on this side.
const AT_ONCE: usize = 400;

fn connect(studio: &Opened) -> TcpStream {
    let stream = TcpStream::connect(("127.0.0.1", studio.address.port())).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
    stream
}

/// Resident memory of this process, kB.
fn resident() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    status.lines().find_map(|l| l.strip_prefix("VmRSS:")?.trim().strip_suffix(" kB")?.trim().parse().ok())
}

/// A connection on which the studio speaks WebSocket.
fn upgraded(studio: &Opened, trial: &str) -> TcpStream {
    let mut stream = connect(studio);
    let request = format!(
        "GET {trial}/live?video=h264 HTTP/1.1\r\nHost: {}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n\
         Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n",
        studio.host()
    );
    stream.write_all(request.as_bytes()).unwrap();
    let mut answer = Vec::new();
    while !answer.ends_with(b"\r\n\r\n") {
        let mut byte = [0];
        stream.read_exact(&mut byte).unwrap();
        answer.push(byte[0]);
    }
    assert!(answer.starts_with(b"HTTP/1.1 101"), "{}", String::from_utf8_lossy(&answer));
    stream
}

/// A masked frame as a client sends it; the length that is said may be another than that of what is sent.
fn frame(first: u8, said: u64, payload: &[u8]) -> Vec<u8> {
    let mut bytes = vec![first];
    match said {
        0..=125 => bytes.push(0x80 | said as u8),
        126..=65_535 => {
            bytes.push(0x80 | 126);
            bytes.extend((said as u16).to_be_bytes());
        }
        _ => {
            bytes.push(0x80 | 127);
            bytes.extend(said.to_be_bytes());
        }
    }
    // A mask of zeros leaves everything as it is.
    bytes.extend([0; 4]);
    bytes.extend(payload);
    bytes
}

/// Whether the studio ends this connection, and not only our patience.
fn is_over(stream: &mut TcpStream) -> bool {
    match stream.read_to_end(&mut Vec::new()) {
        Ok(_) => true,
        Err(error) => matches!(error.kind(), ErrorKind::ConnectionReset | ErrorKind::BrokenPipe),
    }
}

#[test]
fn ten_thousand_connections_are_refused_and_a_run_goes_on() {
    let (studio, _root) = studio();
    let trial = studio.trial(&json!({ "source": "scene:drift?seed=7&duration=600", "tracker": "mosse" }));
    studio.ok("POST", &format!("{trial}/targets"), &json!({ "box": [145.5, 105.5, 30.0, 30.0] }));
    // In two and a half minutes it would be over.
    studio.ok("POST", &format!("{trial}/orders"), &json!({ "order": "speed", "times": 4 }));
    // Who came before goes on being answered on the connection that is open.
    let mut early = connect(&studio);
    let mut ask = |method: &str, path: &str, body: &str| -> Value {
        let (host, length) = (studio.host(), body.len());
        let head = format!("{method} {path} HTTP/1.1\r\nHost: {host}\r\nContent-Type: application/json\r\n");
        early.write_all(format!("{head}Content-Length: {length}\r\n\r\n{body}").as_bytes()).unwrap();
        let mut answer = Vec::new();
        let mut byte = [0];
        while !answer.ends_with(b"\r\n\r\n") {
            early.read_exact(&mut byte).unwrap();
            answer.push(byte[0]);
        }
        let head = String::from_utf8_lossy(&answer).to_lowercase();
        assert!(head.starts_with("http/1.1 200"), "{head}");
        let length = head.lines().find_map(|l| l.strip_prefix("content-length: ")?.parse().ok()).unwrap();
        let mut body = vec![0; length];
        early.read_exact(&mut body).unwrap();
        serde_json::from_slice(&body).unwrap()
    };
    let before = ask("POST", &format!("{trial}/orders"), r#"{ "order": "start" }"#)["head"].as_u64().unwrap();
    let memory = resident();
    let (mut open, mut refused) = (VecDeque::new(), 0);
    for i in 0..10_000 {
        // Where the system itself gives no more, that is a refusal too.
        let Ok(mut stream) = TcpStream::connect(("127.0.0.1", studio.address.port())) else {
            refused += 1;
            continue;
        };
        if i % 500 == 499 {
            // Whoever is beyond the limit hears so at once; others may come before that, while earlier ones time out.
            stream.set_read_timeout(Some(Duration::from_millis(500))).unwrap();
            let mut answer = [0; 12];
            if stream.read_exact(&mut answer).is_ok() {
                assert_eq!(&answer, b"HTTP/1.1 503");
                refused += 1;
            }
            let facts = ask("GET", &trial, "");
            assert_eq!(facts["phase"], "running", "{facts}");
        }
        open.push_back(stream);
        if open.len() > AT_ONCE {
            // From the newest: the oldest hold their places all the time.
            open.pop_back();
        }
    }
    assert!(refused >= 5, "{refused} were told");
    let facts = ask("GET", &trial, "");
    assert!(facts["head"].as_u64().unwrap() > before, "the run stood still: {facts}");
    if let Some((before, after)) = memory.zip(resident()) {
        // The trial itself keeps the pictures of the last 128 MB.
        assert!(after < before + ((128 + 64) << 10), "from {before} kB to {after} kB");
    }
    drop(open);
    // When they are gone there is room again.
    assert_eq!(studio.get("/api/info").status, 200);
    let metrics = studio.get("/metrics").text();
    let line = metrics.lines().find_map(|l| l.strip_prefix("pursuit_studio_connections_refused_total ")).unwrap();
    // Most of the others had gone before it was their turn.
    assert!(line.parse::<u64>().unwrap() > 1_000, "{line}");
}

#[test]
fn frames_that_are_none_end_their_connection_and_nothing_else() {
    let (studio, _root) = studio();
    let trial = studio.trial(&json!({ "source": "scene:drift?seed=7&duration=2", "tracker": "mosse" }));
    let unmasked = b"\x82\x03abc".to_vec();
    let cases: [(&str, Vec<u8>); 10] = [
        ("not masked", unmasked),
        ("of a kind that there is not", frame(0x83, 0, b"")),
        ("with bits that mean nothing", frame(0xf2, 0, b"")),
        ("longer than may be", frame(0x82, 5 << 10, &[7; 5 << 10])),
        ("of a length without end", frame(0x82, u64::MAX >> 1, b"abc")),
        ("of a length with the highest bit", frame(0x82, u64::MAX, b"abc")),
        ("that goes on with nothing", frame(0x80, 3, b"abc")),
        ("text that is none", frame(0x81, 4, b"\xff\xfe\x80\xff")),
        ("a ping in parts", frame(0x09, 2, b"ab")),
        ("a ping that is too long", frame(0x89, 126, &[7; 126])),
    ];
    for (what, bytes) in cases {
        let mut stream = upgraded(&studio, &trial);
        // It may be cut off while this is sent.
        let _ = stream.write_all(&bytes);
        assert!(is_over(&mut stream), "a frame {what} did not end the connection");
    }
    // Parts of one message that grow without end.
    let mut stream = upgraded(&studio, &trial);
    let mut sent = stream.write_all(&frame(0x02, 4000, &[7; 4000]));
    for _ in 0..1000 {
        sent = sent.and_then(|()| stream.write_all(&frame(0x00, 4000, &[7; 4000])));
    }
    assert!(is_over(&mut stream), "a message without end did not end the connection");
    // Half a frame, and then nothing; what is no order; orders without end.
    let mut half = upgraded(&studio, &trial);
    half.write_all(&frame(0x82, 100, b"abc")).unwrap();
    let mut chatty = upgraded(&studio, &trial);
    for _ in 0..10_000 {
        chatty.write_all(&frame(0x81, 3, b"key")).unwrap();
        chatty.write_all(&frame(0x81, 5, b"dance")).unwrap();
    }
    studio.ok("POST", &format!("{trial}/targets"), &json!({ "box": [145.5, 105.5, 30.0, 30.0] }));
    assert_eq!(studio.follow_to_the_end(&trial)["head"], 59);
}
