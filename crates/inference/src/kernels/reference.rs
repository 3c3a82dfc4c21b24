//! Slow, obvious twins of the kernels, and the comparisons with them.

use super::*;
use crate::weights::Layer;
use fearless_simd::{Level, dispatch};
use pursuit_testkit::Noise;

/// Numbers of both signs without a pattern that a mistake could share.
fn numbers(count: usize, seed: u32) -> Vec<f32> {
    let mut noise = Noise::new(seed.wrapping_mul(2_654_435_761).wrapping_add(12_345));
    (0..count).map(|_| (noise.draw() >> 8) as f32 / (1 << 23) as f32 - 1.0).collect()
}

/// A tensor in channel, row, column order.
struct Planes {
    channels: usize,
    height: usize,
    width: usize,
    data: Vec<f32>,
}

impl Planes {
    fn new(channels: usize, height: usize, width: usize, seed: u32) -> Self {
        Self { channels, height, width, data: numbers(channels * height * width, seed) }
    }

    fn at(&self, c: usize, y: isize, x: isize) -> f32 {
        let inside = (0..self.height as isize).contains(&y) && (0..self.width as isize).contains(&x);
        if inside { self.data[(c * self.height + y as usize) * self.width + x as usize] } else { 0.0 }
    }

    fn in_map(&self, mut map: Map) -> Map {
        map.fill(&self.data);
        map
    }
}

fn contents(map: &Map) -> Vec<f32> {
    let mut tensor = vec![0.0; map.channels * map.height * map.width];
    map.copy_to(&mut tensor);
    tensor
}

/// The convolution as it is defined; `weights` in output, input of its group, row, column order.
fn convolution(
    input: &Planes,
    weights: &[f32],
    bias: &[f32],
    (side, stride, padding): (usize, usize, usize),
    is_depthwise: bool,
) -> Planes {
    let out = |n: usize| (n + 2 * padding - side) / stride + 1;
    let (height, width) = (out(input.height), out(input.width));
    let inputs = if is_depthwise { 1 } else { input.channels };
    let mut data = Vec::new();
    for o in 0..bias.len() {
        for y in 0..height {
            for x in 0..width {
                let mut sum = f64::from(bias[o]);
                for i in 0..inputs {
                    for ky in 0..side {
                        for kx in 0..side {
                            let row = (y * stride + ky) as isize - padding as isize;
                            let column = (x * stride + kx) as isize - padding as isize;
                            let channel = if is_depthwise { o } else { i };
                            let weight = weights[((o * inputs + i) * side + ky) * side + kx];
                            sum += f64::from(weight) * f64::from(input.at(channel, row, column));
                        }
                    }
                }
                data.push(sum as f32);
            }
        }
    }
    Planes { channels: bias.len(), height, width, data }
}

fn assert_close(got: &[f32], want: &[f32], what: &str) {
    assert_eq!(got.len(), want.len(), "{what}");
    for (i, (g, w)) in got.iter().zip(want).enumerate() {
        assert!((g - w).abs() <= 2e-5 * w.abs().max(1.0), "{what}: number {i} is {g} instead of {w}");
    }
}

/// Whether everything but the map's own columns is zero: what the next convolution takes for its padding.
fn assert_padding_is_zero(map: &Map, what: &str) {
    let mut own = vec![false; map.row_len()];
    for c in 0..map.channels {
        (0..map.width).for_each(|x| own[map.offset(c, x)] = true);
    }
    let rows = map.padded_rows_from(0).chunks_exact(map.row_len());
    for (y, row) in rows.enumerate() {
        let is_inside = (map.padding..map.padding + map.height).contains(&y);
        let stray = row.iter().zip(&own).position(|(&v, &own)| v != 0.0 && !(own && is_inside));
        assert_eq!(stray, None, "{what}: row {y}");
    }
}

#[test]
fn activations_are_what_their_equations_say() {
    for x in [-7.0f32, -3.0, -2.5, -0.5, 0.0, 0.5, 2.5, 3.0, 5.0, 7.0] {
        assert_eq!(Activation::None.of(x), x);
        assert_eq!(Activation::Relu.of(x), if x > 0.0 { x } else { 0.0 });
        assert_eq!(Activation::Relu6.of(x), if x > 6.0 { 6.0 } else { x.max(0.0) });
        let hard = if x <= -3.0 {
            0.0
        } else if x >= 3.0 {
            1.0
        } else {
            (x + 3.0) / 6.0
        };
        assert!((hard_sigmoid(x) - hard).abs() < 1e-6);
        assert!((Activation::HardSwish.of(x) - x * hard).abs() < 1e-5);
        for activation in [
            Activation::None,
            Activation::Relu,
            Activation::Relu6,
            Activation::HardSwish,
            Activation::Gelu,
            Activation::Probability,
        ] {
            let lanes: [f32; LANES] =
                dispatch!(Level::new(), simd => activation.of_lanes([f32x16::splat(simd, x); 2])[1].to_array());
            assert!((lanes[3] - activation.of(x)).abs() < 1e-6, "{activation:?} of {x}");
        }
    }
}

#[test]
fn pointwise_agrees_with_the_definition() {
    let targets: [fn(usize, usize, usize) -> Map; 4] = [
        Map::dense,
        |c, h, w| Map::padded(c, h, w, 2, 5),
        |c, h, w| Map::split(c, h, w, 1, 3),
        |c, h, w| Map::split(c, h, w, 2, 5),
    ];
    for (inputs, outputs, height, width) in [(16, 8, 4, 16), (5, 12, 3, 32), (24, 3, 15, 15), (7, 20, 8, 8)] {
        let input = Planes::new(inputs, height, width, 1);
        let (weights, bias) = (numbers(inputs * outputs, 2), numbers(outputs, 3));
        let plain = convolution(&input, &weights, &bias, (1, 1, 0), false);
        for (n, target) in targets.into_iter().enumerate() {
            for activation in [Activation::None, Activation::HardSwish] {
                let what = format!("{inputs} to {outputs}, {height} x {width}, target {n}, {activation:?}");
                let mut map = input.in_map(Map::dense(inputs, height, width));
                let mut out = target(outputs, height, width);
                Pointwise::new(&weights, &bias, activation).run(PointwiseInput::plain(&mut map), &mut out);
                let want: Vec<f32> = plain.data.iter().map(|&v| activation.of(v)).collect();
                assert_close(&contents(&out), &want, &what);
                if n > 0 {
                    assert_padding_is_zero(&out, &what);
                }
            }
        }
    }
}

#[test]
fn pointwise_gates_concatenates_and_adds() {
    let (inputs, more, outputs, side) = (6, 9, 11, 16);
    let (input, other) = (Planes::new(inputs, side, side, 4), Planes::new(more, side, side, 5));
    let residual = Planes::new(outputs, side, side, 6);
    let (weights, bias) = (numbers((inputs + more) * outputs, 7), numbers(outputs, 8));
    let factors = numbers(inputs, 9);
    let mut joined = Planes::new(0, side, side, 0);
    for (c, plane) in input.data.chunks_exact(side * side).enumerate() {
        joined.data.extend(plane.iter().map(|&v| Activation::HardSwish.of(factors[c] * v)));
    }
    joined.data.extend(&other.data);
    joined.channels = inputs + more;
    let sums = convolution(&joined, &weights, &bias, (1, 1, 0), false);
    let want: Vec<f32> = sums.data.iter().zip(&residual.data).map(|(s, r)| (s + r).max(0.0)).collect();

    let mut map = input.in_map(Map::dense(inputs, side, side));
    let other = other.in_map(Map::dense(more, side, side));
    let residual = residual.in_map(Map::dense(outputs, side, side));
    let gate = Some((factors.as_slice(), Activation::HardSwish));
    let mut out = Map::dense(outputs, side, side);
    let layer = Pointwise::new(&weights, &bias, Activation::Relu);
    layer.run(PointwiseInput { map: &mut map, more: Some(&other), gate, residual: Some(&residual) }, &mut out);
    assert_close(&contents(&out), &want, "gated, concatenated and added");
}

/// Each instruction set has its own number of sums at a time; a sum is the same in all.
#[test]
fn what_is_summed_together_changes_nothing() {
    type Panel = fn(&Pointwise, &PointwiseInput<'_>, usize, &mut Map);
    let ways: [(usize, Panel); 4] = [
        (4, |p, i, n, o| dispatch!(Level::new(), s => pointwise::panel::<_, 1, 4>(s, p, i, n, 0..o.height, o, n * 4))),
        (6, |p, i, n, o| dispatch!(Level::new(), s => pointwise::panel::<_, 1, 6>(s, p, i, n, 0..o.height, o, n * 6))),
        (8, |p, i, n, o| dispatch!(Level::new(), s => pointwise::panel::<_, 1, 8>(s, p, i, n, 0..o.height, o, n * 8))),
        (8, |p, i, n, o| dispatch!(Level::new(), s => pointwise::panel::<_, 2, 8>(s, p, i, n, 0..o.height, o, n * 8))),
    ];
    for (inputs, outputs, height, width) in [(5, 12, 3, 48), (9, 7, 5, 16), (3, 16, 2, 33), (4, 8, 1, 5)] {
        let input = Planes::new(inputs, height, width, 41);
        let mut layer = Pointwise::new(&numbers(inputs * outputs, 42), &numbers(outputs, 43), Activation::Relu6);
        let results = ways.map(|(together, panel)| {
            layer.panels = layer.panels.regrouped(together);
            let mut map = input.in_map(Map::dense(inputs, height, width));
            let mut out = Map::split(outputs, height, width, 1, 3);
            (0..layer.panels.count()).for_each(|n| panel(&layer, &PointwiseInput::plain(&mut map), n, &mut out));
            contents(&out)
        });
        let want = convolution(&input, &numbers(inputs * outputs, 42), &numbers(outputs, 43), (1, 1, 0), false);
        let want: Vec<f32> = want.data.iter().map(|&v| Activation::Relu6.of(v)).collect();
        assert_close(&results[0], &want, "four at a time");
        assert!(results.iter().all(|r| *r == results[0]), "{inputs} to {outputs}, {height} x {width}");
    }

    type Row = fn(&Convolution, &Map, usize, &mut Map);
    let ways: [(usize, Row); 4] = [
        (
            4,
            |layer, map, y, out| dispatch!(Level::new(), simd => convolution::row::<_, 1, 4>(simd, layer, map, y, out)),
        ),
        (
            6,
            |layer, map, y, out| dispatch!(Level::new(), simd => convolution::row::<_, 1, 6>(simd, layer, map, y, out)),
        ),
        (
            8,
            |layer, map, y, out| dispatch!(Level::new(), simd => convolution::row::<_, 1, 8>(simd, layer, map, y, out)),
        ),
        (
            8,
            |layer, map, y, out| dispatch!(Level::new(), simd => convolution::row::<_, 2, 8>(simd, layer, map, y, out)),
        ),
    ];
    for width in [31, 95] {
        let map = Planes::new(3, 31, width, 44).in_map(Map::split(3, 31, width, 1, 3));
        let mut layer = Convolution::new(&numbers(27 * 11, 45), &numbers(11, 46), Activation::HardSwish, &map);
        let results = ways.map(|(together, row)| {
            layer.panels = layer.panels.regrouped(together);
            let mut out = Map::split(11, 16, width.div_ceil(2), 1, 3);
            (0..16).for_each(|y| row(&layer, &map, y, &mut out));
            contents(&out)
        });
        assert!(results.iter().all(|r| *r == results[0]), "{width} wide");
    }
}

#[test]
fn depthwise_agrees_with_the_definition() {
    use DepthwiseShape::*;
    let cases = [(Two, 1, 0), (Three, 1, 1), (Four, 1, 1), (Five, 1, 2), (ThreeByTwo, 2, 1), (FiveByTwo, 2, 2)];
    for (shape, stride, padding) in cases {
        for (channels, height, width) in [(3, 16, 16), (2, 15, 15), (4, 8, 8), (2, 9, 32), (1, 64, 64)] {
            let side = shape.side();
            let what = format!("{shape:?}, {channels} x {height} x {width}");
            let input = Planes::new(channels, height, width, 11);
            let (weights, bias) = (numbers(channels * side * side, 12), numbers(channels, 13));
            let plain = convolution(&input, &weights, &bias, (side, stride, padding), true);
            let map = match stride {
                1 => Map::padded(channels, height, width, padding, side),
                _ => Map::split(channels, height, width, padding, side),
            };
            let map = input.in_map(map);
            let mut out = Map::dense(channels, plain.height, plain.width);
            let mut sums = vec![9.0; channels * LANES];
            let layer = Depthwise::new(shape, &weights, &bias, Activation::Relu6);
            layer.run(&map, &mut out, Some(&mut sums));
            let want: Vec<f32> = plain.data.iter().map(|&v| Activation::Relu6.of(v)).collect();
            assert_close(&contents(&out), &want, &what);
            // A last segment that is not whole has columns beyond the map in its sums; no such map is averaged.
            let is_whole = plain.width <= LANES || plain.width.is_multiple_of(LANES);
            for (c, plane) in want.chunks_exact(plain.height * plain.width).enumerate().filter(|_| is_whole) {
                let columns = plain.width.min(LANES);
                let sum: f32 = sums[c * LANES..c * LANES + columns].iter().sum();
                assert!((sum - plane.iter().sum::<f32>()).abs() < 1e-2, "{what}: sum of channel {c}");
            }
        }
    }
}

#[test]
fn pointwise_into_depthwise_is_one_after_the_other() {
    use DepthwiseShape::*;
    let cases = [(Two, 1, 0), (Three, 1, 1), (Four, 1, 1), (Five, 1, 2), (ThreeByTwo, 2, 1), (FiveByTwo, 2, 2)];
    for (shape, stride, padding) in cases {
        for (inputs, outputs, height, width) in [(5, 20, 16, 16), (3, 8, 15, 15), (9, 3, 8, 8), (4, 17, 6, 33)] {
            let side = shape.side();
            let what = format!("{shape:?}, {inputs} to {outputs}, {height} x {width}");
            let input = Planes::new(inputs, height, width, 51);
            let mix = Pointwise::new(&numbers(inputs * outputs, 52), &numbers(outputs, 53), Activation::HardSwish);
            let (weights, bias) = (numbers(outputs * side * side, 54), numbers(outputs, 55));
            let filter = Depthwise::new(shape, &weights, &bias, Activation::Relu);
            let layout = |channels: usize| match stride {
                1 => Map::padded(channels, height, width, padding, side),
                _ => Map::split(channels, height, width, padding, side),
            };
            let out_side = |n: usize| (n + 2 * padding - side) / stride + 1;
            let mut out = Map::dense(outputs, out_side(height), out_side(width));
            let (mut want, mut sums, mut want_sums) =
                (out.clone(), vec![7.0; outputs * LANES], vec![8.0; outputs * LANES]);
            let factors = numbers(inputs, 56);

            let mut map = input.in_map(Map::dense(inputs, height, width));
            let mut whole = layout(outputs);
            let gate = Some((factors.as_slice(), Activation::Relu));
            mix.run(PointwiseInput { gate, ..PointwiseInput::plain(&mut map) }, &mut whole);
            filter.run(&whole, &mut want, Some(&mut want_sums));

            let mut map = input.in_map(Map::dense(inputs, height, width));
            let mut between = layout(TOGETHER);
            let mut gated = PointwiseInput { gate, ..PointwiseInput::plain(&mut map) };
            let height = out.height;
            let middle = if height >= 8 { 4 } else { height };
            mix.run_into(&mut gated, &mut between, &filter, &mut out, &(0..middle));
            if middle < height {
                mix.run_into(&mut gated, &mut between, &filter, &mut out, &(middle..height));
            }
            filter.sum_up(&out, Some(&mut sums));
            assert_eq!(contents(&out), contents(&want), "{what}");
            assert_eq!(sums, want_sums, "{what}: sums");
            assert_padding_is_zero(&between, &what);
        }
    }
}

#[test]
fn strided_convolution_agrees_with_the_definition() {
    for (height, width, outputs) in [(31, 31, 16), (255, 64, 5)] {
        let input = Planes::new(3, height, width, 21);
        let (weights, bias) = (numbers(27 * outputs, 22), numbers(outputs, 23));
        let plain = convolution(&input, &weights, &bias, (3, 2, 1), false);
        let map = input.in_map(Map::split(3, height, width, 1, 3));
        let layer = Convolution::new(&weights, &bias, Activation::HardSwish, &map);
        let mut out = Map::split(outputs, plain.height, plain.width, 1, 3);
        layer.run(&map, &mut out);
        let want: Vec<f32> = plain.data.iter().map(|&v| Activation::HardSwish.of(v)).collect();
        assert_close(&contents(&out), &want, "strided convolution");
        assert_padding_is_zero(&out, "strided convolution");
    }
}

#[test]
fn squeeze_and_excite_agrees_with_the_definition() {
    let (channels, hidden, columns, rows) = (13, 5, 8, 6);
    let planes: Vec<f32> = numbers(channels * rows * columns, 31);
    let (squeeze, excite) = (numbers(hidden * channels, 32), numbers(channels * hidden, 33));
    let (squeeze_bias, excite_bias) = (numbers(hidden, 34), numbers(channels, 35));
    let means: Vec<f32> = planes.chunks_exact(rows * columns).map(|p| p.iter().sum::<f32>() / p.len() as f32).collect();
    let dot = |row: &[f32], x: &[f32]| row.iter().zip(x).map(|(a, b)| a * b).sum::<f32>();
    let inner: Vec<f32> =
        squeeze.chunks_exact(channels).zip(&squeeze_bias).map(|(row, b)| (dot(row, &means) + b).max(0.0)).collect();
    let want: Vec<f32> =
        excite.chunks_exact(hidden).zip(&excite_bias).map(|(row, b)| hard_sigmoid(dot(row, &inner) + b)).collect();

    let mut sums = vec![1e3; channels * LANES]; // what lies beyond the columns does not count
    for (c, plane) in planes.chunks_exact(rows * columns).enumerate() {
        for x in 0..columns {
            sums[c * LANES + x] = plane.iter().skip(x).step_by(columns).sum();
        }
    }
    let mut layer = SqueezeExcite::new(&squeeze, &squeeze_bias, &excite, &excite_bias);
    assert_close(layer.factors(&sums, columns, rows * columns), &want, "squeeze and excite");
}

/// Winograd's algorithm adds and takes away more than the definition, so that more digits are lost.
fn assert_near(got: &[f32], want: &[f32], what: &str) {
    assert_eq!(got.len(), want.len(), "{what}");
    for (i, (g, w)) in got.iter().zip(want).enumerate() {
        assert!((g - w).abs() <= 2e-4 * w.abs().max(1.0), "{what}: number {i} is {g} instead of {w}");
    }
}

#[test]
fn winograd_agrees_with_the_definition() {
    type All = fn(&Winograd, &mut WinogradInput, &mut Map);
    for (channels, outputs, height, width) in
        [(5, 12, 16, 16), (9, 3, 7, 15), (4, 8, 4, 33), (3, 17, 9, 5), (70, 9, 5, 7), (1, 41, 4, 16)]
    {
        let input = Planes::new(channels, height, width, 61);
        let (weights, bias) = (numbers(9 * channels * outputs, 62), numbers(outputs, 63));
        let factors = numbers(channels, 64);
        let weighed: Vec<f32> = input
            .data
            .chunks_exact(height * width)
            .zip(&factors)
            .flat_map(|(p, f)| p.iter().map(move |v| v * f))
            .collect();
        let weighed = Planes { data: weighed, channels, height, width };
        let mut transformed = WinogradInput::new(channels, height, width);
        transformed.set(0, &input.in_map(Map::dense(channels, height, width)), Some(&factors));
        let want = convolution(&weighed, &weights, &bias, (3, 1, 1), false);
        let want: Vec<f32> = want.data.iter().map(|v| v.max(0.0)).collect();
        let layer = Winograd::new(&weights, &bias, Activation::Relu);
        let what = format!("{channels} to {outputs}, {height} x {width}");
        let mut out = Map::dense(outputs, height, width);
        layer.run(&mut transformed, &mut out);
        assert_near(&contents(&out), &want, &what);

        let ways: [(usize, All); 3] = [
            (4, |l, i, o| dispatch!(Level::new(), s => winograd::all::<_, 1, 4>(s, l, i, o))),
            (6, |l, i, o| dispatch!(Level::new(), s => winograd::all::<_, 1, 6>(s, l, i, o))),
            (8, |l, i, o| dispatch!(Level::new(), s => winograd::all::<_, 2, 8>(s, l, i, o))),
        ];
        for (together, way) in ways {
            let mut layer = layer.clone();
            layer.rows = layer.rows.map(|panels| panels.regrouped(together));
            let mut other = Map::dense(outputs, height, width);
            way(&layer, &mut transformed, &mut other);
            assert_eq!(contents(&other), contents(&out), "{what}: what is summed together changes nothing");
        }
    }
}

#[test]
fn winograd_takes_several_maps() {
    let (height, width) = (8, 16);
    let (a, b) = (Planes::new(2, height, width, 71), Planes::new(3, height, width, 72));
    let both = Planes { channels: 5, height, width, data: [a.data.clone(), b.data.clone()].concat() };
    let mut whole = WinogradInput::new(5, height, width);
    whole.set(0, &both.in_map(Map::dense(5, height, width)), None);
    let mut parts = WinogradInput::new(5, height, width);
    parts.set(2, &b.in_map(Map::dense(3, height, width)), None);
    parts.set(0, &a.in_map(Map::dense(2, height, width)), None);
    let layer = Winograd::new(&numbers(5 * 9, 73), &numbers(1, 74), Activation::None);
    let [of_whole, of_parts] = [whole, parts].map(|mut input| {
        let mut out = Map::dense(1, height, width);
        layer.run(&mut input, &mut out);
        contents(&out)
    });
    assert_eq!(of_whole, of_parts);
}

#[test]
fn layer_norm_agrees_with_the_definition() {
    let (channels, rows) = (24, 6);
    let input = Planes::new(channels, rows, LANES, 81);
    let (weights, bias) = (numbers(channels, 82), numbers(channels, 83));
    let mut out = Map::dense(channels, rows, LANES);
    let map = input.in_map(Map::dense(channels, rows, LANES));
    LayerNorm::new(weights.clone(), bias.clone()).run(&map, 2..5, (&mut out, 1));
    let points = rows * LANES;
    let mut want = vec![0.0; channels * points];
    for i in 2 * LANES..5 * LANES {
        let of_token: Vec<f64> = (0..channels).map(|c| f64::from(input.data[c * points + i])).collect();
        let mean = of_token.iter().sum::<f64>() / channels as f64;
        let variance = of_token.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / channels as f64;
        for (c, x) in of_token.iter().enumerate() {
            let normal = (x - mean) / (variance + 1e-5).sqrt();
            want[c * points + i - LANES] = (normal * f64::from(weights[c]) + f64::from(bias[c])) as f32;
        }
    }
    assert_close(&contents(&out), &want, "layer norm");
}

#[test]
fn attention_agrees_with_the_definition() {
    let (channels, rows) = (16, 4);
    let tokens = rows * LANES;
    let input = Planes::new(3 * channels, rows, LANES, 91);
    let of = |part: usize, c: usize, t: usize| f64::from(input.data[(part * channels + c) * tokens + t]);
    let mut want = vec![0.0; channels * tokens];
    for query in 2 * LANES..tokens {
        let product = |key: usize| (0..channels).map(|c| of(0, c, query) * of(1, c, key)).sum::<f64>();
        let shares: Vec<f64> = (0..tokens).map(|key| product(key).exp()).collect();
        let total: f64 = shares.iter().sum();
        for c in 0..channels {
            let mean: f64 = shares.iter().enumerate().map(|(key, s)| s / total * of(2, c, key)).sum();
            want[c * tokens + query] = mean as f32;
        }
    }
    let mut out = Map::dense(channels, rows, LANES);
    let map = input.in_map(Map::dense(3 * channels, rows, LANES));
    Attention::new(tokens, channels).run(&map, 2..rows, &mut out);
    assert_close(&contents(&out), &want, "attention");
}

#[test]
fn excitation_agrees_with_the_definition() {
    let (channels, hidden) = (6, 3);
    let planes = Planes::new(channels, 4, LANES, 101);
    let layer = |inputs: usize, outputs: usize, seed| Layer {
        weights: numbers(inputs * outputs, seed),
        bias: numbers(outputs, seed + 1),
    };
    let (squeeze, excite) = (layer(channels, hidden, 102), layer(hidden, channels, 104));
    let applied = |l: &Layer, x: &[f32]| -> Vec<f32> {
        let rows = l.weights.chunks_exact(x.len()).zip(&l.bias);
        rows.map(|(row, b)| row.iter().zip(x).map(|(w, x)| w * x).sum::<f32>() + b).collect()
    };
    let want = |means: &[f32]| -> Vec<f32> {
        let inner: Vec<f32> = applied(&squeeze, means).iter().map(|h| h.max(0.0)).collect();
        applied(&excite, &inner).iter().map(|f| 1.0 / (1.0 + (-f).exp())).collect()
    };
    let means: Vec<f32> = planes.data.chunks_exact(4 * LANES).map(|p| p.iter().sum::<f32>() / p.len() as f32).collect();
    let mut excitation = Excitation::new(squeeze.clone(), excite.clone());
    let map = planes.in_map(Map::dense(channels, 4, LANES));
    assert_close(excitation.factors(&map), &want(&means), "of a map");
    let before = layer(2, channels, 106);
    let of_before = applied(&before, &[0.5, -2.0]);
    assert_close(excitation.factors_of(&before, &[0.5, -2.0]), &want(&of_before), "of a layer");
}
