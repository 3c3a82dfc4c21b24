use super::{Head, Hook, Password, Timeouts, visca};
use crate::{PtzError, Result};
use pursuit_address::{AddressError, Locator};
use std::path::PathBuf;

/// Where a head is, as it is written on a command line.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum HeadAddress {
    /// `onvif://[USER@]HOST[:PORT][/PATH]`, `onvifs://…` by TLS
    Onvif {
        /// Whether by TLS.
        tls: bool,
        /// The user, if any.
        user: Option<String>,
        /// `HOST` or `HOST:PORT`.
        host: String,
        /// The path of the device service, `/onvif/device_service` by default.
        path: String,
    },
    /// `visca://HOST[:PORT]`: VISCA over UDP, port 52381 by default.
    ViscaUdp {
        /// The host.
        host: String,
        /// The port.
        port: u16,
    },
    /// `visca+tcp://HOST[:PORT]`: VISCA over TCP, port 5678 by default.
    ViscaTcp {
        /// The host.
        host: String,
        /// The port.
        port: u16,
    },
    /// `visca:DEVICE`: VISCA on a serial line.
    ViscaSerial {
        /// The device, for example `/dev/ttyUSB0`.
        device: String,
    },
    /// `pelco:DEVICE`, also `pelco://DEVICE`: Pelco-D on a serial line.
    Pelco {
        /// The device.
        device: String,
    },
    /// `mavlink:LINK`: a gimbal on a MAVLink link, as in `mavlink:udpin:0.0.0.0:14550`.
    Mavlink {
        /// The link.
        link: String,
    },
    /// `hook:COMMAND`: a user's own program.
    Hook {
        /// The command, for the system's shell.
        command: String,
    },
}

impl std::str::FromStr for HeadAddress {
    type Err = PtzError;

    fn from_str(text: &str) -> Result<Self> {
        let wrong = |reason: &str| Err(PtzError::Address { reason: reason.to_owned() });
        let Some((scheme, rest)) = text.split_once(':') else { return wrong("the head's address has no scheme") };
        let after_slashes = rest.strip_prefix("//");
        if rest.trim_start_matches('/').is_empty() {
            return wrong("the head's address is empty");
        }
        let locator = Locator::new(text);
        match (scheme, after_slashes) {
            ("onvif" | "onvifs", Some(_)) => onvif(&locator, scheme == "onvifs"),
            ("visca", Some(_)) => host_and_port(&locator, 52_381).map(|(host, port)| Self::ViscaUdp { host, port }),
            ("visca+tcp", Some(_)) => host_and_port(&locator, 5678).map(|(host, port)| Self::ViscaTcp { host, port }),
            ("visca", None) => Ok(Self::ViscaSerial { device: rest.to_owned() }),
            ("pelco", device) => Ok(Self::Pelco { device: device.unwrap_or(rest).to_owned() }),
            ("mavlink", _) => Ok(Self::Mavlink { link: rest.to_owned() }),
            ("hook", _) => Ok(Self::Hook { command: rest.to_owned() }),
            _ => wrong("there is no such kind of head"),
        }
    }
}

fn of_address(error: AddressError) -> PtzError {
    PtzError::Address { reason: format!("the head's address {error}") }
}

fn onvif(locator: &Locator, tls: bool) -> Result<HeadAddress> {
    if locator.credentials().is_some() {
        // Said without repeating it: an address ends up in logs and in lists of processes.
        let reason = "a password has no place in a head's address; give it by a variable of the environment or a file";
        return Err(PtzError::Address { reason: reason.to_owned() });
    }
    let server = locator.server().map_err(of_address)?;
    let path = if server.path.is_empty() { "onvif/device_service" } else { server.path };
    let path = format!("/{path}{}", server.query);
    Ok(HeadAddress::Onvif { tls, user: locator.login().map(|(user, _)| user), host: server.to_string(), path })
}

fn host_and_port(locator: &Locator, default: u16) -> Result<(String, u16)> {
    let server = locator.server().map_err(of_address)?;
    let is_more = locator.login().is_some() || !server.query.is_empty() || !server.path.trim_matches('/').is_empty();
    if is_more {
        let reason = "the head's address is more than a host and a port".to_owned();
        return Err(PtzError::Address { reason });
    }
    Ok((server.host.to_owned(), server.port.unwrap_or(default)))
}

/// What proves the user to a head, and a head to the user.
#[derive(Debug, Clone, Default)]
pub struct Access {
    /// The password of the address's user.
    pub password: Option<Password>,
    /// A PEM file of certificates that are trusted at an `onvifs://` address in place of the system's authorities; the camera's
    /// own may stand in it.
    pub certificates: Option<PathBuf>,
}

/// Reaches the head at an address, with the usual parameters of its kind.
///
/// # Errors
/// Where it cannot be reached, or this build was made without the feature that such heads need.
pub fn open(address: &HeadAddress, access: &Access, timeouts: Timeouts) -> Result<Box<dyn Head>> {
    match address {
        #[cfg(feature = "onvif")]
        HeadAddress::Onvif { tls, user, host, path } => {
            use super::onvif::{Login, Onvif, OnvifParams};
            let password = || access.password.clone().unwrap_or_default();
            let login = user.as_ref().map(|user| Login { user: user.clone(), password: password() });
            let url = format!("{}://{host}{path}", if *tls { "https" } else { "http" });
            let certificates = access.certificates.as_deref();
            Ok(Box::new(Onvif::connect(&url, login, certificates, OnvifParams::default(), timeouts)?))
        }
        #[cfg(not(feature = "onvif"))]
        HeadAddress::Onvif { .. } => {
            let _ = access;
            Err(without("onvif"))
        }
        HeadAddress::ViscaUdp { host, port } => {
            let link = visca::connect_udp(host, *port)?;
            let name = format!("visca://{host}:{port}");
            Ok(Box::new(visca::Visca::new(name, link, visca::ViscaParams::usual()?, timeouts)?))
        }
        HeadAddress::ViscaTcp { host, port } => {
            let link = visca::connect_tcp(host, *port, &timeouts)?;
            let name = format!("visca+tcp://{host}:{port}");
            Ok(Box::new(visca::Visca::new(name, link, visca::ViscaParams::usual()?, timeouts)?))
        }
        HeadAddress::ViscaSerial { device } => visca_serial(device, timeouts),
        HeadAddress::Pelco { device } => pelco_serial(device, timeouts),
        HeadAddress::Mavlink { link } => gimbal(link),
        HeadAddress::Hook { command } => Ok(Box::new(Hook::start(command)?)),
    }
}

#[cfg(feature = "mavlink")]
fn gimbal(link: &str) -> Result<Box<dyn Head>> {
    use pursuit_mavlink::{Endpoint, Identity};
    let of_link = |error: pursuit_mavlink::MavlinkError| PtzError::Mavlink { reason: error.to_string() };
    let endpoint = Endpoint::start(Identity::default(), &[link.parse().map_err(of_link)?], None).map_err(of_link)?;
    Ok(Box::new(super::GimbalHead::find(endpoint, None)?))
}

#[cfg(not(feature = "mavlink"))]
fn gimbal(_link: &str) -> Result<Box<dyn Head>> {
    Err(PtzError::Address {
        reason: "this build was made without the feature `mavlink`, which gimbals need".to_owned(),
    })
}

/// The certificate that the camera at an `onvifs://` address shows, in PEM, and its SHA-256 as `AB:CD:…`: for people to
/// compare. It is not judged, and nothing else is said to the camera.
///
/// # Errors
/// Where the address is no such one, the camera cannot be reached in time, or this build was made without the feature
/// `onvif-tls`.
pub fn certificate(address: &HeadAddress, timeouts: Timeouts) -> Result<(String, String)> {
    match address {
        #[cfg(feature = "onvif-tls")]
        HeadAddress::Onvif { tls: true, host, .. } => {
            let url = format!("https://{host}");
            let locator = Locator::new(&url);
            let server = locator.server().map_err(of_address)?;
            super::onvif::shown_certificate(server.host, server.port.unwrap_or(443), timeouts)
        }
        #[cfg(not(feature = "onvif-tls"))]
        HeadAddress::Onvif { tls: true, .. } => {
            let _ = timeouts;
            Err(without("onvif-tls"))
        }
        _ => Err(PtzError::Address { reason: "only an onvifs:// address shows a certificate".into() }),
    }
}

#[cfg(not(all(feature = "onvif-tls", feature = "serial")))]
pub(super) fn without(feature: &str) -> PtzError {
    PtzError::Address {
        reason: format!("this build was made without the feature `ptz-{feature}`, which such heads need"),
    }
}

#[cfg(feature = "serial")]
fn line(device: &str, baud: u32, timeouts: Timeouts) -> Result<serial2::SerialPort> {
    let io = |source| PtzError::Io { head: device.to_owned(), doing: "opening the serial line", source };
    let mut port = serial2::SerialPort::open(device, baud).map_err(io)?;
    port.set_read_timeout(timeouts.answer.min(std::time::Duration::from_millis(20))).map_err(io)?;
    port.set_write_timeout(timeouts.answer).map_err(io)?;
    Ok(port)
}

#[cfg(feature = "serial")]
fn visca_serial(device: &str, timeouts: Timeouts) -> Result<Box<dyn Head>> {
    let link = visca::StreamLink::new(line(device, 9600, timeouts)?);
    Ok(Box::new(visca::Visca::new(format!("visca:{device}"), link, visca::ViscaParams::usual()?, timeouts)?))
}

#[cfg(feature = "serial")]
fn pelco_serial(device: &str, timeouts: Timeouts) -> Result<Box<dyn Head>> {
    use super::pelco_d::{PelcoD, PelcoDParams};
    let port = line(device, 2400, timeouts)?;
    Ok(Box::new(PelcoD::new(format!("pelco:{device}"), port, PelcoDParams::default(), timeouts)?))
}

#[cfg(not(feature = "serial"))]
fn visca_serial(_device: &str, _timeouts: Timeouts) -> Result<Box<dyn Head>> {
    Err(without("serial"))
}

#[cfg(not(feature = "serial"))]
fn pelco_serial(_device: &str, _timeouts: Timeouts) -> Result<Box<dyn Head>> {
    Err(without("serial"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<HeadAddress> {
        text.parse()
    }

    #[test]
    fn addresses_are_read() {
        let onvif = |user: Option<&str>, host: &str, path: &str| HeadAddress::Onvif {
            tls: false,
            user: user.map(str::to_owned),
            host: host.to_owned(),
            path: path.to_owned(),
        };
        assert_eq!(parse("onvif://admin@10.0.0.5").unwrap(), onvif(Some("admin"), "10.0.0.5", "/onvif/device_service"));
        assert_eq!(parse("onvif://cam:8080/x/y").unwrap(), onvif(None, "cam:8080", "/x/y"));
        let HeadAddress::Onvif { tls, .. } = parse("onvifs://cam").unwrap() else { panic!("it is ONVIF") };
        assert!(tls);
        let udp = |host: &str, port| HeadAddress::ViscaUdp { host: host.into(), port };
        assert_eq!(parse("visca://cam").unwrap(), udp("cam", 52_381));
        assert_eq!(parse("visca://[fe80::1]:1259/").unwrap(), udp("fe80::1", 1259));
        assert_eq!(parse("visca://[fe80::1]").unwrap(), udp("fe80::1", 52_381));
        assert_eq!(parse("visca+tcp://cam").unwrap(), HeadAddress::ViscaTcp { host: "cam".into(), port: 5678 });
        assert_eq!(parse("visca:/dev/ttyUSB0").unwrap(), HeadAddress::ViscaSerial { device: "/dev/ttyUSB0".into() });
        for pelco in ["pelco:/dev/ttyS0", "pelco:///dev/ttyS0"] {
            assert_eq!(parse(pelco).unwrap(), HeadAddress::Pelco { device: "/dev/ttyS0".into() });
        }
        assert_eq!(parse("hook:./move --fast").unwrap(), HeadAddress::Hook { command: "./move --fast".into() });
    }

    #[test]
    fn wrong_addresses_are_refused_without_repeating_a_password() {
        for bad in [
            "",
            "cam",
            "onvif://",
            "onvif:",
            "ftp://x",
            "visca://",
            "visca://cam:99999",
            "visca://cam/x",
            "visca://me@cam",
            "visca://a b",
            "onvif://u@",
        ] {
            assert!(parse(bad).is_err(), "{bad}");
        }
        let error = parse("onvif://admin:sesame@cam").unwrap_err().to_string();
        assert!(!error.contains("sesame") && error.contains("environment"), "{error}");
    }
}
