use super::{ScoreWeights, SiameseLocalizer, SiameseModel};
use crate::runtime::{RuntimeParams, unusable};
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_inference::onnx::OnnxSiamese;
use pursuit_inference::siamese::{SiameseConfig, SiameseDescription};
use pursuit_parameters::{FileName, ParameterError};
use pursuit_tracking::{LocalizerRecipe, Needs, Result};

pursuit_parameters::choices! {
    /// What the network is.
    pub enum Layout {
        /// What a TOML file says.
        Described = "described",
        /// FEAR-XS: `fear_xs_template.onnx` and `fear_xs_track.onnx`.
        FearXs = "fear-xs",
        /// NanoTrack v2: `nanotrack_backbone_sim.onnx` and `nanotrack_head_sim.onnx`.
        NanoTrackV2 = "nanotrack-v2",
        /// NanoTrack v3: `nanotrack_backbone.onnx` and `nanotrack_head.onnx`.
        NanoTrackV3 = "nanotrack-v3",
    }
}

pursuit_parameters::parameters! {
    /// Parameters of a Siamese tracker whose network comes as files.
    pub struct SiameseParams {
        /// The network: the TOML file that describes it, or, of a known layout, the folder with its files.
        pub model: FileName = FileName::default();
        /// What the network is.
        pub layout: Layout = Layout::Described;
        /// Score: constant of the logistic regression.
        pub score_bias: f64 = -1.84, in Bounds::default(), source "of nanotrack by its score alone";
        /// Score: weight of the log odds of the network's score.
        pub score_weight: f64 = 0.48, in 0.0.., source "of nanotrack by its score alone";
        /// How the network is run.
        pub runtime: RuntimeParams = RuntimeParams::default();
    }
}

impl SiameseParams {
    /// What is known of the network.
    fn description(&self, owner: &str) -> Result<SiameseDescription> {
        let Some(model) = self.model.path() else {
            let example = match self.layout {
                Layout::Described => "the TOML file that describes one, for example `--set model=mine.toml`",
                Layout::FearXs | Layout::NanoTrackV2 | Layout::NanoTrackV3 => {
                    "the folder with its ONNX files, for example `--set model=networks/fear_xs`"
                }
            };
            let problem = format!("names no network; give {example}");
            return Err(ParameterError::new(owner, "model", problem).into());
        };
        let in_folder = |template: &str, search: &str, head: Option<&str>, config: SiameseConfig| SiameseDescription {
            template: Some(model.join(template)),
            search: model.join(search),
            head: head.map(|h| model.join(h)),
            refine: None,
            config,
        };
        Ok(match self.layout {
            Layout::Described => SiameseDescription::read(model).map_err(unusable(owner, "model"))?,
            Layout::FearXs => in_folder("fear_xs_template.onnx", "fear_xs_track.onnx", None, SiameseConfig::fear_xs()),
            Layout::NanoTrackV2 => {
                let backbone = "nanotrack_backbone_sim.onnx";
                in_folder(backbone, backbone, Some("nanotrack_head_sim.onnx"), SiameseConfig::nanotrack_v2())
            }
            Layout::NanoTrackV3 => {
                let backbone = "nanotrack_backbone.onnx";
                in_folder(backbone, backbone, Some("nanotrack_head.onnx"), SiameseConfig::nanotrack_v3())
            }
        })
    }
}

impl SiameseModel for SiameseParams {
    type Network = OnnxSiamese;

    const NAME: &'static str = "siamese";

    fn open(&self) -> Result<(OnnxSiamese, SiameseConfig)> {
        let owner = if self.layout == Layout::FearXs { "fear-xs" } else { "siamese" };
        let description = self.description(owner)?;
        let network = description.open(&self.runtime.options()).map_err(unusable(owner, "model"))?;
        network.notes().iter().for_each(|note| tracing::warn!("{note}"));
        Ok((network, description.config))
    }

    fn score_weights(&self) -> ScoreWeights {
        ScoreWeights { bias: self.score_bias, score: self.score_weight, embedding: 0.0 }
    }
}

impl LocalizerRecipe for SiameseParams {
    type Localizer = SiameseLocalizer<Self>;

    const NEEDS: Needs = Needs { color: false, file: true };

    fn localizer(&self, frame: &Frame, bbox: BBox) -> Result<SiameseLocalizer<Self>> {
        SiameseLocalizer::new(self, frame, bbox)
    }
}
