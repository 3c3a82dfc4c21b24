//! Background models on noisy colour pictures, one thread; `opencv.py` beside times OpenCV on the same ones.
#![allow(clippy::expect_used, reason = "a bench may panic")]

use criterion::{Criterion, criterion_group, criterion_main};
use pursuit_imaging::{Image, Rgb8};
use pursuit_testkit::Noise;
use pursuit_vision::background::{
    BackgroundModel, FixedBackground, Learning, Mog2, Mog2Params, RunningAverage, RunningAverageParams, TemporalMedian,
    TemporalMedianParams, ThreeFrame,
};

/// Frame `n` of a clip: a gradient with noise of ±8 codes that repeats after 97 frames, and a square that moves.
fn frame(width: usize, height: usize, n: usize) -> Image<Rgb8> {
    let mut numbers = Noise::new((n % 97) as u32 * 2_654_435_761 + 1);
    let (side, left) = (height / 4, n * 5 % width);
    Image::from_fn(width, height, |x, y| {
        let state = numbers.draw();
        let noise = |shift: u32| (((state >> shift) & 15) + ((state >> (shift + 4)) & 15)) as u8 / 2;
        if (left..left + side).contains(&x) && (side..2 * side).contains(&y) {
            return [220 + noise(8), 40 + noise(12), 60 + noise(16)];
        }
        let v = (x / 8 + y / 8) as u8 / 2;
        [60 + v + noise(8), 70 + v / 2 + noise(12), 50 + v + noise(16)]
    })
    .expect("valid size")
}

fn background(c: &mut Criterion) {
    for (width, height) in [(1280, 720), (768, 576)] {
        let frames: Vec<_> = (0..97).step_by(4).map(|n| frame(width, height, n)).collect();
        let models: Vec<(&str, Box<dyn BackgroundModel<Rgb8>>)> = vec![
            ("mog2", Box::new(Mog2::new(Mog2Params::default()).expect("valid"))),
            ("running average", Box::new(RunningAverage::new(RunningAverageParams::default()).expect("valid"))),
            ("temporal median", Box::new(TemporalMedian::new(TemporalMedianParams::default()).expect("valid"))),
            ("three frames", Box::new(ThreeFrame::new(25))),
            ("fixed", Box::new(FixedBackground::from_first_frame(25))),
        ];
        let mut group = c.benchmark_group(format!("{width}x{height}"));
        let mut mask = Image::filled(1, 1, 0).expect("valid size");
        for (name, mut model) in models {
            // As after the start: the schedule of rates has settled.
            for n in 0..300 {
                model.apply(frames[n % frames.len()].view(), &Learning::default(), &mut mask).expect("equal sizes");
            }
            let mut n = 0;
            group.bench_function(name, |b| {
                b.iter(|| {
                    n += 1;
                    model.apply(frames[n % frames.len()].view(), &Learning::default(), &mut mask)
                });
            });
        }
        group.finish();
    }
}

criterion_group!(benches, background);
criterion_main!(benches);
