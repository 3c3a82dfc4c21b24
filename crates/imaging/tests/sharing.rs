//! What may be shared is shared: allocations are counted.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use pursuit_imaging::{ColorMatrix, ColorRange, Frame, Image, Pixels, SharedImage, Yuv420};

const WIDTH: usize = 320;
const HEIGHT: usize = 240;

fn planar() -> Pixels {
    let plane = |w, h| Image::filled(w, h, 90u8).unwrap();
    let (y, u, v) = (plane(WIDTH, HEIGHT), plane(WIDTH / 2, HEIGHT / 2), plane(WIDTH / 2, HEIGHT / 2));
    Yuv420::new(y, u, v, ColorMatrix::Bt709, ColorRange::Limited).unwrap().into()
}

fn all_kinds() -> [Pixels; 4] {
    [
        Image::filled(WIDTH, HEIGHT, 7u8).unwrap().into(),
        Image::filled(WIDTH, HEIGHT, 700u16).unwrap().into(),
        Image::filled(WIDTH, HEIGHT, [7u8, 8, 9]).unwrap().into(),
        planar(),
    ]
}

fn with_depth(pixels: Pixels) -> Frame {
    Frame::new(0, 0.0, pixels).with_depth(Image::filled(WIDTH, HEIGHT, 900u16).unwrap()).unwrap()
}

#[test]
fn a_clone_allocates_nothing() {
    for frame in all_kinds().map(with_depth) {
        let used = allocation_counter::measure(|| drop(frame.clone().retimed(4, 0.2)));
        assert_eq!(used.count_total, 0, "{frame:?}: {used:?}");
    }
}

#[test]
fn an_undecorated_frame_allocates_no_pixels() {
    for frame in all_kinds().map(with_depth) {
        frame.color();
        let used = allocation_counter::measure(|| drop(frame.undecorated()));
        assert!(used.count_total == 1 && used.bytes_total < 256, "{frame:?}: {used:?}");
    }
}

#[test]
fn each_plane_is_made_once_for_all_clones() {
    for frame in all_kinds().map(with_depth) {
        let clones = [frame.clone(), frame.clone()];
        let planes = |f: &Frame| assert_eq!(f.gray().size(), f.color().size());
        let first = allocation_counter::measure(|| planes(&clones[0]));
        let later = allocation_counter::measure(|| clones.iter().chain([&frame]).for_each(planes));
        assert!(first.bytes_total > 0, "{frame:?}");
        assert_eq!(later.count_total, 0, "{frame:?}: {later:?}");
    }
}

#[test]
fn what_is_finished_is_handed_on_without_a_copy() {
    let image = Image::filled(WIDTH, HEIGHT, 5u8).unwrap();
    let depth = SharedImage::from(Image::filled(WIDTH, HEIGHT, 5u16).unwrap());
    let used = allocation_counter::measure(|| {
        let frame = Frame::new(0, 0.0, image).with_depth(depth.clone()).unwrap();
        assert_eq!(frame.gray().row(0)[0], 5);
    });
    assert!(used.bytes_total < 512, "{used:?}");
}
