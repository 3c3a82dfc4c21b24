use super::decode::Decoder;
use super::recognised::{Said, in_words, recognised};
use super::{Description, DetectionConfig, Letterbox, Object, suppress};
use crate::onnx::{self, OnnxOptions};
use crate::resample::{Resampler, Window};
use crate::siamese::ChannelOrder;
use crate::{InferenceError, Network, Result};
use pursuit_imaging::{ImageView, Rgb8};
use std::path::Path;

/// Which of a network's boxes are taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Least score, 0 to 1.
    pub score: f64,
    /// Greatest overlap (IoU) of two boxes of one class, 0 to 1.
    pub overlap: f64,
    /// Most boxes that are compared with each other, the best: bounds what a network that answers everywhere may cost.
    pub candidates: usize,
    /// Most boxes that come out.
    pub most: usize,
}

/// A network that finds objects all over an image, with what is known of it.
pub struct ObjectDetector {
    network: Box<dyn Network>,
    /// Width and height of its image.
    image: (usize, usize),
    config: DetectionConfig,
    decoder: Decoder,
    wanted: Vec<bool>,
    resampler: Resampler,
    /// The letterbox for which the rest of the network's image is filled.
    filled: Option<Letterbox>,
    objects: Vec<Object>,
    /// What it was taken for, where nothing described it.
    taken_for: Option<String>,
}

fn misfit(network: &dyn Network, why: String) -> InferenceError {
    InferenceError::Model {
        what: network.name().to_owned(),
        why,
        mend: "name a detector of objects that takes one image, such as YOLOX, described in a TOML file beside it"
            .into(),
    }
}

/// Width and height of the one image that a network takes.
fn image_of(network: &dyn Network) -> Result<(usize, usize)> {
    match network.inputs() {
        [port] => match *port.shape.as_slice() {
            [1, 3, height, width] if width > 0 && height > 0 => Ok((width, height)),
            _ => Err(misfit(network, format!("its input is {:?}, no image of three planes", port.shape))),
        },
        inputs => Err(misfit(network, format!("it has {} inputs", inputs.len()))),
    }
}

impl ObjectDetector {
    /// The network in the ONNX file `model`: as described in the TOML file of its name beside it; or, where that is not there or says
    /// nothing but the classes and the size of the image, as its answer and the names in the file tell.
    ///
    /// # Errors
    /// As [`onnx::open`], [`DetectionConfig::beside`] and [`new`](Self::new); [`InferenceError::Model`] where it is not clear what it is.
    pub fn open(model: &Path, options: &OnnxOptions) -> Result<Self> {
        let Description { config, names_classes, says_how } = DetectionConfig::beside(model)?;
        let said = if says_how { Said::default() } else { Said::read(&onnx::metadata(model, options)?) };
        // Where a file leaves the size of its image open, it may say for which it was exported.
        let sizes = [options.image, config.image_px.map(Into::into), said.image];
        let open = |image| onnx::open(model, &OnnxOptions { image, ..options.clone() });
        let network = open(sizes.into_iter().flatten().next())?;
        if says_how {
            return Self::new(network, config);
        }
        let image = image_of(&*network)?;
        let names = if names_classes { Some(config.classes) } else { said.names.clone() };
        let config = recognised(&*network, image, names, &said)?;
        let taken_for = in_words(network.name(), &config, image);
        Ok(Self { taken_for: Some(taken_for), ..Self::new(network, config)? })
    }

    /// From a network of one input, an image of three planes, whose first output has boxes of
    /// [`attributes`](DetectionConfig::attributes) numbers, `1 × boxes × numbers` or `1 × numbers × boxes`. It looks for all
    /// classes.
    ///
    /// # Errors
    /// [`InferenceError::Model`] if the network has other inputs and outputs, or the configuration is out of range.
    pub fn new(network: Box<dyn Network>, config: DetectionConfig) -> Result<Self> {
        config.check().map_err(|why| misfit(&*network, why))?;
        let image = image_of(&*network)?;
        let decoder = Decoder::new(config.clone(), &*network, image)?;
        let wanted = vec![true; config.classes.len()];
        let (resampler, objects) = (Resampler::default(), Vec::new());
        Ok(Self { network, image, config, decoder, wanted, resampler, filled: None, objects, taken_for: None })
    }

    /// What is known of the network.
    pub const fn config(&self) -> &DetectionConfig {
        &self.config
    }

    /// What a user should know of how it was opened, a line each: what the file was taken for where nothing described it, and what
    /// the network itself says of where it runs.
    pub fn notes(&self) -> Vec<String> {
        self.taken_for.iter().chain(self.network.notes()).cloned().collect()
    }

    /// Looks for these classes alone; for all if there are none.
    ///
    /// # Errors
    /// The first name that is no class.
    pub fn look_for<'a>(&mut self, classes: &'a [String]) -> Result<(), &'a str> {
        let mut wanted = vec![classes.is_empty(); self.config.classes.len()];
        for name in classes {
            let at = self.config.classes.iter().position(|c| c.eq_ignore_ascii_case(name.trim()));
            *wanted.get_mut(at.unwrap_or(usize::MAX)).ok_or(name.as_str())? = true;
        }
        self.wanted = wanted;
        Ok(())
    }

    /// The objects in an image, the best first, in its pixels.
    ///
    /// # Errors
    /// [`InferenceError::Run`] if the network cannot be run.
    pub fn detect(&mut self, image: ImageView<'_, Rgb8>, limits: &Limits) -> Result<&[Object]> {
        let letterbox = Letterbox::new(image.size(), self.image, self.config.place);
        self.write(image, &letterbox);
        self.network.run()?;
        let objects = &mut self.objects;
        self.decoder.decode(self.network.output(0), limits.score, &self.wanted, objects);
        if objects.len() > limits.candidates {
            objects.sort_by(|a, b| b.score.total_cmp(&a.score));
            objects.truncate(limits.candidates);
        }
        let overlap = if self.config.unique { 1.0 } else { limits.overlap };
        suppress(objects, overlap, limits.most);
        objects.iter_mut().for_each(|o| o.bbox = letterbox.in_frame(&o.bbox));
        Ok(objects)
    }

    /// Resamples, normalises and hands over.
    fn write(&mut self, image: ImageView<'_, Rgb8>, letterbox: &Letterbox) {
        let Self { network, config, resampler, .. } = self;
        let (columns, rows) = self.image;
        let (mean, deviation) = (config.mean, config.deviation);
        let normal = |value: f32, c: usize| (value - mean[c]) / deviation[c];
        let input = network.input_mut(0);
        if self.filled != Some(*letterbox) {
            for (c, plane) in input.chunks_exact_mut(columns * rows).enumerate() {
                plane.fill(normal(f32::from(config.fill), c.min(2)));
            }
            self.filled = Some(*letterbox);
        }
        let (left, top, width, height) = letterbox.window();
        let size = image.size();
        let window = Window { left: 0, top: 0, width: size.width as i64, height: size.height as i64 };
        let channels = match config.channels {
            ChannelOrder::Rgb => [0, 1, 2],
            ChannelOrder::Bgr => [2, 1, 0],
        };
        resampler.resample(image, window, (width, height), [config.fill; 3], |y, planes| {
            let start = (top + y) * columns + left;
            for (c, plane) in input.chunks_exact_mut(columns * rows).enumerate().take(3) {
                let to = plane.get_mut(start..start + width).unwrap_or_default();
                to.iter_mut().zip(&*planes[channels[c]]).for_each(|(to, &pixel)| *to = normal(pixel, c));
            }
        });
    }
}
