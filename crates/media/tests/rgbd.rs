//! Depth beside the picture: codings, pairing, registration, and what is said of input that does not fit.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may panic")]

use pursuit_imaging::{Frame, Image};
use pursuit_media::depth::{DepthCoding, DepthOptions, Pairing};
use pursuit_media::wrappers::write_png;
use pursuit_media::{OpenOptions, Source, open, open_with_depth};
use std::path::Path;

const SIZE: (usize, usize) = (16, 12);

/// `count` pictures named by `name`.
fn pictures(folder: &Path, count: u64, name: impl Fn(u64) -> String) {
    std::fs::create_dir_all(folder).unwrap();
    for k in 0..count {
        let image = Image::filled(SIZE.0, SIZE.1, [k as u8, 7, 9]).unwrap();
        write_png(&Frame::new(k, 0.0, image), &folder.join(name(k))).unwrap();
    }
}

/// Depth of 1000 + 10 x + k millimetres, as `code` writes it.
fn depths(folder: &Path, numbers: impl IntoIterator<Item = u64>, name: impl Fn(u64) -> String, code: fn(u16) -> u16) {
    std::fs::create_dir_all(folder).unwrap();
    for k in numbers {
        let image = Image::from_fn(SIZE.0, SIZE.1, |x, _| code(1000 + 10 * x as u16 + k as u16)).unwrap();
        write_png(&Frame::new(k, 0.0, image), &folder.join(name(k))).unwrap();
    }
}

fn plain(k: u64) -> String {
    format!("{k:04}.png")
}

fn path(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// The depth of the first pixel of each frame.
fn first_pixels(source: &mut dyn Source) -> Vec<Option<u16>> {
    std::iter::from_fn(|| source.next_frame().unwrap()).map(|f| f.depth_mm().map(|d| d.row(0)[0])).collect()
}

fn with(depth: DepthOptions) -> OpenOptions {
    OpenOptions { depth, ..OpenOptions::default() }
}

/// Distances of 1 m are plausible in fifths of a millimetre and, as 5 m, in millimetres.
#[test]
fn lists_beside_the_folders_tell_the_coding_of_tum() {
    let root = tempfile::tempdir().unwrap();
    let name = |k: u64| format!("{}.{:06}.png", 1_305_031_102, 100_000 * k + 1);
    pictures(&root.path().join("rgb"), 3, name);
    depths(&root.path().join("depth"), 0..3, name, |mm| 5 * mm + 1);
    let coding = |root: &Path| {
        let (a, b) = (root.join("rgb"), root.join("depth"));
        let mut source = open_with_depth(path(&a), path(&b), &OpenOptions::default()).unwrap();
        (source.info().depth.clone().unwrap().coding, first_pixels(&mut *source)[0])
    };
    assert_eq!(coding(root.path()), (DepthCoding::Millimetres, Some(5001)));
    for list in ["rgb.txt", "depth.txt"] {
        std::fs::write(root.path().join(list), "# timestamp filename\n").unwrap();
    }
    assert_eq!(coding(root.path()), (DepthCoding::FifthMillimetres, Some(1000)));
}

#[test]
fn two_folders_are_paired_by_number_and_the_coding_is_found_out() {
    for (code, coding) in
        [((|mm| mm) as fn(u16) -> u16, DepthCoding::Millimetres), (|mm| mm.rotate_left(3), DepthCoding::Princeton)]
    {
        let root = tempfile::tempdir().unwrap();
        pictures(&root.path().join("a"), 3, plain);
        depths(&root.path().join("b"), [0, 2], plain, code);
        let (a, b) = (root.path().join("a"), root.path().join("b"));
        let mut source = open_with_depth(path(&a), path(&b), &OpenOptions::default()).unwrap();
        let facts = source.info().depth.clone().unwrap();
        assert_eq!((facts.coding, facts.coding_detected), (coding, true));
        assert_eq!((facts.pairing.pairing, facts.pairing.paired, facts.pairing.unpaired), (Pairing::FrameId, 2, 1));
        assert_eq!(first_pixels(&mut *source), [Some(1000), None, Some(1002)]);
        source.seek(2).unwrap();
        assert_eq!(first_pixels(&mut *source), [Some(1002)]);
    }
}

#[test]
fn what_is_said_counts_more_than_what_is_found() {
    let root = tempfile::tempdir().unwrap();
    pictures(&root.path().join("rgb"), 2, plain);
    depths(&root.path().join("depth"), 0..2, plain, |mm| mm);
    let options = with(DepthOptions {
        coding: Some(DepthCoding::FifthMillimetres),
        intrinsics: Some([20.0, 21.0, 8.0, 6.0]),
        ..DepthOptions::default()
    });
    let mut source = open(path(root.path()), &options).unwrap();
    assert!(!source.info().depth.as_ref().unwrap().coding_detected);
    let frame = source.next_frame().unwrap().unwrap();
    assert_eq!(frame.depth_mm().unwrap().row(0)[0], 200);
    assert_eq!(frame.camera().unwrap().lens().pinhole_px(frame.size()), [20.0, 21.0, 8.0, 6.0]);
}

#[test]
fn the_princeton_layout_states_its_camera_and_offsets() {
    let root = tempfile::tempdir().unwrap();
    pictures(&root.path().join("rgb"), 3, |k| format!("r-{}-{}.png", k * 33_369, k + 1));
    depths(
        &root.path().join("depth"),
        0..3,
        |k| format!("d-{}-{}.png", k * 33_369 + 4000, k + 1),
        |mm| mm.rotate_left(3),
    );
    let json = r#"{"K": [[575.8, 0, 320], [0, 575.8, 240], [0, 0, 1]], "length": 3}"#;
    std::fs::write(root.path().join("frames.json"), json).unwrap();
    let mut source = open(path(root.path()), &OpenOptions::default()).unwrap();
    let facts = source.info().depth.clone().unwrap();
    assert_eq!(facts.intrinsics, Some([575.8, 575.8, 320.0, 240.0]));
    assert!((facts.pairing.largest_offset_s.unwrap() - 0.004).abs() < 1e-9);
    assert_eq!(first_pixels(&mut *source), [Some(1000), Some(1001), Some(1002)]);
}

#[test]
fn depth_that_ends_early_leaves_the_rest_to_the_picture() {
    let root = tempfile::tempdir().unwrap();
    // Names without numbers: by order.
    pictures(&root.path().join("a"), 3, |k| format!("{}.png", ["x", "y", "z"][k as usize]));
    depths(&root.path().join("b"), 0..2, plain, |mm| mm);
    let list = "index,image,x,y,w,h\n0,a/x.png,1,1,4,4\n1,a/y.png,1,1,4,4\n2,a/z.png,1,1,4,4\n";
    std::fs::write(root.path().join("frames.csv"), list).unwrap();
    for input in [root.path().join("a"), root.path().to_owned()] {
        let depth = root.path().join("b");
        let mut source = open_with_depth(path(&input), path(&depth), &OpenOptions::default()).unwrap();
        let facts = source.info().depth.as_ref().unwrap().pairing;
        assert_eq!((facts.pairing, facts.paired, facts.unpaired), (Pairing::Order, 2, 1));
        assert_eq!(first_pixels(&mut *source), [Some(1000), Some(1001), None]);
    }
}

#[test]
fn depth_of_another_size_wants_to_be_registered() {
    let root = tempfile::tempdir().unwrap();
    pictures(&root.path().join("rgb"), 1, plain);
    std::fs::create_dir_all(root.path().join("depth")).unwrap();
    let image = Image::filled(8, 6, 1500_u16).unwrap();
    write_png(&Frame::new(0, 0.0, image), &root.path().join("depth/0000.png")).unwrap();
    let mut source = open(path(root.path()), &OpenOptions::default()).unwrap();
    let error = source.next_frame().unwrap_err().to_string();
    assert!(error.contains("8x6") && error.contains("16x12") && error.contains("intrinsics of both"), "{error}");
    let options = DepthOptions {
        intrinsics: Some([20.0, 20.0, 8.0, 6.0]),
        depth_intrinsics: Some([10.0, 10.0, 4.0, 3.0]),
        ..DepthOptions::default()
    };
    let mut source = open(path(root.path()), &with(options)).unwrap();
    assert!(source.info().depth.as_ref().unwrap().registered);
    let frame = source.next_frame().unwrap().unwrap();
    assert!(frame.depth_mm().unwrap().rows().flatten().all(|mm| *mm == 1500));
}

#[test]
fn what_makes_no_sense_is_told() {
    let root = tempfile::tempdir().unwrap();
    pictures(&root.path().join("rgb"), 2, plain);
    pictures(&root.path().join("depth"), 2, plain);
    let refused = |options: DepthOptions| open(path(root.path()), &with(options)).err().unwrap().to_string();
    let nan = DepthOptions { intrinsics: Some([f64::NAN, 20.0, 8.0, 6.0]), ..DepthOptions::default() };
    assert!(refused(nan).contains("focal length"), "{}", refused(nan));
    let alone = DepthOptions { depth_intrinsics: Some([20.0, 20.0, 8.0, 6.0]), ..DepthOptions::default() };
    assert!(refused(alone).contains("those of the picture's camera"));
    let far = DepthOptions {
        intrinsics: Some([20.0, 20.0, 8.0, 6.0]),
        depth_intrinsics: Some([20.0, 20.0, 8.0, 6.0]),
        offset_mm: Some([0.0, f64::INFINITY, 0.0]),
        ..DepthOptions::default()
    };
    assert!(refused(far).contains("finite numbers in millimetres"));
    // Colour for depth.
    let mut source = open(path(root.path()), &OpenOptions::default()).unwrap();
    let error = source.next_frame().unwrap_err().to_string();
    assert!(error.contains("16-bit grey PNG") && error.contains("frame 0"), "{error}");
    // Names that have nothing to do with each other.
    let other = tempfile::tempdir().unwrap();
    pictures(&other.path().join("rgb"), 2, |k| format!("{}.00.png", 10 + k));
    depths(&other.path().join("depth"), 0..2, |k| format!("{}.00.png", 9000 + k), |mm| mm);
    let error = open(path(other.path()), &OpenOptions::default()).err().unwrap().to_string();
    assert!(error.contains("none of the depth images belongs"), "{error}");
}

#[test]
fn depth_beside_the_picture_is_found_out_on_real_footage() {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/rgbd");
    // One is said to be unregistered, the others to lie pixel by pixel.
    for (name, beside) in [("mug_kitchen", true), ("soft_toy_hand", false), ("ptb_coding_11frames", false)] {
        let folder = data.join(name);
        if !folder.is_dir() {
            eprintln!("skipped: {name} lies on its picture or not, for want of ../shared/data");
            continue;
        }
        let facts = |depth| open(path(&folder), &with(depth)).unwrap().info().depth.clone().unwrap();
        let found = facts(DepthOptions::default());
        assert_eq!((found.registered, found.registration_detected), (beside, beside), "{name}");
        let said = facts(DepthOptions { registered: Some(true), ..DepthOptions::default() });
        assert!(!said.registered && !said.registration_detected, "{name}");
    }
}
