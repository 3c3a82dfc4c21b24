//! Follows a target through raw frames with NanoTrack v3: the program beside which `xtask/peers/check_nanotrack.py` runs
//! the network in onnxruntime.
//!
//! Standard input: a line `WIDTH HEIGHT LEFT TOP BOX_WIDTH BOX_HEIGHT`, then frames of `WIDTH · HEIGHT` red, green, blue
//! bytes. Standard output: a line `LEFT TOP WIDTH HEIGHT SCORE` for each frame but the first; the last line gives the
//! milliseconds a frame.
#![allow(clippy::expect_used, reason = "an example may panic")]

use pursuit_geometry::{BBox, Point};
use pursuit_imaging::{Frame, Image};
use pursuit_inference::nanotrack::NanoTrackV3;
use pursuit_inference::siamese::{SiameseConfig, SiameseTracker};
use std::io::{BufRead, Read};
use std::time::Instant;

fn main() {
    let mut input = std::io::stdin().lock();
    let mut line = String::new();
    input.read_line(&mut line).expect("a line with sizes");
    let numbers: Vec<f64> = line.split_whitespace().map(|w| w.parse().expect("a number")).collect();
    let (width, height) = (numbers[0] as usize, numbers[1] as usize);
    let mut next = || {
        let mut bytes = vec![0u8; 3 * width * height];
        input.read_exact(&mut bytes).ok()?;
        let pixels = bytes.as_chunks::<3>().0.to_vec();
        Some(Frame::new(0, 0.0, Image::from_vec(pixels, width, height).expect("a frame")))
    };
    let bbox = BBox::from_ltwh(numbers[2], numbers[3], numbers[4], numbers[5]);
    let network = NanoTrackV3::new().expect("the weights are built in");
    let first = next().expect("a first frame");
    let mut tracker =
        SiameseTracker::new(network, SiameseConfig::nanotrack_v3(), &first, bbox).expect("a box with an area");
    // The released tracker starts half a pixel beside the middle, where it also cuts the template.
    let mut center = Point::new(bbox.center().x - 0.5, bbox.center().y - 0.5);
    let mut size = (bbox.width(), bbox.height());
    let (mut seconds, mut frames) = (0.0, 0);
    while let Some(frame) = next() {
        let start = Instant::now();
        let found = tracker.locate(&frame, center, size).expect("a finite box").expect("a finite answer");
        seconds += start.elapsed().as_secs_f64();
        frames += 1;
        (center, size) = (found.bbox.center(), (found.bbox.width(), found.bbox.height()));
        let (left, top, wide, high) = found.bbox.ltwh();
        println!("{left:.4} {top:.4} {wide:.4} {high:.4} {:.5}", found.score);
    }
    println!("{:.4}", 1e3 * seconds / f64::from(frames.max(1)));
}
