//! Against a real NATS server, which is killed, stands still and returns, and against servers that are none.
#![cfg(feature = "nats")]
#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;
#[path = "common/publishers.rs"]
mod publishers;

use common::nats::NatsServer;
use common::{Gate, wait_until};
use publishers::{login, options, publisher};
use pursuit_publish::{Broker, Message, Options, Publisher, Qos};
use std::collections::BTreeSet;
use std::time::Duration;

const QUALITIES: [Qos; 2] = [Qos::AtMostOnce, Qos::AtLeastOnce];

fn broker(port: u16) -> Broker {
    Broker::parse(format!("nats://127.0.0.1:{port}")).unwrap()
}

#[test]
fn everything_arrives_once_and_in_order() {
    for qos in QUALITIES {
        let Some(nats) = NatsServer::open() else { return };
        let listener = nats.listen();
        let mut publisher = publisher(broker(nats.port), Options { capacity: 20_000, ..options() }, qos);
        listener.wait_for("t.status", "online");
        for n in 0..5000 {
            publisher.extend([2 * n, 2 * n + 1]);
        }
        publisher.push(Message::retained("t/document", "last"));
        let counts = publisher.finish();
        listener.wait_for("t.status", "offline");
        assert_eq!(listener.under("t.n"), (0..10_000).map(|n| n.to_string()).collect::<Vec<_>>());
        assert_eq!(listener.under("t.document"), ["last"]);
        assert_eq!((counts.messages, counts.dropped, counts.connections), (10_001, 0, 1));
    }
}

#[test]
fn retained_messages_are_repeated_until_forgotten() {
    let Some(nats) = NatsServer::open() else { return };
    let early = nats.listen();
    let options = Options { keep_alive: Duration::from_secs(1), ..options() };
    let publisher = publisher(broker(nats.port), options, Qos::AtMostOnce);
    publisher.push(Message::retained("t/document", "old"));
    publisher.push(Message::retained("t/gone", "here"));
    publisher.push(Message::retained("t/document", "new"));
    publisher.push(Message::retained("t/gone", ""));
    early.wait_for("t.document", "new");
    let late = nats.listen();
    late.wait_for("t.status", "online");
    late.wait_for("t.document", "new");
    wait_until("another sign of life", || late.under("t.status").len() > 2);
    assert_eq!(early.under("t.gone"), ["here"], "nothing is there to be forgotten by an empty message");
    assert!(late.under("t.gone").is_empty() && !late.under("t.document").contains(&"old".to_owned()));
    assert_eq!((publisher.counts().messages, publisher.counts().dropped), (4, 0));
}

#[test]
fn returning_servers_get_newest_and_retained_messages() {
    for qos in QUALITIES {
        let Some(mut nats) = NatsServer::open() else { return };
        let early = nats.listen();
        let gate = Gate::to(nats.port);
        let mut publisher = publisher(broker(gate.port), Options { capacity: 100, ..options() }, qos);
        publisher.push(Message::retained("t/document", "one"));
        publisher.extend(0..50);
        early.wait_for("t.n", "49");
        early.wait_for("t.document", "one");
        nats.kill();
        gate.set_open(false);
        publisher.extend(50..1000);
        wait_until("attempts that fail", || publisher.counts().failed_attempts > 1);
        publisher.extend(1000..1100);
        assert_eq!(publisher.counts().messages, 1101);
        nats.again();
        // The listener is back before the publisher.
        let back = nats.listen();
        gate.set_open(true);
        back.wait_for("t.n", "1099");
        back.wait_for("t.document", "one");
        publisher.extend(1100..1110);
        let counts = publisher.finish();
        back.wait_for("t.status", "offline");
        let heard = [early.under("t.n"), back.under("t.n")].concat();
        let heard: BTreeSet<u32> = heard.iter().map(|n| n.parse().unwrap()).collect();
        // Nothing is lost unnoticed; of what arrived, only what was not confirmed in time may count as dropped.
        let lost = counts.messages - 1 - heard.len() as u64;
        assert!((lost..=lost + 50).contains(&counts.dropped), "{lost} lost, {counts:?}");
        assert!((1000..1110).all(|n| heard.contains(&n)), "the newest are kept: {heard:?}");
        assert!(counts.dropped >= 800 && counts.connections == 2, "{counts:?}");
    }
}

#[test]
#[cfg(unix)]
fn stalled_servers_are_noticed_in_bounded_memory() {
    let Some(nats) = NatsServer::open() else { return };
    let listener = nats.listen();
    let mut publisher = publisher(broker(nats.port), Options { capacity: 100, ..options() }, Qos::AtLeastOnce);
    publisher.extend(0..10);
    listener.wait_for("t.n", "9");
    nats.hang(true);
    for n in 10..5000 {
        publisher.extend([n]);
    }
    wait_until("an attempt that fails", || publisher.counts().failed_attempts > 0);
    let counts = publisher.counts();
    assert_eq!((counts.messages, counts.dropped), (5000, 4890), "all but what can wait and what was confirmed");
    nats.hang(false);
    let counts = publisher.finish();
    listener.wait_for("t.status", "offline");
    assert_eq!((counts.dropped, counts.connections), (4890, 2));
    let heard: BTreeSet<u32> = listener.under("t.n").iter().map(|n| n.parse().unwrap()).collect();
    assert!((4900..5000).all(|n| heard.contains(&n)), "{heard:?}");
}

#[cfg(unix)]
impl publishers::Fallible for NatsServer {
    /// A server confirms what was written before the last question, which may be all: heard is not confirmed.
    const UNSURE: u64 = 401;

    fn open() -> Option<Self> {
        Self::open()
    }

    fn port(&self) -> u16 {
        self.port
    }

    fn broker(port: u16) -> Broker {
        broker(port)
    }

    fn subject(topic: &str) -> String {
        topic.replace('/', ".")
    }

    fn listen(&self) -> common::Listener {
        self.listen()
    }

    fn kill(&mut self) {
        self.kill();
    }

    fn again(&mut self) {
        self.again();
    }

    fn hang(&self, is_hung: bool) {
        NatsServer::hang(self, is_hung);
    }
}

#[cfg(unix)]
#[test]
fn whenever_a_server_fails_the_truth_is_told() {
    publishers::whenever_it_fails_the_truth_is_told::<NatsServer>();
}

#[test]
fn messages_wait_for_a_server_that_comes_later() {
    let Some(mut nats) = NatsServer::open() else { return };
    nats.kill();
    let gate = Gate::to(nats.port);
    let mut publisher = publisher(broker(gate.port), options(), Qos::AtLeastOnce);
    publisher.extend(0..20);
    wait_until("an attempt that fails", || publisher.counts().failed_attempts > 0);
    nats.again();
    let listener = nats.listen();
    let counts = publisher.finish();
    listener.wait_for("t.status", "offline");
    assert_eq!((counts.messages, counts.dropped), (20, 0), "{counts:?}");
    // The listener may have come while the publisher was already trying.
    assert!(listener.under("t.n").len() <= 20);
}

#[test]
fn a_wrong_password_is_said_and_never_shown() {
    let Some(nats) = NatsServer::start(|_| "authorization { user: me, password: sesame }".to_owned()) else { return };
    publishers::a_wrong_password_is_said_and_never_shown(&broker(nats.port));
}

#[test]
fn a_token_stands_for_a_user() {
    let Some(nats) = NatsServer::start(|_| "authorization { token: sesame }".to_owned()) else { return };
    for (token, is_right) in [("sesame", true), ("wrong-secret", false)] {
        let mut publisher =
            publisher(Broker { login: login("", token), ..broker(nats.port) }, options(), Qos::AtMostOnce);
        publisher.extend(0..10);
        assert_eq!(publisher.finish().dropped, if is_right { 0 } else { 10 });
        assert_eq!(publisher.check().is_ok(), is_right);
    }
}

/// Users who may do only so much.
fn users() -> Option<NatsServer> {
    let user = |name: &str, may: &str| format!("{{ user: {name}, password: pw, permissions: {{ publish: [{may}] }} }}");
    let all = [user("watcher", "\"t.>\""), user("half", "\"t.status\", \"_INBOX.>\""), user("other", "\"u.>\"")];
    NatsServer::start(|_| format!("authorization {{ users: [ {{ user: all, password: pw }}, {} ] }}", all.join(", ")))
}

#[test]
fn servers_without_inbox_get_everything() {
    let Some(nats) = users() else { return };
    let listener = nats.listen_as("\"user\":\"all\",\"pass\":\"pw\",");
    let mut publisher =
        publisher(Broker { login: login("watcher", "pw"), ..broker(nats.port) }, options(), Qos::AtLeastOnce);
    publisher.extend(0..5000);
    let counts = publisher.finish();
    listener.wait_for("t.status", "offline");
    assert_eq!(listener.under("t.n"), (0..5000).map(|n| n.to_string()).collect::<Vec<_>>());
    assert_eq!((counts.dropped, counts.connections, counts.failed_attempts), (0, 1, 0));
}

#[test]
fn forbidden_messages_are_reported_and_counted() {
    let Some(nats) = users() else { return };
    let with =
        |user: &str| publisher(Broker { login: login(user, "pw"), ..broker(nats.port) }, options(), Qos::AtMostOnce);
    let mut other = with("other");
    other.extend(0..10);
    assert_eq!(other.finish().dropped, 10);
    let error = other.check().unwrap_err().to_string();
    assert!(error.contains("does not allow publishing under `t.status`"), "{error}");
    let mut half = with("half");
    half.extend(0..10);
    assert_eq!(half.finish().dropped, 10);
    half.check().unwrap();
}

#[test]
fn servers_that_are_no_brokers_hold_nothing_up() {
    let answers: [(&str, &[u8], bool); 6] = [
        ("silent", b"", false),
        ("garbage", b"\xff\xff\xff\xff\xff\xff\r\n\xff\xff\r\n", true),
        ("http", b"HTTP/1.1 400 Bad Request\r\n\r\n", true),
        ("half", b"INFO {\"server_id\":\r\n", true),
        // Nobody who was asked for says such a thing.
        ("early", b"PONG\r\n", true),
        // A message of the greatest length there is, of which nothing comes, for nobody.
        ("confused", b"INFO {\"server_id\":\"x\",\"max_payload\":100}\r\nPONG\r\nMSG a 9 99999999999\r\n", false),
    ];
    publishers::servers_that_are_no_brokers_hold_nothing_up(broker, &answers, false);
}

#[test]
fn ending_without_server_is_quick() {
    publishers::ending_without_broker_is_quick(broker);
}

/// What the guide says of whoever wants retained messages: a stream of the server keeps the last of each subject.
#[test]
fn a_stream_keeps_what_mqtt_would_retain() {
    let Some(nats) = NatsServer::start(|folder| format!("jetstream {{ store_dir: \"{}\" }}", folder.display())) else {
        return;
    };
    let stream = r#"{"name":"WATCHERS","subjects":["t.>"],"max_msgs_per_subject":1,"storage":"memory","retention":"limits","discard":"old","num_replicas":1}"#;
    let made = nats.ask("$JS.API.STREAM.CREATE.WATCHERS", stream);
    assert!(!made.contains("\"error\""), "{made}");
    let mut publisher = publisher(broker(nats.port), options(), Qos::AtMostOnce);
    publisher.extend(0..100);
    publisher.push(Message::retained("t/document", "last"));
    assert_eq!(publisher.finish().dropped, 0);
    let last =
        |subject: &str| nats.ask("$JS.API.STREAM.MSG.GET.WATCHERS", &format!(r#"{{"last_by_subj":"{subject}"}}"#));
    // `offline`, `last` and `99` in base 64.
    for (subject, data) in [("t.status", "b2ZmbGluZQ=="), ("t.document", "bGFzdA=="), ("t.n", "OTk=")] {
        let kept = last(subject);
        assert!(kept.contains(&format!("\"data\":\"{data}\"")), "{subject}: {kept}");
    }
}

#[cfg(not(feature = "tls"))]
#[test]
fn what_this_build_lacks_is_said() {
    let secure = Broker::parse("tls://127.0.0.1").unwrap();
    let started = Publisher::<u32>::start(secure, options(), |_| unreachable!());
    assert!(started.err().unwrap().to_string().contains("--features nats,tls"));
}

#[test]
fn demanded_tls_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    if !common::certificates(folder.path()) {
        return;
    }
    let Some(nats) = NatsServer::start(|_| with_tls(folder.path(), false)) else { return };
    let mut publisher = publisher(broker(nats.port), options(), Qos::AtMostOnce);
    publisher.extend(0..10);
    assert_eq!(publisher.finish().dropped, 10);
    let error = publisher.check().unwrap_err().to_string();
    assert!(error.contains(&format!("write tls://127.0.0.1:{}", nats.port)), "{error}");
}

fn with_tls(folder: &std::path::Path, allows_plain: bool) -> String {
    let file = |name: &str| folder.join(name).display().to_string();
    let (certificate, key) = (file("server.crt"), file("server.key"));
    format!("tls {{ cert_file: \"{certificate}\", key_file: \"{key}\" }}\nallow_non_tls: {allows_plain}")
}

#[cfg(feature = "tls")]
#[test]
fn only_certificates_of_the_authority_named_are_trusted() {
    let folder = tempfile::tempdir().unwrap();
    if !common::certificates(folder.path()) {
        return;
    }
    let file = |name: &str| folder.path().join(name);
    let Some(nats) = NatsServer::start(|_| with_tls(folder.path(), true)) else { return };
    let secure = |ca: &str, port: u16| Broker {
        ca_file: Some(file(ca)),
        ..Broker::parse(format!("tls://localhost:{port}")).unwrap()
    };
    let listener = nats.listen();
    let mut right = publisher(secure("ca.crt", nats.port), options(), Qos::AtLeastOnce);
    listener.wait_for("t.status", "online");
    right.extend(0..100);
    assert_eq!(right.finish().dropped, 0);
    listener.wait_for("t.n", "99");
    let mut wrong = publisher(secure("other.crt", nats.port), options(), Qos::AtLeastOnce);
    wrong.finish();
    let error = wrong.check().unwrap_err().to_string();
    assert!(error.contains("certificate is not to be trusted"), "{error}");
    for (name, word) in [("server.key", "there is none"), ("absent.crt", "absent.crt")] {
        let started = Publisher::<u32>::start(secure(name, nats.port), options(), |_| unreachable!());
        let error = started.err().unwrap().to_string();
        assert!(error.contains(word), "{error}");
    }
    // One that speaks no TLS.
    let Some(plain) = NatsServer::open() else { return };
    let mut publisher = publisher(secure("ca.crt", plain.port), options(), Qos::AtLeastOnce);
    let counts = publisher.finish();
    assert!(counts.failed_attempts > 0 && publisher.check().is_ok(), "{counts:?}");
}
