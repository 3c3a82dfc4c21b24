//! The arithmetic of the published trackers around their networks, step by step as they take it, on plain numbers: nothing of this
//! crate but what runs an ONNX file. Sources, for the facts alone: siamfc-pytorch `siamfc/siamfc.py` and `siamfc/ops.py` (commit
//! 82c01cb), PySOT `siamrpn_tracker.py`, `base_tracker.py` and `anchor.py` (313172f), DaSiamRPN `code/run_SiamRPN.py` (14f07c9),
//! LightTrack `lib/tracker/lighttrack.py` (6c290e5), OSTrack `lib/test/tracker/ostrack.py` and `processing_utils.py` (af701f5).

use pursuit_inference::Network;
use std::f64::consts::PI;

/// A picture of red, green and blue.
#[derive(Clone)]
pub struct Picture {
    pub width: usize,
    pub height: usize,
    pub pixels: Vec<[u8; 3]>,
}

/// Where the target is: its middle, in pixels from the upper left corner of the picture, and its size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Target {
    pub x: f64,
    pub y: f64,
    pub width: f64,
    pub height: f64,
}

/// How grey levels are handed to the network.
#[derive(Clone, Copy)]
pub enum Input {
    /// Blue, green and red as they are.
    Bgr,
    /// Red, green and blue as they are.
    Rgb,
    /// Red, green and blue by the means and deviations of ImageNet.
    ImageNet,
}

/// The network's files, opened.
pub struct Opened {
    pub template: Option<Box<dyn Network>>,
    pub search: Box<dyn Network>,
    pub head: Option<Box<dyn Network>>,
    /// What is kept of the template: its features, or its image.
    pub kept: Vec<f32>,
}

impl Opened {
    pub fn learn(&mut self, image: &[f32]) {
        self.kept = match &mut self.template {
            Some(network) => {
                network.set_input(0, image).unwrap();
                network.run().unwrap();
                network.output(0).to_vec()
            }
            None => image.to_vec(),
        };
    }

    /// The outputs by their names.
    fn ask(&mut self, image: &[f32], names: &[&str]) -> Vec<Vec<f64>> {
        let place = |network: &dyn Network, name: &str| network.inputs().iter().position(|p| p.name == name).unwrap();
        let image_at = place(&*self.search, "search");
        self.search.set_input(image_at, image).unwrap();
        let answering = match &mut self.head {
            Some(head) => {
                self.search.run().unwrap();
                let (z, x) = (place(&**head, "template"), place(&**head, "search"));
                head.set_input(x, self.search.output(0)).unwrap();
                head.set_input(z, &self.kept).unwrap();
                &mut **head
            }
            None => {
                let kept = if self.template.is_some() { "features" } else { "template" };
                let kept_at = place(&*self.search, kept);
                self.search.set_input(kept_at, &self.kept).unwrap();
                &mut *self.search
            }
        };
        answering.run().unwrap();
        let output = |name: &&str| answering.outputs().iter().position(|p| p.name == **name).unwrap();
        names.iter().map(|name| answering.output(output(name)).iter().map(|&v| f64::from(v)).collect()).collect()
    }
}

/// The mean of each channel.
fn means(picture: &Picture) -> [f64; 3] {
    [0, 1, 2].map(|c| picture.pixels.iter().map(|p| f64::from(p[c])).sum::<f64>() / picture.pixels.len() as f64)
}

/// Cuts a square of `side` pixels from column `left` and row `top` on, outside of the picture `fill`, and resamples it to `samples` ×
/// `samples` as `cv2.resize` does with 8-bit pictures: places in single precision, weights in parts of 2048, sums shifted by 4, 16 and 2 bits.
fn cut(
    picture: &Picture,
    (left, top, side): (i64, i64, i64),
    samples: usize,
    fill: [f64; 3],
    input: Input,
) -> Vec<f32> {
    // A picture that a float is assigned to keeps the whole part.
    let fill = fill.map(|v| v as u8);
    let pixel = |x: i64, y: i64| {
        let inside = x >= 0 && y >= 0 && x < picture.width as i64 && y < picture.height as i64;
        if inside { picture.pixels[y as usize * picture.width + x as usize] } else { fill }
    };
    let (mut out, count) = (vec![0f32; 3 * samples * samples], samples * samples);
    for i in 0..count {
        let (u, v) = (i % samples, i / samples);
        let place = |k: usize| ((k as f64 + 0.5) * side as f64 / samples as f64 - 0.5) as f32;
        let inside = |k: i64| k.clamp(0, side - 1);
        let (mut x, y) = (place(u), place(v));
        // Columns beyond the border are put onto it before their weights are taken, rows afterwards.
        x = x.clamp(0.0, (side - 1) as f32);
        let (x0, y0) = (x.floor() as i64, y.floor() as i64);
        let weight = |t: f32| ((t - t.floor()) * 2048.0).round_ties_even() as i64;
        let (wx, wy) = (weight(x), weight(y));
        for c in 0..3 {
            let level = |x: i64, y: i64| i64::from(pixel(left + inside(x), top + inside(y))[c]);
            let row = |y: i64| level(x0, y) * (2048 - wx) + level(x0 + 1, y) * wx;
            let (upper, lower) = (row(y0) >> 4, row(y0 + 1) >> 4);
            let grey = (((upper * (2048 - wy)) >> 16) + ((lower * wy) >> 16) + 2) >> 2;
            let (mean, deviation) = ([0.485, 0.456, 0.406][c], [0.229, 0.224, 0.225][c]);
            let (plane, value) = match input {
                Input::Bgr => (2 - c, grey as f64),
                Input::Rgb => (c, grey as f64),
                Input::ImageNet => (c, (grey as f64 / 255.0 - mean) / deviation),
            };
            out[plane * count + i] = value as f32;
        }
    }
    out
}

/// `np.hanning`.
fn hanning(n: usize) -> Vec<f64> {
    (0..n).map(|i| 0.5 - 0.5 * (2.0 * PI * i as f64 / (n as f64 - 1.0)).cos()).collect()
}

fn outer(line: &[f64]) -> Vec<f64> {
    line.iter().flat_map(|a| line.iter().map(move |b| a * b)).collect()
}

/// The first of the greatest, as `np.argmax` has it.
fn greatest(values: &[f64]) -> usize {
    (0..values.len()).fold(0, |best, i| if values[i] > values[best] { i } else { best })
}

fn change(r: f64) -> f64 {
    r.max(1.0 / r)
}

/// The side of a target with half of its context.
fn padded(w: f64, h: f64) -> f64 {
    let pad = (w + h) * 0.5;
    ((w + pad) * (h + pad)).sqrt()
}

/// Where a square of `side` pixels about `c` begins (`get_subwindow`).
fn begin(c: f64, side: f64, p: &Numbers) -> i64 {
    let v = c - (side + 1.0) / 2.0;
    let rounded = match p.round {
        Round::Floor => (v + 0.5).floor(),
        Round::Python2 => v.round(),
        Round::Python3 => v.round_ties_even(),
    };
    rounded as i64
}

/// How it is rounded where a window begins.
#[derive(Clone, Copy)]
pub enum Round {
    /// `np.floor(v + 0.5)`.
    Floor,
    /// `round` of Python 2, and of Python 3.
    Python2,
    Python3,
}

/// Numbers of a tracker of SiamRPN's family, or of LightTrack.
#[derive(Clone, Copy)]
pub struct Numbers {
    pub exemplar: usize,
    pub instance: usize,
    pub stride: f64,
    pub points: usize,
    pub penalty: f64,
    pub window: f64,
    pub rate: f64,
    pub input: Input,
    pub round: Round,
}

/// What all of that family do alike: the template's image.
pub fn exemplar(net: &mut Opened, picture: &Picture, at: Target, p: &Numbers) -> [f64; 3] {
    let fill = means(picture);
    let context = 0.5 * (at.width + at.height);
    let side = ((at.width + context) * (at.height + context)).sqrt().round_ties_even();
    let window = (begin(at.x, side, p), begin(at.y, side, p), side as i64);
    net.learn(&cut(picture, window, p.exemplar, fill, p.input));
    fill
}

/// The search image, and how many of its pixels there are to one of the picture.
fn instance(picture: &Picture, at: Target, p: &Numbers, fill: [f64; 3]) -> (Vec<f32>, f64) {
    let context = 0.5 * (at.width + at.height);
    let z = ((at.width + context) * (at.height + context)).sqrt();
    let scale = p.exemplar as f64 / z;
    let side = (z + 2.0 * ((p.instance - p.exemplar) as f64 / 2.0) / scale).round_ties_even();
    let window = (begin(at.x, side, p), begin(at.y, side, p), side as i64);
    (cut(picture, window, p.instance, fill, p.input), scale)
}

fn kept(picture: &Picture, target: Target) -> Target {
    let (width, height) = (picture.width as f64, picture.height as f64);
    Target {
        x: target.x.min(width).max(0.0),
        y: target.y.min(height).max(0.0),
        width: target.width.min(width).max(10.0),
        height: target.height.min(height).max(10.0),
    }
}

/// A step of SiamRPN, DaSiamRPN or SiamRPN++: anchors of heights by widths `ratios`, eight strides large. With the target the row and the
/// column of the point that has found it.
pub fn proposals(
    net: &mut Opened,
    picture: &Picture,
    at: Target,
    fill: [f64; 3],
    p: &Numbers,
    ratios: &[f64],
) -> (Target, (usize, usize)) {
    let (image, scale) = instance(picture, at, p, fill);
    let answer = net.ask(&image, &["scores", "boxes"]);
    let (scores, deltas) = (&answer[0], &answer[1]);
    let (n, kinds) = (p.points, ratios.len());
    let all = kinds * n * n;
    let hann = outer(&hanning(n));
    let first = -((n / 2) as f64) * p.stride;
    let (mut boxes, mut ranks, mut weights) = (Vec::new(), Vec::new(), Vec::new());
    for k in 0..all {
        let (kind, row, column) = (k / (n * n), k / n % n, k % n);
        let wide = (p.stride * p.stride / ratios[kind]).sqrt().floor();
        let (anchor_w, anchor_h) = (wide * 8.0, (wide * ratios[kind]).floor() * 8.0);
        let x = deltas[k] * anchor_w + first + p.stride * column as f64;
        let y = deltas[all + k] * anchor_h + first + p.stride * row as f64;
        let (w, h) = (deltas[2 * all + k].exp() * anchor_w, deltas[3 * all + k].exp() * anchor_h);
        let (other, this) = (scores[k].exp(), scores[all + k].exp());
        let score = this / (other + this);
        let grown = change(padded(w, h) / padded(at.width * scale, at.height * scale));
        let bent = change((at.width / at.height) / (w / h));
        let penalty = (-(bent * grown - 1.0) * p.penalty).exp();
        ranks.push(penalty * score * (1.0 - p.window) + hann[k % (n * n)] * p.window);
        weights.push(penalty * score * p.rate);
        boxes.push([x / scale, y / scale, w / scale, h / scale]);
    }
    let best = greatest(&ranks);
    let ([x, y, w, h], lr) = (boxes[best], weights[best]);
    let target = Target {
        x: x + at.x,
        y: y + at.y,
        width: at.width * (1.0 - lr) + w * lr,
        height: at.height * (1.0 - lr) + h * lr,
    };
    (kept(picture, target), (best / n % n, best % n))
}

/// A step of LightTrack. The size is smoothed twice.
pub fn lighttrack(net: &mut Opened, picture: &Picture, at: Target, fill: [f64; 3], p: &Numbers) -> Target {
    let (image, scale) = instance(picture, at, p, fill);
    let answer = net.ask(&image, &["score", "edges"]);
    let (n, count) = (p.points, p.points * p.points);
    let hann = outer(&hanning(n));
    let middle = (p.instance / 2) as f64;
    let (wide, high) = (at.width * scale, at.height * scale);
    let (mut boxes, mut ranks, mut weights) = (Vec::new(), Vec::new(), Vec::new());
    for k in 0..count {
        let grid = |i: usize| (i as f64 - (n / 2) as f64) * p.stride + middle;
        let (gx, gy) = (grid(k % n), grid(k / n));
        let edge = |plane: usize| answer[1][plane * count + k];
        let (x1, y1, x2, y2) = (gx - edge(0), gy - edge(1), gx + edge(2), gy + edge(3));
        let score = 1.0 / (1.0 + (-answer[0][k]).exp());
        let grown = change(padded(x2 - x1, y2 - y1) / padded(wide, high));
        let bent = change((wide / high) / ((x2 - x1) / (y2 - y1)));
        let penalty = (-(bent * grown - 1.0) * p.penalty).exp();
        ranks.push(penalty * score * (1.0 - p.window) + hann[k] * p.window);
        weights.push(penalty * score * p.rate);
        boxes.push([x1, y1, x2, y2]);
    }
    let best = greatest(&ranks);
    let ([x1, y1, x2, y2], lr) = (boxes[best], weights[best]);
    let once = |new: f64, old: f64| new / scale * lr + (1.0 - lr) * old;
    let (w, h) = (once(x2 - x1, at.width), once(y2 - y1, at.height));
    let target = Target {
        x: at.x + ((x1 + x2) / 2.0 - middle) / scale,
        y: at.y + ((y1 + y2) / 2.0 - middle) / scale,
        width: at.width * (1.0 - lr) + lr * w,
        height: at.height * (1.0 - lr) + lr * h,
    };
    kept(picture, target)
}

/// SiamFC's sides of template and search windows, which are kept from frame to frame.
pub fn siamfc_sides(at: Target) -> (f64, f64) {
    let context = 0.5 * (at.width + at.height);
    let z = ((at.width + context) * (at.height + context)).sqrt();
    (z, z * 255.0 / 127.0)
}

/// SiamFC's window about a middle, `side` large, to `samples`: its corner is rounded. Middles count from the middle of the first pixel.
fn siamfc_window(picture: &Picture, (x, y): (f64, f64), side: f64, samples: usize, fill: [f64; 3]) -> Vec<f32> {
    let side = side.round_ties_even();
    let corner = |c: f64| (c - (side - 1.0) / 2.0).round_ties_even() as i64;
    cut(picture, (corner(x), corner(y), side as i64), samples, fill, Input::Rgb)
}

pub fn siamfc_exemplar(net: &mut Opened, picture: &Picture, at: Target) -> [f64; 3] {
    // `copyMakeBorder` rounds to the nearest.
    let fill = means(picture).map(f64::round_ties_even);
    net.learn(&siamfc_window(picture, (at.x - 0.5, at.y - 0.5), siamfc_sides(at).0, 127, fill));
    fill
}

/// A step of SiamFC: three scales, responses enlarged sixteen times by cubic convolution.
pub fn siamfc(net: &mut Opened, picture: &Picture, at: Target, fill: [f64; 3]) -> Target {
    let (scales, large, window) = ([1.0375f64.powi(-1), 1.0, 1.0375], 272usize, 0.176);
    let (x, y) = (at.x - 0.5, at.y - 0.5);
    let side = siamfc_sides(at).1;
    let mut responses: Vec<Vec<f64>> = Vec::new();
    for (i, factor) in scales.into_iter().enumerate() {
        let small = net.ask(&siamfc_window(picture, (x, y), side * factor, 255, fill), &["response"]).remove(0);
        let penalty = if i == 1 { 1.0 } else { 0.9745 };
        responses.push(enlarged(&small, 17, 16).into_iter().map(|v| v * penalty).collect());
    }
    let tops: Vec<f64> = responses.iter().map(|r| r.iter().copied().fold(f64::MIN, f64::max)).collect();
    let scale = greatest(&tops);
    let mut response = responses.swap_remove(scale);
    let least = response.iter().copied().fold(f64::MAX, f64::min);
    response.iter_mut().for_each(|v| *v -= least);
    let sum: f64 = response.iter().sum();
    let hann = outer(&hanning(large));
    let whole: f64 = hann.iter().sum();
    let ranks: Vec<f64> =
        response.iter().zip(&hann).map(|(v, h)| (1.0 - window) * v / (sum + 1e-16) + window * h / whole).collect();
    let best = greatest(&ranks);
    let moved = |i: usize| (i as f64 - (large as f64 - 1.0) / 2.0) * 8.0 / 16.0 * side * scales[scale] / 255.0;
    let growth = (1.0 - 0.59) + 0.59 * scales[scale];
    Target {
        x: at.x + moved(best % large),
        y: at.y + moved(best / large),
        width: at.width * growth,
        height: at.height * growth,
    }
}

/// `cv2.resize` with cubic convolution, `times` as large.
fn enlarged(small: &[f64], side: usize, times: usize) -> Vec<f64> {
    let kernel = |d: f64| {
        let (a, d) = (-0.75, d.abs());
        if d <= 1.0 {
            (a + 2.0) * d * d * d - (a + 3.0) * d * d + 1.0
        } else if d < 2.0 {
            a * d * d * d - 5.0 * a * d * d + 8.0 * a * d - 4.0 * a
        } else {
            0.0
        }
    };
    let large = side * times;
    let place = |i: usize| (i as f64 + 0.5) / times as f64 - 0.5;
    let mut out = Vec::with_capacity(large * large);
    for i in 0..large * large {
        let (x, y) = (place(i % large), place(i / large));
        let mut sum = 0.0;
        for dv in -1..3 {
            for du in -1..3 {
                let (u, v) = (x.floor() as i64 + du, y.floor() as i64 + dv);
                let at = |k: i64| k.clamp(0, side as i64 - 1) as usize;
                sum += kernel(x - u as f64) * kernel(y - v as f64) * small[at(v) * side + at(u)];
            }
        }
        out.push(sum);
    }
    out
}

/// OSTrack's window: its side rounded up, its corner rounded. Left, top and side.
fn ostrack_window(at: Target, factor: f64) -> (i64, i64, i64) {
    let side = ((at.width * at.height).sqrt() * factor).ceil();
    let corner = |c: f64| (c - side * 0.5).round_ties_even() as i64;
    (corner(at.x), corner(at.y), side as i64)
}

pub fn ostrack_exemplar(net: &mut Opened, picture: &Picture, at: Target) {
    net.learn(&cut(picture, ostrack_window(at, 2.0), 128, [0.0; 3], Input::ImageNet));
}

/// A step of OSTrack, with the middle of the window that it took for the target's: published is the target's own, `exact` is that of the
/// window's pixels.
pub fn ostrack(net: &mut Opened, picture: &Picture, at: Target, exact: bool) -> Target {
    let (left, top, side) = ostrack_window(at, 4.0);
    let image = cut(picture, (left, top, side), 256, [0.0; 3], Input::ImageNet);
    let answer = net.ask(&image, &["score", "size", "offset"]);
    // `hann2d(…, centered=True)`: nought lies beyond the first and the last point.
    let line: Vec<f64> = (1..17).map(|i| 0.5 * (1.0 - (2.0 * PI / 17.0 * f64::from(i)).cos())).collect();
    let ranks: Vec<f64> = answer[0].iter().zip(outer(&line)).map(|(score, hann)| score * hann).collect();
    let best = greatest(&ranks);
    let (row, column) = ((best / 16) as f64, (best % 16) as f64);
    let (size, offset) = (&answer[1], &answer[2]);
    let factor = 256.0 / side as f64;
    let frame = |fraction: f64| fraction * 256.0 / factor;
    let (x, y) = (frame((column + offset[best]) / 16.0), frame((row + offset[256 + best]) / 16.0));
    let (w, h) = (frame(size[best]), frame(size[256 + best]));
    let half = 0.5 * 256.0 / factor;
    let before = if exact { (left as f64 + side as f64 / 2.0, top as f64 + side as f64 / 2.0) } else { (at.x, at.y) };
    let (x, y) = (x + before.0 - half, y + before.1 - half);
    // `clip_box` with a margin of 10.
    let clip = |first: f64, length: f64, most: f64| {
        let last = (first + length).max(10.0).min(most);
        let first = first.max(0.0).min(most - 10.0);
        (first, (last - first).max(10.0))
    };
    let (left, width) = clip(x - 0.5 * w, w, picture.width as f64);
    let (top, height) = clip(y - 0.5 * h, h, picture.height as f64);
    Target { x: left + width / 2.0, y: top + height / 2.0, width, height }
}
