#![no_main]

// Networks by file: what is accepted has inputs of bounded size.
libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    pursuit_inference::onnx::is_sound(bytes);
});
