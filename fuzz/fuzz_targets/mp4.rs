#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    pursuit_media::fuzz_entry::mp4(bytes);
});
