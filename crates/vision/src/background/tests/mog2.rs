use super::*;

include!("../../../tests/fixtures/mog2.rs");

/// One pixel's mixture after `values`, by the formulas of OpenCV's implementation in double precision.
fn slow_mog2(values: &[[f64; 3]], p: &Mog2Params) -> Vec<u8> {
    let mut modes: Vec<(f64, f64, [f64; 3])> = Vec::new();
    let mut masks = Vec::new();
    for (n, v) in values.iter().enumerate() {
        let a = 1.0 / ((2 * (n + 1)).min(p.history_frames)) as f64;
        let distance = |m: &[f64; 3]| (0..3).map(|c| (m[c] - v[c]).powi(2)).sum::<f64>();
        // Modes are kept sorted by falling weight; the first that fits is the owner.
        let owner = modes.iter().position(|m| distance(&m.2) < p.match_distance * m.1);
        let mut total = 0.0;
        let mut background = false;
        for (k, m) in modes.iter().enumerate() {
            background |= owner.is_none_or(|o| k <= o)
                && total < p.background_ratio
                && distance(&m.2) < p.background_distance * m.1;
            total += (1.0 - a) * m.0 - a * p.complexity_reduction + if owner == Some(k) { a } else { 0.0 };
        }
        for (k, m) in modes.iter_mut().enumerate() {
            m.0 = (1.0 - a) * m.0 - a * p.complexity_reduction + if owner == Some(k) { a } else { 0.0 };
            if owner == Some(k) {
                let (d, rate) = (distance(&m.2), a / m.0);
                (0..3).for_each(|c| m.2[c] += rate * (v[c] - m.2[c]));
                m.1 = (m.1 + rate * (d - m.1)).clamp(p.least_variance, p.most_variance);
            }
        }
        modes.retain(|m| m.0 >= a * p.complexity_reduction);
        let sum: f64 = modes.iter().map(|m| m.0).sum();
        modes.iter_mut().for_each(|m| m.0 /= sum);
        if owner.is_none() {
            modes.truncate(p.most_modes - 1);
            modes.iter_mut().for_each(|m| m.0 *= 1.0 - a);
            let weight = if modes.is_empty() { 1.0 } else { a };
            modes.push((weight, p.initial_variance, *v));
        }
        modes.sort_by(|a, b| b.0.total_cmp(&a.0));
        masks.push(if background || n == 0 { BACKGROUND } else { FOREGROUND });
    }
    masks
}

#[test]
fn mog2_equals_the_twin() {
    // Pixels that flicker between three values, with noise, each in its own rhythm.
    let (w, h, frames) = (40, 25, 120);
    let value = |x: usize, y: usize, n: i64| -> [u8; 3] {
        let base = [60, 110, 170][(noise(x, y, 1000 + n / (1 + (x % 7) as i64)) as usize * (1 + y % 3)) / 256 % 3];
        [0, 1, 2].map(|c| (base + noise(x, y, 3 * n + c) / 24 + c * 5) as u8)
    };
    for history_frames in [500, 30] {
        let params = Mog2Params {
            shadow_ratio: None,
            history_frames,
            most_modes: 3,
            background_ratio: 0.6,
            ..Default::default()
        };
        let (mut model, mut mask) = (Mog2::<Rgb8>::new(params).unwrap(), mask());
        let mut masks = Vec::new();
        for n in 0..frames {
            model
                .apply(Image::from_fn(w, h, |x, y| value(x, y, n)).unwrap().view(), &Learning::default(), &mut mask)
                .unwrap();
            masks.push(mask.clone());
        }
        let (mut differ, mut foreground) = (0, 0);
        for y in 0..h {
            for x in 0..w {
                let values: Vec<[f64; 3]> = (0..frames).map(|n| value(x, y, n).map(f64::from)).collect();
                for (want, got) in slow_mog2(&values, &params).iter().zip(&masks) {
                    differ += usize::from(*want != got.row(y)[x]);
                    foreground += usize::from(*want == FOREGROUND);
                }
            }
        }
        // Ties of weights fall either way in single and double precision.
        assert!(differ * 1000 < w * h * frames as usize * 2, "{differ}");
        assert!(foreground > w * h * frames as usize / 50);
    }
}

#[test]
fn mog2_marks_what_opencv_marks() {
    let (mut model, mut mask) = (mog2(), mask());
    for frame in 0..60 {
        model.apply(clip(frame).view(), &Learning::default(), &mut mask).unwrap();
        let runs = match frame {
            10 => MASK_10,
            21 => MASK_21,
            35 => MASK_35,
            59 => MASK_59,
            _ => continue,
        };
        let expected: Vec<u8> = runs
            .iter()
            .flat_map(|&(n, code)| std::iter::repeat_n([BACKGROUND, SHADOW, FOREGROUND][usize::from(code)], n))
            .collect();
        let differ = mask.as_slice().iter().zip(&expected).filter(|(a, b)| a != b).count();
        assert!(differ * 1000 <= expected.len(), "frame {frame}: {differ} of {}", expected.len());
    }
    assert!(mask.as_slice().contains(&SHADOW) && mask.as_slice().contains(&FOREGROUND));
}

#[test]
fn mog2_with_rate_0_learns_nothing() {
    let (mut model, mut mask) = (mog2(), mask());
    let still = Learning { rate: Some(0.0), protect: None };
    model.apply(clip(3).view(), &still, &mut mask).unwrap();
    assert!(mask.as_slice().iter().all(|&v| v == BACKGROUND) && !model.background(&mut clip(3)).unwrap());
    for frame in 0..40 {
        model.apply(clip(frame).view(), &Learning::default(), &mut mask).unwrap();
    }
    let before = format!("{model:?}").replace(&line_of(&model), "");
    let mut masks = Vec::new();
    for _ in 0..30 {
        model.apply(clip(45).view(), &still, &mut mask).unwrap();
        masks.push(mask.clone());
    }
    assert!(masks.iter().all(|m| *m == masks[0]) && masks[0].as_slice().contains(&FOREGROUND));
    let after = format!("{model:?}").replace(&line_of(&model), "");
    // All but the counter of frames and the scratch is as it was.
    let state = |s: &str| s[s.find("counts").unwrap()..].to_owned();
    assert_eq!(state(&before), state(&after));
}

/// The scratch in a model's debug output.
fn line_of(model: &Mog2<Rgb8>) -> String {
    let text = format!("{model:?}");
    text[text.find("line:").unwrap()..].to_owned()
}

#[test]
fn fast_learning_forgets_and_slow_learning_remembers() {
    let place = |mask: &Image<u8>| mask.row(20)[10];
    for (rate, want) in [(0.2, BACKGROUND), (0.002, FOREGROUND)] {
        let (mut model, mut mask) = (mog2(), mask());
        (0..20).for_each(|f| model.apply(clip(f).view(), &Learning::default(), &mut mask).unwrap());
        let learning = Learning { rate: Some(rate), protect: None };
        (0..30).for_each(|_| model.apply(clip(25).view(), &learning, &mut mask).unwrap());
        assert_eq!(place(&mask), want, "{rate}");
    }
}

#[test]
fn grey_mog2_sees_shadows_by_brightness() {
    let (mut model, mut mask) = (Mog2::<u8>::new(Mog2Params::default()).unwrap(), mask());
    let frame =
        |patch: u8| Image::from_fn(50, 20, |x, y| if x < 10 { patch } else { 118 + ((x + y) % 5) as u8 }).unwrap();
    for _ in 0..30 {
        model.apply(frame(120).view(), &Learning::default(), &mut mask).unwrap();
    }
    assert!(mask.as_slice().iter().all(|&v| v == BACKGROUND));
    let judge = Learning { rate: Some(0.0), protect: None };
    for (v, want) in [(90, SHADOW), (61, SHADOW), (58, FOREGROUND), (150, FOREGROUND), (118, BACKGROUND)] {
        model.apply(frame(v).view(), &judge, &mut mask).unwrap();
        assert!((0..10).all(|x| mask.row(3)[x] == want) && mask.row(3)[30] == BACKGROUND, "{v} {:?}", mask.row(3));
    }
}

#[test]
fn the_background_of_a_part_is_that_of_the_whole() {
    let (mut model, mut mask) = (mog2(), mask());
    (0..30).for_each(|k| model.apply(clip(k).view(), &Learning::default(), &mut mask).unwrap());
    let (mut whole, mut part) = (clip(0), Image::filled(96, 64, [9; 3]).unwrap());
    let windows = [
        PixelWindow { x: 3, y: 5, width: 70, height: 9 },
        PixelWindow { x: 90, y: 60, width: 40, height: 40 },
        PixelWindow { x: 96, y: 0, width: 1, height: 1 },
    ];
    assert!(model.background(&mut whole).unwrap() && model.background_in(&windows, &mut part).unwrap());
    let inside = |x: usize, y: usize| {
        let within = |w: &PixelWindow| (w.x..w.x + w.width).contains(&x) && (w.y..w.y + w.height).contains(&y);
        windows.iter().any(within)
    };
    let wanted = Image::from_fn(96, 64, |x, y| if inside(x, y) { whole.row(y)[x] } else { [9; 3] }).unwrap();
    assert_eq!(part, wanted);
}
