use crate::{InferenceError, Result};

/// An input or an output of a network.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Port {
    /// Its name in the file.
    pub name: String,
    /// Its dimensions, all known.
    pub shape: Vec<usize>,
}

impl Port {
    /// How many numbers it has.
    pub fn len(&self) -> usize {
        self.shape.iter().product()
    }

    /// Whether it has none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// A network from tensors to tensors, all in single precision, prepared for inputs of fixed shapes.
///
/// Inputs and outputs belong to the network: they are written, the network is run, and they are read, so that a call
/// copies nothing it need not.
pub trait Network: Send {
    /// What it is called in messages.
    fn name(&self) -> &str;

    /// Its inputs, in the order of the file.
    fn inputs(&self) -> &[Port];

    /// Its outputs, in the order of the file.
    fn outputs(&self) -> &[Port];

    /// The numbers of an input, to be written; empty if there is no such input.
    fn input_mut(&mut self, input: usize) -> &mut [f32];

    /// Computes the outputs from the inputs.
    ///
    /// # Errors
    /// [`InferenceError::Run`] if the library that runs it fails.
    fn run(&mut self) -> Result<()>;

    /// The numbers of an output, as the last run left them; empty if there is no such output.
    fn output(&self, output: usize) -> &[f32];

    /// What a user should know of how it is run, a line each: that it runs elsewhere than asked for.
    fn notes(&self) -> &[String] {
        &[]
    }

    /// Writes an input from a slice.
    ///
    /// # Errors
    /// [`InferenceError::Tensor`] unless it has as many numbers as the input.
    fn set_input(&mut self, input: usize, numbers: &[f32]) -> Result<()> {
        let expected = self.input_mut(input).len();
        if expected != numbers.len() {
            let port = self.inputs().get(input).map_or_else(|| format!("input {input}"), |p| p.name.clone());
            return Err(InferenceError::Tensor { what: self.name().to_owned(), port, expected, actual: numbers.len() });
        }
        self.input_mut(input).copy_from_slice(numbers);
        Ok(())
    }
}
