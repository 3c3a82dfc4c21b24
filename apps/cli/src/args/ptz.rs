use super::{Credentials, Track};
use clap::{Args, Subcommand};
use pursuit::ptz::simulation::{Contender, Walk};
use std::path::PathBuf;

#[derive(Debug, Args)]
pub struct Ptz {
    #[command(subcommand)]
    pub command: PtzCommand,
}

#[derive(Debug, Subcommand)]
pub enum PtzCommand {
    /// Follow a simulated walker with a simulated head, and compare controllers
    Simulate(PtzSimulate),
    /// Follow a target with a head: as `track`, and the head turns to where the target will be
    Follow(Box<PtzFollow>),
    /// Measure a head by small moves: delay, pixels a degree, acceleration, play
    Calibrate(PtzCalibrate),
    /// Reach a head and print what it can do and what it says of itself
    Probe(PtzProbe),
}

/// A head and the way to its password.
#[derive(Debug, Args)]
pub struct HeadAt {
    /// The head: onvif[s]://USER@HOST, visca://HOST, visca+tcp://HOST, visca:DEVICE, pelco:DEVICE, mavlink:LINK or hook:COMMAND
    #[arg(long, value_name = "ADDRESS")]
    pub head: String,
    #[command(flatten)]
    pub secret: Secret,
}

/// What proves the user to a head, and the head to the user. A password is never on the command line itself.
#[derive(Debug, Args)]
pub struct Secret {
    /// Variable of the environment that holds the password
    #[arg(long, value_name = "NAME", default_value = "PURSUIT_PTZ_PASSWORD")]
    pub password_env: String,
    /// File whose first line is the password
    #[arg(long, value_name = "FILE", conflicts_with = "password_env")]
    pub password_file: Option<PathBuf>,
    /// Trust these certificates (PEM) at an onvifs:// address in place of the system's; the camera's own may stand there
    #[arg(long, value_name = "FILE")]
    pub head_ca: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub struct PtzFollow {
    #[command(flatten)]
    pub track: Track,
    #[command(flatten)]
    pub head: HeadAt,
    /// How the head is driven, as a TOML file: delays, limits, lost policy, zoom (what `calibrate` prints belongs there);
    /// --set follower.KEY=VALUE overrides it
    #[arg(long, value_name = "FILE.toml")]
    pub follower: Option<PathBuf>,
    /// How wide the picture is at the widest zoom, from its left to its right edge
    #[arg(long, value_name = "DEGREES", default_value_t = 60.0)]
    pub field_of_view: f64,
}

#[derive(Debug, Args)]
pub struct PtzCalibrate {
    /// The camera on the head, live: `camera:0`, `rtsp://…`, `http(s)://…` or `-` (Y4M or MJPEG on standard input)
    pub input: String,
    #[command(flatten)]
    pub credentials: Credentials,
    #[command(flatten)]
    pub head: HeadAt,
    /// How old a picture is when it arrives; the rest of the delay counts as the commands'
    #[arg(long, value_name = "SECONDS", default_value_t = 0.0)]
    pub frame_age: f64,
}

#[derive(Debug, Args)]
pub struct PtzSimulate {
    /// The head, the camera and the follower, as a TOML file [default: 60°/s, 300 ms of delay, 60° wide]
    #[arg(long, value_name = "FILE.toml")]
    pub head: Option<PathBuf>,
    /// Set what such a file says: KEY=VALUE, for example head.delay_s=0.3 or follower.gain_per_s=2; tracker.KEY is a
    /// parameter of the tracker, whose motion.camera is pose for the controller forecast, detect.KEY one of the detector
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub settings: Vec<String>,
    /// How the target moves [default: pacing, passing, standing, dog_leg; of a drone all]
    #[arg(long, value_name = "WALKS", value_delimiter = ',', value_parser = Walk::EVERY.map(Walk::name))]
    pub walk: Vec<String>,
    /// A scene the camera looks at, and a tracker at its pictures: wide-world?seed=3
    #[arg(long, value_name = "SCENE", conflicts_with_all = ["walk", "clip"])]
    pub scene: Option<String>,
    /// A clip of a wide camera that stands still, with its true boxes: the camera crops its pictures from it
    #[arg(long, value_name = "INPUT", conflicts_with = "walk")]
    pub clip: Option<String>,
    /// The head is on a drone that hovers in the wind and swings, flies past or round its target: --set drone.KEY=VALUE says how,
    /// or [drone] in FILE.toml
    #[arg(long, conflicts_with_all = ["scene", "clip", "grid"])]
    pub drone: bool,
    /// How wide the clip is, from its left to its right edge
    #[arg(long, value_name = "DEGREES", default_value_t = 90.0, requires = "clip")]
    pub clip_view: f64,
    /// The tracker that looks at the pictures of a scene or a clip [default: pursuit, or that of the detector]
    #[arg(long, value_name = "NAME")]
    pub tracker: Option<String>,
    /// The target is found by this detector, as by `ptz follow --detect`: the camera looks straight ahead at first, and a clip is
    /// looked at from its first frame to its last, a line of figures for each time that somebody comes
    #[arg(long, value_name = "NAME")]
    pub detect: Option<String>,
    /// Controllers to compare [default: all]
    #[arg(long, value_name = "NAMES", value_delimiter = ',',
          value_parser = Contender::ALL.map(Contender::name))]
    pub controller: Vec<String>,
    /// How many runs to average over [default: 20; of a scene or a clip 1]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=100_000))]
    pub seeds: Option<u64>,
    /// The first of the seeds
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u64).range(0..=1_000_000_000))]
    pub first_seed: u64,
    /// Compare two controllers (velocity and unpredicted where --controller names no other two) over delays, jitter, losses
    /// and walks, over 3 seeds where --seeds says nothing else, and write a heat map
    #[arg(long, conflicts_with_all = ["scene", "clip"])]
    pub grid: bool,
    /// Where the heat map of --grid goes
    #[arg(long, value_name = "FILE.svg", default_value = "ptz-grid.svg", requires = "grid")]
    pub heat_map: PathBuf,
    /// Of --scene or --clip: a video of what the camera saw, of one --controller and one seed
    #[arg(long, value_name = "FILE.mp4")]
    pub film: Option<PathBuf>,
    /// Print the figures as JSON
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
pub struct PtzProbe {
    /// The head: onvif[s]://USER@HOST, visca://HOST, visca+tcp://HOST, visca:DEVICE, pelco:DEVICE, mavlink:LINK or hook:COMMAND
    pub head: String,
    #[command(flatten)]
    pub secret: Secret,
    /// Write the certificate that an onvifs:// camera shows to this file, print its SHA-256, and do nothing else
    #[arg(long, value_name = "FILE", conflicts_with_all = ["password_env", "password_file", "head_ca"])]
    pub save_certificate: Option<PathBuf>,
}
