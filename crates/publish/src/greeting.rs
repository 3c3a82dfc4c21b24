//! What answers at a port, by what it says to a greeting.

use std::io::{Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::Duration;

/// For how long an answer is waited for; only where a first attempt has failed.
const PATIENCE: Duration = Duration::from_secs(1);

/// The shortest `ClientHello` of TLS 1.2 (RFC 5246, section 7.4.1.2): no session, two suites that every server knows, no compression, no
/// extensions.
fn client_hello() -> Vec<u8> {
    let mut hello = vec![3, 3];
    hello.extend([0x5a; 32]);
    hello.extend([0, 0, 4, 0xc0, 0x2f, 0, 0x2f, 1, 0]);
    let mut handshake = vec![1, 0, 0, hello.len() as u8];
    handshake.extend(hello);
    let mut record = vec![22, 3, 1, 0, handshake.len() as u8];
    record.extend(handshake);
    record
}

/// Whether TLS is spoken there: a handshake or an alert answers its greeting.
pub(crate) fn speaks_tls(host: &str, port: u16) -> bool {
    let answer = || -> std::io::Result<[u8; 2]> {
        let addresses = (host, port).to_socket_addrs()?;
        let mut stream = None;
        for address in addresses {
            stream = TcpStream::connect_timeout(&address, PATIENCE).ok();
            if stream.is_some() {
                break;
            }
        }
        let mut stream = stream.ok_or(std::io::ErrorKind::NotConnected)?;
        stream.set_read_timeout(Some(PATIENCE))?;
        stream.set_write_timeout(Some(PATIENCE))?;
        stream.write_all(&client_hello())?;
        let mut first = [0; 2];
        stream.read_exact(&mut first)?;
        Ok(first)
    };
    matches!(answer(), Ok([21 | 22, 3]))
}

#[cfg(test)]
mod tests {
    use super::client_hello;

    #[test]
    fn the_greeting_has_the_lengths_that_it_says() {
        let record = client_hello();
        assert_eq!(usize::from(record[4]), record.len() - 5);
        assert_eq!(usize::from(record[8]), record.len() - 9);
    }
}
