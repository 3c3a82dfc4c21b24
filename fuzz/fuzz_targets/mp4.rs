#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    pursuit_media::fuzzing::mp4(bytes);
});
