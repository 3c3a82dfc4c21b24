//! Everything that looks: features, appearance models, correlation filters, and every tracker and detector, each a short
//! file of parameters and assembly, in one [`registry`].

pub mod acpf;
mod ahead;
pub mod appearance;
pub mod at_point;
mod backdrop;
pub mod ball;
#[cfg(feature = "zoo")]
pub mod cam_shift;
#[cfg(feature = "zoo")]
pub mod classifiers;
#[cfg(feature = "zoo")]
pub mod condensation;
#[cfg(feature = "zoo")]
pub mod continuous;
pub mod correlation;
#[cfg(feature = "zoo")]
pub mod csr_dcf;
pub mod depth;
pub mod depth_occlusion;
pub mod detectors;
pub mod dsst;
pub mod embedding;
pub mod families;
pub mod features;
pub mod flow;
pub mod kcf;
pub mod lightfc;
pub mod masks;
#[cfg(feature = "zoo")]
pub mod mean_shift;
pub mod mosse;
pub mod nanotrack;
pub mod person;
pub mod pursuit;
pub mod registry;
pub mod regularised;
pub mod runtime;
pub mod siamese;
#[cfg(feature = "zoo")]
pub mod sparse;
pub mod staple;
pub mod tld;
pub mod vittrack;
#[cfg(feature = "zoo")]
mod wary;

use families::Family;
use pursuit_tracking::TrackerEntry;

/// An entry whose recipe is made by a function of the name.
macro_rules! tracker {
    ($name:literal, $paper:literal, $recipe:path, $summary:literal) => {
        TrackerEntry::new($name, $summary, $paper, |name| masks::with_masks(Box::new($recipe(name))))
    };
}

/// Every tracker. A new one is its module above, its entry here, and its name in a family below.
const TRACKERS: &[TrackerEntry] = &[
    tracker!(
        "pursuit",
        "pursuit",
        pursuit::pursuit,
        "the default: a filter and a network watch, one judge decides; says when the target is hidden, finds it again"
    ),
    tracker!(
        "pursuit-light",
        "pursuit",
        pursuit::light,
        "the default's filter alone: quicker, says when the target is hidden, finds it again"
    ),
    tracker!(
        "nanotrack",
        "nanotrack",
        nanotrack::nanotrack,
        "a small Siamese network, nothing to install: robust to changes of shape, slower than filters"
    ),
    tracker!("lightfc", "lightfc", lightfc::lightfc, "a larger network, nothing to install: slower than NanoTrack"),
    tracker!("vittrack", "vittrack", vittrack::vittrack, "a small transformer, nothing to install"),
    tracker!(
        "fear-xs",
        "siamese",
        siamese::fear_xs,
        "FEAR-XS, a Siamese network by file: more robust than nanotrack, and slower"
    ),
    tracker!(
        "siamese",
        "siamese",
        siamese::siamese,
        "any Siamese network of yours: ONNX files and a TOML file that describes them"
    ),
    tracker!(
        "ball",
        "ball",
        ball::ball,
        "a ball (or anything of one colour) by colour and shape, with a filter for bounces"
    ),
    tracker!(
        "depth-occlusion",
        "zhai2024",
        depth_occlusion::depth_occlusion,
        "correlation on depth: knows when something nearer hides the target, waits, finds it again, in any light"
    ),
    tracker!(
        "depth-occlusion-fused",
        "zhai2024",
        depth_occlusion::depth_occlusion_fused,
        "depth-occlusion on the gradients of depth and of the picture together"
    ),
    tracker!(
        "person",
        "qu2010",
        person::person,
        "someone before a camera that stands still: the default's eye, the background's outline, the next position predicted"
    ),
    tracker!(
        "bacf",
        "bacf",
        regularised::bacf,
        "background-aware correlation filter on gradients and colour names: accurate, quick"
    ),
    tracker!(
        "strcf",
        "strcf",
        regularised::strcf,
        "spatial-temporal regularised correlation filter: learns each frame anew, near the last"
    ),
    #[cfg(feature = "zoo")]
    tracker!(
        "csr-dcf",
        "lukezic2017",
        csr_dcf::csr_dcf,
        "a filter that has the target's outline, channels as far as they are reliable: OpenCV's CSRT"
    ),
    #[cfg(feature = "zoo")]
    tracker!(
        "eco-hc",
        "danelljan2017",
        continuous::eco_hc,
        "continuous convolution on gradients and colour names: learns from a compact mixture of all that it saw"
    ),
    #[cfg(feature = "zoo")]
    tracker!(
        "c-cot",
        "danelljan2016",
        continuous::c_cot,
        "eco-hc's forerunner: every feature and every frame counts, trained in each one; slower"
    ),
    tracker!("kcf", "kcf", kcf::kcf, "kernelized correlation filter on HOG with a search over sizes: very fast"),
    tracker!(
        "kcf-fixed",
        "kcf",
        kcf::kcf_fixed,
        "kernelized correlation filter on HOG as published: keeps the size, faster still"
    ),
    tracker!(
        "kcf-depth",
        "kcf",
        kcf::kcf_depth,
        "kernelized correlation filter on HOG of depth (of grey where there is none): keeps the size"
    ),
    tracker!(
        "acpf",
        "zhai2024",
        acpf::acpf,
        "occlusion-aware particle filter on colour and depth: the baseline that depth-occlusion is compared with"
    ),
    tracker!("csk", "kcf", kcf::csk, "kernelized correlation filter on grey values: the circulant structure tracker"),
    tracker!(
        "mosse",
        "mosse",
        mosse::mosse,
        "minimum output sum of squared error on grey values: the fastest, keeps the size"
    ),
    tracker!("staple", "staple", staple::staple, "HOG correlation beside colour histograms: bears deformation, fast"),
    tracker!("dsst", "dsst", dsst::dsst, "correlation on gradients beside a filter along scale: exact sizes, quick"),
    tracker!(
        "fdsst",
        "dsst",
        dsst::fdsst,
        "dsst on compressed features with half as many sizes, interpolated: quicker"
    ),
    #[cfg(feature = "zoo")]
    tracker!(
        "meanshift",
        "comaniciu2003",
        mean_shift::meanshift,
        "climbs to where the colours are most alike: bears any deformation, needs colours of the target's own"
    ),
    #[cfg(feature = "zoo")]
    tracker!(
        "camshift",
        "bradski1998",
        cam_shift::camshift,
        "climbs to where the target's hues are thickest, and grows with them: very fast, for targets of a hue of their own"
    ),
    #[cfg(feature = "zoo")]
    tracker!(
        "condensation",
        "isard1998",
        condensation::condensation,
        "hundreds of guesses that move on and are weighed by colours and outline: bears clutter and sudden motion"
    ),
    #[cfg(feature = "zoo")]
    tracker!(
        "struck",
        "hare2011",
        classifiers::struck,
        "learns to rank displacements by overlap, with few support vectors: bears blur and clutter, keeps the size"
    ),
    #[cfg(feature = "zoo")]
    tracker!(
        "dlssvm",
        "ning2016",
        classifiers::dlssvm,
        "learns as struck does, a linear function of quantised colours and ranks of brightness; follows the size"
    ),
    #[cfg(feature = "zoo")]
    tracker!(
        "mil",
        "babenko2011",
        classifiers::mil,
        "boosting on bags of windows, which forgives a box that is a little off; keeps the size"
    ),
    #[cfg(feature = "zoo")]
    tracker!(
        "boosting",
        "grabner2006",
        classifiers::boosting,
        "chooses the features that tell the target from its surroundings, anew in each frame; keeps the size"
    ),
    #[cfg(feature = "zoo")]
    tracker!(
        "online-forest",
        "saffari2009",
        classifiers::online_forest,
        "random trees that grow while frames come; keeps the size"
    ),
    #[cfg(feature = "zoo")]
    tracker!(
        "l1",
        "bao2012",
        sparse::l1,
        "hundreds of guesses written as few templates and few single pixels: bears partial covering, knows of it"
    ),
    #[cfg(feature = "zoo")]
    tracker!(
        "cst",
        "zhang2016",
        sparse::cst,
        "writes the window as a sum of few shifted templates of gradients and colours: quick, follows the size"
    ),
    tracker!(
        "kalman-tld",
        "zhu2014",
        tld::kalman_tld,
        "follows points, learns what the target is, finds it again; a Kalman filter says where to scan"
    ),
    tracker!(
        "tld",
        "tld",
        tld::tld,
        "tracking-learning-detection: as kalman-tld, all over the frame at every frame, without the filter"
    ),
    tracker!(
        "median-flow",
        "tld",
        flow::median_flow,
        "follows points there and back: exact on smooth motion, very fast, never finds a target again"
    ),
    tracker!(
        "point",
        "shi1994",
        flow::point,
        "one point, to a fraction of a pixel, by how its surroundings looked at the start: knows when it is hidden, finds it again"
    ),
];

/// Every family. A new tracker is a name in one of them.
const FAMILIES: &[Family] = &[
    Family {
        name: "own",
        sentence: "Several kinds of looks at once, and one judge who says when the target is hidden: this program's own.",
        trackers: &["pursuit", "pursuit-light", "person"],
    },
    Family {
        name: "siamese",
        sentence: "A network trained beforehand compares the first picture of the target with what is around it: bears changes of \
                   shape, and takes what is like the target for it.",
        trackers: &["nanotrack", "lightfc", "vittrack", "fear-xs", "siamese"],
    },
    Family {
        name: "correlation",
        sentence: "A filter learnt from the target answers with a peak where it is, computed by Fourier transforms: very fast, and \
                   learns what is in the box, whatever it is.",
        trackers: &[
            "bacf",
            "strcf",
            "csr-dcf",
            "eco-hc",
            "c-cot",
            "kcf",
            "kcf-fixed",
            "csk",
            "mosse",
            "staple",
            "dsst",
            "fdsst",
        ],
    },
    Family {
        name: "colour",
        sentence: "The colours of the target, wherever in it they are: bears any deformation, and needs colours that the \
                   surroundings do not have.",
        trackers: &["ball", "meanshift", "camshift", "condensation"],
    },
    Family {
        name: "classifiers",
        sentence: "A classifier that learns from frame to frame tells windows of the target from windows beside it: bears clutter, \
                   and keeps the size.",
        trackers: &["struck", "dlssvm", "mil", "boosting", "online-forest"],
    },
    Family {
        name: "sparse",
        sentence: "The target is a sum of few templates, and what does not fit lies in front of it: bears partial occlusion, slow.",
        trackers: &["l1", "cst"],
    },
    Family {
        name: "flow",
        sentence: "Points are followed from frame to frame, and with detection what was learnt is looked for all over the picture: \
                   exact on smooth motion, comes back.",
        trackers: &["kalman-tld", "tld", "median-flow", "point"],
    },
    Family {
        name: "depth",
        sentence: "How far away the target is, from a depth camera: knows what is in front of what, in any light.",
        trackers: &["depth-occlusion", "depth-occlusion-fused", "kcf-depth", "acpf"],
    },
];
