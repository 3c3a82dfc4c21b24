//! Answers of an ONVIF camera.
#![no_main]

use libfuzzer_sys::fuzz_target;
use pursuit_ptz::drivers::onvif::{Spaces, parse_answer};

fuzz_target!(|text: &str| {
    if let Ok(answer) = parse_answer(text) {
        Spaces::read(&answer);
        answer.text_of("PTZ");
    }
});
