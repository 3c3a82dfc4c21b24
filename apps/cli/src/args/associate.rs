//! `pursuit associate`.

use clap::Args;
use pursuit::inference::onnx::Device;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub struct Associate {
    /// A file of detections, a folder of YOLO's text files, a sequence (`det.txt` or `det/det.txt`, and `seqinfo.ini`), or a folder
    /// of sequences, which are worked on by all threads
    #[arg(value_name = "SET|DETECTIONS")]
    pub input: PathBuf,
    /// The video that the detections are of, for the camera's motion, times and size
    #[arg(long, value_name = "INPUT")]
    pub video: Option<String>,
    /// The form of the detections [default: told by their name and first line]
    #[arg(long, value_name = "FORM", value_parser = ["mot", "kitti", "coco", "yolo", "jsonl"])]
    pub format: Option<String>,
    /// Frames a second [default: what seqinfo.ini or the video says, else 25]
    #[arg(long, value_name = "F", allow_negative_numbers = true)]
    pub fps: Option<f64>,
    /// Size of the picture [default: what seqinfo.ini or the video says]
    #[arg(long, value_name = "WIDTHxHEIGHT")]
    pub size: Option<String>,
    /// A published way to associate, in place of our own defaults
    #[arg(long, value_name = "NAME", value_parser = ["sort", "bytetrack", "ocsort", "botsort", "cbiou"])]
    pub preset: Option<String>,
    /// What a network by file that tells looks apart (many.embedding) runs on, where onnxruntime's library can hand it there
    #[arg(long, value_name = "DEVICE", value_parser = super::device_parser())]
    pub device: Option<Device>,
    /// Look at the whole clip at once: targets from their first sighting on, gaps filled
    #[arg(long, conflicts_with = "video")]
    pub offline: bool,
    /// Set a parameter of how targets are told apart: many.KEY=VALUE
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub settings: Vec<String>,
    /// Write the tracks in a further format too, FORMAT/SEQUENCE.*
    #[arg(long = "write", value_parser = super::format_parser(), value_name = "FORMAT", value_delimiter = ',')]
    pub formats: Vec<pursuit::sinks::Format>,
    /// Folder for the results: SEQUENCE.txt in MOTChallenge's form, and times.csv
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Print what was done as JSON
    #[arg(long)]
    pub json: bool,
}
