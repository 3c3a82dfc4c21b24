use crate::{MavlinkError, Result};
use std::fmt;
use std::str::FromStr;

/// Where the other side of a link is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum LinkAddress {
    /// `udpin:HOST:PORT`: whoever sends to this port is answered, several ground stations at once.
    UdpIn {
        /// The address of this machine that is listened on.
        host: String,
        /// The port.
        port: u16,
    },
    /// `udpout:HOST:PORT`: sends there, and hears what comes back.
    UdpOut {
        /// The host.
        host: String,
        /// The port.
        port: u16,
    },
    /// `tcp:HOST:PORT`: connects to a server.
    Tcp {
        /// The host.
        host: String,
        /// The port.
        port: u16,
    },
    /// `serial:DEVICE[:BAUD]`, 57 600 baud where nothing is said.
    Serial {
        /// The device.
        device: String,
        /// Symbols per second.
        baud: u32,
    },
}

impl LinkAddress {
    /// The usual rate of telemetry radios.
    const BAUD: u32 = 57_600;
}

impl FromStr for LinkAddress {
    type Err = MavlinkError;

    fn from_str(text: &str) -> Result<Self> {
        let wrong = |problem| MavlinkError::Address { address: text.to_owned(), problem };
        let (scheme, rest) = text.split_once(':').ok_or_else(|| wrong("has no scheme"))?;
        if scheme == "serial" {
            let (device, baud) = match rest.rsplit_once(':') {
                Some((device, baud)) => {
                    (device, baud.parse().ok().filter(|baud| *baud > 0).ok_or_else(|| wrong("has a wrong baud rate"))?)
                }
                None => (rest, Self::BAUD),
            };
            return match device {
                "" => Err(wrong("names no device")),
                device => Ok(Self::Serial { device: device.to_owned(), baud }),
            };
        }
        let place = rest.strip_prefix("//").unwrap_or(rest).trim_end_matches('/');
        let (host, port) = place.rsplit_once(':').ok_or_else(|| wrong("has no port"))?;
        let host = host.strip_prefix('[').and_then(|h| h.strip_suffix(']')).unwrap_or(host).to_owned();
        if host.is_empty() || host.contains(['/', '@', ' ']) {
            return Err(wrong("has no host"));
        }
        let port: u16 = port.parse().ok().filter(|port| *port > 0).ok_or_else(|| wrong("has a wrong port"))?;
        match scheme {
            "udpin" | "udp" => Ok(Self::UdpIn { host, port }),
            "udpout" => Ok(Self::UdpOut { host, port }),
            "tcp" | "tcpout" => Ok(Self::Tcp { host, port }),
            _ => Err(wrong("is of no known kind")),
        }
    }
}

impl fmt::Display for LinkAddress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let bracketed = |host: &str| if host.contains(':') { format!("[{host}]") } else { host.to_owned() };
        match self {
            Self::UdpIn { host, port } => write!(f, "udpin:{}:{port}", bracketed(host)),
            Self::UdpOut { host, port } => write!(f, "udpout:{}:{port}", bracketed(host)),
            Self::Tcp { host, port } => write!(f, "tcp:{}:{port}", bracketed(host)),
            Self::Serial { device, baud } => write!(f, "serial:{device}:{baud}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_are_read_and_shown() {
        for (text, shown) in [
            ("udpin:0.0.0.0:14550", "udpin:0.0.0.0:14550"),
            ("udp://:14550", ""),
            ("udpin://[::1]:14550/", "udpin:[::1]:14550"),
            ("udpout:localhost:14540", "udpout:localhost:14540"),
            ("tcp:10.0.0.2:5760", "tcp:10.0.0.2:5760"),
            ("serial:/dev/ttyACM0", "serial:/dev/ttyACM0:57600"),
            ("serial:/dev/ttyS1:921600", "serial:/dev/ttyS1:921600"),
        ] {
            match text.parse::<LinkAddress>() {
                Ok(address) => {
                    assert_eq!(address.to_string(), shown);
                    assert_eq!(shown.parse::<LinkAddress>().unwrap(), address);
                }
                Err(error) => assert!(shown.is_empty(), "{error}"),
            }
        }
    }

    #[test]
    fn wrong_addresses_say_what_would_do() {
        for text in
            ["", "udpin", "udpin:14550", "udpin:host:0", "tcp:host:99999", "serial:", "serial:/dev/x:fast", "ftp:a:1"]
        {
            let error = text.parse::<LinkAddress>().unwrap_err().to_string();
            assert!(error.contains("udpout:HOST:PORT"), "{error}");
        }
    }
}
