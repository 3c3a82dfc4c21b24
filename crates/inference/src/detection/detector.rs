use super::decode::Decoder;
use super::{DetectionConfig, Letterbox, Object, suppress};
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
}

impl ObjectDetector {
    /// The network in the ONNX file `model`, as described in the TOML file of its name beside it, or YOLOX where there is none.
    ///
    /// # Errors
    /// As [`onnx::open`], [`DetectionConfig::beside`] and [`new`](Self::new).
    pub fn open(model: &Path, options: &OnnxOptions) -> Result<Self> {
        let config = DetectionConfig::beside(model)?;
        let options = OnnxOptions { image: options.image.or(config.image_px.map(Into::into)), ..options.clone() };
        Self::new(onnx::open(model, &options)?, config)
    }

    /// From a network of one input, an image of three planes, whose first output has boxes of
    /// [`attributes`](DetectionConfig::attributes) numbers, `1 × boxes × numbers` or `1 × numbers × boxes`. It looks for all
    /// classes.
    ///
    /// # Errors
    /// [`InferenceError::Model`] if the network has other inputs and outputs, or the configuration is out of range.
    pub fn new(network: Box<dyn Network>, config: DetectionConfig) -> Result<Self> {
        let misfit = |why: String| InferenceError::Model {
            what: network.name().to_owned(),
            why,
            mend: "name a detector of objects that takes one image, such as YOLOX, described in a TOML file beside it"
                .into(),
        };
        config.check().map_err(misfit)?;
        let image = match network.inputs() {
            [port] => match *port.shape.as_slice() {
                [1, 3, height, width] if width > 0 && height > 0 => (width, height),
                _ => return Err(misfit(format!("its input is {:?}, no image of three planes", port.shape))),
            },
            inputs => return Err(misfit(format!("it has {} inputs", inputs.len()))),
        };
        let decoder = Decoder::new(config.clone(), &*network, image)?;
        let wanted = vec![true; config.classes.len()];
        let (resampler, objects) = (Resampler::default(), Vec::new());
        Ok(Self { network, image, config, decoder, wanted, resampler, filled: None, objects })
    }

    /// What is known of the network.
    pub const fn config(&self) -> &DetectionConfig {
        &self.config
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
        suppress(objects, limits.overlap, limits.most);
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
