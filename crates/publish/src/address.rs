use crate::{PublishError, Result};
use pursuit_address::{AddressError, Locator, Server};
use std::fmt;
use std::path::PathBuf;

/// The longest prefix of topics, bytes: topics have at most 65 535, and other systems far less.
const LONGEST_PREFIX: usize = 200;

/// How a broker is spoken to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Scheme {
    /// MQTT 3.1.1 over TCP.
    Mqtt,
    /// MQTT 3.1.1 over TLS.
    Mqtts,
    /// NATS over TCP.
    Nats,
    /// NATS over TLS, named as the tools of NATS name it.
    Tls,
}

impl Scheme {
    /// As it stands before `://`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Mqtt => "mqtt",
            Self::Mqtts => "mqtts",
            Self::Nats => "nats",
            Self::Tls => "tls",
        }
    }

    /// Whether brokers of this kind speak MQTT, so that they retain messages and know a last will.
    pub const fn is_mqtt(self) -> bool {
        matches!(self, Self::Mqtt | Self::Mqtts)
    }

    /// Whether they are spoken to over TLS.
    pub const fn is_encrypted(self) -> bool {
        matches!(self, Self::Mqtts | Self::Tls)
    }

    /// # Errors
    /// [`PublishError::Missing`] where this build cannot reach such brokers.
    pub const fn check(self) -> Result<()> {
        let is_there = match self {
            Self::Mqtt => cfg!(feature = "mqtt"),
            Self::Mqtts => cfg!(all(feature = "mqtt", feature = "tls")),
            Self::Nats => cfg!(feature = "nats"),
            Self::Tls => cfg!(all(feature = "nats", feature = "tls")),
        };
        if is_there { Ok(()) } else { Err(self.missing()) }
    }

    /// What would mend that this build cannot reach such brokers.
    pub(crate) const fn missing(self) -> PublishError {
        let features = match self {
            Self::Mqtt | Self::Mqtts => self.name(),
            Self::Nats => "nats",
            Self::Tls => "nats,tls",
        };
        PublishError::Missing { scheme: self.name(), features }
    }

    const fn default_port(self) -> u16 {
        match self {
            Self::Mqtt => 1883,
            Self::Mqtts => 8883,
            Self::Nats | Self::Tls => 4222,
        }
    }
}

/// Who one is.
#[derive(Clone, PartialEq, Eq)]
pub struct Login {
    /// The name; with NATS none where the password is a token.
    pub user: String,
    /// The password, shown to nobody.
    pub password: String,
}

impl fmt::Debug for Login {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Login").field("user", &self.user).finish_non_exhaustive()
    }
}

/// A broker and the way to it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Broker {
    /// How it is spoken to.
    pub scheme: Scheme,
    /// Its name or address; an IPv6 address in brackets.
    pub host: String,
    /// Its port.
    pub port: u16,
    /// What its topics begin with, where the address says it.
    pub prefix: Option<String>,
    /// Who one is there.
    pub login: Option<Login>,
    /// Certificates to trust in place of the system's, a PEM file.
    pub ca_file: Option<PathBuf>,
}

impl Broker {
    /// Reads `SCHEME://[USER[:PASSWORD]@]HOST[:PORT][/PREFIX]`.
    ///
    /// # Errors
    /// [`PublishError::Address`] saying what is wrong.
    pub fn parse(address: impl Into<Locator>) -> Result<Self> {
        let address = address.into();
        let wrong = |reason: String| PublishError::Address { reason };
        let of_address = |error: AddressError| wrong(format!("the broker's address {error}"));
        let scheme = match address.scheme().ok_or(AddressError::Scheme).map_err(of_address)? {
            "mqtt" => Scheme::Mqtt,
            "mqtts" => Scheme::Mqtts,
            "nats" => Scheme::Nats,
            "tls" => Scheme::Tls,
            other => return Err(wrong(format!("there are no brokers of the kind `{other}`"))),
        };
        let server = address.server().map_err(of_address)?;
        if let Some(sign) = server.query.chars().next() {
            return Err(wrong(format!("`{sign}` has no meaning in a broker's address")));
        }
        let prefix = server.path.trim_end_matches('/');
        let prefix = if prefix.is_empty() { None } else { Some(checked(prefix, scheme).map_err(wrong)?) };
        let login = address.login().map(|(user, password)| Login { user, password: password.unwrap_or_default() });
        let port = server.port.unwrap_or(scheme.default_port());
        let host = Server { port: None, ..server }.to_string();
        Ok(Self { scheme, host, port, prefix, login, ca_file: None })
    }
}

/// A prefix that every broker of the kind takes.
fn checked(prefix: &str, scheme: Scheme) -> std::result::Result<String, String> {
    if prefix.len() > LONGEST_PREFIX {
        return Err(format!("the prefix is longer than {LONGEST_PREFIX} bytes"));
    }
    let has_wildcards = match scheme.is_mqtt() {
        true => prefix.contains(['+', '#']),
        false => prefix.contains(['*', '>']) || prefix.contains(char::is_whitespace),
    };
    if has_wildcards || prefix.contains(char::is_control) || prefix.starts_with('$') {
        let signs = if scheme.is_mqtt() { "`+`, `#`" } else { "`*`, `>`, space" };
        return Err(format!("a prefix of topics has no {signs} or control character and does not begin with `$`"));
    }
    // Levels of NATS are separated by dots in the end.
    if prefix.split(['/', '.']).any(str::is_empty) && (!scheme.is_mqtt() || prefix.split('/').any(str::is_empty)) {
        return Err("a prefix of topics has no empty level".to_owned());
    }
    Ok(prefix.to_owned())
}

impl fmt::Display for Broker {
    /// The address without the password.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}://", self.scheme.name())?;
        if let Some(login) = self.login.as_ref().filter(|login| !login.user.is_empty()) {
            write!(f, "{}@", login.user)?;
        }
        write!(f, "{}:{}", self.host, self.port)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_are_read() {
        let read = |text: &str| {
            let b = Broker::parse(text).unwrap();
            (b.scheme, b.host, b.port, b.prefix.unwrap_or_default())
        };
        assert_eq!(read("mqtt://house"), (Scheme::Mqtt, "house".into(), 1883, String::new()));
        assert_eq!(read("mqtts://house/"), (Scheme::Mqtts, "house".into(), 8883, String::new()));
        assert_eq!(read("mqtt://10.0.0.2:2883/a/b"), (Scheme::Mqtt, "10.0.0.2".into(), 2883, "a/b".into()));
        assert_eq!(read("mqtt://[::1]/yard"), (Scheme::Mqtt, "[::1]".into(), 1883, "yard".into()));
        assert_eq!(read("mqtt://[::1]:9/yard"), (Scheme::Mqtt, "[::1]".into(), 9, "yard".into()));
        assert_eq!(read("mqtt://house/a..b"), (Scheme::Mqtt, "house".into(), 1883, "a..b".into()));
        assert_eq!(read("nats://house/a/b.c"), (Scheme::Nats, "house".into(), 4222, "a/b.c".into()));
        assert_eq!(read("nats://me:s/e@cret@house/a"), (Scheme::Nats, "house".into(), 4222, "a".into()));
        assert_eq!(read("tls://[::1]"), (Scheme::Tls, "[::1]".into(), 4222, String::new()));
    }

    #[test]
    fn wrong_addresses_are_refused() {
        for (bad, word) in [
            ("house", "scheme"),
            ("http://house", "kind `http`"),
            ("mqtt://", "no host"),
            ("mqtt://:1883", "no host"),
            ("mqtt://a b", "no host"),
            ("mqtt://::1", "brackets"),
            ("mqtt://house:0", "port"),
            ("mqtt://house:99999", "port"),
            ("mqtt://house:x", "port"),
            ("mqtt://house/a?b=c", "`?`"),
            ("mqtt://house/a/#", "`#`"),
            ("mqtt://house/a/+", "`+`"),
            ("mqtt://house/a//b", "empty level"),
            ("mqtt://house/$SYS", "`$`"),
            ("nats://house/a/*", "`*`"),
            ("nats://house/>", "`>`"),
            ("nats://house/a b", "space"),
            ("tls://house/a..b", "empty level"),
            ("nats://house/.a", "empty level"),
            ("nats://house/$JS", "`$`"),
        ] {
            let error = Broker::parse(bad).unwrap_err().to_string();
            assert!(error.contains(word), "{bad}: {error}");
        }
        assert!(Broker::parse(format!("mqtt://h/{}", "a".repeat(300))).is_err());
    }

    #[test]
    fn what_this_build_cannot_reach_is_said_with_what_would_mend_it() {
        let tls = cfg!(feature = "tls");
        for (scheme, has, features) in [
            (Scheme::Mqtt, cfg!(feature = "mqtt"), "`--features mqtt`"),
            (Scheme::Mqtts, cfg!(feature = "mqtt") && tls, "`--features mqtts`"),
            (Scheme::Nats, cfg!(feature = "nats"), "`--features nats`"),
            (Scheme::Tls, cfg!(feature = "nats") && tls, "`--features nats,tls`"),
        ] {
            assert_eq!(scheme.check().is_ok(), has, "{scheme:?}");
            let error = scheme.missing().to_string();
            assert!(error.contains(features) && error.contains(&format!("`{}://`", scheme.name())), "{error}");
        }
    }

    #[test]
    fn a_password_is_not_shown() {
        let broker = Broker::parse("mqtt://me:sesame@house").unwrap();
        assert_eq!(broker.login, Some(Login { user: "me".into(), password: "sesame".into() }));
        assert_eq!(broker.to_string(), "mqtt://me@house:1883");
        assert!(!format!("{broker:?}").contains("sesame"));
        let login = Some(Login { user: String::new(), password: "token".into() });
        assert_eq!(Broker { login, ..broker }.to_string(), "mqtt://house:1883");
    }
}
