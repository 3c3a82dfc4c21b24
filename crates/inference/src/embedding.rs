//! Networks that say what the inside of a box looks like, so that the same person or car is known again by the cosine between two
//! answers: OSNet (Zhou et al. 2019, arXiv:1905.00953) and others for re-identification.

use crate::onnx::{self, OnnxOptions};
use crate::resample::{Resampler, Window};
use crate::{InferenceError, Network, Result};
use pursuit_geometry::BBox;
use pursuit_imaging::{ImageView, Rgb8};
use std::path::Path;

/// Mean and standard deviation of red, green and blue over ImageNet, in shares of 255, with which such networks are trained.
const IMAGENET: [(f32, f32); 3] = [(0.485, 0.229), (0.456, 0.224), (0.406, 0.225)];

/// A network from the inside of a box to an embedding.
pub struct EmbeddingNetwork {
    network: Box<dyn Network>,
    /// Width and height of its image.
    image: (usize, usize),
    resampler: Resampler,
    embedding: Vec<f32>,
}

impl EmbeddingNetwork {
    /// The network in the ONNX file `model`; `options.image` is the size of its image where the file leaves it open.
    ///
    /// # Errors
    /// As [`onnx::open`] and [`new`](Self::new).
    pub fn open(model: &Path, options: &OnnxOptions) -> Result<Self> {
        Self::new(onnx::open(model, options)?)
    }

    /// From a network of one input, `1 × 3 × height × width`, red, green and blue less the means of ImageNet and over its deviations,
    /// whose first output is the embedding.
    ///
    /// # Errors
    /// [`InferenceError::Model`] if the network has other inputs and outputs.
    pub fn new(network: Box<dyn Network>) -> Result<Self> {
        let misfit = |why: String| InferenceError::Model {
            what: network.name().to_owned(),
            why,
            mend: "name a network for re-identification that takes one image, such as OSNet".into(),
        };
        let image = match network.inputs() {
            [port] => match *port.shape.as_slice() {
                [1, 3, height, width] if width > 0 && height > 0 => (width, height),
                _ => return Err(misfit(format!("its input is {:?}, no image of three planes", port.shape))),
            },
            inputs => return Err(misfit(format!("it has {} inputs", inputs.len()))),
        };
        let length = network.outputs().first().map_or(0, crate::Port::len);
        if length < 2 {
            return Err(misfit("it answers with no embedding".into()));
        }
        Ok(Self { network, image, resampler: Resampler::default(), embedding: vec![0.0; length] })
    }

    /// What a user should know of how it is run, a line each.
    pub fn notes(&self) -> &[String] {
        self.network.notes()
    }

    /// What the inside of `bbox` looks like; zeros where it lies outside of the image.
    ///
    /// # Errors
    /// [`InferenceError::Run`] if the network cannot be run.
    pub fn embed(&mut self, image: ImageView<'_, Rgb8>, bbox: &BBox) -> Result<&[f32]> {
        let Some(inside) = bbox.clipped_to(image.size()) else {
            self.embedding.fill(0.0);
            return Ok(&self.embedding);
        };
        let (left, top) = (inside.left().floor() as i64, inside.top().floor() as i64);
        let (right, bottom) = (inside.right().ceil() as i64, inside.bottom().ceil() as i64);
        let window = Window { left, top, width: (right - left).max(1), height: (bottom - top).max(1) };
        let Self { network, resampler, embedding, image: (columns, rows) } = self;
        let input = network.input_mut(0);
        resampler.resample(image, window, (*columns, *rows), [0; 3], |y, planes| {
            let line = y * *columns..(y + 1) * *columns;
            for ((plane, pixels), (mean, deviation)) in
                input.chunks_exact_mut(*columns * *rows).zip(planes).zip(IMAGENET)
            {
                let to = plane.get_mut(line.clone()).unwrap_or_default();
                to.iter_mut().zip(&*pixels).for_each(|(to, pixel)| *to = (pixel / 255.0 - mean) / deviation);
            }
        });
        network.run()?;
        embedding.copy_from_slice(network.output(0));
        Ok(embedding)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Port;
    use pursuit_imaging::Image;

    /// Answers with the mean of each plane of its image.
    struct Means {
        ports: [Vec<Port>; 2],
        input: Vec<f32>,
        output: Vec<f32>,
    }

    impl Means {
        fn of(input: &[usize], output: &[usize]) -> Self {
            let port = |name: &str, shape: &[usize]| vec![Port { name: name.into(), shape: shape.into() }];
            let ports = [port("image", input), port("embedding", output)];
            let (input, output) = (vec![0.0; ports[0][0].len()], vec![0.0; ports[1][0].len()]);
            Self { ports, input, output }
        }
    }

    impl Network for Means {
        fn name(&self) -> &str {
            "means"
        }

        fn inputs(&self) -> &[Port] {
            &self.ports[0]
        }

        fn outputs(&self) -> &[Port] {
            &self.ports[1]
        }

        fn input_mut(&mut self, _: usize) -> &mut [f32] {
            &mut self.input
        }

        fn run(&mut self) -> Result<()> {
            let each = self.input.len() / 3;
            let means = self.input.chunks(each).map(|plane| plane.iter().sum::<f32>() / each as f32);
            self.output.iter_mut().zip(means).for_each(|(out, mean)| *out = mean);
            Ok(())
        }

        fn output(&self, _: usize) -> &[f32] {
            &self.output
        }
    }

    #[test]
    fn the_inside_of_the_box_is_seen_in_numbers_of_imagenet() {
        let image = Image::from_fn(60, 40, |x, _| if x < 30 { [255, 0, 51] } else { [0, 255, 255] }).unwrap();
        let mut network = EmbeddingNetwork::new(Box::new(Means::of(&[1, 3, 16, 8], &[1, 3]))).unwrap();
        let seen = network.embed(image.view(), &BBox::from_ltwh(-10.0, 5.0, 40.0, 30.0)).unwrap();
        let wanted = [(1.0 - 0.485) / 0.229, -0.456 / 0.224, (0.2 - 0.406) / 0.225];
        assert!(seen.iter().zip(wanted).all(|(a, b): (&f32, f32)| (a - b).abs() < 1e-5), "{seen:?} {wanted:?}");
        let outside = network.embed(image.view(), &BBox::from_ltwh(70.0, 5.0, 10.0, 30.0)).unwrap();
        assert_eq!(outside, [0.0; 3]);
    }

    #[test]
    fn networks_of_other_shapes_are_refused() {
        for (input, output) in [(&[1, 1, 16, 8][..], &[1, 3][..]), (&[3, 16, 8], &[1, 3]), (&[1, 3, 16, 8], &[1, 1])] {
            let error = EmbeddingNetwork::new(Box::new(Means::of(input, output))).err().unwrap().to_string();
            assert!(error.contains("such as OSNet"), "{error}");
        }
    }
}
