//! Clips that begin before what they are of.
#![cfg(all(feature = "encode", feature = "h264"))]
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use pursuit_imaging::{Image, Rgb8};
use pursuit_media::output::{ClipRecorder, VideoOptions};
use std::path::Path;

/// A picture whose brightness says its number.
fn picture(number: u8) -> Image<Rgb8> {
    Image::filled(64, 48, [number, number, number]).unwrap()
}

/// Times of the frames of a clip, and how bright each is.
fn frames(path: &Path) -> Vec<(f64, u8)> {
    let mut source = pursuit_media::open(path.to_str().unwrap(), &pursuit_media::OpenOptions::default()).unwrap();
    let mut all = Vec::new();
    while let Some(frame) = source.next_frame().unwrap() {
        all.push((frame.time_s(), frame.color().row(24)[32][1]));
    }
    all
}

fn recorder(before_s: f64) -> ClipRecorder {
    ClipRecorder::new(VideoOptions { nominal_fps: 10.0, ..VideoOptions::default() }, before_s)
}

#[test]
fn a_clip_holds_what_was_before_during_and_after() {
    let folder = tempfile::tempdir().unwrap();
    let (first, second) = (folder.path().join("first.mp4"), folder.path().join("second.mp4"));
    let mut clips = recorder(3.0);
    for n in 0..200_u8 {
        match n {
            100 => clips.begin(&first).unwrap(),
            120 => clips.begin(&second).unwrap(),
            150 => clips.end().unwrap(),
            _ => {}
        }
        clips.write(picture(n + 20).view(), f64::from(n) * 0.1).unwrap();
    }
    for (path, begins, ends) in [(first, 100_u8, 120_u8), (second, 120, 150)] {
        let frames = frames(&path);
        let before = frames.len() - usize::from(ends - begins);
        assert!((30..=41).contains(&before), "{before}");
        let brightness = |at: usize| usize::from(begins) - before + 20 + at;
        for (at, (time_s, green)) in frames.iter().enumerate() {
            assert!((time_s - at as f64 * 0.1).abs() < 1e-4, "{time_s}");
            assert!(usize::from(*green).abs_diff(brightness(at)) <= 3, "{at}: {green}");
        }
    }
}

#[test]
fn a_clip_of_the_first_picture_and_one_that_nobody_ended_play() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("clip.mp4");
    let mut clips = recorder(5.0);
    clips.begin(&path).unwrap();
    clips.write(picture(30).view(), 0.0).unwrap();
    drop(clips);
    assert_eq!(frames(&path).len(), 1);
}

#[test]
fn what_cannot_be_written_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let error = recorder(1.0).begin(&folder.path().join("none/clip.mp4")).unwrap_err();
    assert!(error.is_output() && error.to_string().contains("clip.mp4"), "{error}");
    let mut clips = recorder(1.0);
    clips.write(picture(1).view(), 0.0).unwrap();
    let other = Image::<Rgb8>::filled(32, 32, [0; 3]).unwrap();
    assert!(clips.write(other.view(), 0.1).unwrap_err().to_string().contains("size changed"));
}
