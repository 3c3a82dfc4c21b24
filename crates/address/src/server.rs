use std::fmt;

/// What is wrong with the server of an address, to be said behind "the address of …".
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum AddressError {
    /// There is no `SCHEME://`.
    #[error("has no scheme")]
    Scheme,
    /// There is no host, or what stands in its place is none.
    #[error("has no host")]
    Host,
    /// The port is not a number from 1 to 65535.
    #[error("has a port that is no number from 1 to 65535")]
    Port,
    /// An IPv6 address stands without brackets, so that its port cannot be told.
    #[error("has an IPv6 address that does not stand in brackets, as in [::1]")]
    Brackets,
}

/// The server of an address and what is wanted of it, without the login.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Server<'a> {
    /// Its name or address; an IPv6 address without brackets.
    pub host: &'a str,
    /// Its port, where the address says it.
    pub port: Option<u16>,
    /// What stands behind the first `/`, without it.
    pub path: &'a str,
    /// What stands behind the path, with its `?` or `#`.
    pub query: &'a str,
}

impl<'a> Server<'a> {
    /// Reads `HOST[:PORT][/PATH][?QUERY]`.
    pub(crate) fn parse(text: &'a str) -> Result<Self, AddressError> {
        let (text, query) = text.split_at(text.find(['?', '#']).unwrap_or(text.len()));
        let (authority, path) = text.split_once('/').unwrap_or((text, ""));
        let (host, port) = match authority.rsplit_once(':') {
            Some((host, port)) if !port.ends_with(']') => {
                (host, Some(port.parse().ok().filter(|port| *port > 0).ok_or(AddressError::Port)?))
            }
            _ => (authority, None),
        };
        let bare = host.strip_prefix('[').and_then(|h| h.strip_suffix(']')).unwrap_or(host);
        if bare.is_empty() || bare.contains(['@', '[', ']']) || bare.contains(char::is_whitespace) {
            return Err(AddressError::Host);
        }
        if bare == host && host.contains(':') {
            return Err(AddressError::Brackets);
        }
        Ok(Self { host: bare, port, path, query })
    }
}

impl fmt::Display for Server<'_> {
    /// `HOST[:PORT]`, an IPv6 address in brackets.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.host.contains(':') {
            true => write!(f, "[{}]", self.host)?,
            false => f.write_str(self.host)?,
        }
        self.port.map_or(Ok(()), |port| write!(f, ":{port}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Locator;

    #[test]
    fn servers_are_read() {
        for (text, host, port, path, query, shown) in [
            ("mqtt://house", "house", None, "", "", "house"),
            ("mqtt://10.0.0.2:2883/a/b", "10.0.0.2", Some(2883), "a/b", "", "10.0.0.2:2883"),
            ("visca://[fe80::1]:1259/", "fe80::1", Some(1259), "", "", "[fe80::1]:1259"),
            ("tls://[::1]", "::1", None, "", "", "[::1]"),
            ("rtsp://me:s/e@cret@cam/1?x=2#y", "cam", None, "1", "?x=2#y", "cam"),
            ("http://cam?a:b", "cam", None, "", "?a:b", "cam"),
        ] {
            let locator = Locator::new(text);
            let server = locator.server().unwrap();
            assert_eq!(server, Server { host, port, path, query }, "{text}");
            assert_eq!(server.to_string(), shown);
        }
    }

    #[test]
    fn servers_that_there_are_not_are_refused() {
        for (text, error) in [
            ("house", AddressError::Scheme),
            ("mqtt://", AddressError::Host),
            ("mqtt://:1883", AddressError::Host),
            ("mqtt://a b", AddressError::Host),
            ("mqtt://me@", AddressError::Host),
            ("mqtt://[::1", AddressError::Host),
            ("mqtt://::1", AddressError::Brackets),
            ("mqtt://house:0", AddressError::Port),
            ("mqtt://house:99999", AddressError::Port),
            ("mqtt://house:x", AddressError::Port),
        ] {
            assert_eq!(Locator::new(text).server(), Err(error), "{text}");
        }
    }
}
