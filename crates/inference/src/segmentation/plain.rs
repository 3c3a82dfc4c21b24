//! A network from a picture of the target's region to a mask of it.

use super::picture::{Picture, Shown, about};
use super::{Grid, MaskValues, SegmentationConfig, misfit};
use crate::onnx::{self, OnnxOptions};
use crate::{InferenceError, Network, Result};
use pursuit_geometry::BBox;
use pursuit_imaging::{ImageView, Rgb8};
use std::path::Path;

/// How much about the box is shown where nobody says, target sizes.
const CONTEXT: f64 = 0.25;

/// How the numbers of the mask lie in the first output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Order {
    /// Plane after plane.
    Planes,
    /// Pixel after pixel.
    Pixels,
}

/// A network of one picture.
pub(super) struct Plain {
    network: Box<dyn Network>,
    picture: Picture,
    order: Order,
    planes: usize,
    /// Which of several planes is the target's.
    own: usize,
    /// What numbers of one plane are; never found out any more.
    values: MaskValues,
    /// Whether that was found out by looking at answers.
    is_guess: bool,
    grid: Grid,
}

impl std::fmt::Debug for Plain {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Plain").field("network", &self.network.name()).finish_non_exhaustive()
    }
}

impl Plain {
    /// Opens the file, its picture of the size that the description says where the file leaves it open.
    pub fn open(file: &Path, config: &SegmentationConfig, options: &OnnxOptions) -> Result<Self> {
        let name = file.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let shape = Picture::shape_of(&name, &onnx::declared_inputs(file, options)?, config)?;
        Self::new(onnx::open(file, &OnnxOptions { shapes: vec![shape], ..options.clone() })?, config)
    }

    pub fn new(mut network: Box<dyn Network>, config: &SegmentationConfig) -> Result<Self> {
        let picture = Picture::of(&*network)?;
        let shape = network.outputs().first().map(|p| p.shape.clone()).unwrap_or_default();
        let refused = |why: String| misfit(network.name(), why);
        let (order, planes, rows, columns) = match *shape.as_slice() {
            [rows, columns] | [1, rows, columns] => (Order::Planes, 1, rows, columns),
            // Planes are few, and of a grid the sides are alike.
            [1, planes, rows, columns] if planes <= rows.min(columns) => (Order::Planes, planes, rows, columns),
            [1, rows, columns, planes] if planes < rows.min(columns) => (Order::Pixels, planes, rows, columns),
            _ => return Err(refused(format!("its first output is {shape:?}, no mask of the picture"))),
        };
        if rows < 2 || columns < 2 {
            return Err(refused(format!("its first output is {shape:?}, no mask of the picture")));
        }
        let own = match (planes, config.plane) {
            (1, None | Some(0)) => 0,
            (2, None) => 1,
            (_, Some(plane)) if plane < planes => plane,
            (_, Some(plane)) => {
                return Err(refused(format!("its mask has {planes} planes, from 0 on, and none is {plane}")));
            }
            (_, None) => {
                return Err(InferenceError::Model {
                    what: network.name().to_owned(),
                    why: format!("its mask has {planes} planes, and nothing says which is the target's"),
                    mend: "write `plane = …`, counted from 0, in a TOML file of its name beside it".into(),
                });
            }
        };
        let (values, is_guess) = match (config.values, planes) {
            (MaskValues::Auto, 1) => {
                let values = found_out(&mut *network)?;
                (values, values == MaskValues::Probabilities)
            }
            (values, _) => (values, false),
        };
        let grid = Grid { columns, rows, values: vec![0.0; columns * rows], picture: (picture.width, picture.height) };
        Ok(Self { network, picture, order, planes, own, values, is_guess, grid })
    }

    pub fn name(&self) -> &str {
        self.network.name()
    }

    pub fn notes(&self) -> Vec<String> {
        self.network.notes().to_vec()
    }

    pub fn taken_for(&self) -> String {
        let (Picture { width, height, .. }, Grid { columns, rows, .. }) = (&self.picture, &self.grid);
        let what = match (self.planes, self.values) {
            (1, MaskValues::Probabilities) => "probabilities".to_owned(),
            (1, _) => "logits".to_owned(),
            (planes, _) => format!("{planes} planes, of which {} is the target's", self.own),
        };
        format!(
            "{} is taken for a network from a picture of the target's region, {width} x {height}, to a mask of {columns} x {rows} {what}",
            self.name()
        )
    }

    /// What the network says of the target at `bbox`.
    pub fn ask(
        &mut self,
        image: ImageView<'_, Rgb8>,
        bbox: &BBox,
        config: &SegmentationConfig,
    ) -> Result<Option<(Shown, &Grid)>> {
        let window = about(bbox, config.context.unwrap_or(CONTEXT), image.size());
        let shown = Shown::new(window, (self.picture.width, self.picture.height), config.place);
        self.picture.write(image, &shown, config, self.network.input_mut(0));
        self.network.run()?;
        let answer = self.network.output(0);
        let Grid { columns, rows, values, .. } = &mut self.grid;
        let cells = *columns * *rows;
        let at = |cell: usize, plane: usize| match self.order {
            Order::Planes => plane * cells + cell,
            Order::Pixels => cell * self.planes + plane,
        };
        let number = |cell: usize, plane: usize| answer.get(at(cell, plane)).copied().unwrap_or(f32::NAN);
        for (cell, value) in values.iter_mut().enumerate() {
            let own = number(cell, self.own);
            *value = match (self.planes, self.values) {
                (1, MaskValues::Probabilities) => own - 0.5,
                (1, _) => own,
                // By how much it is the greatest, which logits and probabilities agree on.
                (planes, _) => {
                    let others = (0..planes).filter(|plane| *plane != self.own).map(|plane| number(cell, plane));
                    own - others.fold(f32::NEG_INFINITY, |most, v| if v > most || v.is_nan() { v } else { most })
                }
            };
        }
        if self.is_guess && answer.iter().any(|v| *v < 0.0 || *v > 1.0) {
            let file = Path::new(self.network.name()).with_extension("toml");
            return Err(InferenceError::Run {
                what: self.network.name().to_owned(),
                why: format!(
                    "it was taken for one that answers probabilities, and now answers others; write `values = \"logits\"` in a file {} \
                     beside it",
                    file.display()
                ),
            });
        }
        Ok(Some((shown, &self.grid)))
    }
}

/// What the numbers of one plane are, by the answers to a plain picture and to one of noise. All of a trained network's logits hardly lie
/// from 0 to 1; where they do after all, a later answer tells.
fn found_out(network: &mut dyn Network) -> Result<MaskValues> {
    let mut state = 0x2545_f491_u32;
    for amplitude in [0.0_f32, 2.0] {
        for to in network.input_mut(0) {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            *to = amplitude * ((state >> 16) as f32 / 32_768.0 - 1.0);
        }
        network.run()?;
        if network.output(0).iter().any(|v| *v < 0.0 || *v > 1.0) {
            return Ok(MaskValues::Logits);
        }
    }
    Ok(MaskValues::Probabilities)
}
