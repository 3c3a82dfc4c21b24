//! A network without weights.

use pursuit_inference::{Network, Port, Result};

/// A tensor's name and shape.
pub type Named<'a> = (&'a str, &'a [usize]);

/// What a number of an answer is above the first number of each input, by the number of the output and its place in it.
pub type Above = fn(usize, usize) -> usize;

/// Takes tensors of given names and shapes.
struct Told {
    inputs: Vec<Port>,
    outputs: Vec<Port>,
    given: Vec<Vec<f32>>,
    answers: Vec<Vec<f32>>,
    above: Above,
}

pub fn told(inputs: &[Named<'_>], outputs: &[Named<'_>], above: Above) -> Box<dyn Network> {
    let ports = |named: &[Named<'_>]| -> Vec<Port> {
        named.iter().map(|(name, shape)| Port { name: (*name).to_owned(), shape: shape.to_vec() }).collect()
    };
    let (inputs, outputs) = (ports(inputs), ports(outputs));
    let blank = |ports: &[Port]| ports.iter().map(|p| vec![0.0; p.len()]).collect();
    Box::new(Told { given: blank(&inputs), answers: blank(&outputs), inputs, outputs, above })
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
            answer.iter_mut().enumerate().for_each(|(k, v)| *v = sum + (self.above)(output, k) as f32);
        }
        Ok(())
    }
    fn output(&self, output: usize) -> &[f32] {
        &self.answers[output]
    }
}
