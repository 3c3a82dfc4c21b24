use crate::{PublishError, Result};
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
}

impl Scheme {
    /// As it stands before `://`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Mqtt => "mqtt",
            Self::Mqtts => "mqtts",
        }
    }

    const fn default_port(self) -> u16 {
        match self {
            Self::Mqtt => 1883,
            Self::Mqtts => 8883,
        }
    }
}

/// Who one is.
#[derive(Clone, PartialEq, Eq)]
pub struct Login {
    /// The name.
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
    /// Reads `SCHEME://HOST[:PORT][/PREFIX]`; a user and a password do not belong here.
    ///
    /// # Errors
    /// [`PublishError::Address`] saying what is wrong.
    pub fn parse(address: &str) -> Result<Self> {
        let wrong = |reason: String| PublishError::Address { reason };
        let Some((scheme, rest)) = address.split_once("://") else {
            return Err(wrong("the broker's address has no scheme".to_owned()));
        };
        let scheme = match scheme {
            "mqtt" => Scheme::Mqtt,
            "mqtts" => Scheme::Mqtts,
            other => return Err(wrong(format!("there are no brokers of the kind `{other}`"))),
        };
        if let Some(at) = rest.find(['?', '#']) {
            return Err(wrong(format!("`{}` has no meaning in a broker's address", &rest[at..=at])));
        }
        let (authority, prefix) = rest.split_once('/').unwrap_or((rest, ""));
        let (host, port) = match authority.rsplit_once(':') {
            Some((host, port)) if !port.ends_with(']') => {
                let port = port.parse().ok().filter(|port| *port > 0);
                (host, port.ok_or_else(|| wrong("the port of the broker's address is no number up to 65535".into()))?)
            }
            _ => (authority, scheme.default_port()),
        };
        let bare = host.strip_prefix('[').and_then(|h| h.strip_suffix(']')).unwrap_or(host);
        if bare.is_empty() || bare.contains(['@', '[', ']']) || bare.contains(char::is_whitespace) {
            return Err(wrong("the broker's address has no host".to_owned()));
        }
        if bare == host && host.contains(':') {
            return Err(wrong("an IPv6 address stands in brackets, for example mqtt://[::1]".to_owned()));
        }
        let prefix = prefix.trim_end_matches('/');
        let prefix = if prefix.is_empty() { None } else { Some(checked(prefix).map_err(wrong)?) };
        Ok(Self { scheme, host: host.to_owned(), port, prefix, login: None, ca_file: None })
    }
}

/// A prefix that every broker takes.
fn checked(prefix: &str) -> std::result::Result<String, String> {
    if prefix.len() > LONGEST_PREFIX {
        return Err(format!("the prefix is longer than {LONGEST_PREFIX} bytes"));
    }
    if prefix.contains(['+', '#']) || prefix.contains(char::is_control) || prefix.starts_with('$') {
        return Err("a prefix of topics has no `+`, `#` or control character and does not begin with `$`".to_owned());
    }
    if prefix.split('/').any(str::is_empty) {
        return Err("a prefix of topics has no empty level".to_owned());
    }
    Ok(prefix.to_owned())
}

impl fmt::Display for Broker {
    /// The address without the password.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}://", self.scheme.name())?;
        if let Some(login) = &self.login {
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
        ] {
            let error = Broker::parse(bad).unwrap_err().to_string();
            assert!(error.contains(word), "{bad}: {error}");
        }
        assert!(Broker::parse(&format!("mqtt://h/{}", "a".repeat(300))).is_err());
    }

    #[test]
    fn a_password_is_not_shown() {
        let login = Some(Login { user: "me".into(), password: "sesame".into() });
        let broker = Broker { login, ..Broker::parse("mqtt://house").unwrap() };
        assert_eq!(broker.to_string(), "mqtt://me@house:1883");
        assert!(!format!("{broker:?}").contains("sesame"));
    }
}
