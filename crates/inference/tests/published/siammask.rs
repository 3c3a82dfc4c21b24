//! SiamMask: its masks, refined and not, put into the frame as the project does it. Sources, for the facts alone: PySOT
//! `siammask_tracker.py` and `head/mask.py` (2172c96), SiamMask `tools/test.py` (564c9bf).

use crate::twin::{self, Input, Numbers, Opened, Picture, Round, Target};
use crate::{FRAMES, RATIOS, frame, networks, opened, options, picture, start, tracker, write};
use pursuit_geometry::{Point, Size};
use pursuit_inference::Network;
use pursuit_inference::onnx::open;
use std::path::Path;

const SIAMMASK: &str = "template_side_px = 127\nsearch_side_px = 255\nanswer_side = 25\nstride_px = 8.0\nchannels = 'bgr'\n\
    scores = 'softmax'\ncontext = 0.5\nwindow = 0.41\npenalty = 0.1\nrate = 0.32\ntemplate_shift_px = -0.5\n\
    answer = { anchors = { ratios = [0.33, 0.5, 1.0, 2.0, 3.0], scales = [8.0] } }\n";

const P: Numbers = Numbers {
    exemplar: 127,
    instance: 255,
    stride: 8.0,
    points: 25,
    penalty: 0.1,
    window: 0.41,
    rate: 0.32,
    input: Input::Bgr,
    round: Round::Floor,
};

/// The probabilities in the frame.
type Drawn = Vec<f64>;

/// `warpAffine` of the mask, bilinear and 0 beyond it, as `_crop_back` puts it about a point of the search at `at`.
fn in_frame(mask: &[f32], out_size: usize, (row, column): (usize, usize), at: Target, picture: &Picture) -> Drawn {
    let context = 0.5 * (at.width + at.height);
    let s_z = ((at.width + context) * (at.height + context)).sqrt();
    let s_x = (s_z * (255.0 / 127.0)).round_ties_even();
    let (base_size, s) = (8.0, s_x / 255.0);
    let sub_box = [
        at.x - s_x / 2.0 + (column as f64 - base_size / 2.0) * 8.0 * s,
        at.y - s_x / 2.0 + (row as f64 - base_size / 2.0) * 8.0 * s,
        s * 127.0,
    ];
    let s = out_size as f64 / sub_box[2];
    let (im_w, im_h) = (picture.width as f64, picture.height as f64);
    let back = [-sub_box[0] * s, -sub_box[1] * s, im_w * s, im_h * s];
    let (a, b) = ((im_w - 1.0) / back[2], (im_h - 1.0) / back[3]);
    let (c, d) = (-a * back[0], -b * back[1]);
    let at = |x: i64, y: i64| {
        let inside = |k: i64| (0..out_size as i64).contains(&k);
        if !(inside(x) && inside(y)) {
            return 0.0;
        }
        1.0 / (1.0 + (-f64::from(mask[y as usize * out_size + x as usize])).exp())
    };
    (0..picture.width * picture.height)
        .map(|k| {
            let (x, y) = (((k % picture.width) as f64 - c) / a, ((k / picture.width) as f64 - d) / b);
            let (x0, y0) = (x.floor(), y.floor());
            let (u, v) = (x - x0, y - y0);
            let (x0, y0) = (x0 as i64, y0 as i64);
            (1.0 - v) * ((1.0 - u) * at(x0, y0) + u * at(x0 + 1, y0))
                + v * ((1.0 - u) * at(x0, y0 + 1) + u * at(x0 + 1, y0 + 1))
        })
        .collect()
}

/// `F.pad` by `pad` at each side, then `side` rows and columns from `first` on.
fn cut(features: &[f32], map: usize, pad: usize, first: (usize, usize), side: usize) -> Vec<f32> {
    let planes = features.len() / (map * map);
    let mut out = Vec::new();
    for (plane, y, x) in (0..planes).flat_map(|p| (0..side * side).map(move |k| (p, k / side, k % side))) {
        let (y, x) = ((first.0 + y).checked_sub(pad), (first.1 + x).checked_sub(pad));
        let inside = |k: Option<usize>| k.filter(|&k| k < map);
        let value = inside(y).zip(inside(x)).map_or(0.0, |(y, x)| features[(plane * map + y) * map + x]);
        out.push(value);
    }
    out
}

/// The mask of the point that has answered last.
fn drawn(net: &Opened, refine: Option<&mut Box<dyn Network>>, (row, column): (usize, usize)) -> Vec<f32> {
    let output = |name: &str| {
        let at = net.search.outputs().iter().position(|p| p.name == name).unwrap();
        net.search.output(at)
    };
    let Some(refine) = refine else {
        return output("masks").chunks_exact(25 * 25).map(|plane| plane[row * 25 + column]).collect();
    };
    let parts = [
        ("half", cut(output("half"), 125, 16, (4 * row, 4 * column), 61)),
        ("quarter", cut(output("quarter"), 63, 8, (2 * row, 2 * column), 31)),
        ("eighth", cut(output("eighth"), 31, 4, (row, column), 15)),
        ("correlated", cut(output("correlated"), 25, 0, (row, column), 1)),
    ];
    for (name, values) in parts {
        let input = refine.inputs().iter().position(|p| p.name == name).unwrap();
        refine.set_input(input, &values).unwrap();
    }
    refine.run().unwrap();
    refine.output(0).to_vec()
}

/// Boxes and masks by the twin.
fn theirs(folder: &Path, files: &networks::Files, side: usize, first: Target) -> Vec<(Target, Drawn)> {
    let mut net = opened(folder, files);
    let mut refine = files.refine.as_ref().map(|_| open(&folder.join("refine.onnx"), &options()).unwrap());
    let fill = twin::exemplar(&mut net, &picture(0), first, &P);
    let mut at = first;
    (1..=FRAMES)
        .map(|time| {
            let picture = picture(time);
            let (target, point) = twin::proposals(&mut net, &picture, at, fill, &P, &RATIOS);
            let mask = in_frame(&drawn(&net, refine.as_mut(), point), side, point, at, &picture);
            at = target;
            (at, mask)
        })
        .collect()
}

/// In how many pixels our masks differ from these, which are the target's above `threshold`, over frames in which the boxes are theirs; but for
/// those on the edge, where rounding decides.
fn differing(folder: &Path, first: Target, theirs: &[(Target, Drawn)], threshold: f64) -> usize {
    let mut tracker = tracker(folder);
    let (mut at, mut off) = (first, 0);
    for (time, (target, drawn)) in (1..).zip(theirs) {
        let (frame, center, size) = (frame(time), Point::new(at.x, at.y), (at.width, at.height));
        let found = tracker.locate(&frame, center, size).unwrap().unwrap();
        let mask = tracker.mask(frame.size(), center, size, &found).unwrap().unwrap().in_frame(frame.size());
        assert_eq!(mask.clipped_to(frame.size()), mask);
        let Size { width, height } = frame.size();
        let mut ours = vec![false; width * height];
        mask.spans().iter().for_each(|s| (s.from..s.to).for_each(|x| ours[s.row as usize * width + x as usize] = true));
        let differs = |(&p, &is): (&f64, &bool)| (p > threshold) != is && (p - threshold).abs() > 1e-5;
        off += drawn.iter().zip(&ours).filter(|&pair| differs(pair)).count();
        let set = drawn.iter().filter(|&&p| p > threshold).count();
        println!("{set} pixels of {width} x {height}, {off} others");
        at = *target;
    }
    off
}

fn assert_masks_alike(files: &networks::Files, side: usize, changes: &[(&str, &str)]) {
    let first = Target { x: start().x - 0.5, y: start().y - 0.5, ..start() };
    let folder = tempfile::tempdir().unwrap();
    let config = format!("{SIAMMASK}mask_side = {side}\nmask_threshold = 0.35\n");
    write(folder.path(), files, &config);
    let want = theirs(folder.path(), files, side, first);
    let areas: Vec<usize> = want.iter().map(|(_, drawn)| drawn.iter().filter(|&&p| p > 0.35).count()).collect();
    assert!(areas.iter().all(|&a| (500..60_000).contains(&a)), "masks of {areas:?} pixels prove nothing");
    assert_eq!(differing(folder.path(), first, &want, 0.35), 0);
    for (from, to) in changes {
        write(folder.path(), files, &config.replace(from, to));
        let off = differing(folder.path(), first, &want, 0.35);
        assert!(off > 20, "{to} makes no difference ({off} pixels)");
    }
}

#[test]
fn masks_of_siammask_are_the_published_ones() {
    let changes = [("mask_threshold = 0.35", "mask_threshold = 0.3"), ("window = 0.41", "window = 0.9")];
    assert_masks_alike(&networks::siammask(63), 63, &changes);
}

#[test]
fn refined_masks_of_siammask_are_the_published_ones() {
    assert_masks_alike(&networks::siammask_refined(), 127, &[("mask_threshold = 0.35", "mask_threshold = 0.3")]);
}
