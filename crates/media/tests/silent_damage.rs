//! Damage that no decoder complains of: what files say of themselves is held against what comes.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use common::{fixture, hash, open_built_in};
use std::path::Path;

/// What was delivered, and whether anything was amiss.
fn read(path: &Path) -> (Vec<String>, bool) {
    let Ok(mut source) = pursuit_media::open(path, &pursuit_media::OpenOptions::default()) else {
        return (Vec::new(), true);
    };
    let (mut frames, mut amiss) = (Vec::new(), false);
    loop {
        match source.next_frame() {
            Ok(Some(frame)) => frames.push(format!("{} {:.6} {}", frame.index(), frame.time_s(), hash(&frame))),
            Ok(None) => return (frames, amiss),
            Err(_) => amiss = true,
        }
    }
}

fn changed(name: &str, change: impl FnOnce(&mut Vec<u8>)) -> (Vec<String>, bool) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    let mut bytes = std::fs::read(fixture(name)).unwrap();
    change(&mut bytes);
    std::fs::write(&path, bytes).unwrap();
    read(&path)
}

#[test]
fn sound_files_are_sound() {
    for name in [
        "b_frames.mp4",
        "baseline.mp4",
        "cropped.mp4",
        "dash.mp4",
        "edited.mp4",
        "fragmented.mp4",
        "vfr.mp4",
        "quicktime.mov",
    ] {
        assert!(!read(&fixture(name)).1, "{name}");
    }
}

/// Wherever a file is cut, what is missing is noticed, unless nothing is.
#[test]
fn no_file_is_cut_unnoticed() {
    for name in ["fragmented.mp4", "dash.mp4", "b_frames.mp4"] {
        let (whole, _) = read(&fixture(name));
        let length = std::fs::metadata(fixture(name)).unwrap().len() as usize;
        for cut in (1..length).step_by(length / 40) {
            let (frames, amiss) = changed(name, |bytes| bytes.truncate(cut));
            assert!(amiss || frames == whole, "{name} cut at {cut}: {} frames", frames.len());
        }
    }
}

/// The place of a box's content.
fn content_of(bytes: &[u8], kind: &[u8; 4]) -> usize {
    bytes.windows(4).position(|w| w == kind).unwrap() + 4
}

#[test]
fn an_index_that_contradicts_itself_is_noticed() {
    let (whole, _) = read(&fixture("b_frames.mp4"));
    // One more frame has a time than there are frames; a frame is shown for hours; the file says that it is longer.
    for (kind, at, value) in [(b"stts", 8, 25_u32), (b"stts", 12, 1 << 28), (b"mdhd", 16, 1 << 28)] {
        let (frames, amiss) = changed("b_frames.mp4", |bytes| {
            let at = content_of(bytes, kind) + at;
            bytes[at..at + 4].copy_from_slice(&value.to_be_bytes());
        });
        let kind = str::from_utf8(kind).unwrap();
        assert!(amiss && !frames.is_empty(), "{kind} at {at}: {} frames of {}", frames.len(), whole.len());
    }
}

/// A wrong bit leads the decoder astray, and it goes on beyond the end of its slice, which it does not complain of itself. These
/// flips are those of 160 drawn at random that go unnoticed without what stands behind each slice for that.
#[test]
fn a_decoder_that_runs_beyond_its_slice_is_noticed() {
    let flips =
        [(3088, 2), (5321, 0), (5593, 7), (2313, 0), (5447, 2), (1744, 0), (5491, 5), (2301, 4), (5232, 2), (5286, 1)];
    for (at, bit) in flips {
        let (frames, amiss) = changed("b_frames.mp4", |bytes| bytes[at] ^= 1 << bit);
        assert!(amiss && frames.len() < 24, "bit {bit} of byte {at}: {} frames", frames.len());
    }
}

#[test]
fn a_hole_in_a_film_with_one_key_frame_is_named() {
    let mut source = open_built_in(&fixture("vfr.mp4"));
    while source.next_frame().unwrap().is_some() {}
    let (frames, amiss) = changed("vfr.mp4", |bytes| {
        let data = content_of(bytes, b"mdat");
        let middle = data + (bytes.len() - data) / 2;
        bytes[middle..middle + 200].fill(0);
    });
    assert!(amiss && !frames.is_empty());
}
