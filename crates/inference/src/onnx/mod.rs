//! Networks by ONNX file.
//!
//! Two libraries can run them: onnxruntime, where the machine has it, loaded at run time (feature `onnxruntime`), and
//! rten, in pure Rust (feature `rten`). A file is looked through before either sees it (the `file` module): what is damaged, asks
//! for other files, loops, or makes much out of little is refused with a word on what would mend it. With neither feature
//! [`open`] says which would run the file.

#[cfg(any(feature = "onnxruntime", feature = "rten"))]
mod file;
mod library;
mod masks;
#[cfg(feature = "onnxruntime")]
mod onnxruntime;
#[cfg(any(feature = "onnxruntime", feature = "rten"))]
mod proto;
#[cfg(feature = "rten")]
mod rten;
mod siamese;
#[cfg(all(test, any(feature = "onnxruntime", feature = "rten")))]
mod tests;

pub use library::find_library;
pub use siamese::OnnxSiamese;

use crate::{InferenceError, Network, Result};
#[cfg(any(feature = "onnxruntime", feature = "rten"))]
use file::Model;
use std::path::{Path, PathBuf};

pursuit_parameters::choices! {
    /// What a network runs on.
    pub enum Device {
        /// The processor.
        Cpu = "cpu",
        /// A GPU of NVIDIA, by CUDA.
        Cuda = "cuda",
        /// A GPU of NVIDIA, by TensorRT, and by CUDA what that cannot do.
        TensorRt = "tensorrt",
        /// What OpenVINO finds of Intel's: GPU, NPU or processor.
        OpenVino = "openvino",
        /// GPU and neural engine of Apple's, by Core ML.
        CoreMl = "coreml",
    }
}

/// Which library runs a network.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Backend {
    /// onnxruntime where it is found, else rten.
    #[default]
    Auto,
    /// onnxruntime.
    OnnxRuntime,
    /// rten.
    Rten,
}

/// Whether these bytes are a file that would be handed to a library; for fuzz targets, not part of the interface.
#[doc(hidden)]
#[cfg(any(feature = "onnxruntime", feature = "rten"))]
pub fn is_sound(bytes: &[u8]) -> bool {
    Model::parse("fuzz".to_owned(), bytes, &OnnxOptions::default()).is_ok()
}

/// How a file is opened.
#[derive(Debug, Clone)]
pub struct OnnxOptions {
    /// The library.
    pub backend: Backend,
    /// The file of the onnxruntime library, or the folder it is in; where it is named, no other is tried. A program
    /// takes it from `PURSUIT_ONNXRUNTIME`; this crate reads no environment.
    pub library: Option<PathBuf>,
    /// Folders of Python packages (`site-packages`) to look for onnxruntime in, before the system's own.
    pub package_folders: Vec<PathBuf>,
    /// Shapes of inputs by name, where the file leaves them open or is to be run on others than it names.
    pub shapes: Vec<(String, Vec<usize>)>,
    /// Width and height of images (inputs of three planes), where the file leaves them open or is to be run on others.
    pub image: Option<(usize, usize)>,
    /// What it runs on, where onnxruntime's library can hand it there; else it runs on the processor, and says so
    /// ([`Network::notes`]).
    pub device: Device,
    /// Threads, at least 1.
    pub threads: usize,
    /// The most bytes a file may have, and the most numbers an input, output or constant.
    pub max_bytes: u64,
}

impl Default for OnnxOptions {
    fn default() -> Self {
        Self {
            backend: Backend::Auto,
            library: None,
            package_folders: Vec::new(),
            shapes: Vec::new(),
            image: None,
            device: Device::Cpu,
            threads: 1,
            max_bytes: 256 << 20,
        }
    }
}

/// Opens a network and runs it once on zeros, so that what cannot run is found out here.
///
/// # Errors
/// [`InferenceError::Read`] if the file cannot be read, [`InferenceError::Model`] if it is no network that can be used,
/// [`InferenceError::NoBackend`] if no library is there to run it.
#[cfg(any(feature = "onnxruntime", feature = "rten"))]
pub fn open(path: &Path, options: &OnnxOptions) -> Result<Box<dyn Network>> {
    let model = Model::read(path, options)?;
    match options.backend {
        Backend::OnnxRuntime => with_onnxruntime(&model, options),
        Backend::Rten => with_rten(&model, options),
        Backend::Auto => match with_onnxruntime(&model, options) {
            // A library that was asked for by name and is not there is a mistake; otherwise there is another way.
            Err(InferenceError::NoBackend { why, mend, .. }) if options.library.is_none() => with_rten(&model, options)
                .map_err(|e| match e {
                    InferenceError::NoBackend { what, why: also, mend: other } => InferenceError::NoBackend {
                        what,
                        why: format!("{why}, and {also}"),
                        mend: format!("{mend}, or {other}"),
                    },
                    other => other,
                }),
            other => other,
        },
    }
}

/// An input as a file declares it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Declared {
    /// Its name.
    pub name: String,
    /// Its dimensions; `None` where the file leaves one open.
    pub shape: Vec<Option<usize>>,
}

/// The inputs that the file `path` declares, in its order, before anything is known of the shapes that it leaves open: what to
/// [`open`] it with.
///
/// # Errors
/// [`InferenceError::Read`] if the file cannot be read, [`InferenceError::Model`] if it is damaged or no ONNX file.
#[cfg(any(feature = "onnxruntime", feature = "rten"))]
pub fn declared_inputs(path: &Path, options: &OnnxOptions) -> Result<Vec<Declared>> {
    file::declared_inputs(path, options)
}

/// Without a library nothing can be opened: says so, as [`open`] does.
///
/// # Errors
/// As [`open`].
#[cfg(not(any(feature = "onnxruntime", feature = "rten")))]
pub fn declared_inputs(path: &Path, options: &OnnxOptions) -> Result<Vec<Declared>> {
    open(path, options).map(|_| Vec::new())
}

/// What the file `path` says of itself, key and value in its order (`metadata_props`); nothing where it is no ONNX file.
///
/// # Errors
/// [`InferenceError::Read`] if the file cannot be read.
#[cfg(any(feature = "onnxruntime", feature = "rten"))]
pub fn metadata(path: &Path, options: &OnnxOptions) -> Result<Vec<(String, String)>> {
    file::metadata(path, options)
}

/// Without a library nothing is read of a file.
///
/// # Errors
/// None.
#[cfg(not(any(feature = "onnxruntime", feature = "rten")))]
pub fn metadata(_: &Path, _: &OnnxOptions) -> Result<Vec<(String, String)>> {
    Ok(Vec::new())
}

/// No library was built in: says so, after a look whether the file is there.
///
/// # Errors
/// [`InferenceError::Read`] if the file cannot be read, else [`InferenceError::NoBackend`].
#[cfg(not(any(feature = "onnxruntime", feature = "rten")))]
pub fn open(path: &Path, _: &OnnxOptions) -> Result<Box<dyn Network>> {
    std::fs::File::open(path).map_err(|source| InferenceError::Read { path: path.to_owned(), source })?;
    Err(InferenceError::NoBackend {
        what: path.file_name().map_or_else(|| path.to_string_lossy(), |n| n.to_string_lossy()).into_owned(),
        why: "this program was built with none".into(),
        mend: "build it with `--features onnxruntime` (quick; loads that library when it runs) or `--features rten` \
               (needs nothing installed)"
            .into(),
    })
}

#[cfg(feature = "onnxruntime")]
fn with_onnxruntime(model: &Model, options: &OnnxOptions) -> Result<Box<dyn Network>> {
    Ok(Box::new(onnxruntime::OnnxRuntime::new(model, options)?))
}

#[cfg(all(feature = "rten", not(feature = "onnxruntime")))]
fn with_onnxruntime(model: &Model, _: &OnnxOptions) -> Result<Box<dyn Network>> {
    Err(no_backend(model, "this program was built without onnxruntime", "build it with `--features onnxruntime`"))
}

#[cfg(feature = "rten")]
fn with_rten(model: &Model, options: &OnnxOptions) -> Result<Box<dyn Network>> {
    Ok(Box::new(rten::Rten::new(model, options)?))
}

#[cfg(all(feature = "onnxruntime", not(feature = "rten")))]
fn with_rten(model: &Model, _: &OnnxOptions) -> Result<Box<dyn Network>> {
    Err(no_backend(model, "this program was built without rten", "build it with `--features rten`"))
}

#[cfg(any(all(feature = "rten", not(feature = "onnxruntime")), all(feature = "onnxruntime", not(feature = "rten"))))]
fn no_backend(model: &Model, why: &str, mend: &str) -> InferenceError {
    InferenceError::NoBackend { what: model.name.clone(), why: why.into(), mend: mend.into() }
}
