use super::{BoxCoding, DetectionConfig, ScoreCoding};
use crate::{InferenceError, Network, Result};
use pursuit_geometry::BBox;

/// One thing that a network saw.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Object {
    /// Its box.
    pub bbox: BBox,
    /// Its score, in `[0, 1]`: not calibrated.
    pub score: f64,
    /// Its class, counted from 0.
    pub class: usize,
}

/// How the numbers of boxes lie in an output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Order {
    /// Box after box.
    Boxes,
    /// First the first number of all boxes, then the second …
    Planes,
}

/// Turns a network's output into boxes in pixels of its image.
#[derive(Debug, Clone)]
pub(super) struct Decoder {
    config: DetectionConfig,
    order: Order,
    count: usize,
    /// Column, row and side of the cell of each box, for boxes relative to grids.
    cells: Vec<[f32; 3]>,
    numbers: Vec<f32>,
    /// Width and height of the image, which fractions are of.
    image: [f64; 2],
}

impl Decoder {
    /// For the output of `network`, whose image has `width` × `height` pixels.
    pub fn new(config: DetectionConfig, network: &dyn Network, (width, height): (usize, usize)) -> Result<Self> {
        let misfit = |why: String, mend: &str| InferenceError::Model {
            what: network.name().to_owned(),
            why,
            mend: mend.to_owned(),
        };
        let describe =
            "describe the network in a TOML file of its name beside it (family, classes, boxes, objectness, strides)";
        let attributes = config.attributes();
        let shape = network.outputs().first().map(|p| p.shape.clone()).unwrap_or_default();
        let (order, count) = match *shape.as_slice() {
            [1, count, numbers] if numbers == attributes => (Order::Boxes, count),
            [1, numbers, count] if numbers == attributes => (Order::Planes, count),
            _ => {
                let of = match config.scores {
                    ScoreCoding::Classes => format!("{} classes need", config.classes.len()),
                    ScoreCoding::Best => "a best class needs".to_owned(),
                };
                let why = format!("its output is {shape:?}, where {of} {attributes} numbers a box");
                return Err(misfit(why, describe));
            }
        };
        let mut cells = Vec::new();
        if config.boxes == BoxCoding::Grid {
            for &stride in &config.strides {
                let (columns, rows) = (width / stride, height / stride);
                if cells.len() + columns * rows > count {
                    break;
                }
                let of_row = |row: usize| (0..columns).map(move |column| [column as f32, row as f32, stride as f32]);
                cells.extend((0..rows).flat_map(of_row));
            }
            if cells.len() != count {
                let all: usize = config.strides.iter().map(|s| (width / s) * (height / s)).sum();
                let why = format!("it has {count} boxes, where grids of strides {:?} have {all} cells", config.strides);
                return Err(misfit(why, describe));
            }
        }
        let image = [width as f64, height as f64];
        Ok(Self { numbers: vec![0.0; attributes], config, order, count, cells, image })
    }

    /// Puts boxes with a score of at least `least` of classes that are `wanted` into `objects`, which is emptied first. A box is
    /// of the class that scores best, and no other.
    pub fn decode(&mut self, output: &[f32], least: f64, wanted: &[bool], objects: &mut Vec<Object>) {
        objects.clear();
        let Self { config, order, count, cells, numbers, image } = self;
        let attributes = numbers.len();
        let probability = |v: f32| if config.logits { 1.0 / (1.0 + (-v).exp()) } else { v };
        for i in 0..*count {
            let own: &[f32] = match order {
                Order::Boxes => output.get(i * attributes..(i + 1) * attributes).unwrap_or_default(),
                Order::Planes => {
                    let all = output.iter().skip(i).step_by((*count).max(1));
                    numbers.iter_mut().zip(all).for_each(|(to, from)| *to = *from);
                    numbers
                }
            };
            let &[x, y, w, h, ref scores @ ..] = own else { continue };
            let (holds, scores) = match scores {
                [holds, classes @ ..] if config.objectness => (probability(*holds), classes),
                classes => (1.0, classes),
            };
            // Not-a-number is never the greatest, and never enough.
            let enough = |score: f32| f64::from(score) >= least;
            if !enough(holds) {
                continue;
            }
            let best = match (config.scores, scores) {
                (ScoreCoding::Classes, scores) => {
                    scores.iter().copied().enumerate().reduce(|a, b| if b.1 > a.1 { b } else { a })
                }
                (ScoreCoding::Best, &[best, class]) => numbered(class, config.classes.len()).map(|class| (class, best)),
                (ScoreCoding::Best, _) => None,
            };
            let Some((class, best)) = best else { continue };
            let score = holds * probability(best);
            if !enough(score) || !wanted.get(class).copied().unwrap_or(false) {
                continue;
            }
            let [x, y, w, h] = match (config.boxes, cells.get(i)) {
                (BoxCoding::Grid, Some(&[column, row, stride])) => {
                    [(x + column) * stride, (y + row) * stride, w.exp() * stride, h.exp() * stride]
                }
                _ => [x, y, w, h],
            }
            .map(f64::from);
            let [columns, rows] = *image;
            let bbox = match config.boxes {
                BoxCoding::Grid | BoxCoding::Pixels => BBox::from_ltwh(x - w / 2.0, y - h / 2.0, w, h),
                BoxCoding::Fractions => {
                    BBox::from_ltwh((x - w / 2.0) * columns, (y - h / 2.0) * rows, w * columns, h * rows)
                }
                BoxCoding::Corners => BBox::from_ltrb(x, y, w, h),
            };
            if bbox.is_finite() && bbox.width() > 0.0 && bbox.height() > 0.0 {
                objects.push(Object { bbox, score: f64::from(score).min(1.0), class });
            }
        }
    }
}

/// The class of this number, which is stored as a fraction; none where there is no such class.
fn numbered(class: f32, classes: usize) -> Option<usize> {
    (0..classes).contains(&(class as usize)).then_some(class as usize).filter(|&c| class >= 0.0 && c as f32 == class)
}
