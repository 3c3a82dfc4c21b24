//! Follows a target through raw frames with a network by file: the program beside which `xtask/peers/siamese.py` runs other projects'
//! trackers in Python.
//!
//! `siamese DESCRIPTION rten|LIBRARY`, where LIBRARY is onnxruntime's. Standard input: a line `WIDTH HEIGHT`; then for each frame a line
//! `LEFT TOP BOX_WIDTH BOX_HEIGHT` and `WIDTH · HEIGHT` red, green, blue bytes. The first box is the target, each later one what it is
//! looked for about; where the line is `-`, that is the last answer. Standard output: a line `LEFT TOP WIDTH HEIGHT SCORE` for each
//! frame but the first, and in it the mask as VOT has it, where the network draws one.
#![allow(clippy::expect_used, clippy::panic, reason = "an example may panic")]

use pursuit_geometry::BBox;
use pursuit_imaging::{Frame, Image};
use pursuit_inference::onnx::{Backend, OnnxOptions};
use pursuit_inference::siamese::{SiameseDescription, SiameseTracker};
use std::io::{BufRead, Read};
use std::path::Path;

fn numbers<T: std::str::FromStr>(line: &str) -> Vec<T> {
    line.split_whitespace().map(|w| w.parse().ok().expect("a number")).collect()
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [description, library] = arguments.as_slice() else { panic!("two arguments") };
    let options = match library.as_str() {
        "rten" => OnnxOptions { backend: Backend::Rten, ..OnnxOptions::default() },
        path => OnnxOptions { backend: Backend::OnnxRuntime, library: Some(path.into()), ..OnnxOptions::default() },
    };
    let description = SiameseDescription::read(Path::new(description)).expect("a description");
    let mut network = Some(description.open(&options).expect("a network"));
    let mut input = std::io::stdin().lock();
    let mut line = String::new();
    input.read_line(&mut line).expect("a line with the size");
    let size: Vec<usize> = numbers(&line);
    let mut tracker = None;
    let mut last = BBox::from_ltwh(0.0, 0.0, 0.0, 0.0);
    loop {
        line.clear();
        if input.read_line(&mut line).expect("a line or the end") == 0 {
            break;
        }
        if line.trim() != "-" {
            let sides: Vec<f64> = numbers(&line);
            last = BBox::from_ltwh(sides[0], sides[1], sides[2], sides[3]);
        }
        let mut bytes = vec![0u8; 3 * size[0] * size[1]];
        input.read_exact(&mut bytes).expect("a frame");
        let pixels = bytes.as_chunks::<3>().0.to_vec();
        let frame = Frame::new(0, 0.0, Image::from_vec(pixels, size[0], size[1]).expect("a frame"));
        let Some(tracker) = &mut tracker else {
            let network = network.take().expect("one start");
            let config = description.config.clone();
            tracker = Some(SiameseTracker::new(network, config, &frame, last).expect("a box with an area"));
            continue;
        };
        let (center, sides) = (last.center(), (last.width(), last.height()));
        let found = tracker.locate(&frame, center, sides).expect("a finite box").expect("a finite answer");
        let drawn = tracker.mask(frame.size(), center, sides, &found).expect("a mask of its size");
        let mask = drawn.map_or_else(String::new, |drawn| format!(" {}", drawn.in_frame(frame.size()).to_vot()));
        last = found.bbox;
        let (left, top, width, height) = last.ltwh();
        println!("{left:.6} {top:.6} {width:.6} {height:.6} {:.6}{mask}", found.score);
    }
}
