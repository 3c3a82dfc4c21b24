//! What every kind of broker must do.

use crate::common::{free_port, server, wait_until};
use pursuit_publish::{Broker, Counts, Login, Message, Options, PublishError, Publisher, Qos};
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
