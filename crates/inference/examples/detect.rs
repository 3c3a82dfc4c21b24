//! Finds objects in raw frames: the program beside which `xtask/peers/check_objects.py` runs the network in Python.
//!
//! `detect MODEL rten|LIBRARY SCORE OVERLAP`, where LIBRARY is onnxruntime's. Standard input: a line `WIDTH HEIGHT` before each
//! frame of `WIDTH · HEIGHT` red, green, blue bytes. Standard output: for each frame a line `COUNT MILLISECONDS` and as many
//! lines `CLASS SCORE LEFT TOP WIDTH HEIGHT`.
#![allow(clippy::expect_used, clippy::panic, reason = "an example may panic")]

use pursuit_imaging::Image;
use pursuit_inference::detection::{Limits, ObjectDetector};
use pursuit_inference::onnx::{Backend, OnnxOptions};
use std::io::{BufRead, Read};
use std::path::Path;
use std::time::Instant;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [model, library, score, overlap] = arguments.as_slice() else { panic!("four arguments") };
    let options = match library.as_str() {
        "rten" => OnnxOptions { backend: Backend::Rten, ..OnnxOptions::default() },
        path => OnnxOptions { backend: Backend::OnnxRuntime, library: Some(path.into()), ..OnnxOptions::default() },
    };
    let number = |text: &String| text.parse().expect("a number");
    let limits = Limits { score: number(score), overlap: number(overlap), candidates: 1000, most: 1000 };
    let mut detector = ObjectDetector::open(Path::new(model), &options).expect("a network");
    let mut input = std::io::stdin().lock();
    let mut line = String::new();
    while input.read_line(&mut line).expect("a line or the end") > 0 {
        let size: Vec<usize> = line.split_whitespace().map(|w| w.parse().expect("a number")).collect();
        let mut bytes = vec![0u8; 3 * size[0] * size[1]];
        input.read_exact(&mut bytes).expect("a frame");
        let image = Image::from_vec(bytes.as_chunks::<3>().0.to_vec(), size[0], size[1]).expect("a frame");
        let start = Instant::now();
        let objects = detector.detect(image.view(), &limits).expect("an answer");
        println!("{} {:.3}", objects.len(), 1e3 * start.elapsed().as_secs_f64());
        for o in objects {
            let (left, top, width, height) = o.bbox.ltwh();
            println!("{} {:.6} {left:.4} {top:.4} {width:.4} {height:.4}", o.class, o.score);
        }
        line.clear();
    }
}
