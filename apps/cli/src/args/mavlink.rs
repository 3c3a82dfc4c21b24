use super::Track;
use clap::Args;
use pursuit::mavlink::LinkAddress;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub struct Mavlink {
    #[command(flatten)]
    pub track: Track,
    /// Where ground stations and the autopilot are: udpin:HOST:PORT (whoever sends to that port is answered), udpout:HOST:PORT,
    /// tcp:HOST:PORT or serial:DEVICE[:BAUD]; once for each link
    #[arg(long = "link", value_name = "LINK", required = true)]
    pub links: Vec<LinkAddress>,
    /// The vehicle that the camera is on
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u8).range(1..))]
    pub system_id: u8,
    /// Which component of it the camera is: 100 to 105 are cameras
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u8).range(1..))]
    pub component_id: u8,
    /// Sign all messages by the key in this file, and heed none that is not signed by it: 64 hexadecimal digits or a passphrase
    #[arg(long, value_name = "FILE")]
    pub signing_key_file: Option<PathBuf>,
    /// How wide the camera sees, from the left to the right edge of the picture: with it places on the ground can be told
    #[arg(long, value_name = "DEGREES")]
    pub camera_view: Option<f64>,
    /// How far a camera without a gimbal looks above the nose; below it is negative
    #[arg(long, value_name = "DEGREES", default_value_t = 0.0, allow_negative_numbers = true)]
    pub camera_pitch: f64,
    /// Where ground stations can see the pictures, without any password [default: the input, where it is an rtsp:// stream]
    #[arg(long, value_name = "URI")]
    pub stream_uri: Option<String>,
    /// Tell the autopilot the target's angles while it is seen (LANDING_TARGET)
    #[arg(long, requires = "camera_view")]
    pub landing_target: bool,
    /// How wide the target is in truth: its distance follows
    #[arg(long, value_name = "METRES", requires = "landing_target")]
    pub target_width: Option<f64>,
    /// Turn a gimbal after the target, by the gimbal protocol on the same links: any that answers, or this one of several
    #[arg(long, value_name = "DEVICE", num_args = 0..=1, default_missing_value = "0", requires = "camera_view")]
    pub gimbal: Option<u8>,
    /// How the gimbal follows, as a TOML file; `--set follower.KEY=VALUE` takes its place
    #[arg(long, value_name = "FILE.toml", requires = "gimbal")]
    pub follower: Option<PathBuf>,
}
