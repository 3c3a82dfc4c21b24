use super::messages::{Service, envelope, is_writable, request};
use super::xml::{Element, parse_answer};
use super::{clock, token};
use crate::drivers::{Password, Timeouts};
use crate::{PtzError, Result};
use http_auth::{PasswordClient, PasswordClientBuilder, PasswordParams};
use pursuit_address::Locator;
use std::path::Path;
use std::time::{Duration, Instant};
use ureq::Agent;
use ureq::http::StatusCode;
#[cfg(feature = "onvif-tls")]
use ureq::unversioned::{
    resolver::DefaultResolver,
    transport::{Connector, TcpConnector},
};

/// A user and a password.
#[derive(Debug, Clone)]
pub struct Login {
    /// The user.
    pub user: String,
    /// The password.
    pub password: Password,
}

/// Asks one camera.
pub(super) struct Client {
    pub name: String,
    agent: Agent,
    #[cfg(feature = "onvif-tls")]
    tls: super::tls::Tls,
    /// `http://HOST[:PORT]` or `https://HOST[:PORT]`.
    root: String,
    device_path: String,
    media_path: Option<String>,
    media2_path: Option<String>,
    ptz_path: Option<String>,
    login: Option<Login>,
    /// The camera's clock minus ours, seconds.
    clock_s: i64,
    /// The same by the `Date` of its last answer.
    http_s: Option<i64>,
    challenge: Option<PasswordClient>,
    timeouts: Timeouts,
    nonces: u64,
}

/// What faults say of a wrong user or password: ONVIF's own, that of some makers, and that of gSOAP's plugin for WS-Security.
const DENIALS: [&str; 5] = [
    "NotAuthorized",
    "not authorized",
    "Authentication failed",
    "FailedAuthentication",
    "could not be authenticated or authorized",
];

impl Client {
    /// The longest answer read, bytes. Profiles of cameras with many streams take a tenth of it.
    const LONGEST: u64 = 512 * 1024;

    /// `certificates` is a PEM file of what is trusted at an `https://` address in place of the system's authorities.
    pub fn new(url: &str, login: Option<Login>, certificates: Option<&Path>, timeouts: Timeouts) -> Result<Self> {
        let wrong =
            || PtzError::Address { reason: "the address of an ONVIF camera is no http:// or https:// address".into() };
        let url = Locator::new(url);
        let server = url.server().map_err(|_| wrong())?;
        let (scheme, kind) = match url.scheme() {
            Some("http") => ("http", "onvif"),
            Some("https") => ("https", "onvifs"),
            _ => return Err(wrong()),
        };
        if url.login().is_some() {
            return Err(wrong());
        }
        if certificates.is_some() && scheme == "http" {
            let reason = "certificates are of use with onvifs:// only: plain HTTP proves nothing".to_owned();
            return Err(PtzError::Address { reason });
        }
        #[cfg(not(feature = "onvif-tls"))]
        if scheme == "https" {
            return Err(crate::drivers::address::without("onvif-tls"));
        }
        let path = if server.path.is_empty() { "onvif/device_service" } else { server.path };
        let config = Agent::config_builder()
            .timeout_connect(Some(timeouts.connect))
            .http_status_as_error(false)
            .max_redirects(0)
            .proxy(None)
            .user_agent("pursuit")
            .build();
        #[cfg(feature = "onvif-tls")]
        let tls = super::tls::Tls::new(certificates)?;
        #[cfg(feature = "onvif-tls")]
        let agent = Agent::with_parts(config, TcpConnector::default().chain(tls.clone()), DefaultResolver::default());
        #[cfg(not(feature = "onvif-tls"))]
        let agent = config.into();
        Ok(Self {
            name: format!("{kind}://{server}"),
            agent,
            #[cfg(feature = "onvif-tls")]
            tls,
            root: format!("{scheme}://{server}"),
            device_path: format!("/{path}{}", server.query),
            media_path: None,
            media2_path: None,
            ptz_path: None,
            login,
            clock_s: 0,
            http_s: None,
            challenge: None,
            timeouts,
            nonces: 0,
        })
    }

    /// Dates messages by the camera's clock from now on.
    pub fn set_clock(&mut self, camera_s: i64) {
        self.clock_s = camera_s - clock::now_s();
    }

    /// Dates messages by the clock that the camera's HTTP server shows, where it shows one.
    pub fn set_clock_by_http(&mut self) {
        self.clock_s = self.http_s.unwrap_or(self.clock_s);
    }

    /// Takes note of where a service is. Of the address that the camera gives only the path is taken: behind a router its
    /// host is wrong, and whatever it is, the user is proved to this camera only.
    pub fn set_service(&mut self, service: Service, address: &str) {
        let path =
            address.split_once("://").map_or(address, |(_, rest)| rest.split_once('/').map_or("", |(_, path)| path));
        let path = format!("/{}", path.trim_start_matches('/'));
        match service {
            Service::Device => self.device_path = path,
            Service::Media => self.media_path = Some(path),
            Service::Media2 => self.media2_path = Some(path),
            Service::Ptz => self.ptz_path = Some(path),
        }
    }

    /// Asks a service; gives the answer's body.
    pub fn ask(&mut self, service: Service, action: &'static str, contents: &str) -> Result<Element> {
        self.ask_as(service, action, contents, true)
    }

    /// Asks without proving the user.
    pub fn ask_openly(&mut self, service: Service, action: &'static str) -> Result<Element> {
        self.ask_as(service, action, "", false)
    }

    fn ask_as(&mut self, service: Service, action: &'static str, contents: &str, proved: bool) -> Result<Element> {
        let path = match service {
            Service::Device => None,
            Service::Media => self.media_path.clone(),
            Service::Media2 => self.media2_path.clone(),
            Service::Ptz => self.ptz_path.clone(),
        };
        let path = path.unwrap_or_else(|| self.device_path.clone());
        let deadline = Instant::now() + self.timeouts.connect + self.timeouts.answer;
        let header = match &self.login {
            Some(login) if proved => {
                let created = clock::written(clock::now_s() + self.clock_s);
                token::header(login, &nonce(&mut self.nonces), &created)
            }
            _ => String::new(),
        };
        let message = envelope(&header, &request(service, action, contents));
        if !is_writable(&message) {
            let what = "be told a control character: a user, a name or a token has one, and XML has none";
            return Err(PtzError::Unsupported { head: self.name.clone(), what });
        }
        let soap_action = format!("{}/{action}", service.namespace());
        let (status, challenge, text) = self.post(&path, &soap_action, &message, action, deadline)?;
        let asks = status == StatusCode::UNAUTHORIZED && self.login.is_some() && proved;
        let (status, text) = match challenge.filter(|_| asks) {
            Some(challenge) => {
                self.challenge = Some(challenge);
                let (status, _, text) = self.post(&path, &soap_action, &message, action, deadline)?;
                (status, text)
            }
            None => (status, text),
        };
        self.read(status, &text, action)
    }

    /// Posts a message; gives the status, a challenge to prove the user that can be met, and the text.
    fn post(
        &mut self,
        path: &str,
        soap_action: &str,
        message: &str,
        doing: &'static str,
        deadline: Instant,
    ) -> Result<(StatusCode, Option<PasswordClient>, String)> {
        let left = deadline.saturating_duration_since(Instant::now()).max(Duration::from_millis(1));
        let content = format!("application/soap+xml; charset=utf-8; action=\"{soap_action}\"");
        let mut post = self
            .agent
            .post(format!("{}{path}", self.root))
            .config()
            .timeout_global(Some(left))
            .build()
            .header("Content-Type", content)
            .header("SOAPAction", format!("\"{soap_action}\""));
        if let Some(proof) = self.proof(path) {
            post = post.header("Authorization", proof);
        }
        let mut answer = post.send(message).map_err(|error| self.failed(doing, error))?;
        let date = answer.headers().get("date").and_then(|value| clock::read_http(value.to_str().ok()?));
        self.http_s = date.map(|camera_s| camera_s - clock::now_s()).or(self.http_s);
        // The first that is understood: a camera names the strongest first. Basic would give the password away; the library knows it where
        // another part of the program, such as RTSP, has asked for that.
        let asked = answer.headers().get_all("www-authenticate").iter().filter_map(|value| value.to_str().ok());
        let challenge = PasswordClient::builder();
        let challenge = asked.fold(challenge, PasswordClientBuilder::challenges).build().ok();
        let challenge = challenge.filter(|challenge| matches!(challenge, PasswordClient::Digest(_)));
        let body = answer.body_mut().with_config().limit(Self::LONGEST).lossy_utf8(true).read_to_string();
        let text = body.map_err(|error| self.failed(doing, error))?;
        Ok((answer.status(), challenge, text))
    }

    /// The answer to the camera's HTTP challenge, if it made one.
    fn proof(&mut self, path: &str) -> Option<String> {
        let login = self.login.as_ref()?;
        let params = PasswordParams {
            username: &login.user,
            password: login.password.reveal(),
            uri: path,
            method: "POST",
            body: None,
        };
        self.challenge.as_mut()?.respond(&params).ok()
    }

    fn read(&self, status: StatusCode, text: &str, doing: &'static str) -> Result<Element> {
        let head = || self.name.clone();
        let answer = parse_answer(text);
        let fault = answer.as_ref().ok().and_then(|root| root.find("Fault")).map(fault_text);
        let denied = fault.as_deref().is_some_and(|fault| DENIALS.iter().any(|words| fault.contains(words)));
        if status == StatusCode::UNAUTHORIZED || denied {
            let reason = if self.login.is_some() {
                "wrong user or password, or the camera's clock is far off".to_owned()
            } else {
                "it wants a user and a password".to_owned()
            };
            return Err(PtzError::Unauthorised { head: head(), reason });
        }
        if let Some(reason) = fault {
            return Err(PtzError::Refused { head: head(), doing, reason });
        }
        if !status.is_success() {
            return Err(PtzError::Refused { head: head(), doing, reason: format!("HTTP status {status}") });
        }
        let answer = answer.map_err(|reason| PtzError::Reply { head: head(), doing, reason })?;
        match answer.find("Body") {
            Some(body) => Ok(body.clone()),
            None => Err(PtzError::Reply { head: head(), doing, reason: "it has no SOAP body".into() }),
        }
    }

    fn failed(&self, doing: &'static str, error: ureq::Error) -> PtzError {
        let head = self.name.clone();
        #[cfg(feature = "onvif-tls")]
        if let Some(error) = super::tls::explained(&error, &self.tls, &head, doing) {
            return error;
        }
        match error {
            ureq::Error::Timeout(_) => {
                let after_s = (self.timeouts.connect + self.timeouts.answer).as_secs_f64();
                PtzError::TimedOut { head, doing, after_s }
            }
            ureq::Error::Io(source) => PtzError::Io { head, doing, source },
            ureq::Error::BodyExceedsLimit(limit) => {
                PtzError::Reply { head, doing, reason: format!("it is longer than {limit} bytes") }
            }
            ureq::Error::Protocol(error) if self.root.starts_with("http:") => {
                let reason = format!("{error}; a camera that wants TLS is reached by onvifs://");
                PtzError::Reply { head, doing, reason }
            }
            other => PtzError::Reply { head, doing, reason: other.to_string() },
        }
    }
}

/// What a fault says: its codes and its reason, shortened.
fn fault_text(fault: &Element) -> String {
    let mut words = Vec::new();
    collect(fault, &mut words);
    words.join(" ").chars().take(300).collect()
}

fn collect<'a>(element: &'a Element, words: &mut Vec<&'a str>) {
    let text = element.text.trim();
    if !text.is_empty() {
        words.push(text);
    }
    element.children.iter().for_each(|child| collect(child, words));
}

/// A number that is used once: from the time, the process and a count, hashed by the standard library's keyed hash.
fn nonce(count: &mut u64) -> [u8; 16] {
    use std::hash::{BuildHasher, RandomState};
    *count = count.wrapping_add(1);
    let (first, second) = (RandomState::new().hash_one(*count), RandomState::new().hash_one(std::process::id()));
    let mut bytes = [0; 16];
    bytes[..8].copy_from_slice(&first.to_le_bytes());
    bytes[8..].copy_from_slice(&second.to_le_bytes());
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nonces_differ_and_services_stay_on_the_camera() {
        let mut count = 0;
        assert_ne!(nonce(&mut count), nonce(&mut count));
        let mut client = Client::new("http://cam:81/onvif/device_service", None, None, Timeouts::default()).unwrap();
        assert_eq!((client.root.as_str(), client.name.as_str()), ("http://cam:81", "onvif://cam:81"));
        client.set_service(Service::Ptz, "http://evil.example/onvif/ptz?x=1");
        client.set_service(Service::Media, "/media");
        assert_eq!(
            (client.ptz_path.as_deref(), client.media_path.as_deref()),
            (Some("/onvif/ptz?x=1"), Some("/media"))
        );
        for bad in ["ftp://cam/", "cam", "http://", "http://u@cam/"] {
            assert!(Client::new(bad, None, None, Timeouts::default()).is_err(), "{bad}");
        }
        let certificates = Some(Path::new("cam.pem"));
        assert!(Client::new("http://cam/", None, certificates, Timeouts::default()).is_err(), "proves nothing");
    }
}
