use super::CHANNELS;
use crate::Result;
use crate::kernels::{Activation, Convolution, Map};
use crate::weights::Weights;
use crate::written::Embedding;

/// Channels in front of and behind the four layers.
const WIDTHS: [usize; 5] = [3, 6, 12, 24, CHANNELS];

/// Four convolutions that make tokens of 16 × 16 pixels each.
#[derive(Debug, Clone)]
pub struct Stem {
    /// The image, then what each layer gives.
    maps: Vec<Map>,
    layers: Vec<Convolution>,
}

impl Stem {
    /// For images of `side` × `side` pixels.
    pub fn new(weights: &Weights<'_>, side: usize) -> Result<Self> {
        let last = WIDTHS.len() - 1;
        let maps: Vec<Map> = (0..=last)
            .map(|n| match n {
                n if n == last => Map::dense(WIDTHS[n], side >> n, side >> n),
                n => Map::split(WIDTHS[n], side >> n, side >> n, 1, 3),
            })
            .collect();
        let layers: Result<Vec<Convolution>> = (0..last)
            .map(|n| {
                let layer = weights.convolution(&format!("stem.{n}"), WIDTHS[n], WIDTHS[n + 1])?;
                let activation = if n + 1 == last { Activation::None } else { Activation::HardSwish };
                Ok(Convolution::new(&layer.weights, &layer.bias, activation, &maps[n]))
            })
            .collect();
        Ok(Self { maps, layers: layers? })
    }
}

impl Embedding for Stem {
    fn image_mut(&mut self) -> &mut Map {
        &mut self.maps[0]
    }

    /// The tokens of the image, 48 channels at a sixteenth of its size, in which positions are not yet told apart.
    fn run(&mut self) -> &mut Map {
        for (n, layer) in self.layers.iter().enumerate() {
            let (from, to) = self.maps.split_at_mut(n + 1);
            layer.run(&from[n], &mut to[0]);
        }
        &mut self.maps[self.layers.len()]
    }
}
