//! Against a real broker, which is killed and returns, and against servers that are none.
#![cfg(feature = "mqtt")]
#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;
#[path = "common/publishers.rs"]
mod publishers;

use common::{Gate, Mosquitto, wait_until};
use publishers::{options, publisher};
use pursuit_publish::{Broker, Message, Options, OwnTopics, Publisher, Qos};
use std::collections::BTreeSet;

fn broker(port: u16) -> Broker {
    Broker::parse(format!("mqtt://127.0.0.1:{port}")).unwrap()
}

/// Leaves something for listeners that come.
fn marker(port: u16) {
    let mut publisher =
        publisher(broker(port), Options { status_topic: "m/status".into(), ..options() }, Qos::AtLeastOnce);
    publisher.push(Message::retained("marker", "here"));
    assert_eq!(publisher.finish().dropped, 0);
}

#[test]
fn messages_arrive_once_in_order_at_every_quality() {
    for qos in [Qos::AtMostOnce, Qos::AtLeastOnce, Qos::ExactlyOnce] {
        let Some(mosquitto) = Mosquitto::open() else { return };
        let listener = mosquitto.listen(&[]);
        let mut publisher = publisher(broker(mosquitto.port), options(), qos);
        listener.wait_for("t/status", "online");
        for n in 0..500 {
            publisher.extend([2 * n, 2 * n + 1]);
        }
        publisher.push(Message::retained("t/document", "last"));
        let counts = publisher.finish();
        listener.wait_for("t/status", "offline");
        // Of quality 2 the last is heard after two more exchanges, and so after the end of less quality.
        listener.wait_for("t/n", "999");
        assert_eq!(listener.under("t/n"), (0..1000).map(|n| n.to_string()).collect::<Vec<_>>());
        assert_eq!((counts.messages, counts.dropped, counts.connections), (1001, 0, 1));
        let late = mosquitto.listen(&[]);
        late.wait_for("t/status", "offline");
        late.wait_for("t/document", "last");
        assert!(late.heard().iter().all(|h| h.is_old), "{:?}", late.heard());
    }
}

#[test]
fn returning_brokers_get_newest_and_retained_messages() {
    let Some(mut mosquitto) = Mosquitto::open() else { return };
    let early = mosquitto.listen(&[]);
    let gate = Gate::to(mosquitto.port);
    let mut publisher = publisher(broker(gate.port), Options { capacity: 100, ..options() }, Qos::AtLeastOnce);
    publisher.push(Message::retained("t/document", "one"));
    publisher.extend(0..50);
    early.wait_for("t/n", "49");
    early.wait_for("t/document", "one");
    mosquitto.kill();
    gate.set_open(false);
    publisher.extend(50..1000);
    wait_until("attempts that fail", || publisher.counts().failed_attempts > 1);
    assert_eq!(publisher.counts().messages, 1001);
    mosquitto.again();
    // The listener is back before the publisher.
    marker(mosquitto.port);
    early.wait_for("marker", "here");
    gate.set_open(true);
    early.wait_for("t/n", "999");
    publisher.extend(1000..1010);
    let counts = publisher.finish();
    early.wait_for("t/status", "offline");
    let heard: BTreeSet<u32> = early.under("t/n").iter().map(|n| n.parse().unwrap()).collect();
    // Nothing is lost unnoticed; of what arrived, only the few may count as dropped that were not acknowledged in time.
    let lost = counts.messages - 1 - heard.len() as u64;
    assert!((lost..=lost + 20).contains(&counts.dropped), "{lost} lost, {counts:?}");
    assert!((950..1010).all(|n| heard.contains(&n)), "the newest are kept: {heard:?}");
    assert!(counts.dropped >= 800 && counts.connections == 2, "{counts:?}");
    // The broker had forgotten it.
    mosquitto.listen(&[]).wait_for("t/document", "one");
}

#[test]
fn messages_wait_for_a_broker_that_comes_later() {
    let Some(mut mosquitto) = Mosquitto::open() else { return };
    mosquitto.kill();
    let mut publisher = publisher(broker(mosquitto.port), options(), Qos::AtLeastOnce);
    publisher.extend(0..20);
    publisher.push(Message::retained("t/document", "old"));
    publisher.push(Message::retained("t/document", "new"));
    wait_until("an attempt that fails", || publisher.counts().failed_attempts > 0);
    mosquitto.again();
    let counts = publisher.finish();
    assert_eq!((counts.messages, counts.dropped), (22, 0), "{counts:?}");
    mosquitto.listen(&[]).wait_for("t/document", "new");
}

#[test]
fn what_a_former_publisher_left_is_forgotten() {
    let Some(mosquitto) = Mosquitto::open() else { return };
    let mut former = publisher(broker(mosquitto.port), options(), Qos::AtLeastOnce);
    for n in 0..200 {
        former.push(Message::retained(format!("t/targets/{n}/state"), "present"));
    }
    former.push(Message::retained("t/other/1/state", "stays"));
    for n in 0..60 {
        former.push(Message::retained(format!("t/numbers/{n}"), n.to_string()));
    }
    assert_eq!(former.finish().dropped, 0);
    let odd = OwnTopics::those("t/numbers/+", |payload| payload.last().is_some_and(|digit| digit % 2 == 1));
    let own = Options { own_topics: vec![OwnTopics::all("t/targets/+/state"), odd], ..options() };
    let mut next = publisher(broker(mosquitto.port), own, Qos::AtLeastOnce);
    next.push(Message::retained("t/targets/7/state", "new"));
    let counts = next.finish();
    assert_eq!((counts.messages, counts.dropped), (1, 0), "{counts:?}");
    let fresh = mosquitto.listen(&[]);
    fresh.wait_for("t/status", "offline");
    // What is said now comes after everything that was left.
    let mut last = publisher(broker(mosquitto.port), options(), Qos::AtLeastOnce);
    last.push(Message::retained("t/end", "here"));
    assert_eq!(last.finish().dropped, 0);
    fresh.wait_for("t/end", "here");
    let left: BTreeSet<String> =
        fresh.heard().iter().filter(|h| h.is_old && h.topic != "t/status").map(|h| h.topic.clone()).collect();
    let even = (0..60).step_by(2).map(|n| format!("t/numbers/{n}"));
    let stays: BTreeSet<String> = even.chain(["t/other/1/state".into(), "t/targets/7/state".into()]).collect();
    assert_eq!(left, stays);
}

#[cfg(unix)]
impl publishers::Fallible for Mosquitto {
    /// The library's window of messages that are not acknowledged, and what it was about to send.
    const UNSURE: u64 = 21;

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
        topic.to_owned()
    }

    fn listen(&self) -> common::Listener {
        let listener = self.listen(&[]);
        marker(self.port);
        listener.wait_for("marker", "here");
        listener
    }

    fn kill(&mut self) {
        self.kill();
    }

    fn again(&mut self) {
        self.again();
    }

    fn hang(&self, is_hung: bool) {
        self.hang(is_hung);
    }
}

#[cfg(unix)]
#[test]
fn whenever_a_broker_fails_the_truth_is_told() {
    publishers::whenever_it_fails_the_truth_is_told::<Mosquitto>();
}

#[test]
fn a_wrong_password_is_said_and_never_shown() {
    let Some(mosquitto) = Mosquitto::with_password() else { return };
    publishers::a_wrong_password_is_said_and_never_shown(&broker(mosquitto.port));
}

#[test]
fn servers_that_are_no_brokers_hold_nothing_up() {
    let answers: [(&str, &[u8], bool); 5] = [
        ("silent", b"", false),
        ("garbage", &[0xff; 300], true),
        ("http", b"HTTP/1.1 400 Bad Request\r\n\r\n", true),
        // A packet of the greatest length there is, of which nothing comes.
        ("endless", &[0x20, 0xff, 0xff, 0xff, 0x7f], true),
        // An acknowledgement of a message that was never sent, after one of the connection.
        ("confused", &[0x20, 2, 0, 0, 0x40, 2, 0, 9], true),
    ];
    publishers::servers_that_are_no_brokers_hold_nothing_up(broker, &answers, true);
}

#[test]
fn ending_without_broker_is_quick() {
    publishers::ending_without_broker_is_quick(broker);
}

#[cfg(not(feature = "tls"))]
#[test]
fn what_this_build_lacks_is_said() {
    let secure = Broker::parse("mqtts://127.0.0.1").unwrap();
    let started = Publisher::<u32>::start(secure, options(), |_| unreachable!());
    assert!(started.err().unwrap().to_string().contains("--features mqtts"));
}

#[cfg(feature = "tls")]
mod tls {
    use super::*;
    use common::{certificates, server};

    #[test]
    fn only_certificates_of_the_authority_named_are_trusted() {
        let folder = tempfile::tempdir().unwrap();
        if !certificates(folder.path()) {
            return;
        }
        let file = |name: &str| folder.path().join(name);
        let Some(mosquitto) = Mosquitto::start(|_| {
            format!(
                "allow_anonymous true\ncafile {}\ncertfile {}\nkeyfile {}",
                file("ca.crt").display(),
                file("server.crt").display(),
                file("server.key").display()
            )
        }) else {
            return;
        };
        let secure = |ca: &str| Broker {
            ca_file: Some(file(ca)),
            ..Broker::parse(format!("mqtts://localhost:{}", mosquitto.port)).unwrap()
        };
        let listener = mosquitto.listen(&["--cafile", file("ca.crt").to_str().unwrap()]);
        let mut right = publisher(secure("ca.crt"), options(), Qos::AtLeastOnce);
        listener.wait_for("t/status", "online");
        right.extend(0..100);
        assert_eq!(right.finish().dropped, 0);
        listener.wait_for("t/n", "99");
        // Spoken to plainly, it is told what is there.
        let plainly = Broker::parse(format!("mqtt://localhost:{}", mosquitto.port)).unwrap();
        let mut plain = publisher(plainly, options(), Qos::AtLeastOnce);
        plain.finish();
        let error = plain.check().unwrap_err().to_string();
        assert!(error.contains(&format!("write mqtts://localhost:{}", mosquitto.port)), "{error}");
        let mut wrong = publisher(secure("other.crt"), options(), Qos::AtLeastOnce);
        wrong.finish();
        let error = wrong.check().unwrap_err().to_string();
        assert!(error.contains("certificate is not to be trusted"), "{error}");
        for (name, word) in [("server.key", "there is none"), ("absent.crt", "absent.crt")] {
            let started = Publisher::<u32>::start(secure(name), options(), |_| unreachable!());
            let error = started.err().unwrap().to_string();
            assert!(error.contains(word), "{error}");
        }
        // A broker that speaks no TLS.
        let plain = Broker {
            ca_file: Some(file("ca.crt")),
            ..Broker::parse(format!("mqtts://localhost:{}", server(b"\x20\x02\x00\x00"))).unwrap()
        };
        let mut publisher = publisher(plain, options(), Qos::AtLeastOnce);
        let counts = publisher.finish();
        assert!(counts.failed_attempts > 0 && publisher.check().is_ok(), "{counts:?}");
    }
}
