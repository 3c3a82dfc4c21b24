//! Bytes of a Pelco-D head.
#![no_main]

use libfuzzer_sys::fuzz_target;
use pursuit_ptz::drivers::pelco_d::parse_replies;

fuzz_target!(|bytes: &[u8]| {
    parse_replies(1, bytes);
});
