#![no_main]

use pursuit::config::{parse_box, parse_setting};
use pursuit::{Resize, RunConfig, toml};

// Configurations and what stands on command lines: what is read can be written, and read again as the same; whatever it
// names, the methods are made or refused.
libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    let _ = parse_box(text);
    let _ = parse_setting(text);
    if let Ok(resize) = text.parse::<Resize>() {
        assert_eq!(resize.to_string().parse::<Resize>().ok(), Some(resize));
    }
    let Ok(config) = toml::from_str::<RunConfig>(text) else { return };
    let _ = config.methods();
    if config.boxes.iter().flatten().all(|v| v.is_finite()) && config.input.as_ref().is_none_or(|i| !i.has_secrets()) {
        if let Ok(written) = toml::to_string(&config) {
            let read: RunConfig = toml::from_str(&written).expect("what was written can be read");
            assert_eq!(toml::to_string(&read).ok(), Some(written));
        }
    }
});
