//! Networks of the published architectures in narrow, with drawn weights: layers, strides, paddings and correlations are those of the
//! papers, so that images and answers have their sides; planes are fewer.

use crate::file::{Attribute, File, Layer};

/// Planes of the features.
const PLANES: usize = 16;
/// Anchors of the proposal networks.
const ANCHORS: usize = 5;

/// The files of a network.
pub struct Files {
    pub template: Option<Vec<u8>>,
    pub search: Vec<u8>,
    pub head: Option<Vec<u8>>,
    pub refine: Option<Vec<u8>>,
}

/// Grey levels to about one deviation.
fn image(file: &mut File, name: &str, side: usize, raw: bool) -> String {
    let image = file.input(name, &[1, 3, side, side]);
    if raw { file.line(&image, 1.0 / 50.0, -2.5) } else { image }
}

/// AlexNet as bertinetto2016, table 1, has it: stride 8, nothing padded.
fn alexnet(file: &mut File, image: &str) -> String {
    let first = file.convolution(image, Layer { stride: 2, ..Layer::new(3, PLANES, 11) });
    let first = file.relu(&first);
    let pooled = file.pool(&first, 0);
    let second = file.convolution(&pooled, Layer { groups: 2, ..Layer::new(PLANES, 2 * PLANES, 5) });
    let second = file.relu(&second);
    let pooled = file.pool(&second, 0);
    let third = file.convolution(&pooled, Layer::new(2 * PLANES, 2 * PLANES, 3));
    let third = file.relu(&third);
    let fourth = file.convolution(&third, Layer { groups: 2, ..Layer::new(2 * PLANES, 2 * PLANES, 3) });
    let fourth = file.relu(&fourth);
    file.convolution(&fourth, Layer { groups: 2, ..Layer::new(2 * PLANES, PLANES, 3) })
}

/// SiamFC: the template's features are the one filter (bertinetto2016, eq. 2).
pub fn siamfc() -> Files {
    let mut template = File::new(1);
    let z = image(&mut template, "template", 127, true);
    let z = alexnet(&mut template, &z);
    template.output("features", &z, &[1, PLANES, 6, 6]);
    let mut search = File::new(1);
    let x = image(&mut search, "search", 255, true);
    let x = alexnet(&mut search, &x);
    let z = search.input("features", &[1, PLANES, 6, 6]);
    let response = search.correlation(&x, &z, Layer::new(PLANES, 1, 6));
    let response = search.line(&response, 0.02, 1.0);
    search.output("response", &response, &[1, 1, 17, 17]);
    Files { template: Some(template.finish()), search: search.finish(), head: None, refine: None }
}

/// Up-channel correlation (li2018siamrpn, section 3.2): a convolution makes of the template's features a filter for every plane of the
/// answer.
fn up_channel(file: &mut File, x: &str, z: &str, planes: usize, gain: f64) -> String {
    let (inner, z_side) = (PLANES / 2, 4);
    let filters = file.convolution(z, Layer::new(PLANES, planes * inner, 3));
    let filters = file.reshape(&filters, &[planes as i64, inner as i64, z_side, z_side]);
    let x = file.convolution(x, Layer::new(PLANES, inner, 3));
    let answer = file.correlation(&x, &filters, Layer::new(inner, planes, z_side as usize));
    file.line(&answer, gain as f32, 0.0)
}

/// SiamRPN as DaSiamRPN runs it: a search image of 271 pixels, 19 points a side.
pub fn dasiamrpn() -> Files {
    let mut template = File::new(2);
    let z = image(&mut template, "template", 127, true);
    let z = alexnet(&mut template, &z);
    template.output("features", &z, &[1, PLANES, 6, 6]);
    let mut search = File::new(2);
    let x = image(&mut search, "search", 271, true);
    let x = alexnet(&mut search, &x);
    let z = search.input("features", &[1, PLANES, 6, 6]);
    let scores = up_channel(&mut search, &x, &z, 2 * ANCHORS, 0.3);
    let boxes = up_channel(&mut search, &x, &z, 4 * ANCHORS, 0.005);
    let boxes = search.convolution(&boxes, Layer { gain: 1.0, ..Layer::new(4 * ANCHORS, 4 * ANCHORS, 1) });
    search.output("boxes", &boxes, &[1, 4 * ANCHORS, 19, 19]);
    search.output("scores", &scores, &[1, 2 * ANCHORS, 19, 19]);
    Files { template: Some(template.finish()), search: search.finish(), head: None, refine: None }
}

/// A residual network of stride 8 as li2019 changes it: no padding where it shrinks, dilated afterwards.
fn resnet(file: &mut File, image: &str) -> String {
    let [.., last] = stages(file, image);
    last
}

/// The same with what lies before: of every second pixel, of every fourth and of every eighth, and the features.
fn stages(file: &mut File, image: &str) -> [String; 4] {
    let first = file.convolution(image, Layer { stride: 2, ..Layer::new(3, PLANES, 7) });
    let first = file.relu(&first);
    let pooled = file.pool(&first, 1);
    let second = file.convolution(&pooled, Layer { stride: 2, ..Layer::new(PLANES, 2 * PLANES, 3) });
    let second = file.relu(&second);
    let dilated = Layer { pad: 2, dilation: 2, ..Layer::new(2 * PLANES, 2 * PLANES, 3) };
    let branch = file.convolution(&second, dilated);
    let branch = file.relu(&branch);
    let branch = file.convolution(&branch, Layer { gain: 0.7, ..dilated });
    let sum = file.node("Add", &[&second, &branch], &[]);
    let sum = file.relu(&sum);
    let features = file.convolution(&sum, Layer::new(2 * PLANES, PLANES, 1));
    [first, pooled, second, features]
}

/// Depthwise correlation (li2019, section 3.3): each plane of the template's features is the filter of one plane.
fn depthwise(file: &mut File, z: &str, x: &str, planes: usize, gain: f64) -> String {
    let alike = alike(file, z, x);
    answer(file, &alike, planes, gain)
}

/// What is correlated, and what is answered of it.
fn alike(file: &mut File, z: &str, x: &str) -> String {
    let z = file.convolution(z, Layer::new(PLANES, PLANES, 3));
    let x = file.convolution(x, Layer::new(PLANES, PLANES, 3));
    let filters = file.reshape(&z, &[PLANES as i64, 1, 5, 5]);
    let alike = file.correlation(&x, &filters, Layer { groups: PLANES, ..Layer::new(PLANES, PLANES, 5) });
    file.line(&alike, 0.1, 0.0)
}

fn answer(file: &mut File, alike: &str, planes: usize, gain: f64) -> String {
    let hidden = file.convolution(alike, Layer::new(PLANES, PLANES, 1));
    let hidden = file.relu(&hidden);
    file.convolution(&hidden, Layer { gain, ..Layer::new(PLANES, planes, 1) })
}

/// A template image to the middle 7 of 15 columns and rows of its features.
fn resnet_template(seed: u64) -> Vec<u8> {
    let mut template = File::new(seed);
    let z = image(&mut template, "template", 127, true);
    let z = resnet(&mut template, &z);
    let (from, to, axes) =
        (template.whole_numbers(&[4, 4]), template.whole_numbers(&[11, 11]), template.whole_numbers(&[2, 3]));
    let z = template.node("Slice", &[&z, &from, &to, &axes], &[]);
    template.output("features", &z, &[1, PLANES, 7, 7]);
    template.finish()
}

/// SiamMask (wang2019): SiamRPN++ of one depth with an answer more, which draws `side` times `side` places about each point.
pub fn siammask(side: usize) -> Files {
    let template = resnet_template(7);
    let mut search = File::new(7);
    let x = image(&mut search, "search", 255, true);
    let [.., x] = stages(&mut search, &x);
    let z = search.input("features", &[1, PLANES, 7, 7]);
    proposals(&mut search, &z, &x);
    let masks = depthwise(&mut search, &z, &x, side * side, 2.0);
    search.output("masks", &masks, &[1, side * side, 25, 25]);
    Files { template: Some(template), search: search.finish(), head: None, refine: None }
}

fn proposals(file: &mut File, z: &str, x: &str) {
    let scores = depthwise(file, z, x, 2 * ANCHORS, 1.5);
    let boxes = depthwise(file, z, x, 4 * ANCHORS, 0.03);
    file.output("scores", &scores, &[1, 2 * ANCHORS, 25, 25]);
    file.output("boxes", &boxes, &[1, 4 * ANCHORS, 25, 25]);
}

/// SiamMask whose mask is refined: what is correlated and the stages before it are shown to a network of its own, window by window.
pub fn siammask_refined() -> Files {
    let template = resnet_template(7);
    let mut search = File::new(7);
    let x = image(&mut search, "search", 255, true);
    let [half, quarter, eighth, x] = stages(&mut search, &x);
    let z = search.input("features", &[1, PLANES, 7, 7]);
    proposals(&mut search, &z, &x);
    let correlated = alike(&mut search, &z, &x);
    search.output("half", &half, &[1, PLANES, 125, 125]);
    search.output("quarter", &quarter, &[1, PLANES, 63, 63]);
    search.output("eighth", &eighth, &[1, 2 * PLANES, 31, 31]);
    search.output("correlated", &correlated, &[1, PLANES, 25, 25]);
    // From the roughest to the finest, each enlarged to the next.
    let mut refine = File::new(8);
    let drawn = refine.input("correlated", &[1, PLANES, 1, 1]);
    let mut drawn = refine.enlarged(&drawn, (PLANES, PLANES), 15, 15);
    for (name, planes, side, kernel) in
        [("eighth", 2 * PLANES, 15, 3), ("quarter", PLANES, 31, 1), ("half", PLANES, 61, 7)]
    {
        let part = refine.input(name, &[1, planes, side, side]);
        let part = refine.convolution(&part, Layer { pad: 1, ..Layer::new(planes, PLANES, 3) });
        let sum = refine.node("Add", &[&part, &drawn], &[]);
        drawn = refine.enlarged(&sum, (PLANES, PLANES), kernel, 2);
    }
    let drawn = refine.convolution(&drawn, Layer { pad: 1, gain: 3.0, ..Layer::new(PLANES, 1, 3) });
    let drawn = refine.reshape(&drawn, &[1, 127 * 127]);
    refine.output("mask", &drawn, &[1, 127 * 127]);
    Files { template: Some(template), search: search.finish(), head: None, refine: Some(refine.finish()) }
}

/// SiamRPN++ in three files: 25 points a side.
pub fn siamrpn_plus() -> Files {
    let template = resnet_template(3);
    let mut search = File::new(3);
    let x = image(&mut search, "search", 255, true);
    let x = resnet(&mut search, &x);
    search.output("features", &x, &[1, PLANES, 31, 31]);
    let mut head = File::new(4);
    let z = head.input("template", &[1, PLANES, 7, 7]);
    let x = head.input("search", &[1, PLANES, 31, 31]);
    let scores = depthwise(&mut head, &z, &x, 2 * ANCHORS, 1.5);
    let boxes = depthwise(&mut head, &z, &x, 4 * ANCHORS, 0.03);
    head.output("scores", &scores, &[1, 2 * ANCHORS, 25, 25]);
    head.output("boxes", &boxes, &[1, 4 * ANCHORS, 25, 25]);
    Files { template: Some(template), search: search.finish(), head: Some(head.finish()), refine: None }
}

/// Separable convolutions of stride 16.
fn separable(file: &mut File, image: &str) -> String {
    let mut x = file.convolution(image, Layer { stride: 2, pad: 1, ..Layer::new(3, PLANES, 3) });
    for (inputs, outputs) in [(PLANES, 24), (24, 32), (32, 32)] {
        let active = file.relu(&x);
        let spread = Layer { stride: 2, pad: 1, groups: inputs, ..Layer::new(inputs, inputs, 3) };
        let spread = file.convolution(&active, spread);
        x = file.convolution(&spread, Layer::new(inputs, outputs, 1));
    }
    x
}

/// LightTrack: pixel-wise correlation (yan2021, section 4.1: every pixel of the template's features is a filter), distances to the
/// edges as powers of e; a search image of 288 pixels, 18 points a side.
pub fn lighttrack() -> Files {
    let mut template = File::new(5);
    let z = image(&mut template, "template", 128, false);
    let z = separable(&mut template, &z);
    template.output("features", &z, &[1, 32, 8, 8]);
    let mut search = File::new(5);
    let x = image(&mut search, "search", 288, false);
    let x = separable(&mut search, &x);
    let z = search.input("features", &[1, 32, 8, 8]);
    let pixels = search.reshape(&z, &[32, 64]);
    let pixels = search.node("Transpose", &[&pixels], &[Attribute::Ints("perm", &[1, 0])]);
    let filters = search.reshape(&pixels, &[64, 32, 1, 1]);
    let alike = search.correlation(&x, &filters, Layer::new(32, 64, 1));
    let alike = search.line(&alike, 0.2, 0.0);
    let hidden = search.convolution(&alike, Layer::new(64, PLANES, 1));
    let hidden = search.relu(&hidden);
    let score = search.convolution(&hidden, Layer { pad: 1, gain: 2.0, ..Layer::new(PLANES, 1, 3) });
    search.output("score", &score, &[1, 1, 18, 18]);
    let edges = search.convolution(&hidden, Layer { pad: 1, gain: 0.15, ..Layer::new(PLANES, 4, 3) });
    let edges = search.line(&edges, 1.0, 3.5);
    let edges = search.node("Exp", &[&edges], &[]);
    search.output("edges", &edges, &[1, 4, 18, 18]);
    Files { template: Some(template.finish()), search: search.finish(), head: None, refine: None }
}

/// Patches of 16 pixels as tokens, with what says where they are.
fn tokens(file: &mut File, image: &str, filters: &str, count: usize) -> String {
    let patches = file.correlation(image, filters, Layer { stride: 16, ..Layer::new(3, 32, 16) });
    let patches = file.reshape(&patches, &[1, 32, count as i64]);
    let patches = file.node("Transpose", &[&patches], &[Attribute::Ints("perm", &[0, 2, 1])]);
    let places = file.drawn(&[1, count, 32], 0.3);
    file.node("Add", &[&patches, &places], &[])
}

/// A linear layer on tokens of 32 numbers.
fn linear(file: &mut File, tokens: &str, (inputs, outputs): (usize, usize), gain: f64) -> String {
    let weights = file.drawn(&[inputs, outputs], gain / (inputs as f64).sqrt());
    file.node("MatMul", &[tokens, &weights], &[])
}

fn normed(file: &mut File, tokens: &str) -> String {
    let scale = file.numbers(&[32], &[1.0; 32]);
    file.node("LayerNormalization", &[tokens, &scale], &[Attribute::Int("axis", -1)])
}

/// OSTrack: one transformer over the tokens of both images (ye2022, section 3.1), a head of scores, sizes and offsets.
pub fn ostrack() -> Files {
    let mut file = File::new(6);
    let z = image(&mut file, "template", 128, false);
    let x = image(&mut file, "search", 256, false);
    let filters = file.drawn(&[32, 3, 16, 16], 1.0 / (768f64).sqrt());
    let (z, x) = (tokens(&mut file, &z, &filters, 64), tokens(&mut file, &x, &filters, 256));
    let all = file.node("Concat", &[&z, &x], &[Attribute::Int("axis", 1)]);
    let known = normed(&mut file, &all);
    let [query, key, value] = [2.0, 2.0, 1.0].map(|gain| linear(&mut file, &known, (32, 32), gain));
    let key = file.node("Transpose", &[&key], &[Attribute::Ints("perm", &[0, 2, 1])]);
    let alike = file.node("MatMul", &[&query, &key], &[]);
    let alike = file.line(&alike, 1.0 / 32f32.sqrt(), 0.0);
    let alike = file.node("Softmax", &[&alike], &[Attribute::Int("axis", -1)]);
    let heeded = file.node("MatMul", &[&alike, &value], &[]);
    let all = file.node("Add", &[&all, &heeded], &[]);
    let known = normed(&mut file, &all);
    let hidden = linear(&mut file, &known, (32, 64), 1.4);
    let hidden = file.relu(&hidden);
    let hidden = linear(&mut file, &hidden, (64, 32), 1.0);
    let all = file.node("Add", &[&all, &hidden], &[]);
    let (from, to, axes) = (file.whole_numbers(&[64]), file.whole_numbers(&[320]), file.whole_numbers(&[1]));
    let x = file.node("Slice", &[&all, &from, &to, &axes], &[]);
    let x = file.node("Transpose", &[&x], &[Attribute::Ints("perm", &[0, 2, 1])]);
    let x = file.reshape(&x, &[1, 32, 16, 16]);
    for (name, planes, gain, constant) in [("score", 1, 1.0, 0.0), ("size", 2, 0.1, -1.1), ("offset", 2, 2.0, 0.0)] {
        let hidden = file.convolution(&x, Layer { pad: 1, ..Layer::new(32, PLANES, 3) });
        let hidden = file.relu(&hidden);
        let answer = file.convolution(&hidden, Layer { gain, ..Layer::new(PLANES, planes, 1) });
        let answer = file.line(&answer, 1.0, constant);
        let answer = file.node("Sigmoid", &[&answer], &[]);
        file.output(name, &answer, &[1, planes, 16, 16]);
    }
    Files { template: None, search: file.finish(), head: None, refine: None }
}
