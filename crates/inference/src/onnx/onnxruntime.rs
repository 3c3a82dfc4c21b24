use super::file::Model;
use super::{OnnxOptions, find_library};
use crate::{InferenceError, Network, Port, Result};
use ort::environment::Environment;
use ort::session::{Session, builder::GraphOptimizationLevel};
use ort::value::{Tensor, TensorElementType};
use std::path::PathBuf;
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
}

impl OnnxRuntime {
    pub fn new(model: &Model, options: &OnnxOptions) -> Result<Self> {
        let environment = environment(model, options)?;
        let refused = |e: &dyn std::fmt::Display| model.refused("onnxruntime", &e.to_string());
        let session = Session::builder(&environment)
            .map_err(|e| refused(&e))?
            .with_intra_threads(options.threads.max(1))
            .map_err(|e| refused(&e))?
            .with_optimization_level(GraphOptimizationLevel::Level3)
            .map_err(|e| refused(&e))?
            .commit_from_memory(&model.bytes)
            .map_err(|e| refused(&e))?;
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
fn environment(model: &Model, options: &OnnxOptions) -> Result<Environment> {
    let none = |why: String| InferenceError::NoBackend {
        what: model.name.clone(),
        why,
        mend: "install the Python package `onnxruntime` or name its library in PURSUIT_ONNXRUNTIME".into(),
    };
    let mut loaded = LOADED.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    if let Some((_, environment)) = &*loaded {
        return Ok(environment.clone());
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
    *loaded = Some((library, environment.clone()));
    Ok(environment)
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

    fn output(&self, output: usize) -> &[f32] {
        self.answered.get(output).map(Vec::as_slice).unwrap_or_default()
    }
}
