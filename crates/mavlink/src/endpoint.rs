use crate::link::Link;
use crate::wire::{self, Content, Parcel, SigningKey, Unsupported};
use crate::{LinkAddress, MavlinkError, Result};
use mavlink::dialects::common::{HEARTBEAT_DATA, MavAutopilot, MavMessage, MavModeFlag, MavState, MavType};
use mavlink::{MavHeader, Message, SigningData};
use std::sync::atomic::{AtomicU8, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Which component of which vehicle it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Identity {
    /// The vehicle, 1 to 255.
    pub system: u8,
    /// The component, 1 to 255; 100 to 105 are cameras.
    pub component: u8,
}

impl Default for Identity {
    /// The first camera of the first vehicle.
    fn default() -> Self {
        Self { system: 1, component: 100 }
    }
}

/// A message for this endpoint, or for all.
#[derive(Debug, Clone)]
pub struct Incoming {
    /// The sender's system.
    pub system: u8,
    /// The sender's component.
    pub component: u8,
    /// What it says.
    pub message: Arc<MavMessage>,
}

/// What has become of one link.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LinkCounts {
    /// Its address.
    pub link: String,
    /// Valid messages that came.
    pub received: u64,
    /// Messages handed to it.
    pub sent: u64,
    /// Messages dropped because the link did not keep up.
    pub dropped: u64,
    /// How often it was opened.
    pub connections: u64,
}

/// One component of one vehicle, on all its links. Sending never waits; what comes is handed to all who [`listen`](Self::listen).
///
/// It says every second that it is there, answers commands that nobody knows, and ends with the last of its clones.
#[derive(Clone)]
pub struct Endpoint(Arc<Owner>);

/// Ends the threads when the last handle goes.
struct Owner(Arc<Shared>);

struct Shared {
    identity: Identity,
    links: Vec<Arc<Link>>,
    signing: Option<Arc<SigningData>>,
    sequence: AtomicU8,
    listeners: Mutex<Vec<SyncSender<Incoming>>>,
    began: Instant,
}

impl Endpoint {
    /// How often it says that it is there.
    const HEARTBEAT: Duration = Duration::from_secs(1);
    /// How many messages wait for a listener at most; more are dropped for that one.
    const WAITING: usize = 256;
    /// How long the end waits for what is not written yet.
    const LAST_WORD: Duration = Duration::from_millis(200);

    /// Opens the links. With a key everything is signed, and what is not signed by it is ignored.
    ///
    /// # Errors
    /// [`MavlinkError::NoLink`], [`MavlinkError::Identity`], and [`MavlinkError::Io`] for a port that is in use and a serial line that is not there. What may come
    /// back, such as a server that does not answer yet, is no error.
    pub fn start(identity: Identity, links: &[LinkAddress], key: Option<&SigningKey>) -> Result<Self> {
        for (what, value) in [("the system", identity.system), ("the component", identity.component)] {
            if value == 0 {
                return Err(MavlinkError::Identity { what, value });
            }
        }
        if links.is_empty() {
            return Err(MavlinkError::NoLink);
        }
        let links: Vec<_> = links.iter().map(|address| Arc::new(Link::new(address.clone()))).collect();
        let opened = links.iter().map(|link| link.first()).collect::<Result<Vec<_>>>()?;
        let signing = key.map(|key| Arc::new(key.data()));
        let (sequence, listeners) = (AtomicU8::new(0), Mutex::default());
        let shared = Arc::new(Shared { identity, links, signing, sequence, listeners, began: Instant::now() });
        let endpoint = Self(Arc::new(Owner(shared.clone())));
        for (link, first) in shared.links.iter().zip(opened) {
            let theirs = shared.clone();
            link.start(first, shared.signing.clone(), Box::new(move |parcel| theirs.take(parcel)))?;
        }
        // Who it is comes before anything else that it says.
        shared.say_that_it_is_there();
        let beating = shared.clone();
        let beat = std::thread::Builder::new().name("mavlink heartbeat".to_owned()).spawn(move || beating.beat());
        beat.map_err(|source| MavlinkError::Io { link: "MAVLink".to_owned(), doing: "starting a thread", source })?;
        Ok(endpoint)
    }

    /// Who it is.
    pub fn identity(&self) -> Identity {
        self.0.0.identity
    }

    /// Milliseconds since it began, as messages count them.
    pub fn time_boot_ms(&self) -> u32 {
        self.0.0.began.elapsed().as_millis() as u32
    }

    /// Sends to all links; never waits.
    pub fn send(&self, message: &MavMessage) {
        self.0.0.send(message);
    }

    /// What comes from now on, for this endpoint or for all.
    pub fn listen(&self) -> Receiver<Incoming> {
        let (sender, receiver) = sync_channel(Self::WAITING);
        self.0.0.listeners.lock().unwrap_or_else(PoisonError::into_inner).push(sender);
        receiver
    }

    /// What has become of its links.
    pub fn counts(&self) -> Vec<LinkCounts> {
        let one = |link: &Arc<Link>| {
            let (sent, dropped) = link.outbox.counts();
            LinkCounts {
                link: link.address.to_string(),
                received: link.received.load(Ordering::Relaxed),
                sent,
                dropped,
                connections: link.connections.load(Ordering::Relaxed),
            }
        };
        self.0.0.links.iter().map(one).collect()
    }
}

impl Drop for Owner {
    fn drop(&mut self) {
        // The last word, that nothing is tracked any more, shall still go out: a program that ends ends the threads too.
        let deadline = Instant::now() + Endpoint::LAST_WORD;
        self.0.links.iter().for_each(|link| link.outbox.drain(deadline));
        self.0.links.iter().for_each(|link| link.outbox.end());
        // The threads hold what they need; listeners see the end.
        self.0.listeners.lock().unwrap_or_else(PoisonError::into_inner).clear();
    }
}

impl Shared {
    fn header(&self) -> MavHeader {
        let Identity { system, component } = self.identity;
        let sequence = self.sequence.fetch_add(1, Ordering::Relaxed);
        MavHeader { system_id: system.into(), component_id: component, sequence }
    }

    fn send(&self, message: &MavMessage) {
        self.hand_out(&wire::encoded(message, self.header(), self.signing.as_deref()));
    }

    fn hand_out(&self, bytes: &[u8]) {
        let bytes: Arc<[u8]> = Arc::from(bytes);
        self.links.iter().for_each(|link| link.outbox.push(bytes.clone()));
    }

    /// Whether something is for this endpoint; a target of 0 is everybody.
    fn is_meant(&self, system: Option<u8>, component: Option<u8>) -> bool {
        let fits = |target: Option<u8>, own: u8| target.is_none_or(|target| target == 0 || target == own);
        fits(system, self.identity.system) && fits(component, self.identity.component)
    }

    fn take(&self, parcel: Parcel) {
        let Parcel { system, component, content } = parcel;
        let is_own = Identity { system, component } == self.identity;
        match content {
            // A link that loops back brings what was sent.
            _ if is_own => {}
            Content::UnknownCommand { command, target_system, target_component } => {
                // What is for everybody is answered by who knows it.
                if target_component != 0 && self.is_meant(Some(target_system), Some(target_component)) {
                    let answer = Unsupported { command, target_system: system, target_component: component };
                    self.hand_out(&wire::encoded_unsupported(&answer, self.header(), self.signing.as_deref()));
                }
            }
            Content::Message(message) => {
                if self.is_meant(message.target_system_id(), message.target_component_id()) {
                    let incoming = Incoming { system, component, message: Arc::from(message) };
                    let mut listeners = self.listeners.lock().unwrap_or_else(PoisonError::into_inner);
                    listeners.retain(|listener| {
                        !matches!(listener.try_send(incoming.clone()), Err(TrySendError::Disconnected(_)))
                    });
                }
            }
        }
    }

    fn say_that_it_is_there(&self) {
        self.send(&MavMessage::HEARTBEAT(HEARTBEAT_DATA {
            mavtype: MavType::MAV_TYPE_CAMERA,
            autopilot: MavAutopilot::MAV_AUTOPILOT_INVALID,
            base_mode: MavModeFlag::empty(),
            system_status: MavState::MAV_STATE_ACTIVE,
            mavlink_version: 3,
            ..HEARTBEAT_DATA::default()
        }));
    }

    fn beat(&self) {
        let has_ended = || self.links.iter().all(|link| link.outbox.has_ended());
        let mut next = Instant::now() + Endpoint::HEARTBEAT;
        while !has_ended() {
            if Instant::now() >= next {
                self.say_that_it_is_there();
                next = Instant::now() + Endpoint::HEARTBEAT;
            }
            std::thread::sleep(Duration::from_millis(50));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mavlink::dialects::common::{COMMAND_LONG_DATA, MavCmd};
    use std::net::UdpSocket;

    fn free_port() -> u16 {
        UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port()
    }

    fn start(identity: Identity, link: String) -> Endpoint {
        Endpoint::start(identity, &[link.parse().unwrap()], None).unwrap()
    }

    /// Waits for a message that fits.
    fn wait_for(from: &Receiver<Incoming>, fits: impl Fn(&Incoming) -> bool) -> Incoming {
        loop {
            let incoming = from.recv_timeout(Duration::from_secs(20)).unwrap();
            if fits(&incoming) {
                return incoming;
            }
        }
    }

    #[test]
    fn two_endpoints_hear_each_other() {
        let port = free_port();
        let camera = start(Identity::default(), format!("udpin:127.0.0.1:{port}"));
        let heard_by_camera = camera.listen();
        let station = start(Identity { system: 255, component: 190 }, format!("udpout:127.0.0.1:{port}"));
        let heard_by_station = station.listen();
        wait_for(&heard_by_camera, |i| i.system == 255);
        wait_for(&heard_by_station, |i| i.system == 1 && i.component == 100);
        let to = |system, component| {
            let command = MavCmd::MAV_CMD_CAMERA_STOP_TRACKING;
            let (target_system, target_component) = (system, component);
            let data = COMMAND_LONG_DATA { command, target_system, target_component, ..COMMAND_LONG_DATA::default() };
            station.send(&MavMessage::COMMAND_LONG(data));
        };
        to(2, 100);
        to(1, 101);
        to(1, 100);
        let command = wait_for(&heard_by_camera, |i| matches!(*i.message, MavMessage::COMMAND_LONG(_)));
        let MavMessage::COMMAND_LONG(data) = &*command.message else { panic!("it is a command") };
        assert_eq!((data.target_system, data.target_component), (1, 100), "what is for others is left alone");
        drop(camera);
        assert!(heard_by_camera.iter().count() < Endpoint::WAITING + 1, "the end is seen");
    }

    #[test]
    fn what_cannot_be_opened_is_an_error_at_once() {
        let taken = UdpSocket::bind("127.0.0.1:0").unwrap();
        let link = format!("udpin:127.0.0.1:{}", taken.local_addr().unwrap().port());
        let start = |links: &[LinkAddress], identity| Endpoint::start(identity, links, None).map(drop);
        let error = start(&[link.parse().unwrap()], Identity::default()).unwrap_err().to_string();
        assert!(error.contains(&link) && error.contains("opening the link"), "{error}");
        assert!(matches!(start(&[], Identity::default()), Err(MavlinkError::NoLink)));
        let nobody = Identity { system: 0, component: 1 };
        assert!(matches!(start(&[link.parse().unwrap()], nobody), Err(MavlinkError::Identity { .. })));
        let error = start(&["serial:/dev/there-is-none".parse().unwrap()], Identity::default()).unwrap_err();
        assert!(matches!(error, MavlinkError::Io { .. }));
    }
}
