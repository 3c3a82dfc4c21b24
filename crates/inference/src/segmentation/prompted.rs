//! An image encoder, and a mask decoder that is asked by a box: Segment Anything and its kin, as their exporters write them.
//!
//! What goes in is what `segment_anything/predictor.py` and `utils/transforms.py` make: the longest side brought to the encoder's, the rest
//! filled with the mean colour, the box's corners times the same ratios as two points with the labels 2 and 3. Of the mask in low
//! resolution a pixel is the target's where it is above 0 (`mask_threshold`), between its cells bilinear.

use super::picture::{Picture, Shown, about, inside};
use super::{Grid, SegmentationConfig, misfit};
use crate::detection::Placing;
use crate::onnx::{self, Declared, OnnxOptions};
use crate::resample::Window;
use crate::{InferenceError, Network, Port, Result};
use pursuit_geometry::BBox;
use pursuit_imaging::{ImageView, Rgb8};
use std::path::Path;

/// Labels of a box's upper left and lower right corner (`segment_anything/modeling/prompt_encoder.py`).
const CORNERS: [f32; 2] = [2.0, 3.0];
/// Names of inputs, as `scripts/export_onnx_model.py` of Segment Anything, MobileSAM and EdgeSAM have them.
const EMBEDDINGS: &str = "image_embeddings";
const POINTS: &str = "point_coords";
const LABELS: &str = "point_labels";
const MASK: &str = "mask_input";
const HAS_MASK: &str = "has_mask_input";
const SIZE: &str = "orig_im_size";
/// Names of outputs, those to be preferred first: `masks` of Segment Anything were brought to another size once more.
const MASKS: [&str; 2] = ["low_res_masks", "masks"];
const QUALITIES: [&str; 2] = ["iou_predictions", "scores"];
/// Cells of a mask input for one of the embedding.
const FINER: usize = 4;

/// Image encoder and mask decoder.
pub(super) struct Prompted {
    encoder: Box<dyn Network>,
    decoder: Box<dyn Network>,
    picture: Picture,
    /// Which inputs of the decoder are which.
    embeddings: usize,
    points: usize,
    /// Which outputs are masks and, where it has any, how good each is said to be.
    masks: usize,
    qualities: Option<usize>,
    grid: Grid,
}

impl std::fmt::Debug for Prompted {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Prompted").field("encoder", &self.encoder.name()).finish_non_exhaustive()
    }
}

fn decoder_misfit(decoder: &str, why: String) -> InferenceError {
    InferenceError::Model {
        what: decoder.to_owned(),
        why,
        mend: format!(
            "export the decoder as Segment Anything, MobileSAM or EdgeSAM do: inputs {EMBEDDINGS}, {POINTS}, {LABELS}, and perhaps {MASK}, \
             {HAS_MASK}, {SIZE}; outputs {} and {}",
            MASKS.join(" or "),
            QUALITIES.join(" or ")
        ),
    }
}

impl Prompted {
    /// Opens both files: the decoder for two points and the encoder's embedding.
    pub fn open(
        (encoder, decoder): (&Path, &Path),
        config: &SegmentationConfig,
        options: &OnnxOptions,
    ) -> Result<Self> {
        let name = |file: &Path| file.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let shape = Picture::shape_of(&name(encoder), &onnx::declared_inputs(encoder, options)?, config)?;
        let encoder = onnx::open(encoder, &OnnxOptions { shapes: vec![shape], ..options.clone() })?;
        let embedding = embedding_of(&*encoder)?;
        let shapes = decoder_shapes(&name(decoder), &onnx::declared_inputs(decoder, options)?, embedding)?;
        let decoder = onnx::open(decoder, &OnnxOptions { shapes, ..options.clone() }).map_err(with_simplifier)?;
        Self::new(encoder, decoder, config)
    }

    pub fn new(encoder: Box<dyn Network>, mut decoder: Box<dyn Network>, config: &SegmentationConfig) -> Result<Self> {
        let picture = Picture::of(&*encoder)?;
        if picture.width != picture.height {
            let why =
                format!("its picture is {} x {}, where an image encoder has a square", picture.width, picture.height);
            return Err(misfit(encoder.name(), why));
        }
        if config.image_px.is_some_and(|[width, height]| width != height) {
            return Err(misfit(encoder.name(), "`image_px` says no square, where an image encoder has one".into()));
        }
        let embedding = embedding_of(&*encoder)?;
        let refused = |why: String| decoder_misfit(decoder.name(), why);
        let place = |name: &str| decoder.inputs().iter().position(|p| p.name == name);
        let wanted = decoder_shapes(decoder.name(), &declared(decoder.inputs()), embedding)?;
        if let Some((port, (_, shape))) = decoder.inputs().iter().zip(&wanted).find(|(port, (_, s))| port.shape != *s) {
            return Err(refused(format!("its input `{}` is {:?}, where {shape:?} is given", port.name, port.shape)));
        }
        let (Some(embeddings), Some(points), Some(labels)) = (place(EMBEDDINGS), place(POINTS), place(LABELS)) else {
            return Err(refused("it lacks an input".into()));
        };
        let (mask, has_mask, size) = (place(MASK), place(HAS_MASK), place(SIZE));
        let (masks, qualities) = outputs(&*decoder)?;
        let [_, _, rows, columns] = decoder.outputs()[masks].shape.as_slice().try_into().unwrap_or([0; 4]);
        let side = picture.width;
        let grid = Grid { columns, rows, values: vec![0.0; columns * rows], picture: (side, side) };
        decoder.set_input(labels, &CORNERS)?;
        // There is no mask to begin with.
        mask.into_iter().chain(has_mask).for_each(|input| decoder.input_mut(input).fill(0.0));
        // The whole picture is its own original: a mask that is brought to its size lies over it as the small one does.
        size.into_iter().for_each(|input| decoder.input_mut(input).fill(side as f32));
        Ok(Self { encoder, decoder, picture, embeddings, points, masks, qualities, grid })
    }

    pub fn name(&self) -> &str {
        self.encoder.name()
    }

    pub fn notes(&self) -> Vec<String> {
        let mut notes: Vec<String> = self.encoder.notes().iter().chain(self.decoder.notes()).cloned().collect();
        notes.dedup();
        notes
    }

    pub fn taken_for(&self) -> String {
        let (side, Grid { columns, rows, .. }) = (self.picture.width, &self.grid);
        let masks = self.decoder.outputs()[self.masks].shape.get(1).copied().unwrap_or(1);
        format!(
            "{} and {} are taken for an image encoder of {side} x {side} and its mask decoder, which answers {masks} of {columns} x {rows}",
            self.encoder.name(),
            self.decoder.name()
        )
    }

    /// What the networks say of the target at `bbox`, of which `inside_box` lies in the image; `None` where no mask is said to be good.
    pub fn ask(
        &mut self,
        image: ImageView<'_, Rgb8>,
        (bbox, inside_box): (&BBox, &BBox),
        config: &SegmentationConfig,
    ) -> Result<Option<(Shown, &Grid)>> {
        let size = image.size();
        let whole = Window { left: 0, top: 0, width: size.width as i64, height: size.height as i64 };
        let window = config.context.map_or(whole, |context| inside(about(bbox, context, size), size));
        let shown = Shown::new(window, (self.picture.width, self.picture.height), Placing::Corner);
        self.picture.write(image, &shown, config, self.encoder.input_mut(0));
        self.encoder.run()?;
        self.decoder.set_input(self.embeddings, self.encoder.output(0))?;
        let ((left, top), (right, bottom)) =
            (shown.place(inside_box.left(), inside_box.top()), shown.place(inside_box.right(), inside_box.bottom()));
        self.decoder.set_input(self.points, &[left, top, right, bottom].map(|v| v as f32))?;
        self.decoder.run()?;
        let cells = self.grid.columns * self.grid.rows;
        let masks = self.decoder.output(self.masks);
        let best = match self.qualities.map(|output| self.decoder.output(output)) {
            // Not-a-number is no quality.
            Some(said) => {
                let said = said.iter().enumerate().filter(|(_, q)| !q.is_nan());
                said.max_by(|a, b| a.1.total_cmp(b.1).then(b.0.cmp(&a.0))).map(|(k, _)| k)
            }
            None => Some(0),
        };
        let Some(values) = best.and_then(|k| masks.get(k * cells..(k + 1) * cells)) else { return Ok(None) };
        self.grid.values.copy_from_slice(values);
        Ok(Some((shown, &self.grid)))
    }
}

/// The error of a decoder whose file computes its own shapes, as exporters leave them for any number of points, with what takes these away.
fn with_simplifier(error: InferenceError) -> InferenceError {
    match error {
        InferenceError::Model { what, why, .. } if why.contains("operator") || why.contains("enlarge") => {
            let mend = format!(
                "make it one for a box alone, whose shapes are known: `python3 -m onnxsim {what} {what} --overwrite-input-shape \
                 {POINTS}:1,2,2 {LABELS}:1,2`"
            );
            InferenceError::Model { what, why, mend }
        }
        other => other,
    }
}

/// Planes, rows and columns of an encoder's embedding.
fn embedding_of(encoder: &dyn Network) -> Result<[usize; 3]> {
    let shape = encoder.outputs().first().map(|p| p.shape.clone()).unwrap_or_default();
    match *shape.as_slice() {
        [1, planes, rows, columns] if planes > 0 && rows > 1 && columns > 1 => Ok([planes, rows, columns]),
        _ => Err(misfit(encoder.name(), format!("its first output is {shape:?}, no embedding of a picture"))),
    }
}

fn declared(ports: &[Port]) -> Vec<Declared> {
    let shape = |p: &Port| p.shape.iter().map(|&side| Some(side)).collect();
    ports.iter().map(|p| Declared { name: p.name.clone(), shape: shape(p) }).collect()
}

/// The shapes in which a decoder's inputs are given, in its order.
fn decoder_shapes(
    decoder: &str,
    inputs: &[Declared],
    [planes, rows, columns]: [usize; 3],
) -> Result<Vec<(String, Vec<usize>)>> {
    let names = || inputs.iter().map(|i| format!("`{}`", i.name)).collect::<Vec<_>>().join(", ");
    if let Some(lacking) = [EMBEDDINGS, POINTS, LABELS].iter().find(|name| inputs.iter().all(|i| i.name != **name)) {
        return Err(decoder_misfit(decoder, format!("it has no input `{lacking}`, but {}", names())));
    }
    let shape = |input: &Declared| {
        let shape = match input.name.as_str() {
            EMBEDDINGS => vec![1, planes, rows, columns],
            POINTS => vec![1, 2, 2],
            LABELS => vec![1, 2],
            MASK => vec![1, 1, FINER * rows, FINER * columns],
            HAS_MASK => vec![1],
            SIZE => vec![2],
            _ => return Err(decoder_misfit(decoder, format!("it has an input `{}` that is not known", input.name))),
        };
        let fits = input.shape.len() == shape.len()
            && input.shape.iter().zip(&shape).all(|(said, given)| said.is_none_or(|said| said == *given));
        if !fits {
            let said: Vec<String> = input.shape.iter().map(|s| s.map_or("open".into(), |s| s.to_string())).collect();
            let why = format!("its input `{}` is {}, where {shape:?} is given", input.name, said.join(" x "));
            return Err(decoder_misfit(decoder, why));
        }
        Ok((input.name.clone(), shape))
    };
    inputs.iter().map(shape).collect()
}

/// Which outputs are masks, and how good they are.
fn outputs(decoder: &dyn Network) -> Result<(usize, Option<usize>)> {
    let find = |names: &[&str]| names.iter().find_map(|n| decoder.outputs().iter().position(|p| p.name == *n));
    let shapes =
        || decoder.outputs().iter().map(|p| format!("`{}` {:?}", p.name, p.shape)).collect::<Vec<_>>().join(", ");
    let Some(masks) = find(&MASKS) else {
        return Err(decoder_misfit(decoder.name(), format!("its outputs are {}", shapes())));
    };
    let count = match *decoder.outputs()[masks].shape.as_slice() {
        [1, count, rows, columns] if count > 0 && rows == columns && rows > 1 => count,
        _ => return Err(decoder_misfit(decoder.name(), format!("its masks are no squares: {}", shapes()))),
    };
    let qualities = find(&QUALITIES).filter(|&q| decoder.outputs()[q].len() == count);
    if count > 1 && qualities.is_none() {
        let why = format!("it answers {count} masks and does not say how good each is: {}", shapes());
        return Err(decoder_misfit(decoder.name(), why));
    }
    Ok((masks, qualities))
}
