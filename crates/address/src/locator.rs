use crate::{AddressError, Server};
use percent_encoding::{AsciiSet, NON_ALPHANUMERIC, percent_decode_str, utf8_percent_encode};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::ffi::{OsStr, OsString};
use std::fmt;
use std::path::Path;

/// Words in the name of a query parameter whose value is shown to nobody.
const SECRETS: [&str; 8] = ["pass", "pwd", "token", "key", "auth", "secret", "sig", "credential"];
/// What stands in the place of a secret.
const HIDDEN: &str = "***";
/// Shorter secrets are words that other text holds by chance; of them only the whole address is hidden.
const SHORTEST: usize = 3;
/// What is escaped in a login: all but RFC 3986's unreserved characters (§2.3).
const ESCAPED: &AsciiSet = &NON_ALPHANUMERIC.remove(b'-').remove(b'.').remove(b'_').remove(b'~');

/// A file name or an address as the user wrote it. Where it holds credentials – `scheme://user:password@…`, `?token=…` –
/// they can be had by [`reveal`](Self::reveal) alone: whatever prints or stores it shows `***` in their place.
#[derive(Clone, PartialEq, Eq, Hash)]
pub struct Locator {
    text: String,
    /// As it is, where that is no text: file names need not be.
    raw: Option<OsString>,
}

impl Locator {
    /// As the user wrote it.
    pub fn new(text: impl Into<String>) -> Self {
        Self { text: text.into(), raw: None }
    }

    /// As a file name, which need not be text.
    pub fn path(&self) -> &Path {
        Path::new(self.raw.as_deref().unwrap_or(OsStr::new(&self.text)))
    }

    /// The whole address, for whoever opens it.
    pub fn reveal(&self) -> &str {
        &self.text
    }

    /// Whether anything in it is hidden.
    pub fn has_secrets(&self) -> bool {
        !self.secrets().is_empty()
    }

    /// Somebody else's message about it, without its secrets.
    pub fn redact(&self, message: &str) -> String {
        let secrets = self.secrets();
        if secrets.is_empty() {
            return message.to_owned();
        }
        let whole = message.replace(&self.text, &self.to_string());
        let long = secrets.into_iter().filter(|s| s.len() >= SHORTEST);
        long.fold(whole, |text, secret| text.replace(secret, HIDDEN))
    }

    /// What stands before `://`.
    pub fn scheme(&self) -> Option<&str> {
        self.text.split_once("://").map(|(scheme, _)| scheme)
    }

    /// The server that it names.
    ///
    /// # Errors
    /// [`AddressError`] saying what of it is missing or wrong.
    pub fn server(&self) -> Result<Server<'_>, AddressError> {
        self.scheme().ok_or(AddressError::Scheme)?;
        Server::parse(self.parts().1)
    }

    /// The same address with these credentials in it, in place of those that it may have.
    #[must_use]
    pub fn with_credentials(&self, user: &str, password: &str) -> Self {
        let Some(scheme) = self.scheme() else { return self.clone() };
        let (_, rest) = self.parts();
        let (user, password) = (utf8_percent_encode(user, ESCAPED), utf8_percent_encode(password, ESCAPED));
        Self::new(format!("{scheme}://{user}:{password}@{rest}"))
    }

    /// The user and the password in it, as they are meant, where there are any.
    pub fn credentials(&self) -> Option<(String, String)> {
        self.login().and_then(|(user, password)| Some((user, password?)))
    }

    /// The user in it, and the password where there is one, as they are meant.
    pub fn login(&self) -> Option<(String, Option<String>)> {
        let (user, password) = match self.parts().0?.split_once(':') {
            Some((user, password)) => (user, Some(percent_decoded(password))),
            None => (self.parts().0?, None),
        };
        Some((percent_decoded(user), password)).filter(|(user, password)| !user.is_empty() || password.is_some())
    }

    /// The address without user and password.
    pub fn address(&self) -> String {
        match self.scheme() {
            Some(scheme) => format!("{scheme}://{}", self.parts().1),
            None => self.text.clone(),
        }
    }

    /// What stands before the `@`, and what stands behind it, without the scheme.
    fn parts(&self) -> (Option<&str>, &str) {
        let Some((_, rest)) = self.text.split_once("://") else { return (None, &self.text) };
        let authority = rest.split(['/', '?', '#']).next().unwrap_or(rest);
        match user_information(rest).or_else(|| authority.rsplit_once('@').map(|(user, _)| user)) {
            Some(user) => (Some(user), rest.get(user.len() + 1..).unwrap_or_default()),
            None => (None, rest),
        }
    }

    /// Every secret in it, from left to right.
    fn secrets(&self) -> Vec<&str> {
        let Some((_, rest)) = self.text.split_once("://") else { return Vec::new() };
        let user = user_information(rest);
        let password = user.and_then(|u| u.split_once(':')).map(|(_, password)| password);
        // A password may look like a query itself.
        let behind = user.and_then(|u| rest.get(u.len()..)).unwrap_or(rest);
        let query = behind.split_once('?').map_or("", |(_, query)| query);
        let values = query.split(['&', ';', '#']).filter_map(|pair| pair.split_once('=')).filter(|(name, _)| {
            let name = name.to_ascii_lowercase();
            SECRETS.iter().any(|word| name.contains(word))
        });
        password.into_iter().chain(values.map(|(_, value)| value)).filter(|secret| !secret.is_empty()).collect()
    }
}

/// What is meant by `%XX`; a `%` that begins no such triple stands for itself.
fn percent_decoded(text: &str) -> String {
    percent_decode_str(text).decode_utf8_lossy().into_owned()
}

/// What stands before the `@`. Passwords are often written as they are, with `@`, `/` and `?` in them: then too much is
/// hidden rather than too little.
fn user_information(rest: &str) -> Option<&str> {
    let authority = rest.split(['/', '?', '#']).next().unwrap_or(rest);
    let port = authority.rsplit_once(':').map(|(_, port)| port);
    let is_whole = !authority.contains('@') && port.is_none_or(|p| p.chars().all(|c| c.is_ascii_digit()));
    if is_whole { None } else { rest.rfind('@').map(|at| &rest[..at]) }
}

impl<T: Into<OsString>> From<T> for Locator {
    fn from(name: T) -> Self {
        match name.into().into_string() {
            Ok(text) => Self::new(text),
            Err(raw) => Self { text: raw.to_string_lossy().into_owned(), raw: Some(raw) },
        }
    }
}

impl Serialize for Locator {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for Locator {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer).map(Self::new)
    }
}

impl fmt::Display for Locator {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut from = 0;
        for secret in self.secrets() {
            // Secrets are parts of the text, in their order.
            let at = secret.as_ptr() as usize - self.text.as_ptr() as usize;
            f.write_str(&self.text[from..at])?;
            f.write_str(HIDDEN)?;
            from = at + secret.len();
        }
        f.write_str(&self.text[from..])
    }
}

impl fmt::Debug for Locator {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "\"{self}\"")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn credentials_are_shown_to_nobody() {
        for (text, shown) in [
            ("clip.mp4", "clip.mp4"),
            ("a@b:c.mp4", "a@b:c.mp4"),
            ("rtsp://camera/1", "rtsp://camera/1"),
            ("rtsp://user@camera/1", "rtsp://user@camera/1"),
            ("http://host:8080/a@b.mp4", "http://host:8080/a@b.mp4"),
            ("rtsp://user:sesame@camera:554/1?x=2", "rtsp://user:***@camera:554/1?x=2"),
            ("rtsp://:sesame@camera", "rtsp://:***@camera"),
            ("rtsp://user:@camera", "rtsp://user:@camera"),
            ("rtsp://user:se@same/x?y@camera/1", "rtsp://user:***@camera/1"),
            ("rtsp://user:s/s@camera/1", "rtsp://user:***@camera/1"),
            ("rtsp://user:s1?token=2@camera/1?token=3", "rtsp://user:***@camera/1?token=***"),
            ("rtsp://user?token=2@camera/1", "rtsp://user?token=***"),
            ("http://h/v?a=1&Access_Token=abc&sig=d;e=f#key=g", "http://h/v?a=1&Access_Token=***&sig=***;e=f#key=***"),
            ("http://u:p@h/v?password=p", "http://u:***@h/v?password=***"),
        ] {
            let locator = Locator::new(text);
            assert_eq!((locator.to_string(), format!("{locator:?}")), (shown.to_owned(), format!("\"{shown}\"")));
            assert_eq!((locator.reveal(), locator.has_secrets()), (text, text != shown), "{text}");
        }
    }

    #[test]
    fn credentials_are_put_in_and_taken_out() {
        let plain = Locator::new("rtsp://camera:554/1?x=2");
        assert_eq!((plain.credentials(), plain.address()), (None, "rtsp://camera:554/1?x=2".to_owned()));
        let with = plain.with_credentials("me", "se:s/a@me%é");
        assert_eq!(with.reveal(), "rtsp://me:se%3As%2Fa%40me%25%C3%A9@camera:554/1?x=2");
        assert_eq!(with.to_string(), "rtsp://me:***@camera:554/1?x=2");
        assert_eq!(with.credentials(), Some(("me".to_owned(), "se:s/a@me%é".to_owned())));
        assert_eq!(with.address(), plain.reveal());
        assert_eq!(with.with_credentials("a", "b").reveal(), "rtsp://a:b@camera:554/1?x=2");
        let raw = Locator::new("rtsp://user:s/s%@camera/1");
        assert_eq!(raw.credentials(), Some(("user".to_owned(), "s/s%".to_owned())));
        assert_eq!(raw.address(), "rtsp://camera/1");
        assert_eq!(Locator::new("rtsp://user@camera/1").address(), "rtsp://camera/1");
        assert_eq!(with.login(), Some(("me".to_owned(), Some("se:s/a@me%é".to_owned()))));
        assert_eq!(Locator::new("mqtt://m%65@house/yard").login(), Some(("me".to_owned(), None)));
        assert!([plain.login(), Locator::new("mqtt://@house").login()].iter().all(Option::is_none));
        let file = Locator::new("clip.mp4");
        assert_eq!((file.with_credentials("a", "b"), file.address()), (file.clone(), "clip.mp4".to_owned()));
    }

    #[test]
    fn what_is_stored_holds_no_secret() {
        let locator: Locator = serde_json::from_str("\"rtsp://user:sesame@camera/1\"").unwrap();
        assert_eq!(locator.reveal(), "rtsp://user:sesame@camera/1");
        assert_eq!(serde_json::to_string(&locator).unwrap(), "\"rtsp://user:***@camera/1\"");
    }

    #[test]
    #[cfg(unix)]
    fn file_names_need_not_be_text() {
        use std::os::unix::ffi::OsStringExt;
        let raw = OsString::from_vec(b"caf\xe9.mp4".to_vec());
        let locator = Locator::from(raw.clone());
        assert_eq!((locator.path(), locator.reveal()), (Path::new(&raw), "caf\u{fffd}.mp4"));
        assert_eq!(Locator::from("clip.mp4"), Locator::new("clip.mp4"));
        assert_eq!(Locator::from("clip.mp4").path(), Path::new("clip.mp4"));
    }

    #[test]
    fn messages_of_others_are_cleaned() {
        let locator = Locator::new("rtsp://user:sesame@camera/1?token=abcd");
        assert_eq!(
            locator.redact("cannot open rtsp://user:sesame@camera/1?token=abcd (user sesame, abcd) at camera"),
            "cannot open rtsp://user:***@camera/1?token=*** (user ***, ***) at camera"
        );
        let short = Locator::new("rtsp://u:p@camera");
        assert_eq!(short.redact("rtsp://u:p@camera: no path"), "rtsp://u:***@camera: no path");
        assert_eq!(Locator::new("clip.mp4").redact("clip.mp4 is bad"), "clip.mp4 is bad");
    }
}
