use std::fmt;

/// Words in the name of a query parameter whose value is shown to nobody.
const SECRETS: [&str; 8] = ["pass", "pwd", "token", "key", "auth", "secret", "sig", "credential"];
/// What stands in the place of a secret.
const HIDDEN: &str = "***";
/// Shorter secrets are words that other text holds by chance; of them only the whole address is hidden.
const SHORTEST: usize = 3;

/// The address of an input as the user wrote it. Where it holds credentials – `scheme://user:password@…`,
/// `?token=…` – they can be had by [`reveal`](Self::reveal) alone: whatever prints it shows `***` in their place.
#[derive(Clone, PartialEq, Eq, Hash)]
pub struct Locator(String);

impl Locator {
    /// As the user wrote it.
    pub fn new(text: impl Into<String>) -> Self {
        Self(text.into())
    }

    /// The whole address, for whoever opens it.
    pub fn reveal(&self) -> &str {
        &self.0
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
        let whole = message.replace(&self.0, &self.to_string());
        let long = secrets.into_iter().filter(|s| s.len() >= SHORTEST);
        long.fold(whole, |text, secret| text.replace(secret, HIDDEN))
    }

    /// Every secret in it, from left to right.
    fn secrets(&self) -> Vec<&str> {
        let Some((_, rest)) = self.0.split_once("://") else { return Vec::new() };
        let password = user_information(rest).and_then(|u| u.split_once(':')).map(|(_, password)| password);
        let query = rest.split_once('?').map_or("", |(_, query)| query);
        let values = query.split(['&', ';', '#']).filter_map(|pair| pair.split_once('=')).filter(|(name, _)| {
            let name = name.to_ascii_lowercase();
            SECRETS.iter().any(|word| name.contains(word))
        });
        password.into_iter().chain(values.map(|(_, value)| value)).filter(|secret| !secret.is_empty()).collect()
    }
}

/// What stands before the `@`. Passwords are often written as they are, with `@`, `/` and `?` in them: then too much is
/// hidden rather than too little.
fn user_information(rest: &str) -> Option<&str> {
    let authority = rest.split(['/', '?', '#']).next().unwrap_or(rest);
    let port = authority.rsplit_once(':').map(|(_, port)| port);
    let is_whole = !authority.contains('@') && port.is_none_or(|p| p.chars().all(|c| c.is_ascii_digit()));
    if is_whole { None } else { rest.rfind('@').map(|at| &rest[..at]) }
}

impl fmt::Display for Locator {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut from = 0;
        for secret in self.secrets() {
            // Secrets are parts of the text, in their order.
            let at = secret.as_ptr() as usize - self.0.as_ptr() as usize;
            f.write_str(&self.0[from..at])?;
            f.write_str(HIDDEN)?;
            from = at + secret.len();
        }
        f.write_str(&self.0[from..])
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
            ("http://h/v?a=1&Access_Token=abc&sig=d;e=f#key=g", "http://h/v?a=1&Access_Token=***&sig=***;e=f#key=***"),
            ("http://u:p@h/v?password=p", "http://u:***@h/v?password=***"),
        ] {
            let locator = Locator::new(text);
            assert_eq!((locator.to_string(), format!("{locator:?}")), (shown.to_owned(), format!("\"{shown}\"")));
            assert_eq!((locator.reveal(), locator.has_secrets()), (text, text != shown), "{text}");
        }
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
