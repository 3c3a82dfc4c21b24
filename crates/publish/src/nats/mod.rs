//! NATS.
//!
//! Its core protocol confirms nothing, retains nothing and knows no last will. So a stretch of messages is followed by one
//! to the connection's own inbox: when that comes back, the server has taken what went before. What MQTT retains is said again
//! with every sign of life.

mod notices;
mod session;

use crate::address::{Broker, Login};
use crate::link::{Failure, Link, PATIENCE_S, Wire};
use crate::publisher::Options;
use crate::{PublishError, Result};
use async_nats::{ConnectError, ConnectErrorKind, ConnectOptions, ServerAddr, ServerError};
use notices::Notices;
use session::Session;
use std::error::Error;
use std::io;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use tokio::sync::watch;

const PATIENCE: Duration = Duration::from_secs(PATIENCE_S);
/// Longer than any connection's client lives.
const NEVER: Duration = Duration::from_secs(365 * 24 * 3600);

/// Brokers that speak NATS.
pub(crate) struct Nats {
    server: ServerAddr,
    login: Option<Login>,
    /// How often the server is asked for a sign of life.
    period: Duration,
    #[cfg(feature = "tls")]
    tls: Option<tokio_rustls::rustls::ClientConfig>,
}

impl Nats {
    /// # Errors
    /// [`PublishError::Address`] for a host of a form that there is not, [`PublishError::Certificates`].
    pub fn new(broker: &Broker, options: &Options) -> Result<Self> {
        let address = format!("{}://{}:{}", broker.scheme.name(), broker.host, broker.port);
        let server = address.parse().map_err(|e: io::Error| PublishError::Address { reason: e.to_string() })?;
        Ok(Self {
            server,
            login: broker.login.clone(),
            period: options.keep_alive.max(Duration::from_secs(1)),
            #[cfg(feature = "tls")]
            tls: match broker.scheme.is_encrypted() {
                true => Some(crate::tls::client_config(broker.ca_file.as_deref())?),
                false => None,
            },
        })
    }

    fn options(&self, notices: watch::Sender<Notices>) -> ConnectOptions {
        let is_first = AtomicBool::new(true);
        let options = ConnectOptions::new()
            .name("pursuit")
            .connection_timeout(PATIENCE)
            .ping_interval(self.period)
            .client_capacity(session::CAPACITY)
            .subscription_capacity(session::CAPACITY)
            .ignore_discovered_servers()
            // Every connection has a client of its own, made by the loop of all links: this one does not come back.
            .reconnect_delay_callback(move |_| match is_first.swap(false, Ordering::Relaxed) {
                true => Duration::ZERO,
                false => NEVER,
            })
            .event_callback(move |event| {
                notices.send_modify(|notices| notices.note(event));
                std::future::ready(())
            });
        let options = match &self.login {
            Some(login) if login.user.is_empty() => options.token(login.password.clone()),
            Some(login) => options.user_and_password(login.user.clone(), login.password.clone()),
            None => options,
        };
        #[cfg(feature = "tls")]
        if let Some(config) = &self.tls {
            return options.tls_client_config(config.clone());
        }
        // A server may demand TLS where the address does not. The library would then look for cryptography that this build need
        // not have, and panic: a file that there is not ends the attempt with an error before.
        options.add_root_certificates(PathBuf::new())
    }

    /// What went wrong, in words, and whether trying again is of no use.
    fn explain(&self, error: &ConnectError) -> (String, bool) {
        let source = error.source();
        let text = source.map_or_else(|| error.to_string(), ToString::to_string);
        match error.kind() {
            ConnectErrorKind::AuthorizationViolation | ConnectErrorKind::Authentication => {
                ("the broker does not accept the user or the password".to_owned(), true)
            }
            ConnectErrorKind::TimedOut => (format!("no answer within {PATIENCE_S} s"), false),
            ConnectErrorKind::Tls if self.server.tls_required() => (text, false),
            ConnectErrorKind::Tls => {
                (format!("the broker demands TLS: write tls://{}:{}", self.server.host(), self.server.port()), true)
            }
            _ => match (source.and_then(|s| s.downcast_ref::<io::Error>()), source) {
                (Some(io), _) => explain_io(io),
                (None, Some(source)) if source.is::<ServerError>() => (format!("the broker says: {text}"), false),
                // What the library says of an end or an answer that it did not expect.
                _ if text.starts_with("expected INFO, got nothing") || text == "broken pipe" => {
                    ("it closed the connection".to_owned(), false)
                }
                _ if text.starts_with("expected INFO") => ("what answers there does not speak NATS".to_owned(), false),
                _ => (text, false),
            },
        }
    }
}

fn explain_io(error: &io::Error) -> (String, bool) {
    match error.kind() {
        #[cfg(feature = "tls")]
        _ if error.get_ref().is_some_and(|inner| inner.is::<tokio_rustls::rustls::Error>()) => {
            crate::tls::explain_io(error)
        }
        io::ErrorKind::InvalidInput | io::ErrorKind::InvalidData => {
            ("what answers there does not speak NATS".to_owned(), false)
        }
        _ => (error.to_string(), false),
    }
}

impl Wire for Nats {
    type Connection = Session;

    async fn connect(&self, link: &Link<'_>) -> std::result::Result<Session, Failure> {
        let notices = watch::Sender::new(Notices::default());
        let told = notices.subscribe();
        let client = self.options(notices).connect(self.server.clone()).await;
        Session::begin(client.map_err(|error| self.explain(&error))?, told, link).await
    }
}
