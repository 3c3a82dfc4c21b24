use super::client::Login;
use super::messages::escaped;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use sha1::{Digest, Sha1};

/// The header of a message that proves the user without giving the password away: WS-UsernameToken with
/// `digest = base64(SHA-1(nonce + created + password))`.
pub(super) fn header(login: &Login, nonce: &[u8; 16], created: &str) -> String {
    const SECURITY: &str = "http://docs.oasis-open.org/wss/2004/01/oasis-200401-wss";
    let mut hash = Sha1::new();
    hash.update(nonce);
    hash.update(created.as_bytes());
    hash.update(login.password.reveal().as_bytes());
    let (digest, nonce, user) = (STANDARD.encode(hash.finalize()), STANDARD.encode(nonce), escaped(&login.user));
    format!(
        "<s:Header><wsse:Security s:mustUnderstand=\"1\" xmlns:wsse=\"{SECURITY}-wssecurity-secext-1.0.xsd\" \
         xmlns:wsu=\"{SECURITY}-wssecurity-utility-1.0.xsd\"><wsse:UsernameToken><wsse:Username>{user}</wsse:Username>\
         <wsse:Password Type=\"{SECURITY}-username-token-profile-1.0#PasswordDigest\">{digest}</wsse:Password>\
         <wsse:Nonce EncodingType=\"{SECURITY}-soap-message-security-1.0#Base64Binary\">{nonce}</wsse:Nonce>\
         <wsu:Created>{created}</wsu:Created></wsse:UsernameToken></wsse:Security></s:Header>"
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drivers::Password;
    use crate::drivers::onvif::parse_answer;

    #[test]
    fn the_digest_is_that_of_the_profile() {
        let login = Login { user: "us<er".into(), password: Password::new("userpassword") };
        // The example of the ONVIF Application Programmer's Guide, section 6.1.1.3: this nonce, time and password.
        let nonce: [u8; 16] = STANDARD.decode("LKqI6G/AikKCQrN0zqZFlg==").unwrap().try_into().unwrap();
        let text = header(&login, &nonce, "2010-09-16T07:50:45Z");
        let root = parse_answer(&format!("<s:E xmlns:s='x'>{text}</s:E>")).unwrap();
        assert_eq!(root.text_of("Password"), Some("tuOSpGlFlIXsozq4HFNeeGeFLEI="));
        assert_eq!(root.text_of("Nonce"), Some("LKqI6G/AikKCQrN0zqZFlg=="));
        assert_eq!(root.text_of("Username"), Some("us<er"));
        assert!(!text.contains("userpassword"));
    }
}
