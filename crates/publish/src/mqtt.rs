//! MQTT 3.1.1.

use crate::address::Broker;
use crate::link::{Connection, Failure, Link, PATIENCE_S, Wire};
use crate::publisher::Options;
use crate::{Message, Qos, Result};
use rumqttc::{
    AsyncClient, ConnectReturnCode, ConnectionError, Event, EventLoop, LastWill, MqttOptions, Outgoing, Packet, QoS,
    Request, StateError, SubscribeFilter, Transport,
};
use std::cell::{Cell, RefCell};
use std::convert::Infallible;
use std::io::ErrorKind;
use std::time::{Duration, SystemTime, UNIX_EPOCH};
use tokio::sync::Notify;

/// Messages handed to the library that it has not sent yet: few, so that what waits can still be dropped.
const WINDOW: u64 = 64;
/// Messages on their way that are not acknowledged: brokers that say nothing of what they hold (3.1.1) may forget more,
/// Mosquitto those of quality 2.
const UNACKNOWLEDGED: u16 = 20;
/// Bytes of a message that comes in (answers, and what a former publisher left), and of one that goes out.
const LARGEST: (usize, usize) = (64 << 10, 1 << 20);

/// Brokers that speak MQTT 3.1.1.
pub(crate) struct Mqtt {
    options: MqttOptions,
    is_plain: bool,
}

impl Mqtt {
    /// # Errors
    /// [`PublishError::Certificates`](crate::PublishError::Certificates).
    pub fn new(broker: &Broker, own: &Options) -> Result<Self> {
        let mut options = MqttOptions::new(client_id(), broker.host.clone(), broker.port);
        options.set_transport(transport(broker)?);
        options.set_keep_alive(own.keep_alive.max(Duration::from_secs(1)));
        options.set_inflight(UNACKNOWLEDGED);
        options.set_max_packet_size(LARGEST.0, LARGEST.1);
        options.set_last_will(LastWill::new(&own.status_topic, "offline", QoS::AtLeastOnce, true));
        if let Some(login) = &broker.login {
            options.set_credentials(login.user.clone(), login.password.clone());
        }
        Ok(Self { options, is_plain: !broker.scheme.is_encrypted() })
    }
}

fn transport(broker: &Broker) -> Result<Transport> {
    #[cfg(feature = "tls")]
    if broker.scheme.is_encrypted() {
        let config = crate::tls::client_config(broker.ca_file.as_deref())?;
        return Ok(Transport::tls_with_config(rumqttc::TlsConfiguration::Rustls(std::sync::Arc::new(config))));
    }
    // Without the feature such brokers were refused before.
    debug_assert!(!broker.scheme.is_encrypted());
    Ok(Transport::tcp())
}

/// A name that nobody else has: a broker cuts off an earlier client of the same name. At most 23 letters and digits, which
/// every broker takes.
fn client_id() -> String {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |d| d.as_nanos());
    let mixed = (now as u64 ^ u64::from(std::process::id()).rotate_left(40)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    format!("pursuit{mixed:016x}")
}

impl Wire for Mqtt {
    type Connection = Session;

    async fn connect(&self, _: &Link<'_>) -> std::result::Result<Session, Failure> {
        let (client, mut events) = AsyncClient::new(self.options.clone(), WINDOW as usize + 1);
        events.network_options.set_connection_timeout(PATIENCE_S);
        match events.poll().await {
            Ok(_) => Ok(Session { client, events, tally: Tally::default() }),
            Err(error) => {
                let (host, port) = self.options.broker_address();
                if self.is_plain && is_strange(&error) && crate::greeting::speaks_tls(&host, port) {
                    return Err((format!("it speaks TLS there; write mqtts://{host}:{port}"), true).into());
                }
                Err(explain(&error).into())
            }
        }
    }
}

/// A connection, and what it was given.
pub(crate) struct Session {
    client: AsyncClient,
    events: EventLoop,
    tally: Tally,
}

/// What a connection was given.
#[derive(Default)]
struct Tally {
    /// Messages handed to the library, and those it has written.
    handed: Cell<u64>,
    written: Cell<u64>,
    /// Those of them that are not acknowledged.
    handed_unsure: Cell<u64>,
    written_unsure: Cell<u64>,
    /// Whether the last message has been handed over.
    ended: Cell<bool>,
    /// Told when there is room for more.
    room: Notify,
    /// Topics under which a former publisher left something, to be made forgotten.
    ghosts: RefCell<Vec<String>>,
}

fn add(count: &Cell<u64>) {
    count.set(count.get() + 1);
}

impl Tally {
    async fn give(&self, client: &AsyncClient, message: Message) {
        while self.handed.get() - self.written.get() >= WINDOW {
            self.room.notified().await;
        }
        let qos = match message.qos {
            Qos::AtMostOnce => QoS::AtMostOnce,
            Qos::AtLeastOnce => QoS::AtLeastOnce,
            Qos::ExactlyOnce => QoS::ExactlyOnce,
        };
        // There is room, and topics were checked: this does not fail.
        if client.try_publish(message.topic, qos, message.retain, message.payload).is_ok() {
            add(&self.handed);
            if qos == QoS::AtMostOnce {
                add(&self.handed_unsure);
            }
        }
    }

    /// Makes the broker forget what a former publisher left, as far as there is room.
    fn lay_ghosts(&self, client: &AsyncClient, link: &Link<'_>) {
        let mut ghosts = self.ghosts.borrow_mut();
        while let Some(topic) = ghosts.pop() {
            // What is said anew under the same topic takes its place anyway.
            if link.outbox.holds(&topic) {
                continue;
            }
            if client.try_publish(&topic, QoS::AtLeastOnce, true, Vec::new()).is_err() {
                ghosts.push(topic);
                return;
            }
            add(&self.handed);
        }
    }

    fn note(&self, event: &Event, link: &Link<'_>) {
        // Only what was there before is handed on as retained.
        if let Event::Incoming(Packet::Publish(left)) = event
            && left.retain
            && !left.payload.is_empty()
            && link.options.own_topics.iter().any(|own| own.is_left(&left.topic, &left.payload))
        {
            self.ghosts.borrow_mut().push(left.topic.clone());
        }
        if let Event::Outgoing(Outgoing::Publish(id)) = event {
            add(&self.written);
            if *id == 0 {
                add(&self.written_unsure);
            }
            self.room.notify_one();
        }
    }
}

impl Connection for Session {
    async fn transfer(&mut self, link: &Link<'_>) -> std::result::Result<(), String> {
        let Self { client, events, tally } = self;
        tokio::select! {
            biased;
            end = pump(link, tally, client, events) => end.map_err(|error| explain(&error).0),
            never = feed(link, tally, client) => match never {},
        }
    }

    /// What waits again would be forgotten with the library's own memory.
    fn take_back(mut self, link: &Link<'_>) {
        let Self { events, tally, .. } = &mut self;
        events.clean();
        events.state.events.clear();
        let collided = events.state.collision.take().map(Request::Publish);
        let kept = std::mem::take(&mut events.pending).into_iter().chain(collided);
        let published = kept.filter_map(|request| match request {
            Request::Publish(publish) => Some(publish),
            _ => None,
        });
        let (mut messages, mut unsure) = (Vec::new(), 0);
        for publish in published {
            let qos = match publish.qos {
                QoS::AtMostOnce => Qos::AtMostOnce,
                QoS::AtLeastOnce => Qos::AtLeastOnce,
                QoS::ExactlyOnce => Qos::ExactlyOnce,
            };
            unsure += u64::from(qos == Qos::AtMostOnce);
            // What would make the broker forget a message that is retained again is not said again.
            let forgets_anew = publish.retain && publish.payload.is_empty() && link.outbox.holds(&publish.topic);
            if publish.topic != link.options.status_topic && !forgets_anew {
                let payload = publish.payload.to_vec();
                messages.push(Message { topic: publish.topic, payload, qos, retain: publish.retain });
            }
        }
        link.outbox.put_back(messages);
        link.outbox.lose((tally.handed_unsure.get() - tally.written_unsure.get()).saturating_sub(unsure));
    }
}

/// Hands the library what is to be sent; does not come back from that.
async fn feed(link: &Link<'_>, tally: &Tally, client: &AsyncClient) -> Infallible {
    let ended = link.outbox.ended();
    // A broker that closes the connection at the question is not asked again.
    let own = &link.options.own_topics;
    if !own.is_empty() && link.report.connections() <= 1 {
        // It is the first request of this connection: there is room.
        let filters = own.iter().map(|own| SubscribeFilter::new(own.filter().to_owned(), QoS::AtLeastOnce));
        let _ = client.try_subscribe_many(filters);
    }
    tally.give(client, link.status("online")).await;
    for document in link.outbox.documents() {
        tally.give(client, document).await;
    }
    loop {
        while tally.handed.get() - tally.written.get() >= WINDOW {
            tally.room.notified().await;
        }
        // News that come between the look and the wait are remembered.
        match link.outbox.take() {
            Some(message) => tally.give(client, message).await,
            None if ended.borrow().is_some() => break,
            None => link.outbox.news().notified().await,
        }
    }
    tally.ended.set(true);
    tally.give(client, link.status("offline")).await;
    std::future::pending().await
}

/// Lets the library work until the connection breaks, or all is sent and acknowledged.
async fn pump(
    link: &Link<'_>,
    tally: &Tally,
    client: &AsyncClient,
    events: &mut EventLoop,
) -> std::result::Result<(), ConnectionError> {
    let mut said_good_bye = false;
    loop {
        tally.lay_ghosts(client, link);
        let is_all = tally.ended.get() && tally.handed == tally.written && events.state.inflight() == 0;
        if is_all && !said_good_bye {
            said_good_bye = client.try_disconnect().is_ok();
        }
        match events.poll().await? {
            Event::Outgoing(Outgoing::Disconnect) => return Ok(()),
            event => tally.note(&event, link),
        }
    }
}

/// Whether somebody is there who does not answer as a broker does.
fn is_strange(error: &ConnectionError) -> bool {
    let is_cut = |io: &std::io::Error| {
        matches!(io.kind(), ErrorKind::UnexpectedEof | ErrorKind::ConnectionReset | ErrorKind::ConnectionAborted)
    };
    match error {
        ConnectionError::MqttState(StateError::Deserialization(rumqttc::mqttbytes::Error::Io(io)))
        | ConnectionError::MqttState(StateError::Io(io))
        | ConnectionError::Io(io) => is_cut(io),
        ConnectionError::MqttState(StateError::Deserialization(_) | StateError::ConnectionAborted)
        | ConnectionError::NotConnAck(_)
        | ConnectionError::NetworkTimeout => true,
        _ => false,
    }
}

/// What went wrong, in words, and whether trying again is of no use.
fn explain(error: &ConnectionError) -> (String, bool) {
    use ConnectReturnCode::{BadClientId, BadUserNamePassword, NotAuthorized, RefusedProtocolVersion};
    match error {
        ConnectionError::ConnectionRefused(BadUserNamePassword | NotAuthorized) => {
            ("the broker does not accept the user or the password".to_owned(), true)
        }
        ConnectionError::ConnectionRefused(RefusedProtocolVersion) => {
            ("the broker does not speak MQTT 3.1.1".to_owned(), true)
        }
        ConnectionError::ConnectionRefused(BadClientId) => {
            ("the broker does not accept names of clients that it does not know".to_owned(), true)
        }
        ConnectionError::ConnectionRefused(_) => ("the broker is not ready".to_owned(), false),
        ConnectionError::NetworkTimeout | ConnectionError::FlushTimeout => {
            (format!("no answer within {PATIENCE_S} s"), false)
        }
        ConnectionError::NotConnAck(Packet::ConnAck(_)) => ("the broker is not ready".to_owned(), false),
        ConnectionError::NotConnAck(_) => ("what answers there does not speak MQTT".to_owned(), false),
        ConnectionError::MqttState(StateError::Deserialization(rumqttc::mqttbytes::Error::Io(io))) => {
            (io.to_string(), false)
        }
        ConnectionError::MqttState(StateError::Deserialization(_)) => {
            ("what answers there does not speak MQTT".to_owned(), false)
        }
        ConnectionError::MqttState(StateError::ConnectionAborted) => ("it closed the connection".to_owned(), false),
        ConnectionError::MqttState(StateError::AwaitPingResp) => ("it gives no sign of life".to_owned(), false),
        ConnectionError::MqttState(StateError::Io(io)) | ConnectionError::Io(io) => (io.to_string(), false),
        #[cfg(feature = "tls")]
        ConnectionError::Tls(error) => explain_tls(error),
        other => (other.to_string(), false),
    }
}

#[cfg(feature = "tls")]
fn explain_tls(error: &rumqttc::TlsError) -> (String, bool) {
    use rumqttc::TlsError;
    match error {
        TlsError::TLS(error) => crate::tls::explain(error),
        TlsError::Io(io) => crate::tls::explain_io(io),
        TlsError::DNSName(_) => ("the broker's name is none that a certificate can have".to_owned(), true),
        other => (other.to_string(), false),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_broker_takes_the_name() {
        let id = client_id();
        assert!(id.len() <= 23 && id.chars().all(|c| c.is_ascii_alphanumeric()), "{id}");
    }
}
