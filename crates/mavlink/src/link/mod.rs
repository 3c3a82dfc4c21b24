//! One link: connected to again and again, with a thread that reads and one that writes, so that a slow line delays nobody.

mod connection;
mod outbox;
mod peers;

pub(crate) use connection::Connection;
pub(crate) use outbox::Outbox;

use crate::wire::{self, Parcel};
use crate::{LinkAddress, Result};
use mavlink::{MavlinkReader, SigningData};
use std::io::{self, ErrorKind};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// How long a read waits before it is looked whether to end.
pub(crate) const GLANCE: Duration = Duration::from_millis(100);
/// The longest wait between two attempts to connect.
const LONGEST_WAIT: Duration = Duration::from_secs(5);

/// One link and what waits for it.
pub(crate) struct Link {
    pub address: LinkAddress,
    pub outbox: Outbox,
    writer: Mutex<Option<connection::Writer>>,
    pub received: AtomicU64,
    pub connections: AtomicU64,
}

impl Link {
    pub fn new(address: LinkAddress) -> Self {
        let (outbox, writer) = (Outbox::default(), Mutex::new(None));
        Self { address, outbox, writer, received: AtomicU64::new(0), connections: AtomicU64::new(0) }
    }

    /// The first attempt: what trying again does not mend is an error, such as a port in use or a device that is not there.
    pub fn first(&self) -> Result<Option<Connection>> {
        match Connection::open(&self.address) {
            Ok(connection) => Ok(Some(connection)),
            Err(source) if matches!(self.address, LinkAddress::UdpIn { .. } | LinkAddress::Serial { .. }) => {
                Err(crate::MavlinkError::Io { link: self.address.to_string(), doing: "opening the link", source })
            }
            Err(error) => {
                tracing::warn!("{}: {error}; it is tried again", self.address);
                Ok(None)
            }
        }
    }

    /// Reads for ever, connecting again where the link breaks; `take` is given each message.
    fn read(&self, first: Option<connection::Reader>, signing: Option<&SigningData>, take: &dyn Fn(Parcel)) {
        let mut reader = first;
        let mut wait = GLANCE;
        while !self.outbox.has_ended() {
            let Some(open) = reader.take() else {
                self.outbox.rest(wait);
                wait = (2 * wait).min(LONGEST_WAIT);
                reader = Connection::open(&self.address).ok().and_then(|connection| self.opened(connection));
                continue;
            };
            wait = GLANCE;
            self.connections.fetch_add(1, Ordering::Relaxed);
            tracing::info!("{}: open", self.address);
            let error = self.serve(open, signing, take);
            *self.writer.lock().unwrap_or_else(PoisonError::into_inner) = None;
            if !self.outbox.has_ended() {
                tracing::warn!("{}: {error}; it is opened again", self.address);
            }
        }
    }

    /// From now on what is sent goes out by this connection; `None` where it broke at once.
    fn opened(&self, connection: Connection) -> Option<connection::Reader> {
        let halves = connection.split();
        let (reader, writer) = halves.map_err(|error| tracing::warn!("{}: {error}", self.address)).ok()?;
        *self.writer.lock().unwrap_or_else(PoisonError::into_inner) = Some(writer);
        Some(reader)
    }

    /// Hands on what one connection brings, until that breaks.
    fn serve(&self, mut reader: connection::Reader, signing: Option<&SigningData>, take: &dyn Fn(Parcel)) -> io::Error {
        let hand_on = |parcel| {
            self.received.fetch_add(1, Ordering::Relaxed);
            take(parcel);
        };
        match &mut reader {
            connection::Reader::Datagrams(datagrams) => loop {
                match datagrams.receive(|bytes| {
                    let mut parcels = MavlinkReader::new(bytes);
                    let mut any = false;
                    while let Ok(parcel) = wire::next(&mut parcels, signing) {
                        any = true;
                        hand_on(parcel);
                    }
                    any
                }) {
                    Err(error) if !is_pause(&error) => return error,
                    _ if self.outbox.has_ended() => return ErrorKind::Interrupted.into(),
                    _ => {}
                }
            },
            connection::Reader::Stream(stream) => {
                let mut parcels = MavlinkReader::new(stream);
                loop {
                    match wire::next(&mut parcels, signing) {
                        Ok(parcel) => hand_on(parcel),
                        Err(error) if !is_pause(&error) => return error,
                        Err(_) => {}
                    }
                    if self.outbox.has_ended() {
                        return ErrorKind::Interrupted.into();
                    }
                }
            }
        }
    }

    /// Writes what waits, for ever. What cannot be written is dropped: the next of its kind is newer.
    pub fn write(&self) {
        while let Some(bytes) = self.outbox.next() {
            let mut writer = self.writer.lock().unwrap_or_else(PoisonError::into_inner);
            let written = writer.as_mut().map(|writer| writer.send(&bytes));
            if let Some(Err(error)) = written {
                tracing::debug!("{}: {error}", self.address);
                if !is_pause(&error) {
                    *writer = None;
                }
            }
            drop(writer);
            self.outbox.done();
        }
    }

    /// Both threads.
    pub fn start(
        self: &Arc<Self>,
        first: Option<Connection>,
        signing: Option<Arc<SigningData>>,
        take: Box<dyn Fn(Parcel) + Send>,
    ) -> Result<()> {
        // Before anything is sent: what finds no connection is dropped.
        let first = first.and_then(|connection| self.opened(connection));
        let (reading, writing) = (self.clone(), self.clone());
        let thread = |name: &str| std::thread::Builder::new().name(format!("mavlink {name}"));
        let read = thread("in").spawn(move || reading.read(first, signing.as_deref(), &*take));
        let write = thread("out").spawn(move || writing.write());
        for started in [read, write] {
            started.map_err(|source| crate::MavlinkError::Io {
                link: self.address.to_string(),
                doing: "starting a thread",
                source,
            })?;
        }
        Ok(())
    }
}

/// Whether nothing is wrong with a link of which this is said.
fn is_pause(error: &io::Error) -> bool {
    // A ground station that is not there yet refuses datagrams.
    matches!(
        error.kind(),
        ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted | ErrorKind::ConnectionRefused
    )
}
