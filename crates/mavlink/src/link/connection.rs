use super::GLANCE;
use super::peers::Peers;
use crate::LinkAddress;
use serial2::SerialPort;
use std::io::{self, ErrorKind, Read, Write};
use std::net::{TcpStream, ToSocketAddrs, UdpSocket};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// How long a connection may take to come about, and a line to take what is written.
const PATIENCE: Duration = Duration::from_secs(3);

/// An open link.
pub(crate) enum Connection {
    /// Answers whoever sends.
    UdpIn(UdpSocket),
    /// Sends to one place.
    UdpOut(UdpSocket),
    Tcp(TcpStream),
    Serial(SerialPort),
}

/// The end that is read.
pub(super) enum Reader {
    Datagrams(Datagrams),
    Stream(Box<dyn Read + Send>),
}

/// The end that is written.
pub(super) enum Writer {
    Peers(UdpSocket, Arc<Mutex<Peers>>),
    Stream(Box<dyn Write + Send>),
}

/// Datagrams, from one place or from anywhere.
pub(super) struct Datagrams {
    socket: UdpSocket,
    peers: Option<Arc<Mutex<Peers>>>,
    bytes: Box<[u8; 65_536]>,
}

impl Connection {
    pub fn open(address: &LinkAddress) -> io::Result<Self> {
        match address {
            LinkAddress::UdpIn { host, port } => Ok(Self::UdpIn(UdpSocket::bind((host.as_str(), *port))?)),
            LinkAddress::UdpOut { host, port } => {
                let there = (host.as_str(), *port).to_socket_addrs()?.next();
                let there = there.ok_or_else(|| io::Error::from(ErrorKind::AddrNotAvailable))?;
                let socket = UdpSocket::bind(if there.is_ipv4() { "0.0.0.0:0" } else { "[::]:0" })?;
                // Telemetry is broadcast where nobody knows the ground station's address.
                socket.set_broadcast(true).ok();
                socket.connect(there)?;
                Ok(Self::UdpOut(socket))
            }
            LinkAddress::Tcp { host, port } => {
                let mut last = ErrorKind::AddrNotAvailable.into();
                for there in (host.as_str(), *port).to_socket_addrs()? {
                    match TcpStream::connect_timeout(&there, PATIENCE) {
                        Ok(stream) => {
                            stream.set_nodelay(true)?;
                            return Ok(Self::Tcp(stream));
                        }
                        Err(error) => last = error,
                    }
                }
                Err(last)
            }
            LinkAddress::Serial { device, baud } => Ok(Self::Serial(SerialPort::open(device, *baud)?)),
        }
    }

    pub(super) fn split(self) -> io::Result<(Reader, Writer)> {
        match self {
            Self::UdpIn(socket) => {
                socket.set_read_timeout(Some(GLANCE))?;
                let peers = Arc::<Mutex<Peers>>::default();
                let writer = Writer::Peers(socket.try_clone()?, peers.clone());
                let bytes = Box::new([0; 65_536]);
                Ok((Reader::Datagrams(Datagrams { socket, peers: Some(peers), bytes }), writer))
            }
            Self::UdpOut(socket) => {
                socket.set_read_timeout(Some(GLANCE))?;
                let writer = Writer::Stream(Box::new(Sending(socket.try_clone()?)));
                let bytes = Box::new([0; 65_536]);
                Ok((Reader::Datagrams(Datagrams { socket, peers: None, bytes }), writer))
            }
            Self::Tcp(stream) => {
                stream.set_read_timeout(Some(GLANCE))?;
                stream.set_write_timeout(Some(PATIENCE))?;
                let writer = Writer::Stream(Box::new(stream.try_clone()?));
                Ok((Reader::Stream(Box::new(stream)), writer))
            }
            Self::Serial(mut port) => {
                port.set_read_timeout(GLANCE)?;
                port.set_write_timeout(PATIENCE)?;
                let writer = Writer::Stream(Box::new(port.try_clone()?));
                Ok((Reader::Stream(Box::new(port)), writer))
            }
        }
    }
}

impl Datagrams {
    /// Waits for a datagram; `take` says whether anything valid is in it: who sends nothing valid is not answered.
    pub fn receive(&mut self, take: impl FnOnce(&[u8]) -> bool) -> io::Result<()> {
        let (count, from) = self.socket.recv_from(&mut self.bytes[..])?;
        let is_valid = take(self.bytes.get(..count).unwrap_or_default());
        if let Some(peers) = self.peers.as_ref().filter(|_| is_valid) {
            peers.lock().unwrap_or_else(PoisonError::into_inner).heard(from, Instant::now());
        }
        Ok(())
    }
}

impl Writer {
    pub fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        match self {
            Self::Stream(stream) => stream.write_all(bytes).and_then(|()| stream.flush()),
            Self::Peers(socket, peers) => {
                let peers: Vec<_> = peers.lock().unwrap_or_else(PoisonError::into_inner).all(Instant::now()).collect();
                // One that cannot be reached is no reason not to tell the others.
                peers.into_iter().for_each(|peer| drop(socket.send_to(bytes, peer)));
                Ok(())
            }
        }
    }
}

/// A socket that writes each message as a datagram.
struct Sending(UdpSocket);

impl Write for Sending {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.send(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
