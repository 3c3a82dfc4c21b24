//! The command line: one table that parsing, help, man page and completions are made from.

mod associate;
mod batch;
mod credentials;
mod days;
mod eval;
mod flow;
#[cfg(feature = "mavlink")]
mod mavlink;
mod measure;
mod ptz;
mod publish;
mod span;
#[cfg(feature = "studio")]
mod studio;
mod survey;
#[cfg(test)]
mod tests;
mod view;

pub use associate::Associate;
pub use batch::Batch;
pub use credentials::Credentials;
pub use days::Days;
pub use eval::{Eval, Measured};
pub use flow::Flow;
#[cfg(feature = "mavlink")]
pub use mavlink::Mavlink;
pub use measure::{Calibrate, Measure, Measuring};
pub use ptz::{Ptz, PtzCalibrate, PtzCommand, PtzFollow, PtzProbe, PtzSimulate, Secret};
pub use publish::Publish;
pub use span::Span;
#[cfg(feature = "studio")]
pub use studio::Studio;
pub use survey::Survey;
pub use view::{View, numbers};

use clap::builder::styling::{AnsiColor, Styles};
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{Args, Parser, Subcommand, ValueEnum};
use clap_complete::Shell;
use pursuit::inference::onnx::Device;
use pursuit::media::depth::DepthCoding;
use pursuit::media::wrappers::Reconnect;
use pursuit::sinks::Format;
#[cfg(feature = "reproduce")]
use pursuit_experiments::Paper;
use std::ffi::OsString;
use std::path::PathBuf;
use std::time::Duration;

const STYLES: Styles = Styles::styled()
    .header(AnsiColor::Green.on_default().bold())
    .usage(AnsiColor::Green.on_default().bold())
    .literal(AnsiColor::Cyan.on_default().bold())
    .placeholder(AnsiColor::Cyan.on_default());

const AFTER_HELP: &str = "\
Exit status: 0 done (losing the target is not an error), 2 wrong usage, 3 input that cannot be read (whole or in part),
4 output that cannot be written, 130 Ctrl-C, 143 SIGTERM, 1 anything else.";

/// Follow one moving thing, or several, through a video.
#[derive(Debug, Parser)]
#[command(name = "pursuit", version, disable_version_flag = true, styles = STYLES, after_help = AFTER_HELP)]
#[command(arg_required_else_help = true, subcommand_negates_reqs = true)]
pub struct Cli {
    #[command(subcommand)]
    pub command: Option<Command>,
    /// Print the version; with -v also the commit, the features and the ffmpeg found
    #[arg(short = 'V', long)]
    pub version: bool,
    #[command(flatten)]
    pub global: Global,
}

#[derive(Debug, Args)]
pub struct Global {
    /// Say more on standard error (twice: debugging)
    #[arg(short, long, global = true, display_order = 900, action = clap::ArgAction::Count)]
    pub verbose: u8,
    /// Say nothing on standard error but errors
    #[arg(short, long, global = true, display_order = 901, conflicts_with = "verbose")]
    pub quiet: bool,
    /// When to use colours
    #[arg(long, global = true, display_order = 902, value_enum, default_value_t = ColorWhen::Auto, value_name = "WHEN")]
    pub color: ColorWhen,
    /// How many threads to use (0: one for each processor)
    #[arg(long, global = true, display_order = 903, default_value_t = 0, value_name = "N")]
    pub threads: usize,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ColorWhen {
    Auto,
    Always,
    Never,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Overlay {
    Minimal,
    Full,
    None,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Track a ball through a scene made on the spot: no input needed
    Demo(Demo),
    /// Track a target, or several, through a video
    Track(Box<Track>),
    /// Track many clips, several at a time; a second call goes on where the first one stopped
    Batch(Batch),
    /// Tell targets apart in the boxes of any detector, from files: no picture needed
    Associate(Associate),
    /// Say how long a pixel is in a clip, where the origin is and which way is up: writes calibration.toml beside it
    Calibrate(Calibrate),
    /// Measure a run: position, velocity and acceleration in metres, each with its standard deviation; events and fits
    Measure(Box<Measure>),
    /// Measure trackers on annotated sequences
    Eval(Eval),
    /// Rank all trackers, or many, on annotated sequences: by family, with intervals, speed and attributes, on one page
    Survey(Survey),
    /// Optical flow: points followed as long as each can be trusted, or a field of every pixel
    Flow(Box<Flow>),
    /// Run a paper's filter experiment again: its figures, ours, and those of better filters side by side
    #[cfg(feature = "reproduce")]
    Reproduce(Reproduce),
    /// Open the studio in the browser: pick a target, follow it, correct, compare, measure
    #[cfg(feature = "studio")]
    Studio(Studio),
    /// Be the tracking camera of a drone: ground stations say what to track, by MAVLink, and see what becomes of it
    #[cfg(feature = "mavlink")]
    Mavlink(Box<Mavlink>),
    /// Drive pan-tilt heads: follow, calibrate, simulate, see what a head can do
    Ptz(Ptz),
    /// List the trackers, or show the parameters of one as commented TOML
    Trackers(Trackers),
    /// Print the licences of everything that this program contains
    Licences,
    /// Print a completion script for a shell
    Completions {
        /// The shell
        shell: Shell,
    },
    /// Print the manual: of everything, or the page of one command
    Man {
        /// The command, for example `track` or `ptz follow`
        #[arg(value_name = "COMMAND")]
        path: Vec<String>,
        /// Write a page for each command into this folder instead (`man -l DIR/pursuit-track.1`)
        #[arg(long, value_name = "DIR", conflicts_with = "path")]
        out: Option<PathBuf>,
    },
}

#[derive(Debug, Args)]
pub struct Demo {
    /// Folder for the results
    #[arg(long, value_name = "DIR", default_value = "pursuit-out/demo")]
    pub out: PathBuf,
    /// Seed of the scene
    #[arg(long, default_value_t = 1, value_name = "N")]
    pub seed: u64,
    /// Set a parameter: KEY=VALUE, TRACKER.KEY=VALUE or detect.KEY=VALUE
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub settings: Vec<String>,
    /// Print the summary as JSON
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
pub struct Track {
    /// A video file, a folder of images, `camera:0`, `rtsp://…`, `http(s)://…`, `-` (Y4M or MJPEG on standard input), or
    /// `scene:NAME[?seed=1&key=value]`; several are tracked in one after the other, each into a folder of its own
    #[arg(value_name = "INPUT", required_unless_present = "config")]
    pub inputs: Vec<OsString>,
    #[command(flatten)]
    pub credentials: Credentials,
    /// Start on this box: left, top, width, height in pixels (repeat for several targets)
    #[arg(long = "box", value_name = "L,T,W,H", allow_hyphen_values = true)]
    pub boxes: Vec<String>,
    /// Follow this point, pixels from the left and from the top (repeat for several); by the tracker `point` unless another is named
    #[arg(long = "point", value_name = "X,Y", value_parser = flow::point, allow_hyphen_values = true, conflicts_with = "boxes")]
    pub points: Vec<[f64; 2]>,
    /// Draw the box in the browser: opens the studio's page, and goes on once there is a box
    #[cfg(feature = "studio")]
    #[arg(long, conflicts_with_all = ["boxes", "points", "detect", "resume"])]
    pub pick: bool,
    /// Show the run in the browser while it goes on, to look at only: prints an address of this machine
    #[cfg(feature = "studio")]
    #[arg(long)]
    pub watch: bool,
    /// Tracker to use (see `pursuit trackers`)
    #[arg(long, value_name = "NAME")]
    pub tracker: Option<String>,
    /// Follow the box by several trackers at once, separated by commas: one overlay, and who was right, or agreed with the first
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub compare: Vec<String>,
    /// Detector that finds the target when no box is given
    #[arg(long, value_name = "NAME")]
    pub detect: Option<String>,
    /// What networks by file run on, where onnxruntime's library can hand them there; else the processor, which is said
    #[arg(long, value_name = "DEVICE", value_parser = device_parser())]
    pub device: Option<Device>,
    /// What starts the run without a box: `detector`, the default where one is named, or `truth`, the first box of the truth that
    /// came with the input [default without a detector: the truth]; `command` follows nothing until somebody says what
    #[arg(long, value_name = "WHAT", value_parser = ["truth", "detector", "command"])]
    pub start: Option<String>,
    /// Take what is detected from this file (MOT, KITTI, COCO or JSON lines; for YOLO a folder), and follow all of it
    #[arg(long, value_name = "FILE", conflicts_with_all = ["detect"])]
    pub detections: Option<PathBuf>,
    /// Follow everything that the detector finds, not one target
    #[arg(long)]
    pub many: bool,
    /// Set a parameter: KEY=VALUE of whoever knows it; TRACKER.KEY, detect.KEY, acquire.KEY or many.KEY of one alone
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub settings: Vec<String>,
    /// Read the configuration from a TOML file; options given here override it
    #[arg(long, value_name = "FILE.toml")]
    pub config: Option<PathBuf>,
    /// Depth that belongs to the input: a folder of 16-bit PNG, paired by frame number or time with a folder of images, else
    /// by order
    #[arg(long, value_name = "INPUT")]
    pub depth: Option<String>,
    /// What the numbers of depth images mean [default: found out from the images]
    #[arg(long, value_name = "CODING", value_parser = coding_parser())]
    pub depth_coding: Option<DepthCoding>,
    /// Focal lengths and principal point of the camera, in pixels
    #[arg(long, value_name = "FX,FY,CX,CY")]
    pub intrinsics: Option<String>,
    /// The same of the depth camera, where depth has to be moved into the picture
    #[arg(long, value_name = "FX,FY,CX,CY", requires = "intrinsics")]
    pub depth_intrinsics: Option<String>,
    /// Where the camera has the depth camera's origin, in millimetres: right, down, ahead
    #[arg(long, value_name = "X,Y,Z", requires = "depth_intrinsics", allow_hyphen_values = true)]
    pub depth_offset: Option<String>,
    /// Depth lies on the picture already [default: found out from the images of a folder]
    #[arg(long, conflicts_with = "depth_intrinsics")]
    pub depth_registered: bool,
    /// Folder for the results; an earlier run there is replaced. `-`: JSON lines on standard output, no files [default: a new pursuit-out/INPUT, INPUT-2 …]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Replace the run in pursuit-out/INPUT in place of making a new folder
    #[arg(long)]
    pub overwrite: bool,
    /// Go on with a run that was interrupted, by the same method on the same input, in the folder `--out` or the newest of
    /// the input's name
    #[arg(long, conflicts_with = "overwrite")]
    pub resume: bool,
    /// Write no overlay video
    #[arg(long)]
    pub no_video: bool,
    /// How much the overlay video shows: `full` all boxes, state and score; `minimal` the estimates alone; `none`: no video
    #[arg(long, value_enum, value_name = "STYLE", conflicts_with = "no_video")]
    pub overlay: Option<Overlay>,
    /// Draw plots of the trajectory
    #[arg(long)]
    pub plots: bool,
    /// Print the summary as JSON
    #[arg(long)]
    pub json: bool,
    /// Measure the run when it is done, by the calibration beside it (see `pursuit measure`)
    #[arg(long)]
    pub measure: bool,
    /// Write the trajectory in a further format
    #[arg(long = "format", value_parser = format_parser(), value_name = "FORMAT", value_delimiter = ',')]
    pub formats: Vec<Format>,
    #[command(flatten)]
    pub measuring: Measuring,
    #[command(flatten)]
    pub days: Days,
    #[command(flatten)]
    pub publish: Publish,
    #[command(flatten)]
    pub span: Span,
    #[command(flatten)]
    pub view: View,
    /// Take the input for one that runs in real time: frames that come while a frame is looked at are dropped
    #[arg(long, overrides_with = "no_live")]
    pub live: bool,
    /// Take the input for one that can wait: no frame is dropped
    #[arg(long)]
    pub no_live: bool,
    /// Say that a stream has stalled, and connect to it again, when no frame came for this long
    #[arg(long, value_name = "SECONDS", default_value = "5", value_parser = seconds)]
    pub stall: Duration,
    /// For how long to go on connecting to a stream that stalled or broke off: seconds, 0 (never) or `forever`
    #[arg(long, value_name = "SECONDS", default_value = "60", value_parser = reconnect)]
    pub reconnect: Reconnect,
    /// Play a recording as a camera would: no faster than its frames' own times say, and without those that come too fast
    #[arg(long)]
    pub real_time: bool,
}

/// Takes a length of time above zero.
fn seconds(text: &str) -> Result<Duration, String> {
    let seconds = text.parse().ok().and_then(|s| Duration::try_from_secs_f64(s).ok());
    seconds.filter(|s| !s.is_zero()).ok_or_else(|| "give seconds above 0, for example 5".to_owned())
}

/// Takes for how long to connect again.
fn reconnect(text: &str) -> Result<Reconnect, String> {
    match text.parse().map(Duration::try_from_secs_f64) {
        _ if text == "forever" => Ok(Reconnect::Forever),
        Ok(Ok(Duration::ZERO)) => Ok(Reconnect::Never),
        Ok(Ok(limit)) => Ok(Reconnect::For(limit)),
        _ => Err("give seconds, 0 or `forever`".to_owned()),
    }
}

/// Takes the names of the codings of depth.
fn coding_parser() -> impl TypedValueParser<Value = DepthCoding> {
    let of = |name: String| DepthCoding::ALL.into_iter().find(|c| c.name() == name).ok_or("no coding of depth");
    PossibleValuesParser::new(DepthCoding::ALL.map(DepthCoding::name)).try_map(of)
}

/// Takes the names of what a network may run on.
fn device_parser() -> impl TypedValueParser<Value = Device> {
    let of = |name: String| Device::ALL.iter().find(|d| d.as_str() == name).copied().ok_or("no device");
    PossibleValuesParser::new(Device::ALL.iter().map(|d| d.as_str())).try_map(of)
}

/// Takes the names of the formats, and says what each is.
fn format_parser() -> impl TypedValueParser<Value = Format> {
    let formats = Format::ALL.iter().map(|f| PossibleValue::new(f.name()).help(f.summary()));
    PossibleValuesParser::new(formats).try_map(|name| name.parse::<Format>())
}

#[cfg(feature = "reproduce")]
#[derive(Debug, Args)]
pub struct Reproduce {
    /// The paper
    #[arg(value_parser = paper_parser())]
    pub paper: Paper,
    /// Folder for the results and pictures [default: pursuit-out/reproduce-PAPER]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// How many seeds to average over [default: as many as take a few seconds; with --full or --check what the bars ask for]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub seeds: Option<u32>,
    /// Average over as many seeds as the bars ask for
    #[arg(long, conflicts_with = "seeds")]
    pub full: bool,
    /// Of zhai2024: compare on the sequences with depth below this folder too (the Princeton Tracking Benchmark as published)
    #[arg(long, value_name = "DIR")]
    pub dataset: Option<PathBuf>,
    /// Exit with 1 when a figure misses its bar
    #[arg(long)]
    pub check: bool,
    /// Print the results as JSON
    #[arg(long)]
    pub json: bool,
}

#[cfg(feature = "reproduce")]
/// Takes the names of the papers, and says what each is about.
fn paper_parser() -> impl TypedValueParser<Value = Paper> {
    let papers = Paper::ALL.map(|p| PossibleValue::new(p.name()).help(p.summary()));
    PossibleValuesParser::new(papers).try_map(|name| name.parse::<Paper>())
}

#[derive(Debug, Args)]
pub struct Trackers {
    /// Show the parameters of this tracker or detector, or of this scene (scene:NAME)
    pub name: Option<String>,
    /// Print names and parameters, with types, ranges, units and sources, as JSON
    #[arg(long)]
    pub json: bool,
}
