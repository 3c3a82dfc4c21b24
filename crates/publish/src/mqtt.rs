//! MQTT 3.1.1: one connection after the other.

use crate::back_off::BackOff;
use crate::publisher::Link;
use crate::{Message, Qos};
use rumqttc::{
    AsyncClient, ConnectReturnCode, ConnectionError, Event, EventLoop, LastWill, MqttOptions, Outgoing, Packet, QoS,
    Request, StateError, Transport,
};
use std::cell::Cell;
use std::time::{Duration, SystemTime, UNIX_EPOCH};
use tokio::sync::{Notify, watch};
use tokio::time::Instant;

/// Messages handed to the library that it has not sent yet: few, so that what waits can still be dropped.
const WINDOW: u64 = 64;
/// Messages on their way that are not acknowledged: brokers that say nothing of what they hold (3.1.1) may forget more,
/// Mosquitto those of quality 2.
const UNACKNOWLEDGED: u16 = 20;
/// Seconds within which a connection must come about, and the broker must take what it is sent.
const PATIENCE_S: u64 = 5;
/// Bytes of a message that comes in (answers alone do), and of one that goes out.
const LARGEST: (usize, usize) = (64 << 10, 1 << 20);

/// What ends a connection.
enum End {
    /// Everything was sent, and the broker knows that this was all.
    Done,
    /// The time for the end is over.
    Late,
    Broken(Box<ConnectionError>),
}

/// Sends what is in the outbox until that has ended and all is sent, or the time for it is over.
pub(crate) async fn run(link: &Link<'_>, transport: Transport) {
    let (client, mut events) = AsyncClient::new(mqtt_options(link, transport), WINDOW as usize + 1);
    events.network_options.set_connection_timeout(PATIENCE_S);
    let ended = link.outbox.ended();
    let mut back_off = BackOff::new();
    loop {
        let is_last = ended.borrow().is_some();
        let (reason, waits) = match connect(&mut events, &ended, link.options.linger).await {
            End::Done => {
                link.report.connected();
                back_off = BackOff::new();
                match serve(link, &client, &mut events, &ended).await {
                    End::Broken(error) => {
                        let (reason, _) = explain(&error);
                        link.report.broke(&format!("the connection broke off: {reason}"));
                        (reason, true)
                    }
                    _ => return,
                }
            }
            End::Late => return,
            End::Broken(error) => {
                let (reason, for_good) = explain(&error);
                if link.report.failed(&reason, for_good) {
                    return;
                }
                (reason, !is_last)
            }
        };
        if !waits {
            return;
        }
        let wait = back_off.wait();
        tracing::debug!("{}: {reason}; next attempt in {:.1} s", link.report.broker(), wait.as_secs_f64());
        // Once no more comes there is one attempt at once.
        let mut told = ended.clone();
        tokio::select! {
            () = tokio::time::sleep(wait) => {}
            _ = told.wait_for(Option::is_some) => {}
        }
    }
}

fn mqtt_options(link: &Link<'_>, transport: Transport) -> MqttOptions {
    let mut options = MqttOptions::new(client_id(), link.broker.host.clone(), link.broker.port);
    options.set_transport(transport);
    options.set_keep_alive(link.options.keep_alive.max(Duration::from_secs(1)));
    options.set_inflight(UNACKNOWLEDGED);
    options.set_max_packet_size(LARGEST.0, LARGEST.1);
    options.set_last_will(LastWill::new(&link.options.status_topic, "offline", QoS::AtLeastOnce, true));
    if let Some(login) = &link.broker.login {
        options.set_credentials(login.user.clone(), login.password.clone());
    }
    options
}

/// A name that nobody else has: a broker cuts off an earlier client of the same name. At most 23 letters and digits, which
/// every broker takes.
fn client_id() -> String {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |d| d.as_nanos());
    let mixed = (now as u64 ^ u64::from(std::process::id()).rotate_left(40)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    format!("pursuit{mixed:016x}")
}

/// One attempt; [`End::Done`] when there is a connection.
async fn connect(events: &mut EventLoop, ended: &watch::Receiver<Option<std::time::Instant>>, linger: Duration) -> End {
    tokio::select! {
        connected = events.poll() => match connected {
            Ok(_) => End::Done,
            Err(error) => End::Broken(Box::new(error)),
        },
        () = deadline(ended.clone(), linger) => End::Late,
    }
}

/// Comes when the time after the end is over.
async fn deadline(mut ended: watch::Receiver<Option<std::time::Instant>>, linger: Duration) {
    let at = match ended.wait_for(Option::is_some).await {
        Ok(at) => at.map(Instant::from_std),
        Err(_) => None,
    };
    tokio::time::sleep_until(at.unwrap_or_else(Instant::now) + linger).await;
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

    fn note(&self, event: &Event) {
        if let Event::Outgoing(Outgoing::Publish(id)) = event {
            add(&self.written);
            if *id == 0 {
                add(&self.written_unsure);
            }
            self.room.notify_one();
        }
    }
}

/// Sends over a connection that has come about.
async fn serve(
    link: &Link<'_>,
    client: &AsyncClient,
    events: &mut EventLoop,
    ended: &watch::Receiver<Option<std::time::Instant>>,
) -> End {
    let tally = Tally::default();
    let status = |word: &str| Message::retained(&link.options.status_topic, word);
    let feed = async {
        tally.give(client, status("online")).await;
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
        tally.give(client, status("offline")).await;
        std::future::pending::<()>().await;
    };
    let end = tokio::select! {
        biased;
        end = pump(&tally, client, events) => end,
        () = feed => End::Late,
        () = deadline(ended.clone(), link.options.linger) => End::Late,
    };
    if !matches!(end, End::Done) {
        events.clean();
        take_back(link, &tally, events);
    }
    end
}

/// Lets the library work until the connection breaks, or all is sent and acknowledged.
async fn pump(tally: &Tally, client: &AsyncClient, events: &mut EventLoop) -> End {
    let mut said_good_bye = false;
    loop {
        let is_all = tally.ended.get() && tally.handed == tally.written && events.state.inflight() == 0;
        if is_all && !said_good_bye {
            said_good_bye = client.try_disconnect().is_ok();
        }
        match events.poll().await {
            Ok(Event::Outgoing(Outgoing::Disconnect)) => return End::Done,
            Ok(event) => tally.note(&event),
            Err(error) => return End::Broken(Box::new(error)),
        }
    }
}

/// What the connection did not take waits again: the library would forget it with the next connection.
fn take_back(link: &Link<'_>, tally: &Tally, events: &mut EventLoop) {
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
        if publish.topic != link.options.status_topic {
            let payload = publish.payload.to_vec();
            messages.push(Message { topic: publish.topic, payload, qos, retain: publish.retain });
        }
    }
    link.outbox.put_back(messages);
    link.outbox.lose((tally.handed_unsure.get() - tally.written_unsure.get()).saturating_sub(unsure));
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
        ConnectionError::Tls(error) => crate::tls::explain(error),
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
