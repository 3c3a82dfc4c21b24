//! Bytes of a VISCA camera, as a stream and as single messages.
#![no_main]

use libfuzzer_sys::fuzz_target;
use pursuit_ptz::drivers::visca::{Splitter, parse_reply};

fuzz_target!(|bytes: &[u8]| {
    if let Some(reply) = parse_reply(bytes) {
        reply.position(14.4);
        reply.zoom(0x4000);
    }
    let mut splitter = Splitter::default();
    for byte in bytes {
        splitter.take(*byte);
    }
});
