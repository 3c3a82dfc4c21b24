//! What the built-in decoders give, bit by bit against what ffmpeg gave when the fixtures were made (`fixtures/make.sh`).
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use common::{all_frames, fixture, hash, hashes_beside, open_built_in};
use pursuit_geometry::Size;
use pursuit_imaging::{ColorMatrix, ColorRange, Frame, Pixels, Yuv420};
use pursuit_media::input::open_stream;
use pursuit_media::{OpenOptions, Source, Truth};

/// Frame numbers, times and every sample of every plane.
fn assert_bit_exact(name: &str) {
    let mut source = open_built_in(&fixture(name));
    let count = source.info().frame_count;
    let frames = all_frames(&mut *source);
    let got: Vec<_> = frames.iter().map(|f| format!("{}, {:.6}, {}", f.index(), f.time_s(), hash(f))).collect();
    assert_eq!(got, hashes_beside(name), "{name}");
    assert_eq!(count, Some(got.len() as u64), "{name}");
    assert!(frames.iter().all(|f| f.size() == source.info().size), "{name}");
}

#[test]
fn b_frames_come_in_display_order() {
    assert_bit_exact("b_frames.mp4");
}

#[test]
fn baseline_with_several_slices() {
    assert_bit_exact("baseline.mp4");
}

#[test]
fn sizes_that_are_no_whole_macroblocks() {
    assert_bit_exact("cropped.mp4");
    assert_eq!(open_built_in(&fixture("cropped.mp4")).info().size, Size::new(130, 98));
}

#[test]
fn rotated_pictures_are_turned() {
    assert_bit_exact("rotated.mp4");
    assert_eq!(open_built_in(&fixture("rotated.mp4")).info().size, Size::new(98, 130));
}

#[test]
fn variable_frame_rates_keep_their_times() {
    assert_bit_exact("vfr.mp4");
    let times: Vec<_> = all_frames(&mut *open_built_in(&fixture("vfr.mp4"))).iter().map(Frame::time_s).collect();
    assert_eq!(times, [0.0, 0.01, 0.04, 0.09, 0.16, 0.25, 0.36, 0.49]);
}

#[test]
fn edit_lists_cut_the_beginning() {
    assert_bit_exact("edited.mp4");
}

#[test]
fn fragments_with_absolute_and_relative_offsets() {
    assert_bit_exact("fragmented.mp4");
    assert_bit_exact("dash.mp4");
}

#[test]
fn quicktime_is_read_alike() {
    assert_bit_exact("quicktime.mov");
}

#[test]
fn y4m_in_colour_and_both_depths_of_grey_at_odd_sizes() {
    assert_bit_exact("color.y4m");
    assert_bit_exact("gray.y4m");
    assert_bit_exact("gray16.y4m");
}

fn yuv(frame: &Frame) -> &Yuv420 {
    let Pixels::Yuv420(planes) = frame.pixels() else { panic!("{frame:?} is not planar") };
    planes
}

#[test]
fn colour_is_what_the_stream_says() {
    assert_bit_exact("full_range.mp4");
    let color = |name| {
        let frame = open_built_in(&fixture(name)).next_frame().unwrap().unwrap();
        (yuv(&frame).matrix(), yuv(&frame).range())
    };
    assert_eq!(color("full_range.mp4"), (ColorMatrix::Bt709, ColorRange::Full));
    assert_eq!(color("b_frames.mp4"), (ColorMatrix::Bt601, ColorRange::Limited));
    assert_eq!(color("mjpeg.avi"), (ColorMatrix::Bt601, ColorRange::Full));
}

/// JPEG leaves the inverse transform's rounding to the decoder, so two decoders agree only nearly.
#[test]
fn motion_jpeg_is_close_to_ffmpegs() {
    let mut ours = open_built_in(&fixture("mjpeg.avi"));
    assert_eq!((ours.info().frame_count, ours.info().fps), (Some(5), Some(25.0)));
    let ours = all_frames(&mut *ours);
    let reference = all_frames(&mut *open_built_in(&fixture("mjpeg_reference.y4m")));
    assert_eq!((ours.len(), reference.len()), (5, 5));
    for (a, b) in ours.iter().zip(&reference) {
        assert_eq!((a.index(), a.time_s(), a.size()), (b.index(), b.time_s(), Size::new(67, 45)));
        assert!(largest_difference(yuv(a).luma(), yuv(b).luma()) <= 2);
        let ((u, v), (ru, rv)) = (yuv(a).chroma(), yuv(b).chroma());
        assert!(largest_difference(u, ru) <= 4 && largest_difference(v, rv) <= 4);
    }
}

type Plane<'a> = pursuit_imaging::ImageView<'a, u8>;

fn largest_difference(a: Plane<'_>, b: Plane<'_>) -> u8 {
    assert_eq!(a.size(), b.size());
    let pairs = a.rows().flatten().zip(b.rows().flatten());
    pairs.map(|(&a, &b)| a.abs_diff(b)).max().unwrap()
}

/// Takes every DHT segment out of the JPEGs of an AVI (their space becomes a comment), as cameras' AVIs come.
fn without_huffman_tables(avi: &[u8]) -> Vec<u8> {
    let mut avi = avi.to_vec();
    let tables: Vec<_> = (0..avi.len() - 1).filter(|&i| avi[i..].starts_with(&[0xFF, 0xC4, 0x01, 0xA2])).collect();
    assert_eq!(tables.len(), 5);
    tables.into_iter().for_each(|i| avi[i + 1] = 0xFE);
    avi
}

#[test]
fn standard_huffman_tables_are_put_in_where_they_are_missing() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("camera.avi");
    std::fs::write(&path, without_huffman_tables(&std::fs::read(fixture("mjpeg.avi")).unwrap())).unwrap();
    let hashes =
        |path: &std::path::Path| -> Vec<_> { all_frames(&mut *open_built_in(path)).iter().map(hash).collect() };
    assert_eq!(hashes(&path), hashes(&fixture("mjpeg.avi")));
}

/// The JPEGs of the AVI one after the other.
fn bare_jpegs() -> Vec<u8> {
    let avi = std::fs::read(fixture("mjpeg.avi")).unwrap();
    let starts: Vec<_> = (0..avi.len() - 8).filter(|&i| avi[i..].starts_with(b"00dc") && avi[i + 8] == 0xFF).collect();
    let chunk = |&i: &usize| {
        let length = u32::from_le_bytes([avi[i + 4], avi[i + 5], avi[i + 6], avi[i + 7]]) as usize;
        avi[i + 8..i + 8 + length].to_vec()
    };
    starts.iter().flat_map(chunk).collect()
}

#[test]
fn motion_jpeg_and_y4m_from_a_pipe() {
    let from_avi: Vec<_> = all_frames(&mut *open_built_in(&fixture("mjpeg.avi"))).iter().map(hash).collect();
    let options = OpenOptions { default_fps: 10.0, ..OpenOptions::default() };
    let mut piped = open_stream(Box::new(std::io::Cursor::new(bare_jpegs())), "pipe", &options).unwrap();
    let frames = all_frames(&mut *piped);
    assert_eq!(frames.iter().map(hash).collect::<Vec<_>>(), from_avi);
    assert_eq!(frames[3].time_s(), 0.3);

    let y4m = std::fs::File::open(fixture("color.y4m")).unwrap();
    let mut piped = open_stream(Box::new(y4m), "pipe", &options).unwrap();
    assert_eq!((piped.info().frame_count, all_frames(&mut *piped).len()), (None, 3));
}

#[test]
fn jpegs_one_after_the_other_in_a_file_are_a_video_and_one_jpeg_is_an_image() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("clip.mp4"); // the name says nothing
    let jpegs = bare_jpegs();
    std::fs::write(&path, &jpegs).unwrap();
    assert_eq!(all_frames(&mut *open_built_in(&path)).len(), 5);
    let second = (2..jpegs.len()).find(|&i| jpegs[i..].starts_with(&[0xFF, 0xD8, 0xFF])).unwrap();
    std::fs::write(&path, &jpegs[..second]).unwrap();
    assert_eq!(all_frames(&mut *open_built_in(&path)).len(), 1);
}

#[test]
fn the_truth_beside_a_video_comes_with_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("clip.mp4");
    std::fs::copy(fixture("baseline.mp4"), &path).unwrap();
    assert_eq!(open_built_in(&path).info().truth, None);
    std::fs::write(folder.path().join("clip.csv"), "index,x,y,w,h\n0,1,2,3,4\n1,nan,nan,nan,nan\n").unwrap();
    let source = open_built_in(&path);
    let first = source.info().truth_at(0).bbox().unwrap();
    assert_eq!(first.ltwh(), (1.0, 2.0, 3.0, 4.0));
    assert_eq!((source.info().truth_at(1), source.info().truth_at(2)), (Truth::Absent, Truth::Unknown));
}
