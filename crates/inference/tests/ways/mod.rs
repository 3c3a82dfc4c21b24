//! Which libraries run networks by file.

use pursuit_inference::onnx::{Backend, OnnxOptions};

/// The libraries of this build; onnxruntime where `PURSUIT_ONNXRUNTIME` names it.
pub fn ways() -> Vec<OnnxOptions> {
    let mut ways = Vec::new();
    if cfg!(feature = "rten") {
        ways.push(OnnxOptions { backend: Backend::Rten, ..OnnxOptions::default() });
    }
    match std::env::var_os("PURSUIT_ONNXRUNTIME").filter(|_| cfg!(feature = "onnxruntime")) {
        Some(library) => ways.push(OnnxOptions { library: Some(library.into()), ..OnnxOptions::default() }),
        None => println!("skipped: onnxruntime, for want of PURSUIT_ONNXRUNTIME"),
    }
    ways
}
