use super::file::Model;
use super::{Device, OnnxOptions, find_library};
use crate::{InferenceError, Network, Port, Result};
use ort::environment::Environment;
use ort::ep::{self, ExecutionProvider, ExecutionProviderDispatch};
use ort::session::{Session, builder::GraphOptimizationLevel};
use ort::value::{Tensor, TensorElementType};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// The library stays loaded, and the first that was loaded is the one.
static LOADED: Mutex<Option<(PathBuf, Environment)>> = Mutex::new(None);

/// A network run by onnxruntime.
pub struct OnnxRuntime {
    name: String,
    session: Session,
    inputs: Vec<Port>,
    outputs: Vec<Port>,
    given: Vec<Tensor<f32>>,
    answered: Vec<Vec<f32>>,
    notes: Vec<String>,
}

/// What hands networks to a device, the first that can counting; none for the processor. Errors say why the library cannot.
fn on_device(device: Device, library: &Path) -> Result<Option<Vec<ExecutionProviderDispatch>>, String> {
    let cuda = || ep::CUDA::default().build();
    let (known, what, first) = match device {
        Device::Cpu => return Ok(None),
        Device::Cuda => (ep::CUDA::is_available(), "CUDA", cuda()),
        Device::TensorRt => (ep::TensorRT::is_available(), "TensorRT", ep::TensorRT::default().build()),
        Device::OpenVino => (ep::OpenVINO::is_available(), "OpenVINO", ep::OpenVINO::default().build()),
        Device::CoreMl => (ep::CoreML::is_available(), "Core ML", ep::CoreML::default().build()),
    };
    if !known.unwrap_or(false) {
        return Err(format!("{} was built without {what}", library.display()));
    }
    // What TensorRT cannot do CUDA may, which comes with it.
    let then = (device == Device::TensorRt).then(cuda);
    Ok(Some(std::iter::once(first.error_on_failure()).chain(then).collect()))
}

impl OnnxRuntime {
    /// On the device asked for; on the processor, with a note, where the library cannot hand it there.
    pub fn new(model: &Model, options: &OnnxOptions) -> Result<Self> {
        let (environment, library) = environment(model, options)?;
        let note = match on_device(options.device, &library) {
            Ok(None) => None,
            Ok(Some(providers)) => match Self::with(model, options, &environment, &providers) {
                Ok(this) => return Ok(this),
                Err(InferenceError::Model { why, .. }) => {
                    Some(format!("{} on {}: {why}", model.name, options.device.as_str()))
                }
                Err(other) => return Err(other),
            },
            Err(why) => Some(why),
        };
        let notes = note.map(|note| format!("{note}; it runs on the processor")).into_iter().collect();
        Ok(Self { notes, ..Self::with(model, options, &environment, &[])? })
    }

    fn with(
        model: &Model,
        options: &OnnxOptions,
        environment: &Environment,
        providers: &[ExecutionProviderDispatch],
    ) -> Result<Self> {
        let refused = |e: &dyn std::fmt::Display| model.refused("onnxruntime", &e.to_string());
        let mut builder = Session::builder(environment)
            .map_err(|e| refused(&e))?
            .with_intra_threads(options.threads.max(1))
            .map_err(|e| refused(&e))?
            .with_optimization_level(GraphOptimizationLevel::Level3)
            .map_err(|e| refused(&e))?;
        if !providers.is_empty() {
            builder = builder.with_execution_providers(providers).map_err(|e| refused(&e))?;
        }
        let session = builder.commit_from_memory(&model.bytes).map_err(|e| refused(&e))?;
        let is_float = |o: &ort::value::Outlet| o.dtype().tensor_type() == Some(TensorElementType::Float32);
        if let Some(other) = session.outputs().iter().find(|o| !is_float(o)) {
            return Err(refused(&format!("its output `{}` is not in single precision", other.name())));
        }
        let given = model.inputs.iter().map(|p| Tensor::from_array((p.shape.clone(), vec![0.0f32; p.len()])));
        let mut this = Self {
            name: model.name.clone(),
            session,
            inputs: model.inputs.clone(),
            outputs: Vec::new(),
            given: given.collect::<Result<_, _>>().map_err(|e| refused(&e))?,
            answered: vec![Vec::new(); model.outputs.len()],
            notes: Vec::new(),
        };
        let shapes = this.answer().map_err(|e| refused(&e))?;
        this.outputs = model.output_ports(shapes)?;
        Ok(this)
    }

    /// Runs the network and keeps its answers; gives their shapes.
    fn answer(&mut self) -> Result<Vec<Vec<usize>>, ort::Error> {
        let given: Vec<_> = self.inputs.iter().map(|p| p.name.as_str()).zip(self.given.iter()).collect();
        let answers = self.session.run(given)?;
        let mut shapes = Vec::with_capacity(self.answered.len());
        for (answer, to) in answers.values().zip(&mut self.answered) {
            let (shape, numbers) = answer.try_extract_tensor::<f32>()?;
            shapes.push(shape.iter().map(|&d| usize::try_from(d).unwrap_or(0)).collect());
            to.clear();
            to.extend_from_slice(numbers);
        }
        Ok(shapes)
    }
}

/// Loads the library, the first time.
fn environment(model: &Model, options: &OnnxOptions) -> Result<(Environment, PathBuf)> {
    let none = |why: String| InferenceError::NoBackend {
        what: model.name.clone(),
        why,
        mend: "install the Python package `onnxruntime` or name its library in PURSUIT_ONNXRUNTIME".into(),
    };
    let mut loaded = LOADED.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    if let Some((library, environment)) = &*loaded {
        return Ok((environment.clone(), library.clone()));
    }
    let library = find_library(options.library.as_deref(), &options.package_folders).ok_or_else(|| {
        none(match &options.library {
            Some(named) => format!("there is no onnxruntime library at {}", named.display()),
            None => "no onnxruntime library was found".into(),
        })
    })?;
    let environment = ort::init_from(&library)
        .map_err(|e| none(format!("{} cannot be loaded: {e}", library.display())))?
        .with_telemetry(false)
        .build()
        .map_err(|e| none(format!("{} cannot be used: {e}", library.display())))?;
    *loaded = Some((library.clone(), environment.clone()));
    Ok((environment, library))
}

impl Network for OnnxRuntime {
    fn name(&self) -> &str {
        &self.name
    }

    fn inputs(&self) -> &[Port] {
        &self.inputs
    }

    fn outputs(&self) -> &[Port] {
        &self.outputs
    }

    fn input_mut(&mut self, input: usize) -> &mut [f32] {
        self.given.get_mut(input).map(|t| t.extract_tensor_mut().1).unwrap_or_default()
    }

    fn run(&mut self) -> Result<()> {
        self.answer().map(drop).map_err(|e| InferenceError::Run { what: self.name.clone(), why: e.to_string() })
    }

    fn notes(&self) -> &[String] {
        &self.notes
    }

    fn output(&self, output: usize) -> &[f32] {
        self.answered.get(output).map(Vec::as_slice).unwrap_or_default()
    }
}
