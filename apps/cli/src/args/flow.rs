//! `pursuit flow`.

use super::{Span, View};
use clap::Args;
use std::ffi::OsString;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub struct Flow {
    /// A video file, a folder of images, `camera:0`, `rtsp://…`, `-`, or `scene:NAME[?seed=1&key=value]`
    #[arg(value_name = "INPUT")]
    pub input: OsString,
    /// Follow this point of the first frame, pixels from the left and from the top (repeat for several)
    #[arg(long = "point", value_name = "X,Y", value_parser = point, allow_hyphen_values = true, conflicts_with_all = ["points", "dense"])]
    pub given: Vec<[f64; 2]>,
    /// Follow so many corners of the first frame, the best there are [default: 200]
    #[arg(long, value_name = "N", conflicts_with_all = ["grid", "dense"])]
    pub points: Option<usize>,
    /// Follow points on a grid, so many pixels of the input apart; with --dense, write the field on that grid as field.csv
    #[arg(long, value_name = "STEP", conflicts_with = "given", allow_negative_numbers = true)]
    pub grid: Option<f64>,
    /// Take new corners in place of those that were lost or left the picture
    #[arg(long, conflicts_with_all = ["given", "grid", "dense"])]
    pub renew: bool,
    /// A point whose way back ends farther than this from where it came from is lost
    #[arg(long, value_name = "PX", default_value_t = 1.0, conflicts_with = "dense")]
    pub forward_backward: f64,
    /// A point whose surroundings correlate by less with those of its start, after the affine change that fits best, is lost;
    /// -1: they are not looked at
    #[arg(long, value_name = "R", default_value_t = 0.8, conflicts_with = "dense", allow_negative_numbers = true)]
    pub likeness: f64,
    /// Side of the window by which a point is followed
    #[arg(long, value_name = "PX", default_value_t = 15, conflicts_with = "dense")]
    pub window: usize,
    /// A field of every pixel from each frame to the next, in place of points
    #[arg(long)]
    pub dense: bool,
    /// How fine the field is: `fast` at an eighth of the resolution, `usual` at half of it, `fine` with larger patches that overlap more, `full` at
    /// full resolution
    #[arg(long, value_name = "HOW", default_value = "usual", value_parser = ["fast", "usual", "fine", "full"], requires = "dense")]
    pub quality: String,
    /// Refine the field of each level variationally, so many rounds at full resolution and more at coarser ones; 0: not [default: that of the quality]
    #[arg(long, value_name = "ROUNDS", requires = "dense")]
    pub refine: Option<usize>,
    /// Write every field as flo/FRAME.flo, in Middlebury's form
    #[arg(long, requires = "dense")]
    pub flo: bool,
    /// Show the field by arrows, so many pixels apart, in place of colours
    #[arg(long, value_name = "STEP", requires = "dense", allow_negative_numbers = true)]
    pub arrows: Option<f64>,
    /// The motion with the fullest colour [default: that of the fastest pixels lately]
    #[arg(long, value_name = "PX", requires = "dense", allow_negative_numbers = true)]
    pub longest: Option<f64>,
    /// Write overlay.mp4: points with trails, or the field in the colours of its directions
    #[arg(long)]
    pub overlay: bool,
    /// Folder for the results; an earlier flow there is replaced [default: a new pursuit-out/INPUT-flow]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Print the summary as JSON
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub span: Span,
    #[command(flatten)]
    pub view: View,
}

/// Takes a point.
pub(super) fn point(text: &str) -> Result<[f64; 2], String> {
    let number = |text: &str| text.trim().parse::<f64>().ok().filter(|v| v.is_finite());
    let point = text.split_once(',').and_then(|(x, y)| Some([number(x)?, number(y)?]));
    point.ok_or_else(|| "give X,Y in pixels, for example 320,240.5".to_owned())
}
