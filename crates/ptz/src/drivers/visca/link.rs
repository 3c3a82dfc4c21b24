use super::frame::{END, Reply, Splitter, parse_reply};
use crate::drivers::Timeouts;
use crate::{PtzError, Result};
use std::io::{ErrorKind, Read, Write};
use std::net::{TcpStream, ToSocketAddrs, UdpSocket};
use std::time::Instant;

/// How messages reach a camera and come back.
pub trait Link: Send {
    /// Sends one message.
    ///
    /// # Errors
    /// As the system says.
    fn send(&mut self, message: &[u8], inquiry: bool) -> std::io::Result<()>;

    /// The next answer, or `None` when there is none by `deadline`.
    ///
    /// # Errors
    /// As the system says.
    fn receive(&mut self, deadline: Instant) -> std::io::Result<Option<Reply>>;

    /// Sends the last message again, if that does no harm; whether it did.
    ///
    /// # Errors
    /// As the system says.
    fn again(&mut self) -> std::io::Result<bool> {
        Ok(false)
    }
}

impl<L: Link + ?Sized> Link for Box<L> {
    fn send(&mut self, message: &[u8], inquiry: bool) -> std::io::Result<()> {
        (**self).send(message, inquiry)
    }

    fn receive(&mut self, deadline: Instant) -> std::io::Result<Option<Reply>> {
        (**self).receive(deadline)
    }

    fn again(&mut self) -> std::io::Result<bool> {
        (**self).again()
    }
}

/// Whether a read that fails so only came back empty-handed.
fn came_back_empty(error: &std::io::Error) -> bool {
    matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted)
}

/// A stream of bytes: TCP or a serial line, whose reads come back after a while.
#[derive(Debug)]
pub struct StreamLink<S> {
    stream: S,
    splitter: Splitter,
    read: Vec<u8>,
}

impl<S: Read + Write + Send> StreamLink<S> {
    /// A link over `stream`.
    pub fn new(stream: S) -> Self {
        Self { stream, splitter: Splitter::default(), read: Vec::new() }
    }
}

impl<S: Read + Write + Send> Link for StreamLink<S> {
    fn send(&mut self, message: &[u8], _inquiry: bool) -> std::io::Result<()> {
        self.stream.write_all(message)?;
        self.stream.flush()
    }

    fn receive(&mut self, deadline: Instant) -> std::io::Result<Option<Reply>> {
        loop {
            while !self.read.is_empty() {
                let byte = self.read.remove(0);
                if let Some(reply) = self.splitter.take(byte) {
                    return Ok(Some(reply));
                }
            }
            if Instant::now() >= deadline {
                return Ok(None);
            }
            let mut some = [0; 256];
            match self.stream.read(&mut some) {
                Ok(0) => return Err(ErrorKind::UnexpectedEof.into()),
                Ok(count) => self.read.extend_from_slice(some.get(..count).unwrap_or_default()),
                Err(error) if came_back_empty(&error) => {}
                Err(error) => return Err(error),
            }
        }
    }
}

/// UDP with the eight bytes of header: kind, length, sequence number.
#[derive(Debug)]
pub struct UdpLink {
    socket: UdpSocket,
    sequence: u32,
    last: Vec<u8>,
}

impl UdpLink {
    const COMMAND: [u8; 2] = [0x01, 0x00];
    const INQUIRY: [u8; 2] = [0x01, 0x10];
    const REPLY: [u8; 2] = [0x01, 0x11];
    const CONTROL: [u8; 2] = [0x02, 0x00];

    fn datagram(kind: [u8; 2], sequence: u32, payload: &[u8]) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(8 + payload.len());
        bytes.extend(kind);
        bytes.extend((payload.len() as u16).to_be_bytes());
        bytes.extend(sequence.to_be_bytes());
        bytes.extend(payload);
        bytes
    }

    /// The answer in a datagram, if it answers the message of this number.
    fn answer(datagram: &[u8], sequence: u32) -> Option<Reply> {
        let (header, payload) = datagram.split_at_checked(8)?;
        let expected = Self::datagram(Self::REPLY, sequence, payload);
        (expected.get(..8) == Some(header) && payload.last() == Some(&END)).then(|| parse_reply(payload)).flatten()
    }
}

impl Link for UdpLink {
    fn send(&mut self, message: &[u8], inquiry: bool) -> std::io::Result<()> {
        self.sequence = self.sequence.wrapping_add(1);
        let kind = if inquiry { Self::INQUIRY } else { Self::COMMAND };
        self.last = Self::datagram(kind, self.sequence, message);
        self.socket.send(&self.last).map(drop)
    }

    fn receive(&mut self, deadline: Instant) -> std::io::Result<Option<Reply>> {
        loop {
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Ok(None);
            }
            self.socket.set_read_timeout(Some(left))?;
            let mut datagram = [0; 512];
            match self.socket.recv(&mut datagram) {
                Ok(count) => {
                    let got = datagram.get(..count).unwrap_or_default();
                    if let Some(reply) = Self::answer(got, self.sequence) {
                        return Ok(Some(reply));
                    }
                }
                Err(error) if came_back_empty(&error) => {}
                Err(error) => return Err(error),
            }
        }
    }

    /// A datagram may get lost; a camera that got it twice knows it by its number.
    fn again(&mut self) -> std::io::Result<bool> {
        self.socket.send(&self.last).map(|_| true)
    }
}

/// Reaches a camera by TCP, where messages go bare; usual ports are 5678 and 1259.
///
/// # Errors
/// Where it cannot be reached within the time-out.
pub fn connect_tcp(host: &str, port: u16, timeouts: &Timeouts) -> Result<StreamLink<TcpStream>> {
    let io = |source| PtzError::Io { head: format!("visca+tcp://{host}:{port}"), doing: "connecting", source };
    let mut last = ErrorKind::AddrNotAvailable.into();
    for address in (host, port).to_socket_addrs().map_err(io)? {
        match TcpStream::connect_timeout(&address, timeouts.connect) {
            Ok(stream) => {
                let short = timeouts.answer.min(std::time::Duration::from_millis(20));
                stream.set_read_timeout(Some(short)).map_err(io)?;
                stream.set_write_timeout(Some(timeouts.answer)).map_err(io)?;
                stream.set_nodelay(true).map_err(io)?;
                return Ok(StreamLink::new(stream));
            }
            Err(error) => last = error,
        }
    }
    Err(io(last))
}

/// Reaches a camera by UDP, usually on port 52381, and asks it to count messages from now on.
///
/// # Errors
/// Where the system gives no socket or knows no such host. That the camera is there shows with the first command only.
pub fn connect_udp(host: &str, port: u16) -> Result<UdpLink> {
    let io = |source| PtzError::Io { head: format!("visca://{host}:{port}"), doing: "opening a socket", source };
    let address = (host, port).to_socket_addrs().map_err(io)?.next().ok_or_else(|| io(ErrorKind::NotFound.into()))?;
    let any = if address.is_ipv4() { "0.0.0.0:0" } else { "[::]:0" };
    let socket = UdpSocket::bind(any).map_err(io)?;
    socket.connect(address).map_err(io)?;
    socket.send(&UdpLink::datagram(UdpLink::CONTROL, 0, &[0x01])).map_err(io)?;
    Ok(UdpLink { socket, sequence: 0, last: Vec::new() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn datagrams_have_the_published_header() {
        let sent = UdpLink::datagram(UdpLink::COMMAND, 0x0102_0304, &[0x81, 0x01, 0x06, 0x04, 0xFF]);
        assert_eq!(sent, [0x01, 0x00, 0x00, 0x05, 1, 2, 3, 4, 0x81, 0x01, 0x06, 0x04, 0xFF]);
        assert_eq!(UdpLink::datagram(UdpLink::CONTROL, 0, &[1]), [0x02, 0x00, 0x00, 0x01, 0, 0, 0, 0, 1]);
    }

    #[test]
    fn only_the_answer_to_the_last_message_counts() {
        let answer = UdpLink::datagram(UdpLink::REPLY, 7, &[0x90, 0x41, 0xFF]);
        assert_eq!(UdpLink::answer(&answer, 7), Some(Reply::Acknowledged));
        assert_eq!(UdpLink::answer(&answer, 8), None, "another number");
        assert_eq!(UdpLink::answer(&answer[..10], 7), None, "cut off");
        assert_eq!(UdpLink::answer(&answer[..5], 7), None);
        let mut wrong = answer.clone();
        wrong[3] = 9;
        assert_eq!(UdpLink::answer(&wrong, 7), None, "a wrong length");
        wrong = answer;
        wrong[1] = 0x00;
        assert_eq!(UdpLink::answer(&wrong, 7), None, "no answer");
    }
}
