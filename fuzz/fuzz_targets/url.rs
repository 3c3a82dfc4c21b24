#![no_main]

use pursuit::media::Locator;

// Addresses with credentials show neither user's password nor token, whatever stands around them.
libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    let locator = Locator::from(text);
    let _ = (locator.to_string(), locator.credentials(), locator.address(), locator.redact("x"));
    assert_eq!(locator.reveal(), text);
    // A password of our own among what came, which ends the part before the host.
    let password = "s3s4m3";
    let mut parts = text.splitn(3, '\n').map(str::to_owned);
    let mut part = || parts.next().unwrap_or_default();
    let (user, host, message) = (part(), part(), part());
    // The last `@` ends the password: with another one in the host it would be a longer one than ours.
    let other = user.contains(['/', '?', '#', ':', '@']) || host.contains('@');
    if other || [&user, &host, &message].iter().any(|p| p.contains("s3s")) {
        return;
    }
    let locator = Locator::from(format!("rtsp://{user}:{password}@{host}"));
    let shown = [
        locator.to_string(),
        locator.address(),
        format!("{locator:?}"),
        locator.redact(&format!("{message}{password}")),
    ];
    for text in shown {
        assert!(!text.contains(password), "{text}");
    }
    if let Some((_, found)) = locator.credentials() {
        assert_eq!(
            Locator::from("rtsp://host").with_credentials("user", &found).credentials().map(|c| c.1),
            Some(found)
        );
    }
});
