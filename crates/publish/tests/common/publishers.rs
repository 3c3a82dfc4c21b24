//! What every kind of broker must do.

#[cfg(unix)]
use crate::common::{Gate, Listener};
use crate::common::{free_port, server, wait_until};
use pursuit_publish::{Broker, Counts, Login, Message, Options, PublishError, Publisher, Qos};
#[cfg(unix)]
use std::collections::BTreeSet;
use std::time::Duration;

pub fn options() -> Options {
    Options { linger: Duration::from_secs(30), ..Options::new("t/status") }
}

/// One whose messages are numbers under `t/n`.
pub fn publisher(broker: Broker, options: Options, qos: Qos) -> Publisher<u32> {
    let encode = move |n: u32| Message { topic: "t/n".into(), payload: n.to_string().into(), qos, retain: false };
    Publisher::start(broker, options, encode).unwrap()
}

pub fn login(user: &str, password: &str) -> Option<Login> {
    Some(Login { user: user.into(), password: password.into() })
}

/// Of a broker that knows the user `me` with the password `sesame`.
pub fn a_wrong_password_is_said_and_never_shown(broker: &Broker) {
    let with = |password: &str| {
        publisher(Broker { login: login("me", password), ..broker.clone() }, options(), Qos::AtMostOnce)
    };
    let mut right = with("sesame");
    right.extend(0..10);
    assert_eq!(right.finish().dropped, 0);
    right.check().unwrap();
    let mut wrong = with("wrong-secret");
    wrong.extend(0..10);
    assert_eq!(wrong.finish().dropped, 10);
    let error = wrong.check().unwrap_err();
    assert!(matches!(error, PublishError::Refused { .. }));
    let text = format!("{error} {error:?}");
    assert!(text.contains("user or the password") && text.contains("me@127.0.0.1"), "{text}");
    assert!(!text.contains("wrong-secret"), "{text}");
}

/// Of servers that answer so, of which some are given up; `connects` where an answer may pass for a broker's at first.
pub fn servers_that_are_no_brokers_hold_nothing_up(
    broker: impl Fn(u16) -> Broker,
    answers: &[(&str, &'static [u8], bool)],
    connects: bool,
) {
    for &(name, answer, is_given_up) in answers {
        let options = Options { capacity: 100, linger: Duration::from_millis(500), ..Options::new("t/status") };
        let mut publisher = publisher(broker(server(answer)), options, Qos::AtLeastOnce);
        publisher.extend(0..1000);
        let attempts = |counts: &Counts| counts.failed_attempts + if connects { counts.connections } else { 0 };
        if is_given_up {
            wait_until(name, || attempts(&publisher.counts()) > 1);
        }
        let counts = publisher.finish();
        assert_eq!((counts.messages, counts.dropped), (1000, 1000), "{name}: {counts:?}");
        assert!(connects || counts.connections == 0, "{name}: {counts:?}");
        assert!(publisher.check().is_ok(), "{name}");
    }
}

pub fn ending_without_broker_is_quick(broker: impl Fn(u16) -> Broker) {
    let mut publisher = publisher(broker(free_port()), options(), Qos::AtMostOnce);
    publisher.extend(0..10);
    // Far less than `linger`: a broker that is not there after one more attempt is given up.
    let counts = publisher.finish();
    assert_eq!((counts.messages, counts.dropped, counts.connections), (10, 10, 0));
    assert!(counts.failed_attempts >= 1);
}

/// A broker that can be made to fail.
#[cfg(unix)]
pub trait Fallible: Sized {
    /// How many messages may have arrived that were not confirmed before it failed.
    const UNSURE: u64;

    /// `None` where it is not installed, which is said.
    fn open() -> Option<Self>;
    fn port(&self) -> u16;
    fn broker(port: u16) -> Broker;
    /// How a topic is called where it is heard.
    fn subject(topic: &str) -> String;
    /// A listener that listens when this returns.
    fn listen(&self) -> Listener;
    fn kill(&mut self);
    fn again(&mut self);
    fn hang(&self, is_hung: bool);
}

/// Killed and hung at the start, in the middle and at the end of a publisher's life, and back again or not.
#[cfg(unix)]
pub fn whenever_it_fails_the_truth_is_told<F: Fallible>() {
    #[derive(Debug, Clone, Copy, PartialEq)]
    enum When {
        Start,
        Middle,
        End,
    }
    for (when, is_killed, returns) in [
        (When::Start, true, true),
        (When::Start, false, true),
        (When::Middle, true, true),
        (When::Middle, false, true),
        (When::Middle, true, false),
        (When::Middle, false, false),
        (When::End, true, false),
        (When::End, false, false),
        (When::End, false, true),
    ] {
        let what = format!(
            "{when:?}, {}, {}",
            if is_killed { "killed" } else { "hung" },
            if returns { "returns" } else { "stays away" }
        );
        let Some(mut broker) = F::open() else { return };
        let (numbers, status) = (F::subject("t/n"), F::subject("t/status"));
        let (mut listeners, gate) = (vec![broker.listen()], Gate::to(broker.port()));
        let fail = |broker: &mut F| {
            if is_killed {
                gate.set_open(false);
                broker.kill();
            } else {
                broker.hang(true);
            }
        };
        // Somebody listens again before the publisher is back.
        let mend = |broker: &mut F, listeners: &mut Vec<Listener>| {
            if is_killed {
                broker.again();
                listeners.push(broker.listen());
                gate.set_open(true);
            } else {
                broker.hang(false);
            }
        };
        if when == When::Start {
            fail(&mut broker);
        }
        let own = Options { linger: Duration::from_secs(2), ..options() };
        let mut publisher = publisher(F::broker(gate.port), own, Qos::AtLeastOnce);
        publisher.push(Message::retained("t/document", "one"));
        publisher.extend(0..200);
        if when != When::Start {
            listeners.last().unwrap().wait_for(&numbers, "199");
        }
        if when == When::Middle {
            fail(&mut broker);
        }
        publisher.extend(200..400);
        if when == When::End {
            listeners.last().unwrap().wait_for(&numbers, "399");
            fail(&mut broker);
            publisher.extend(400..600);
        } else if returns {
            mend(&mut broker, &mut listeners);
            listeners.last().unwrap().wait_for(&numbers, "399");
        }
        let began = std::time::Instant::now();
        let counts = std::thread::scope(|scope| {
            let ending = scope.spawn(|| publisher.finish());
            if when == When::End && returns {
                std::thread::sleep(Duration::from_millis(500));
                mend(&mut broker, &mut listeners);
            }
            ending.join().unwrap()
        });
        assert!(began.elapsed().as_secs() < 8, "{what}: it ends");
        if when == When::End || !returns {
            mend(&mut broker, &mut listeners);
        }
        // Whoever comes now finds nobody who seems to be there.
        let fresh = broker.listen();
        let last = Options { status_topic: "m/status".into(), ..options() };
        let mut other = self::publisher(F::broker(broker.port()), last, Qos::AtLeastOnce);
        other.push(Message { retain: false, ..Message::retained("all", "heard") });
        assert_eq!(other.finish().dropped, 0);
        let live = listeners.last().unwrap();
        [live, &fresh].into_iter().for_each(|listener| listener.wait_for(&F::subject("all"), "heard"));
        let said = fresh.under(&status);
        assert!(said.last().is_none_or(|last| last == "offline"), "{what}: {said:?}");
        let heard: BTreeSet<u32> =
            listeners.iter().flat_map(|l| l.under(&numbers)).map(|n| n.parse().unwrap()).collect();
        let lost = counts.messages - 1 - heard.len() as u64;
        // The document may be lost as well.
        assert!((lost..=lost + F::UNSURE).contains(&counts.dropped), "{what}: {lost} lost, {counts:?}");
        assert!(returns || counts.dropped >= 150, "{what}: {counts:?}");
        assert!(!returns || when == When::End || counts.dropped == 0 || is_killed, "{what}: {counts:?}");
    }
}
