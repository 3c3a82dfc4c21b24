//! `pursuit calibrate` and `pursuit measure`.

use clap::Args;
use pursuit::RunError;
use pursuit::measure::{Board, CalibrationOptions, MeasureOptions, Point};
use pursuit::measuring::{MeasuringError, Method, Unit};
use std::path::PathBuf;

/// A ruler, as it is said on the command line.
#[derive(Debug, Args)]
#[command(next_help_heading = "Ruler")]
pub struct Ruler {
    /// A stick in the picture: its two ends in pixels and its length, for example 100,400,600,400=0.50m or …=0.50m+-1mm
    #[arg(long, value_name = "X1,Y1,X2,Y2=LENGTH", allow_hyphen_values = true)]
    pub scale: Option<String>,
    /// The size of the target itself: 7cm, width=7cm or height=1.8m
    #[arg(long, value_name = "LENGTH")]
    pub target_size: Option<String>,
    /// A point of the plane that the target moves on: pixel and place, for example 412,300=0,2.4m (repeat for four or more)
    #[arg(long, value_name = "X,Y=A,B", allow_hyphen_values = true)]
    pub plane: Vec<String>,
    /// The origin, in pixels
    #[arg(long, value_name = "X,Y", allow_hyphen_values = true)]
    pub origin: Option<String>,
    /// A point toward which x goes from the origin, in pixels
    #[arg(long, value_name = "X,Y", allow_hyphen_values = true)]
    pub axis: Option<String>,
    /// By how many degrees x is turned to the left
    #[arg(long, value_name = "DEGREES", allow_negative_numbers = true, conflicts_with = "axis")]
    pub angle: Option<f64>,
    /// Let y grow downward
    #[arg(long)]
    pub y_down: bool,
    /// A camera with distortion: the YAML or JSON file that OpenCV writes after a calibration, or a calibration.toml that has one
    #[arg(long, value_name = "FILE")]
    pub camera: Option<PathBuf>,
    /// How many frames a second the camera took, where the clip says another number (slow motion)
    #[arg(long, value_name = "F", allow_negative_numbers = true)]
    pub true_fps: Option<f64>,
    /// How uncertain each click is: standard deviation in pixels [default: 0.5]
    #[arg(long, value_name = "PIXELS", allow_negative_numbers = true)]
    pub click_error: Option<f64>,
}

impl Ruler {
    /// What is said.
    pub fn options(&self) -> CalibrationOptions {
        CalibrationOptions {
            scale: self.scale.clone(),
            target_size: self.target_size.clone(),
            plane: self.plane.clone(),
            origin: self.origin.clone(),
            axis: self.axis.clone(),
            angle_deg: self.angle,
            y_down: self.y_down.then_some(true),
            camera: self.camera.clone(),
            true_fps: self.true_fps,
            click_error_px: self.click_error,
        }
    }
}

/// How a run is measured, wherever that is done.
#[derive(Debug, Args)]
#[command(next_help_heading = "Measuring")]
pub struct Measuring {
    /// The calibration to measure by [default: calibration.toml in the run's folder or beside its input]
    #[arg(long, value_name = "FILE.toml")]
    pub calibration: Option<PathBuf>,
    /// How velocity and acceleration are made of places [default: smoother]
    #[arg(id = "measure-method", long = "measure-method", value_name = "METHOD", value_parser = method)]
    pub method: Option<Method>,
    /// How many frames a cubic of `savitzky-golay` is fitted to, odd [default: 11]
    #[arg(id = "measure-window", long = "measure-window", value_name = "FRAMES")]
    pub window: Option<usize>,
    /// Take no jump of the velocity for a bounce
    #[arg(long = "no-bounces")]
    pub no_bounces: bool,
    /// The point of the box that is measured: center, bottom (of who walks on a plane) or top [default: center]
    #[arg(id = "measure-point", long = "measure-point", value_name = "POINT", value_parser = point)]
    pub point: Option<Point>,
    /// Let frames count in which the target was in sight, but not for certain
    #[arg(id = "measure-unsure", long = "measure-unsure")]
    pub unsure: bool,
    /// The unit of the results: km, m, cm, mm, um, in, ft or px [default: the ruler's]
    #[arg(id = "measure-unit", long = "measure-unit", value_name = "UNIT", value_parser = unit)]
    pub unit: Option<Unit>,
    /// Fit line, parabola or sine (repeat): sine:x along x, parabola@0.2-0.9 of a span of seconds
    #[arg(id = "measure-fit", long = "measure-fit", value_name = "FIT")]
    pub fits: Vec<String>,
    /// Report crossings of a line, in the unit of the results (repeat)
    #[arg(id = "measure-line", long = "measure-line", value_name = "[NAME=]X1,Y1,X2,Y2", allow_hyphen_values = true)]
    pub lines: Vec<String>,
    /// Report entries into a zone, in the unit of the results (repeat)
    #[arg(id = "measure-zone", long = "measure-zone", value_name = "[NAME=]X1,Y1,…", allow_hyphen_values = true)]
    pub zones: Vec<String>,
    /// Measure distance and direction from one target to another (repeat)
    #[arg(id = "measure-between", long = "measure-between", value_name = "A,B")]
    pub between: Vec<String>,
    /// Write what was measured in a further format: csv-semicolon, jsonl, parquet, xlsx
    #[arg(id = "measure-format", long = "measure-format", value_name = "FORMAT", value_delimiter = ',')]
    pub formats: Vec<String>,
    /// Draw no plots of what was measured
    #[arg(id = "no-measure-plots", long = "no-measure-plots")]
    pub no_plots: bool,
}

impl Measuring {
    /// What is said.
    pub fn options(&self) -> MeasureOptions {
        MeasureOptions {
            calibration: self.calibration.clone(),
            method: self.method,
            window: self.window,
            bounces: self.no_bounces.then_some(false),
            point: self.point,
            unsure: self.unsure.then_some(true),
            unit: self.unit,
            fits: self.fits.clone(),
            lines: self.lines.clone(),
            zones: self.zones.clone(),
            between: self.between.clone(),
            formats: self.formats.clone(),
            plots: self.no_plots.then_some(false),
        }
    }
}

fn board(text: &str) -> Result<Board, String> {
    text.parse().map_err(|e: RunError| e.to_string())
}

fn method(text: &str) -> Result<Method, String> {
    text.parse().map_err(|e: MeasuringError| e.to_string())
}

fn unit(text: &str) -> Result<Unit, String> {
    text.parse().map_err(|e: MeasuringError| e.to_string())
}

fn point(text: &str) -> Result<Point, String> {
    text.parse().map_err(|e: RunError| e.to_string())
}

#[derive(Debug, Args)]
pub struct Measure {
    /// The folder of a run, or its trajectory (.csv, .jsonl)
    #[arg(value_name = "RUN")]
    pub run: PathBuf,
    #[command(flatten)]
    pub ruler: Ruler,
    #[command(flatten)]
    pub measuring: Measuring,
    /// Folder for the results; an earlier measurement there is replaced [default: the run's own]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Print what measure.json holds
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
pub struct Calibrate {
    /// The clip, for the size of its pictures
    #[arg(value_name = "INPUT")]
    pub input: String,
    /// Find the lens: the clip shows a board that is moved about, chessboard or charuco:COLUMNSxROWS:DICTIONARY:MARKER
    #[arg(long, value_name = "BOARD", conflicts_with = "camera", value_parser = board)]
    pub board: Option<Board>,
    #[command(flatten)]
    pub ruler: Ruler,
    /// The file to write [default: calibration.toml beside the clip]
    #[arg(long, value_name = "FILE.toml")]
    pub out: Option<PathBuf>,
    /// Replace a calibration that is there
    #[arg(long)]
    pub overwrite: bool,
}
