//! What says what detections look like: the group `[many.embedding]`. See `docs/guide/targets.md`.

use crate::runtime::unusable;
use pursuit_geometry::{BBox, Size};
use pursuit_imaging::Frame;
use pursuit_inference::embedding::EmbeddingNetwork;
use pursuit_inference::onnx::{Device, OnnxOptions};
use pursuit_parameters::ParameterError;
use pursuit_tracking::many::{EmbeddingModel, EmbeddingParams, NetworkEmbeddingParams};
use pursuit_tracking::{Embedder, Result, TrackingError};
use pursuit_vision::features::ColorTable;
use pursuit_vision::hog::{Hog, HogLayout};
use pursuit_vision::sampling::{Planes, Sampler, Window};
use std::path::Path;
use std::sync::Arc;

/// The owner of the parameters in errors.
const NAME: &str = "many";

/// What the parameters name; nothing where they name nothing. A network runs on `device` where onnxruntime's library can hand it there, else
/// on the processor, and says so.
///
/// # Errors
/// [`TrackingError::Parameter`] for a network that cannot be opened.
pub fn embedder(params: &EmbeddingParams, device: Device) -> Result<Option<Box<dyn Embedder>>> {
    Ok(match params.model {
        EmbeddingModel::None => None,
        EmbeddingModel::Colors => Some(Box::new(Colors::new())),
        EmbeddingModel::Network => Some(Box::new(ByNetwork::open(&params.network, device)?)),
    })
}

/// The box is brought to this size …
const PATCH: Size = Size::new(24, 48);
/// … and looked at in cells of so many pixels, for colours and for edges.
const COLOR_CELL_PX: usize = 8;
const EDGE_CELL_PX: usize = 8;
/// What edges weigh beside colours.
const EDGES: f32 = 0.5;

/// Colour names (weijer2009) and oriented gradients (felzenszwalb2010) in cells of the box.
struct Colors {
    sampler: Sampler,
    names: ColorTable,
    hog: Hog,
    patch: Planes,
    colors: Planes,
    edges: Planes,
}

impl Colors {
    fn new() -> Self {
        let cells = Size::new(PATCH.width / COLOR_CELL_PX, PATCH.height / COLOR_CELL_PX);
        let (names, hog) = (ColorTable::color_names(), Hog::new(HogLayout::Felzenszwalb31, EDGE_CELL_PX));
        let (patch, edges) = (Planes::new(PATCH, 3), Planes::new(hog.grid(PATCH), hog.channels()));
        let colors = Planes::new(cells, names.channels());
        Self { sampler: Sampler::with_capacity(Size::new(1920, 1080), PATCH), names, hog, patch, colors, edges }
    }
}

impl Embedder for Colors {
    fn embed(&mut self, frame: &Frame, bbox: &BBox) -> Result<Arc<[f32]>> {
        let Some(inside) = bbox.clipped_to(frame.size()) else {
            return Ok(vec![0.0; self.colors.as_slice().len() + self.edges.as_slice().len()].into());
        };
        self.sampler.color(frame.color(), &Window::of_region(inside, PATCH), &mut self.patch);
        self.names.extract(&self.patch, COLOR_CELL_PX, &mut self.colors, 0);
        self.hog.extract(&self.patch, &mut self.edges);
        let unit = |numbers: &[f32], weight: f32| {
            let length = numbers.iter().map(|v| v * v).sum::<f32>().sqrt();
            if length > 0.0 { weight / length } else { 0.0 }
        };
        let (colors, edges) = (self.colors.as_slice(), self.edges.as_slice());
        let (color, edge) = (unit(colors, 1.0), unit(edges, EDGES));
        Ok(colors.iter().map(|v| v * color).chain(edges.iter().map(|v| v * edge)).collect())
    }
}

/// A network for re-identification.
struct ByNetwork(EmbeddingNetwork);

impl ByNetwork {
    fn open(params: &NetworkEmbeddingParams, device: Device) -> Result<Self> {
        let Some(file) = params.file.path() else {
            let problem = "names no network; give the ONNX file of one, for example `--set many.embedding.network.file=osnet.onnx`";
            return Err(ParameterError::new(NAME, "embedding.network.file", problem).into());
        };
        let options = OnnxOptions {
            library: params.onnxruntime.path().map(Path::to_path_buf),
            image: Some((params.width_px, params.height_px)),
            device,
            ..OnnxOptions::default()
        };
        let network = EmbeddingNetwork::open(file, &options).map_err(unusable(NAME, "embedding.network.file"))?;
        Ok(Self(network))
    }
}

impl Embedder for ByNetwork {
    fn embed(&mut self, frame: &Frame, bbox: &BBox) -> Result<Arc<[f32]>> {
        let failed = |e| TrackingError::Computation {
            tracker: "embedding".to_owned(),
            index: frame.index(),
            source: Box::new(e),
        };
        Ok(self.0.embed(frame.color(), bbox).map_err(failed)?.into())
    }

    fn notes(&self) -> Vec<String> {
        self.0.notes().to_vec()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_imaging::Image;
    use pursuit_parameters::Parameters;

    fn cosine(a: &[f32], b: &[f32]) -> f32 {
        let dot = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f32>();
        dot(a, b) / (dot(a, a) * dot(b, b)).sqrt()
    }

    /// People in a shirt and trousers.
    fn frame(shirts: &[([u8; 3], [u8; 3])]) -> Frame {
        let image = Image::from_fn(60 * shirts.len(), 100, |x, y| {
            let (shirt, trousers) = shirts[x / 60];
            let person = (15..45).contains(&(x % 60)) && (10..90).contains(&y);
            let wrinkle = ((x * 7 + y * 13) % 5) as u8;
            let color = if y < 50 { shirt } else { trousers };
            if person { color.map(|c| c.saturating_add(wrinkle)) } else { [110, 115, 110] }
        });
        Frame::new(0, 0.0, image.unwrap())
    }

    fn person(at: usize) -> BBox {
        BBox::from_ltwh(60.0 * at as f64 + 15.0, 10.0, 30.0, 80.0)
    }

    #[test]
    fn the_same_clothes_are_alike_and_others_are_not() {
        let (red, blue, white) = ([180, 30, 30], [30, 40, 160], [220, 220, 220]);
        let frame = frame(&[(red, blue), (red, blue), (blue, red), (white, blue)]);
        let mut colors = Colors::new();
        let mut look = |at: usize, dx: f64| {
            let person = person(at);
            colors.embed(&frame, &BBox::from_ltwh(person.left() + dx, person.top(), 30.0, 80.0)).unwrap()
        };
        let first = look(0, 0.0);
        assert!(cosine(&first, &look(1, 3.0)) > 0.85, "{}", cosine(&first, &look(1, 3.0)));
        for other in [2, 3] {
            assert!(cosine(&first, &look(other, 0.0)) < 0.6, "{other}: {}", cosine(&first, &look(other, 0.0)));
        }
    }

    #[test]
    fn boxes_outside_look_like_nothing() {
        let frame = frame(&[([200, 0, 0], [0, 0, 200])]);
        let mut colors = Colors::new();
        let there = colors.embed(&frame, &person(0)).unwrap();
        let outside = colors.embed(&frame, &BBox::from_ltwh(500.0, 0.0, 20.0, 50.0)).unwrap();
        assert_eq!((outside.len(), outside.iter().all(|v| *v == 0.0)), (there.len(), true));
        assert!(colors.embed(&frame, &BBox::from_ltwh(-1e9, -1e9, 2e9, 2e9)).unwrap().iter().all(|v| v.is_finite()));
    }

    #[test]
    fn a_network_needs_a_file() {
        let params = |text: &str| EmbeddingParams::default().with("embedding", &text.parse().unwrap()).unwrap();
        let made = |text: &str| embedder(&params(text), Device::Cpu);
        assert!(made("").unwrap().is_none());
        assert!(made("model = 'colors'").unwrap().is_some_and(|colors| colors.notes().is_empty()));
        let error = |text: &str| made(text).err().unwrap().to_string();
        assert!(error("model = 'network'").contains("names no network"), "{}", error("model = 'network'"));
        let missing = error("model = 'network'\nnetwork.file = 'nowhere.onnx'");
        assert!(missing.contains("nowhere.onnx"), "{missing}");
    }
}
