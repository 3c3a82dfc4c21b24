use super::{
    AnswerCoding, ChannelOrder, CropShape, Cropper, Decoder, DrawnMask, Fill, Location, Peak, Region, SiameseConfig,
    SiameseNetwork,
};
use crate::nanotrack::Patch;
use crate::{InferenceError, Result};
use pursuit_geometry::{BBox, Point, Size};
use pursuit_imaging::{Frame, ImageView, Rgb8};
use pursuit_parameters::ParameterError;
use serde::{Deserialize, Serialize};

/// What a Siamese tracker remembers of its target.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Exemplar {
    /// The network's features of the template.
    pub features: Vec<f32>,
    /// Red, green and blue of what lies outside the frame: the means of the first frame, or black.
    pub fill: Rgb8,
}

/// A network, its configuration and an exemplar, ready to find the target. Where the target was is an argument of every
/// search and not kept.
#[derive(Debug, Clone)]
pub struct SiameseTracker<N> {
    exemplar: Exemplar,
    pub(super) network: N,
    /// Scratch, with the last answer.
    decoder: Decoder,
    cropper: Cropper,
}

impl<N: SiameseNetwork> SiameseTracker<N> {
    /// Takes what is inside `bbox` in `frame` for the target.
    ///
    /// # Errors
    /// [`InferenceError::Box`] unless the box is finite and has an area, [`InferenceError::Config`] if the network's
    /// sides are not the configuration's, and what running the network may bring.
    pub fn new(network: N, config: SiameseConfig, frame: &Frame, bbox: BBox) -> Result<Self> {
        check_sides(&network, &config)?;
        let fill = match config.fill {
            Fill::Mean => mean_color(frame.color(), f64::floor),
            Fill::NearestMean => mean_color(frame.color(), f64::round_ties_even),
            Fill::Black => [0; 3],
        };
        let exemplar = Exemplar { features: Vec::new(), fill };
        let mut this =
            Self { exemplar, network, cropper: Cropper::new(config.double_precision), decoder: Decoder::new(config) };
        let features = this.embed(frame, bbox)?;
        this.set_features(features)?;
        Ok(this)
    }

    /// From an exemplar that was saved.
    ///
    /// # Errors
    /// [`InferenceError::Config`] if the network's sides are not the configuration's, [`InferenceError::Tensor`] if the
    /// exemplar is another network's.
    pub fn restore(mut network: N, config: SiameseConfig, exemplar: Exemplar) -> Result<Self> {
        check_sides(&network, &config)?;
        network.set_template(&exemplar.features)?;
        Ok(Self { exemplar, network, cropper: Cropper::new(config.double_precision), decoder: Decoder::new(config) })
    }

    /// What is remembered of the target.
    pub const fn exemplar(&self) -> &Exemplar {
        &self.exemplar
    }

    /// The network.
    pub const fn network(&self) -> &N {
        &self.network
    }

    /// The configuration.
    pub const fn config(&self) -> &SiameseConfig {
        self.decoder.config()
    }

    /// The features of what is inside `bbox` in `frame`; the exemplar stays what it is.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn embed(&mut self, frame: &Frame, bbox: BBox) -> Result<Vec<f32>> {
        let extent = self.decoder.template_extent(bbox.width(), bbox.height());
        let shift = self.config().template_shift_px;
        let center = Point::new(bbox.center().x + shift, bbox.center().y + shift);
        if !(bbox.is_finite() && bbox.area() > 0.0) {
            return Err(InferenceError::Box { bbox: format!("{:?}", bbox.ltwh()) });
        }
        self.crop(frame, self.region(center, extent, frame.size()), Patch::Template);
        self.network.embed()
    }

    /// Looks for other features from now on: those of another view, or a mean of several.
    ///
    /// # Errors
    /// [`InferenceError::Tensor`] unless there are as many as [`embed`](Self::embed) gives.
    pub fn set_features(&mut self, features: Vec<f32>) -> Result<()> {
        self.network.set_template(&features)?;
        self.exemplar.features = features;
        Ok(())
    }

    /// Looks for the target around `center`, given that it was `size` (width, height) large. `None` when the network
    /// answered nothing finite.
    ///
    /// # Errors
    /// [`InferenceError::Box`] unless centre and size are finite and the size is positive; what running the network may
    /// bring.
    pub fn locate(&mut self, frame: &Frame, center: Point, size: (f64, f64)) -> Result<Option<Location>> {
        let bbox = BBox::from_center_size(center, size.0, size.1);
        let extent = self.decoder.search_extent(size.0, size.1);
        if !(bbox.is_finite() && extent.0.is_finite() && extent.1.is_finite() && bbox.area() > 0.0) {
            return Err(InferenceError::Box { bbox: format!("{:?}", bbox.ltwh()) });
        }
        let shift = self.config().search_shift_px;
        let cut_at = Point::new(center.x + shift, center.y + shift);
        if let AnswerCoding::Scores { .. } = &self.config().answer {
            for factor in self.decoder.begin_scales() {
                let extent = (extent.0 * factor, extent.1 * factor);
                self.crop(frame, self.region(cut_at, extent, frame.size()), Patch::Search);
                self.decoder.add_scale(self.network.search()?, factor, size);
            }
            return Ok(self.decoder.locate_at_scale(center, size, frame.size()));
        }
        self.crop(frame, self.region(cut_at, extent, frame.size()), Patch::Search);
        let middle = self.middle(center, size);
        let answer = self.network.search()?;
        Ok(self.decoder.locate(answer, middle, size, frame.size()))
    }

    /// The scores of the last search, row by row: probabilities, not calibrated.
    pub fn scores(&self) -> impl ExactSizeIterator<Item = f64> + '_ {
        self.decoder.scores()
    }

    /// The peaks of the last search, which must have been around `center` for `size`, best first; see
    /// [`Decoder::peaks`].
    pub fn peaks(&self, center: Point, size: (f64, f64), least: f64, peaks: &mut Vec<Peak>) {
        self.decoder.peaks(self.middle(center, size), size, least, peaks);
    }

    /// What the network has drawn of the target at `found`, which the last search, around `center` for `size` in a frame of `frame`, has given.
    /// `None` of networks that draw no masks.
    ///
    /// # Errors
    /// What running the network may bring; [`InferenceError::Tensor`] unless there are as many logits as the mask has places.
    pub fn mask(
        &mut self,
        frame: Size,
        center: Point,
        size: (f64, f64),
        found: &Location,
    ) -> Result<Option<DrawnMask>> {
        let expected = self.config().mask_side * self.config().mask_side;
        if expected == 0 {
            return Ok(None);
        }
        let (middle, shift) = (self.middle(center, size), self.config().search_shift_px);
        let cut_at = Point::new(center.x + shift, center.y + shift);
        let (_, _, width, height) = self.region(cut_at, self.search_extent(size), frame).ltwh();
        let logits = self.network.mask(found.point)?;
        if logits.len() != expected {
            let (what, port) = ("the Siamese network".into(), "mask".into());
            return Err(InferenceError::Tensor { what, port, expected, actual: logits.len() });
        }
        let extent = (width as f64, height as f64);
        Ok(Some(DrawnMask::new(logits, self.decoder.config(), found.point, middle, extent)))
    }

    /// What the middle of a search around `center` is taken for: of a rounded window where it lies.
    fn middle(&self, center: Point, size: (f64, f64)) -> Point {
        match self.config().crop {
            CropShape::Rounded => {
                let shift = self.config().search_shift_px;
                let cut_at = Point::new(center.x + shift, center.y + shift);
                Region::rounded(cut_at, self.search_extent(size).0).center()
            }
            CropShape::Square | CropShape::Stretched | CropShape::Inclusive => center,
        }
    }

    /// The pixels of a frame of `size` that an image covers which is `extent` (width, height) large there.
    fn region(&self, center: Point, extent: (f64, f64), size: Size) -> Region {
        match self.config().crop {
            CropShape::Square => Region::around(center, extent.0, self.config().ties),
            CropShape::Stretched => Region::stretched(center, extent),
            CropShape::Rounded => Region::rounded(center, extent.0),
            CropShape::Inclusive => Region::inclusive(center, extent.0, size),
        }
    }

    /// The width and height of the frame that a search for a target of `size` (width, height) takes in, in pixels.
    pub fn search_extent(&self, size: (f64, f64)) -> (f64, f64) {
        self.decoder.search_extent(size.0, size.1)
    }

    /// Cuts, resamples, normalises and hands over.
    fn crop(&mut self, frame: &Frame, region: Region, patch: Patch) {
        let Self { exemplar, network, decoder, cropper } = self;
        let config = decoder.config();
        let samples = match patch {
            Patch::Template => config.template_side_px,
            Patch::Search => config.search_side_px,
        };
        let (mean, deviation) = (config.mean, config.deviation);
        let is_plain = mean == [0.0; 3] && deviation == [1.0; 3];
        let swap = config.channels == ChannelOrder::Bgr;
        let write = |y: usize, mut planes: [&mut [f32]; 3]| {
            if swap {
                planes.swap(0, 2);
            }
            if !is_plain {
                for (c, plane) in planes.iter_mut().enumerate() {
                    plane.iter_mut().for_each(|p| *p = (*p - mean[c]) / deviation[c]);
                }
            }
            network.write_row(patch, y, planes.each_ref().map(|plane| &**plane));
        };
        if config.crop == CropShape::Inclusive {
            cropper.interpolate(frame.color(), region, samples, exemplar.fill, write);
        } else {
            cropper.crop(frame.color(), region, samples, exemplar.fill, write);
        }
    }
}

fn check_sides(network: &impl SiameseNetwork, config: &SiameseConfig) -> Result<()> {
    let sides = network.sides();
    let wrong = |name, value: usize| {
        let problem = format!("must be the side that the network has, not {value}");
        Err(ParameterError::new("config", name, problem).into())
    };
    if sides.template != config.template_side_px {
        return wrong("template_side_px", config.template_side_px);
    }
    if sides.search != config.search_side_px {
        return wrong("search_side_px", config.search_side_px);
    }
    if sides.answer != config.answer_side {
        return wrong("answer_side", config.answer_side);
    }
    Ok(())
}

/// Means of the three channels, rounded.
fn mean_color(image: ImageView<'_, Rgb8>, rounded: fn(f64) -> f64) -> Rgb8 {
    let mut sums = [0u64; 3];
    for pixel in image.rows().flatten() {
        (0..3).for_each(|c| sums[c] += u64::from(pixel[c]));
    }
    sums.map(|s| rounded(s as f64 / image.size().area() as f64) as u8)
}
