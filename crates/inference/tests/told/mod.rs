//! A network without weights.

use pursuit_inference::{Network, Port, Result};

/// Takes tensors of given names and shapes. A number of its answers is the number of the output times 1000, its place in it, and the first
/// number of each input.
struct Told {
    inputs: Vec<Port>,
    outputs: Vec<Port>,
    given: Vec<Vec<f32>>,
    answers: Vec<Vec<f32>>,
}

pub fn told(inputs: &[(&str, &[usize])], outputs: &[(&str, &[usize])]) -> Box<dyn Network> {
    let ports = |named: &[(&str, &[usize])]| -> Vec<Port> {
        named.iter().map(|(name, shape)| Port { name: (*name).to_owned(), shape: shape.to_vec() }).collect()
    };
    let (inputs, outputs) = (ports(inputs), ports(outputs));
    let blank = |ports: &[Port]| ports.iter().map(|p| vec![0.0; p.len()]).collect();
    Box::new(Told { given: blank(&inputs), answers: blank(&outputs), inputs, outputs })
}

impl Network for Told {
    fn name(&self) -> &str {
        "told"
    }
    fn inputs(&self) -> &[Port] {
        &self.inputs
    }
    fn outputs(&self) -> &[Port] {
        &self.outputs
    }
    fn input_mut(&mut self, input: usize) -> &mut [f32] {
        &mut self.given[input]
    }
    fn run(&mut self) -> Result<()> {
        let sum: f32 = self.given.iter().map(|given| given[0]).sum();
        for (output, answer) in self.answers.iter_mut().enumerate() {
            answer.iter_mut().enumerate().for_each(|(k, v)| *v = sum + (1000 * output + k) as f32);
        }
        Ok(())
    }
    fn output(&self, output: usize) -> &[f32] {
        &self.answers[output]
    }
}
