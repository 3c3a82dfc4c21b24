//! How networks that come as files are run: the group `[runtime]` of detectors and trackers that take one.

use pursuit_inference::InferenceError;
use pursuit_inference::onnx::{Backend, Device, OnnxOptions};
use pursuit_parameters::{FileName, ParameterError};
use pursuit_tracking::TrackingError;
use std::path::Path;

pursuit_parameters::choices! {
    /// Which library runs a network.
    pub enum Library {
        /// onnxruntime where it is found, else rten.
        Auto = "auto",
        /// onnxruntime, loaded when the program runs.
        OnnxRuntime = "onnxruntime",
        /// rten, built into the program.
        Rten = "rten",
    }
}

pursuit_parameters::parameters! {
    /// How a network that comes as a file is run.
    pub struct RuntimeParams {
        /// The library that runs it.
        pub library: Library = Library::Auto;
        /// The file of the onnxruntime library, or the folder it is in; empty: the first found where systems put it.
        pub onnxruntime: FileName = FileName::default();
        /// What the network runs on, where onnxruntime's library can hand it there; else it runs on the processor, and says so.
        pub device: Device = Device::Cpu;
        /// Threads for one network. 1: several targets share the machine well.
        pub threads: usize = 1, in 1..=256;
        /// Greatest size of a file, and of what a network takes and gives.
        pub most_mib: usize = 256, in 1..=65_536, unit "MiB";
    }
}

impl RuntimeParams {
    /// The same for `pursuit_inference`.
    pub fn options(&self) -> OnnxOptions {
        OnnxOptions {
            backend: match self.library {
                Library::Auto => Backend::Auto,
                Library::OnnxRuntime => Backend::OnnxRuntime,
                Library::Rten => Backend::Rten,
            },
            library: self.onnxruntime.path().map(Path::to_path_buf),
            device: self.device,
            threads: self.threads,
            max_bytes: (self.most_mib as u64) << 20,
            ..OnnxOptions::default()
        }
    }
}

/// The error about the file named by the parameter `name` of `owner`, which cannot be used.
pub(crate) fn unusable(owner: &str, name: &str) -> impl FnOnce(InferenceError) -> TrackingError {
    let (owner, name) = (owner.to_owned(), name.to_owned());
    move |e| ParameterError::new(owner, name, e.to_string()).into()
}
