use super::file::Model;
use super::{Device, OnnxOptions};
use crate::{InferenceError, Network, Port, Result};
use rten::{NodeId, RunOptions, ThreadPool, Value, ValueOrView, ValueView};
use rten_tensor::prelude::*;
use rten_tensor::{Tensor, TensorView};
use std::sync::Arc;

/// A network run by rten.
pub struct Rten {
    name: String,
    model: rten::Model,
    pool: Arc<ThreadPool>,
    inputs: Vec<Port>,
    outputs: Vec<Port>,
    input_ids: Vec<NodeId>,
    output_ids: Vec<NodeId>,
    given: Vec<Vec<f32>>,
    answered: Vec<Vec<f32>>,
    notes: Vec<String>,
}

impl Rten {
    pub fn new(model: &Model, options: &OnnxOptions) -> Result<Self> {
        let loaded = rten::Model::load(model.bytes.clone()).map_err(|e| model.refused("rten", &e))?;
        let id = |name: &str| loaded.node_id(name).map_err(|e| model.refused("rten", &e));
        let input_ids = model.inputs.iter().map(|p| id(&p.name)).collect::<Result<Vec<_>>>()?;
        let output_ids = model.outputs.iter().map(|n| id(n)).collect::<Result<Vec<_>>>()?;
        let mut this = Self {
            name: model.name.clone(),
            model: loaded,
            pool: Arc::new(ThreadPool::with_num_threads(options.threads.max(1))),
            inputs: model.inputs.clone(),
            outputs: Vec::new(),
            input_ids,
            output_ids,
            given: model.inputs.iter().map(|p| vec![0.0; p.len()]).collect(),
            answered: Vec::new(),
            notes: Vec::new(),
        };
        if options.device != Device::Cpu {
            let wanted = options.device.as_str();
            this.notes.push(format!(
                "{wanted} asks for onnxruntime, and {} is run by rten; it runs on the processor",
                this.name
            ));
        }
        let first = this.answers().map_err(|e| model.refused("rten", &e))?;
        this.outputs = model.output_ports(first.iter().map(|t| t.shape().to_vec()).collect())?;
        this.answered = first.into_iter().map(|t| t.to_vec()).collect();
        Ok(this)
    }

    fn answers(&self) -> Result<Vec<Tensor<f32>>, String> {
        let given = self.inputs.iter().zip(&self.given).zip(&self.input_ids).map(|((port, numbers), &id)| {
            let view = TensorView::from_data(port.shape.as_slice(), numbers.as_slice());
            (id, ValueOrView::View(ValueView::FloatTensor(view)))
        });
        let run = RunOptions::default().with_thread_pool(Some(self.pool.clone()));
        let values = self.model.run(given.collect(), &self.output_ids, Some(run)).map_err(|e| e.to_string())?;
        let float = |value| match value {
            Value::FloatTensor(tensor) => Ok(tensor),
            _ => Err("an output is not in single precision".to_owned()),
        };
        values.into_iter().map(float).collect()
    }
}

impl Network for Rten {
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
        self.given.get_mut(input).map(Vec::as_mut_slice).unwrap_or_default()
    }

    fn run(&mut self) -> Result<()> {
        let failed = |why| InferenceError::Run { what: self.name.clone(), why };
        for (answer, to) in self.answers().map_err(failed)?.iter().zip(&mut self.answered) {
            if let Some(numbers) = answer.data()
                && numbers.len() == to.len()
            {
                to.copy_from_slice(numbers);
            } else {
                *to = answer.to_vec();
            }
        }
        Ok(())
    }

    fn notes(&self) -> &[String] {
        &self.notes
    }

    fn output(&self, output: usize) -> &[f32] {
        self.answered.get(output).map(Vec::as_slice).unwrap_or_default()
    }
}
