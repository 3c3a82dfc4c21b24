//! Requests of strangers are refused, and nothing that is sent breaks the studio.

use crate::common::{open, studio};
use pursuit_studio::Options;
use serde_json::json;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

#[test]
fn other_names_and_other_pages_are_refused() {
    let (studio, _root) = studio();
    let own = studio.host();
    let port = studio.address.port();
    assert_eq!(studio.get("/").status, 200);
    assert_eq!(studio.request("GET", "/api/info", &[("Host", &format!("localhost:{port}"))], b"").status, 200);
    for host in [format!("evil.example:{port}"), format!("10.1.2.3:{port}"), "127.0.0.1:1".to_owned(), String::new()] {
        assert_eq!(studio.request("GET", "/api/info", &[("Host", &host)], b"").status, 403, "rebinding as {host}");
    }
    let with = |name: &str, value: &str| studio.request("GET", "/api/info", &[(name, value)], b"").status;
    assert_eq!(with("Origin", &format!("http://{own}")), 200);
    for origin in [
        "http://evil.example",
        "null",
        &format!("http://127.0.0.1:{}", port.wrapping_add(1)),
        &format!("https://{own}"),
    ] {
        assert_eq!(with("Origin", origin), 403, "{origin}");
    }
    assert_eq!((with("Sec-Fetch-Site", "cross-site"), with("Sec-Fetch-Site", "same-origin")), (403, 200));
    // A WebSocket is asked for like any other page.
    let trial = studio.trial(&json!({ "source": "scene:drift?duration=1" }));
    let handshake = [
        ("Upgrade", "websocket"),
        ("Sec-WebSocket-Version", "13"),
        ("Sec-WebSocket-Key", "dGhlIHNhbXBsZSBub25jZQ=="),
        ("Origin", "http://evil.example"),
    ];
    assert_eq!(studio.request("GET", &format!("{trial}/live"), &handshake, b"").status, 403);
}

#[test]
fn every_answer_has_the_headers_that_keep_others_out() {
    let (studio, _root) = studio();
    for path in ["/", "/assets/app.js", "/api/info", "/nowhere", "/api/trials/7"] {
        let answer = studio.get(path);
        let policy = answer.header("content-security-policy").unwrap();
        assert!(policy.contains("default-src 'none'") && !policy.contains("unsafe"), "{path}: {policy}");
        assert_eq!(answer.header("x-content-type-options").as_deref(), Some("nosniff"), "{path}");
        assert!(answer.header("access-control-allow-origin").is_none(), "{path}");
    }
}

#[test]
fn elsewhere_than_on_the_loopback_a_token_is_needed() {
    let root = tempfile::tempdir().unwrap();
    let options = Options { host: "0.0.0.0".to_owned(), root: root.path().to_owned(), ..Options::default() };
    let studio = open(options);
    let token = studio.url.split_once("?token=").unwrap().1.to_owned();
    assert_eq!(studio.get("/api/info").status, 401);
    let bearer =
        |token: &str| studio.request("GET", "/api/info", &[("Authorization", &format!("Bearer {token}"))], b"");
    let began = Instant::now();
    assert_eq!(bearer("0123456789abcdef0123456789abcdef").status, 401);
    assert!(began.elapsed() >= Duration::from_millis(400), "guessing is slow");
    assert_eq!(bearer(&token).status, 200);
    let exchange = studio.get(&format!("/?token={token}"));
    assert_eq!((exchange.status, exchange.header("location").as_deref()), (303, Some("/")));
    let cookie = exchange.header("set-cookie").unwrap();
    assert!(cookie.contains("HttpOnly") && cookie.contains("SameSite=Strict"), "{cookie}");
    let cookie = cookie.split(';').next().unwrap();
    assert_eq!(studio.request("GET", "/api/info", &[("Cookie", cookie)], b"").status, 200);
    assert_eq!(studio.request("GET", "/", &[("Cookie", "pursuit_token=")], b"").status, 401);
}

#[test]
fn files_outside_the_root_are_not_there() {
    let (studio, root) = studio();
    std::fs::create_dir(root.path().join("clips")).unwrap();
    for source in
        ["/etc/passwd", "../../../../etc/passwd", "clips/../../x", "file:///etc/passwd", "http://127.0.0.1/x", "-", ""]
    {
        let answer = studio.send("POST", "/api/trials", &json!({ "source": source }));
        assert!([404, 422].contains(&answer.status), "{source}: {}", answer.status);
        assert!(!answer.text().contains("root:"), "{source}");
    }
    for path in ["/assets/../Cargo.toml", "/assets/..%2f..%2fCargo.toml", "/..%2fetc/passwd", "/assets/%2e%2e"] {
        assert_eq!(studio.get(path).status, 404, "{path}");
    }
    assert_eq!(studio.get("/api/files?folder=..").status, 404);
    let files = studio.get("/api/files").json();
    assert_eq!((files[0]["name"].as_str(), files[0]["folder"].as_bool()), (Some("clips"), Some(true)));
}

#[test]
fn nonsense_is_refused_and_never_a_failure_of_ours() {
    let (studio, _root) = studio();
    let trial = studio.trial(&json!({ "source": "scene:drift?duration=1", "tracker": "mosse" }));
    for (method, path, body) in [
        ("POST", "/api/trials", json!([])),
        ("POST", "/api/trials", json!({ "source": "scene:nowhere" })),
        ("POST", "/api/trials", json!({ "source": "scene:drift?width=1000000000&height=1000000000" })),
        ("POST", "/api/trials", json!({ "source": "scene:drift", "tracker": "nobody" })),
        ("POST", "/api/trials", json!({ "source": "scene:drift", "parameters": { "motion": { "model": "imn" } } })),
        ("POST", "/api/trials", json!({ "source": "scene:drift", "surprise": 1 })),
        ("POST", "/api/trials", json!({ "source": "x".repeat(5000) })),
        ("POST", "/api/trials", json!({ "source": "camera:99" })),
        ("POST", &format!("{trial}/orders"), json!({ "order": "dance" })),
        ("POST", &format!("{trial}/orders"), json!({ "order": "back" })),
        ("POST", &format!("{trial}/orders"), json!({ "order": "speed", "times": -1 })),
        ("POST", &format!("{trial}/targets"), json!({ "box": [1, 2, 3] })),
        ("POST", &format!("{trial}/targets"), json!({ "box": [10, 10, 0, 5] })),
        ("POST", &format!("{trial}/targets"), json!({ "box": [1e300, 10, 5, 5] })),
        ("POST", &format!("{trial}/targets"), json!({ "box": [-500, -500, 20, 20] })),
        ("PUT", &format!("{trial}/targets/9"), json!({ "box": [10, 10, 20, 20] })),
        ("DELETE", &format!("{trial}/targets/18446744073709551615"), json!({})),
        ("PUT", &format!("{trial}/parameters"), json!({ "nonsense": 1 })),
        ("PUT", &format!("{trial}/parameters"), json!({ "motion": { "acceleration": -1 } })),
        ("PUT", &format!("{trial}/parameters"), json!({ "motion": null })),
        ("PUT", &format!("{trial}/method"), json!({ "tracker": "nobody" })),
        ("GET", &format!("{trial}/rows?from=-1"), json!({})),
        ("GET", &format!("{trial}/rows?version=99"), json!({})),
        ("GET", &format!("{trial}/picture?frame=99999999999"), json!({})),
        ("GET", &format!("{trial}/live"), json!({})),
        ("GET", "/api/trials/99999999999999999999", json!({})),
        ("PATCH", "/api/trials", json!({})),
    ] {
        let answer = studio.send(method, path, &body);
        assert!((400..500).contains(&answer.status), "{method} {path} {body}: {} {}", answer.status, answer.text());
    }
    let facts = studio.get(&trial).json();
    assert_eq!((facts["phase"].as_str(), facts["targets"].clone()), (Some("ready"), json!([])), "{facts}");
    // What comes before any route: bytes that are no HTTP, heads and bodies without end.
    assert_eq!(studio.raw(b"\x16\x03\x01\x02\x00\r\n\r\n").status, 400);
    let long = format!("GET /{} HTTP/1.1\r\nHost: {}\r\n\r\n", "a".repeat(100_000), studio.host());
    assert!([414, 431].contains(&studio.raw(long.as_bytes()).status));
    let body = vec![b' '; 100_000];
    assert_eq!(studio.request("POST", "/api/trials", &[("Content-Type", "application/json")], &body).status, 413);
    let deep = "[".repeat(60_000);
    let answer =
        studio.request("PUT", &format!("{trial}/parameters"), &[("Content-Type", "application/json")], deep.as_bytes());
    assert!([400, 422].contains(&answer.status), "{}", answer.status);
    assert_eq!(studio.get("/api/info").status, 200);
}

#[test]
fn trials_and_uploads_are_bounded() {
    let (studio, _root) = studio();
    let opening = json!({ "source": "scene:drift?duration=1", "tracker": "mosse" });
    let trials: Vec<String> = (0..8).map(|_| studio.trial(&opening)).collect();
    let look = |trial: &String| tungstenite::connect(format!("ws://{}{trial}/live", studio.host())).unwrap().0;
    let mut looking: Vec<_> = trials.iter().map(look).collect();
    // Those that somebody looks at stay.
    let refused = studio.send("POST", "/api/trials", &opening);
    assert!(refused.status == 429 && refused.text().contains("close one under Runs"), "{}", refused.text());
    studio.ok("DELETE", &trials[3], &json!({}));
    looking.push(look(&studio.trial(&opening)));
    assert_eq!(studio.get(&trials[3]).status, 404);
    // Of those that nobody looks at any more, the one that was left first makes room.
    let viewers = || studio.get("/metrics").text();
    for (place, left) in [(5, 7), (0, 6)] {
        looking.remove(place).close(None).unwrap();
        while !viewers().contains(&format!("pursuit_studio_viewers {left}\n")) {
            std::thread::sleep(Duration::from_millis(20));
        }
    }
    std::thread::sleep(Duration::from_millis(2500));
    studio.trial(&opening);
    assert_eq!((studio.get(&trials[5]).status, studio.get(&trials[0]).status), (404, 200));
    for (i, _) in (0..16).enumerate() {
        let answer = studio.request("POST", "/api/uploads?name=../../x.y4m", &[], b"nothing");
        assert_eq!(answer.json()["source"], format!("upload:{}-x.y4m", i + 1));
    }
    assert_eq!(studio.request("POST", "/api/uploads?name=x.y4m", &[], b"nothing").status, 429);
    studio.ok("DELETE", &trials[0], &json!({}));
    for name in ["upload:1-x.y4m", "upload:17-x.y4m", "upload:../1-x.y4m"] {
        assert!([404, 422].contains(&studio.send("POST", "/api/trials", &json!({ "source": name })).status), "{name}");
    }
}

#[test]
fn what_is_uploaded_can_be_followed_and_is_kept() {
    let (studio, root) = studio();
    let mut y4m = b"YUV4MPEG2 W64 H48 F25:1 Ip A1:1 Cmono\n".to_vec();
    for frame in 0..5_u8 {
        y4m.extend_from_slice(b"FRAME\n");
        y4m.extend(
            (0..64 * 48).map(|i| if (10 + usize::from(frame)..26).contains(&(i % 64)) { 200 } else { (i % 7) as u8 }),
        );
    }
    let answer = studio.request("POST", "/api/uploads?name=clip.y4m", &[], &y4m).json();
    let trial = studio.trial(&json!({ "source": answer["source"], "tracker": "mosse" }));
    studio.ok("POST", &format!("{trial}/targets"), &json!({ "box": [10, 10, 16, 20] }));
    let facts = studio.follow_to_the_end(&trial);
    assert_eq!(facts["head"], 4);
    // The upload goes with the studio: a copy is kept beside what was made of it, so that it can be opened again.
    let folder = facts["folder"].as_str().unwrap();
    assert_eq!((folder, std::fs::read(root.path().join(folder).join("clip.y4m")).unwrap()), ("pursuit-out/clip", y4m));
    studio.ok("DELETE", &trial, &json!({}));
    let again = studio.ok("POST", "/api/trials", &json!({ "run": folder }));
    assert_eq!((&again["source"], &again["facts"]["head"]), (&json!("pursuit-out/clip/clip.y4m"), &json!(4)));
}

#[test]
fn connections_that_say_nothing_keep_nobody_out() {
    let (studio, _root) = studio();
    let silent: Vec<TcpStream> =
        (0..300).filter_map(|_| TcpStream::connect(("127.0.0.1", studio.address.port())).ok()).collect();
    assert!(silent.len() > 200);
    let mut late = TcpStream::connect(("127.0.0.1", studio.address.port())).unwrap();
    late.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
    let request = format!("GET /api/info HTTP/1.1\r\nHost: {}\r\nConnection: close\r\n\r\n", studio.host());
    late.write_all(request.as_bytes()).unwrap();
    let mut answer = String::new();
    late.read_to_string(&mut answer).unwrap();
    assert!(answer.starts_with("HTTP/1.1 200"), "{answer}");
}
