//! Whole networks of the published architectures with drawn weights, run from pixels to boxes by this crate and by the arithmetic of the
//! projects that published them, written again in `twin`: both must follow the same boxes.
#![cfg(feature = "rten")]
#![allow(clippy::unwrap_used, reason = "a test may panic")]
#![allow(
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    clippy::cast_precision_loss,
    clippy::cast_sign_loss,
    reason = "what is cast here is small"
)]

mod file;
mod networks;
mod siammask;
mod twin;

use networks::Files;
use pursuit_geometry::{BBox, Point};
use pursuit_imaging::{Frame, Image};
use pursuit_inference::onnx::{Backend, OnnxOptions, OnnxSiamese, open};
use pursuit_inference::siamese::{SiameseDescription, SiameseTracker};
use std::path::Path;
use twin::{Input, Numbers, Opened, Picture, Round, Target};

/// Heights by widths of the anchors of SiamRPN and its successors.
const RATIOS: [f64; 5] = [0.33, 0.5, 1.0, 2.0, 3.0];
const FRAMES: usize = 6;

/// Stripes and blobs in which a target of its own pattern moves and grows.
fn picture(time: usize) -> Picture {
    let (width, height, t) = (320usize, 240usize, time as f64);
    let (x0, y0, growth) = (150.0 + 5.0 * t, 120.0 - 3.0 * t, 1.03f64.powf(t));
    let pixel = |i: usize| {
        let (x, y) = ((i % width) as f64, (i / width) as f64);
        let wave = |a: f64, b: f64, c: f64| (128.0 + 100.0 * (a * x + b * y + c).sin() * (b * x - a * y).cos()) as u8;
        let (u, v) = ((x - x0) / growth, (y - y0) / growth);
        if u.abs() < 23.0 && v.abs() < 18.0 {
            let check = ((u / 6.0).floor() + (v / 9.0).floor()).rem_euclid(2.0);
            [(220.0 * check) as u8 + 20, (128.0 + 4.0 * u) as u8, (128.0 + 6.0 * v) as u8]
        } else {
            [wave(0.05, 0.02, 0.0), wave(0.03, -0.07, 1.0), wave(0.11, 0.04, 2.0)]
        }
    };
    Picture { width, height, pixels: (0..width * height).map(pixel).collect() }
}

/// The target in the first picture: its template of 83 pixels begins midway between two, across for those that cut about its middle, down for
/// SiamFC, which cuts half a pixel beside.
fn start() -> Target {
    Target { x: 150.5, y: 118.0, width: 46.5, height: 36.5 }
}

fn options() -> OnnxOptions {
    OnnxOptions { backend: Backend::Rten, ..OnnxOptions::default() }
}

/// Writes a network and the TOML file that describes it.
fn write(folder: &Path, files: &Files, config: &str) {
    let mut description = String::new();
    let all = [
        ("template", files.template.as_ref()),
        ("search", Some(&files.search)),
        ("head", files.head.as_ref()),
        ("refine", files.refine.as_ref()),
    ];
    for (name, bytes) in all {
        let Some(bytes) = bytes else { continue };
        std::fs::write(folder.join(format!("{name}.onnx")), bytes).unwrap();
        description += &format!("{name} = '{name}.onnx'\n");
    }
    std::fs::write(folder.join("network.toml"), format!("{description}[config]\n{config}")).unwrap();
}

fn opened(folder: &Path, files: &Files) -> Opened {
    let network = |name: &str| open(&folder.join(format!("{name}.onnx")), &options()).unwrap();
    Opened {
        template: files.template.as_ref().map(|_| network("template")),
        search: network("search"),
        head: files.head.as_ref().map(|_| network("head")),
        kept: Vec::new(),
    }
}

fn frame(time: usize) -> Frame {
    let picture = picture(time);
    let pixel = |x: usize, y: usize| picture.pixels[y * picture.width + x];
    Frame::new(time as u64, 0.0, Image::from_fn(picture.width, picture.height, pixel).unwrap())
}

/// This crate's tracker by the files there, started on the target.
fn tracker(folder: &Path) -> SiameseTracker<OnnxSiamese> {
    let description = SiameseDescription::read(&folder.join("network.toml")).unwrap();
    let network = description.open(&options()).unwrap();
    let at = start();
    let bbox = BBox::from_center_size(Point::new(at.x, at.y), at.width, at.height);
    SiameseTracker::new(network, description.config, &frame(0), bbox).unwrap()
}

/// The boxes by this crate, each from the one before; the first search is about `first`.
fn ours(folder: &Path, first: Target) -> Vec<Target> {
    let mut tracker = tracker(folder);
    let mut at = first;
    (1..=FRAMES)
        .map(|time| {
            let size = (at.width, at.height);
            let found = tracker.locate(&frame(time), Point::new(at.x, at.y), size).unwrap().unwrap().bbox;
            let center = found.center();
            at = Target { x: center.x, y: center.y, width: found.width(), height: found.height() };
            at
        })
        .collect()
}

/// The same by the twin.
fn published(mut step: impl FnMut(&Picture, Target) -> Target, first: Target) -> Vec<Target> {
    let mut at = first;
    (1..=FRAMES)
        .map(|time| {
            at = step(&picture(time), at);
            at
        })
        .collect()
}

/// The largest difference of a coordinate or a side, in pixels.
fn apart(a: &[Target], b: &[Target]) -> f64 {
    assert_eq!((a.len(), b.len()), (FRAMES, FRAMES));
    let of = |(a, b): (&Target, &Target)| {
        [a.x - b.x, a.y - b.y, a.width - b.width, a.height - b.height].into_iter().fold(0.0, |m: f64, d| m.max(d.abs()))
    };
    a.iter().zip(b).map(of).fold(0.0, f64::max)
}

/// Boxes that stay where they are, or keep their size, would prove nothing.
fn assert_lively(boxes: &[Target], name: &str) {
    let first = start();
    let far = boxes.iter().map(|b| (b.x - first.x).hypot(b.y - first.y)).fold(0.0, f64::max);
    let grown = boxes.iter().map(|b| (b.width / first.width).ln().abs()).fold(0.0, f64::max);
    println!("{name}: up to {far:.1} px away, size by up to {:.1} %", 100.0 * grown.exp() - 100.0);
    assert!(far > 3.0 && grown > 0.01, "{name}: {far} px, {grown}: {boxes:?}");
}

/// Our boxes are the published ones; and they are not where any one number of the description is another.
fn assert_alike(
    name: &str,
    files: &Files,
    config: &str,
    changes: &[(&str, &str)],
    first: Target,
    published: impl FnOnce(&mut Opened) -> Vec<Target>,
) {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), files, config);
    let want = published(&mut opened(folder.path(), files));
    let got = ours(folder.path(), first);
    let off = apart(&got, &want);
    println!("{name}: {off:.2e} px apart over {FRAMES} frames");
    assert_lively(&want, name);
    assert!(off < 1e-3, "{name}: {off} px\n{got:?}\n{want:?}");
    for (from, to) in changes {
        assert!(config.contains(from), "{name}: {from}");
        write(folder.path(), files, &config.replace(from, to));
        let off = apart(&ours(folder.path(), first), &want);
        assert!(off > 0.01, "{name}: {to} makes no difference ({off} px)");
    }
}

const DASIAMRPN: &str = "template_side_px = 127\nsearch_side_px = 271\nanswer_side = 19\nstride_px = 8.0\nchannels = 'bgr'\n\
    scores = 'softmax'\ncontext = 0.5\nwindow = 0.42\npenalty = 0.055\nrate = 0.295\n\
    answer = { anchors = { ratios = [0.33, 0.5, 1.0, 2.0, 3.0], scales = [8.0] } }\nties = 'away'\n";

#[test]
fn dasiamrpn_follows_the_published_boxes() {
    let p = Numbers {
        exemplar: 127,
        instance: 271,
        stride: 8.0,
        points: 19,
        penalty: 0.055,
        window: 0.42,
        rate: 0.295,
        input: Input::Bgr,
        round: Round::Python2,
    };
    let changes = [
        ("window = 0.42", "window = 0.2"),
        ("penalty = 0.055", "penalty = 0.5"),
        ("rate = 0.295", "rate = 0.4"),
        ("context = 0.5", "context = 0.4"),
        ("'bgr'", "'rgb'"),
        ("scales = [8.0]", "scales = [7.0]"),
        ("'away'", "'even'"),
    ];
    assert_alike("DaSiamRPN", &networks::dasiamrpn(), DASIAMRPN, &changes, start(), |net| {
        let fill = twin::exemplar(net, &picture(0), start(), &p);
        published(|picture, at| twin::proposals(net, picture, at, fill, &p, &RATIOS).0, start())
    });
}

const SIAMRPN_PLUS: &str = "template_side_px = 127\nsearch_side_px = 255\nanswer_side = 25\nstride_px = 8.0\nchannels = 'bgr'\n\
    scores = 'softmax'\ncontext = 0.5\nwindow = 0.42\npenalty = 0.05\nrate = 0.38\ntemplate_shift_px = -0.5\n\
    answer = { anchors = { ratios = [0.33, 0.5, 1.0, 2.0, 3.0], scales = [8.0] } }\n";

#[test]
fn siamrpn_plus_follows_the_published_boxes() {
    let p = Numbers {
        exemplar: 127,
        instance: 255,
        stride: 8.0,
        points: 25,
        penalty: 0.05,
        window: 0.42,
        rate: 0.38,
        input: Input::Bgr,
        round: Round::Floor,
    };
    // PySOT takes x + (w - 1) / 2 of the first box for its middle, to cut the template and to search the first time.
    let first = Target { x: start().x - 0.5, y: start().y - 0.5, ..start() };
    let changes = [
        ("window = 0.42", "window = 0.2"),
        ("penalty = 0.05", "penalty = 0.5"),
        ("rate = 0.38", "rate = 0.2"),
        ("template_shift_px = -0.5", "template_shift_px = 1.0"),
        ("stride_px = 8.0", "stride_px = 8.5"),
    ];
    assert_alike("SiamRPN++", &networks::siamrpn_plus(), SIAMRPN_PLUS, &changes, first, |net| {
        let fill = twin::exemplar(net, &picture(0), first, &p);
        published(|picture, at| twin::proposals(net, picture, at, fill, &p, &RATIOS).0, first)
    });
}

const LIGHTTRACK: &str = "template_side_px = 128\nsearch_side_px = 288\nanswer_side = 18\nstride_px = 16.0\nchannels = 'rgb'\n\
    mean = [123.675, 116.28, 103.53]\ndeviation = [58.395, 57.12, 57.375]\nscores = 'sigmoid'\ncontext = 0.5\nwindow = 0.38\n\
    penalty = 0.062\nrate = 0.765\nboxes = 'smoothed-twice'\nties = 'even'\n";

#[test]
fn lighttrack_follows_the_published_boxes() {
    let p = Numbers {
        exemplar: 128,
        instance: 288,
        stride: 16.0,
        points: 18,
        penalty: 0.062,
        window: 0.38,
        rate: 0.765,
        input: Input::ImageNet,
        round: Round::Python3,
    };
    let changes = [
        ("window = 0.38", "window = 0.1"),
        ("penalty = 0.062", "penalty = 0.5"),
        ("rate = 0.765", "rate = 0.6"),
        ("'smoothed-twice'", "'smoothed'"),
        ("58.395", "64.0"),
        ("'even'", "'up'"),
    ];
    assert_alike("LightTrack", &networks::lighttrack(), LIGHTTRACK, &changes, start(), |net| {
        let fill = twin::exemplar(net, &picture(0), start(), &p);
        published(|picture, at| twin::lighttrack(net, picture, at, fill, &p), start())
    });
}

const SIAMFC: &str = "template_side_px = 127\nsearch_side_px = 255\nanswer_side = 17\nstride_px = 8.0\nchannels = 'rgb'\n\
    scores = 'sigmoid'\ncontext = 0.5\nwindow = 0.176\npenalty = 0.68882\nrate = 0.59\ntemplate_shift_px = 0.5\nsearch_shift_px = 0.5\n\
    answer = { scores = { step = 1.0375, scales = 3, enlarged = 16 } }\nties = 'even'\nfill = 'nearest-mean'\n";

#[test]
fn siamfc_follows_the_published_boxes() {
    let changes = [
        ("window = 0.176", "window = 0.9"),
        ("rate = 0.59", "rate = 0.4"),
        ("step = 1.0375", "step = 1.05"),
        ("enlarged = 16", "enlarged = 8"),
        ("\nsearch_shift_px = 0.5", "\nsearch_shift_px = -0.5"),
        ("'even'", "'up'"),
    ];
    assert_alike("SiamFC", &networks::siamfc(), SIAMFC, &changes, start(), |net| {
        let fill = twin::siamfc_exemplar(net, &picture(0), start());
        published(|picture, at| twin::siamfc(net, picture, at, fill), start())
    });
}

const OSTRACK: &str = "template_side_px = 128\nsearch_side_px = 256\nanswer_side = 16\nstride_px = 16.0\nchannels = 'rgb'\n\
    mean = [123.675, 116.28, 103.53]\ndeviation = [58.395, 57.12, 57.375]\nscores = 'probability'\ncontext = 0.0\nextent = 2.0\n\
    window = 1.0\npenalty = 0.0\nrate = 1.0\ncrop = 'rounded'\nfill = 'black'\nwindow_use = 'multiplied'\nboxes = 'clipped'\n\
    min_side_px = 10.0\nanswer = 'centres'\n";

#[test]
fn ostrack_follows_the_published_boxes_from_where_its_windows_lie() {
    let files = networks::ostrack();
    let changes = [
        ("window = 1.0", "window = 0.0"),
        ("extent = 2.0", "extent = 2.1"),
        ("'rounded'", "'square'"),
        ("rate = 1.0", "rate = 0.8"),
    ];
    assert_alike("OSTrack", &files, OSTRACK, &changes, start(), |net| {
        twin::ostrack_exemplar(net, &picture(0), start());
        published(|picture, at| twin::ostrack(net, picture, at, true), start())
    });
    // The project takes the target's middle for that of a window whose corner was rounded: its boxes are off by what was rounded, which
    // is half a pixel at most in a frame.
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), &files, OSTRACK);
    let mut net = opened(folder.path(), &files);
    twin::ostrack_exemplar(&mut net, &picture(0), start());
    let mut at = start();
    let mut most: f64 = 0.0;
    for time in 1..=FRAMES {
        let exact = twin::ostrack(&mut net, &picture(time), at, true);
        let theirs = twin::ostrack(&mut net, &picture(time), at, false);
        most = most.max((exact.x - theirs.x).abs()).max((exact.y - theirs.y).abs());
        at = exact;
    }
    println!("OSTrack: its middles are up to {most:.3} px off");
    assert!(most > 0.01 && most <= 0.5 + 1e-9, "{most}");
}
