//! Inputs that cannot be read: each a one-line error that names the thing and what would mend it.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use common::{fixture, open_built_in};
use pursuit_imaging::{Frame, Image, Pixels};
use pursuit_media::wrappers::write_png;
use pursuit_media::{MediaError, OpenOptions, Source, open};
use pursuit_testkit::crc32;
use std::collections::BTreeMap;
use std::path::Path;

fn error_of(input: &str) -> String {
    let error = open(input, &OpenOptions::default()).err().unwrap_or_else(|| panic!("{input} was opened"));
    assert!(matches!(error, MediaError::Unreadable { .. }) && !error.is_output(), "{error:?}");
    let text = error.to_string();
    assert!(!text.contains('\n') && text.len() < 400, "{text}");
    text
}

/// The error of opening a file with this content, which must name the file and hold every word.
fn assert_refused(file: &str, content: &[u8], words: &[&str]) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(file);
    std::fs::write(&path, content).unwrap();
    let text = error_of(path.to_str().unwrap());
    assert!(text.contains(file), "{text}");
    words.iter().for_each(|word| assert!(text.contains(word), "{word:?} is not in: {text}"));
}

/// Frame numbers until the source breaks off, and the error.
fn read_until_broken(path: &Path) -> (Vec<u64>, MediaError) {
    let mut source = open_built_in(path);
    let mut seen = Vec::new();
    loop {
        match source.next_frame() {
            Ok(Some(frame)) => seen.push(frame.index()),
            Ok(None) => panic!("{} ended without an error", path.display()),
            Err(error) => {
                assert!(source.next_frame().unwrap().is_none(), "after an error comes the end");
                assert!(!error.to_string().contains('\n'), "{error}");
                return (seen, error);
            }
        }
    }
}

#[test]
fn missing_and_misspelt_inputs() {
    assert!(error_of("no/such/clip.mp4").contains("no such file"));
    assert!(error_of("-clip.mp4").contains("no such file"), "a leading dash is part of a name");
    assert!(error_of("").contains("empty"));
    assert!(error_of("camera:x").contains("camera:0"));
    assert!(error_of("camera:250").contains("/dev/video250"));
    assert!(error_of("rtmp://127.0.0.1/x").contains("ffmpeg"));
}

#[test]
fn empty_and_foreign_files() {
    assert_refused("empty.mp4", b"", &["empty"]);
    assert_refused("clip.csv", b"index,x,y,w,h\n0,1,2,3,4\n", &["it is text", "name the video"]);
    assert_refused("notes.mp4", b"hello, this is no video", &["no ffmpeg was found", "install ffmpeg"]);
    assert_refused("clip.webm", &std::fs::read(fixture("vp9.webm")).unwrap(), &["V_VP9", "Matroska", "install ffmpeg"]);
}

#[test]
fn h264_that_is_not_decoded_here_is_named() {
    let refused = |name| error_of(fixture(name).to_str().unwrap());
    assert!(refused("high10.mp4").contains("more than 8 bits"));
    assert!(refused("interlaced.mp4").contains("interlaced"));
}

#[test]
fn mp4_without_its_index() {
    let whole = std::fs::read(fixture("b_frames.mp4")).unwrap();
    let moov = whole.windows(4).position(|w| w == b"moov").unwrap();
    assert_refused("cut.mp4", &whole[..moov - 5], &["moov"]);
    assert_refused("cut.mp4", &whole[..moov + 100], &["moov", "cut off"]);
    assert_refused("cut.mp4", &whole[..24], &["moov"]);
}

#[test]
fn truncated_videos_give_what_they_have_and_name_the_frame() {
    // Two fragments of eight frames, each with its index before its data.
    let whole = std::fs::read(fixture("fragmented.mp4")).unwrap();
    let second = whole.windows(4).rposition(|w| w == b"moof").unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cut.mp4");

    std::fs::write(&path, &whole[..second + 40]).unwrap();
    let (seen, error) = read_until_broken(&path);
    assert_eq!((seen, error.frame()), ((0..8).collect(), Some(8)));

    std::fs::write(&path, &whole[..whole.len() - 1400]).unwrap();
    let (seen, error) = read_until_broken(&path);
    assert!(seen.len() >= 8 && seen.len() < 16, "{seen:?}");
    assert_eq!(seen[..8], (0..8).collect::<Vec<_>>());
    let broken_at = error.frame().unwrap();
    assert!(broken_at >= 8 && !seen.contains(&broken_at), "{seen:?} {error}");
    assert!(error.to_string().contains("cut.mp4") && error.to_string().contains("ends early"), "{error}");
}

#[test]
fn truncated_avi_and_y4m() {
    for (name, frames) in [("mjpeg.avi", 5), ("color.y4m", 3)] {
        let whole = std::fs::read(fixture(name)).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        std::fs::write(&path, &whole[..whole.len() * 6 / 10]).unwrap();
        let (seen, error) = read_until_broken(&path);
        assert!(!seen.is_empty() && seen.len() < frames, "{seen:?}");
        assert_eq!(error.frame(), Some(seen.len() as u64));
    }
}

/// Everything that a source delivers: numbers and times of frames, and the numbers of damaged ones.
fn read_over_damage(path: &Path) -> (Vec<(u64, f64)>, Vec<u64>) {
    let mut source = open_built_in(path);
    let (mut frames, mut damaged) = (Vec::new(), Vec::new());
    loop {
        match source.next_frame() {
            Ok(Some(frame)) => frames.push((frame.index(), frame.time_s())),
            Ok(None) => return (frames, damaged),
            Err(error) => {
                assert!(error.is_damage(), "{error}");
                damaged.push(error.frame().unwrap());
            }
        }
    }
}

#[test]
fn what_comes_behind_damage_is_delivered_with_its_own_time() {
    let folder = tempfile::tempdir().unwrap();
    let whole = std::fs::read(fixture("b_frames.mp4")).unwrap();
    let path = folder.path().join("hole.mp4");
    std::fs::write(&path, &whole).unwrap();
    let (all, none) = read_over_damage(&path);
    assert_eq!((all.len(), none.len()), (24, 0));
    // A hole in the first of two groups of twelve pictures: the second is whole, at its own times.
    let data = whole.windows(4).position(|w| w == b"mdat").unwrap() + 4;
    let mut spoiled = whole.clone();
    let hole = data + (whole.len() - data) / 6;
    spoiled[hole..hole + 300].fill(0xFF);
    std::fs::write(&path, spoiled).unwrap();
    let (kept, damaged) = read_over_damage(&path);
    assert_eq!(damaged.len(), 1, "{damaged:?}");
    assert!(damaged[0] < 12 && !kept.iter().any(|f| f.0 == damaged[0]), "{damaged:?} {kept:?}");
    assert_eq!(kept[kept.len() - 12..], all[12..]);
    assert!(kept.iter().all(|frame| all.contains(frame)));

    let images = folder.path().join("images");
    std::fs::create_dir(&images).unwrap();
    (0..5).for_each(|k| png(&images, &format!("{k}.png"), 8, 6));
    let cut = std::fs::read(images.join("2.png")).unwrap();
    std::fs::write(images.join("2.png"), &cut[..cut.len() / 2]).unwrap();
    std::fs::write(images.join("3.png"), b"").unwrap();
    let (kept, damaged) = read_over_damage(&images);
    assert_eq!((kept.iter().map(|f| f.0).collect::<Vec<_>>(), damaged), (vec![0, 1, 4], vec![2, 3]));
    assert!((kept[2].1 - 4.0 / 30.0).abs() < 1e-9);
}

/// The brightness of every frame delivered, by number.
fn brightness(path: &Path) -> BTreeMap<u64, Vec<u8>> {
    let mut source = open_built_in(path);
    let mut found = BTreeMap::new();
    loop {
        match source.next_frame() {
            Ok(Some(frame)) => _ = found.insert(frame.index(), frame.gray().rows().flatten().copied().collect()),
            Ok(None) => return found,
            Err(error) => assert!(error.is_damage(), "{error}"),
        }
    }
}

/// Most cameras' clips are one group of pictures to their end, or nearly so: what comes behind a hole is put together from what
/// came before it.
#[test]
fn a_hole_without_a_key_frame_behind_it_is_concealed() {
    let folder = tempfile::tempdir().unwrap();
    for (name, at) in [("baseline.mp4", 0.5), ("baseline.mp4", 0.8), ("b_frames.mp4", 0.85)] {
        let whole = std::fs::read(fixture(name)).unwrap();
        let path = folder.path().join(name);
        std::fs::write(&path, &whole).unwrap();
        let truth = brightness(&path);
        let data = whole.windows(4).position(|w| w == b"mdat").unwrap() + 4;
        let mut spoiled = whole.clone();
        let hole = data + ((whole.len() - data) as f64 * at) as usize;
        spoiled[hole..hole + 60].fill(0xFF);
        std::fs::write(&path, spoiled).unwrap();
        let (_, damaged) = read_over_damage(&path);
        let kept = brightness(&path);
        assert!(!damaged.is_empty() && kept.len() + damaged.len() == truth.len(), "{name} {at}: {damaged:?}");
        assert!(kept.len() + 2 >= truth.len(), "{name} {at}: {} of {}", kept.len(), truth.len());
        for (frame, picture) in &kept {
            let differences = picture.iter().zip(&truth[frame]).map(|(a, b)| f64::from(a.abs_diff(*b)));
            let mean = differences.sum::<f64>() / picture.len() as f64;
            assert!(mean < 25.0 && (*frame > damaged[0] || mean == 0.0), "{name} {at}, frame {frame}: {mean}");
        }
    }
}

#[test]
fn a_damaged_frame_is_named_and_the_others_are_kept() {
    let mut avi = std::fs::read(fixture("mjpeg.avi")).unwrap();
    let chunks: Vec<_> = (0..avi.len() - 8).filter(|&i| avi[i..].starts_with(b"00dc") && avi[i + 8] == 0xFF).collect();
    avi[chunks[3] + 8..chunks[3] + 200].fill(0);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("damaged.avi");
    std::fs::write(&path, avi).unwrap();
    let (kept, damaged) = read_over_damage(&path);
    assert_eq!((kept.iter().map(|f| f.0).collect::<Vec<_>>(), damaged), (vec![0, 1, 2, 4], vec![3]));
}

fn png(folder: &Path, name: &str, width: usize, height: usize) {
    let pixels = Pixels::from(Image::filled(width, height, 9u8).unwrap());
    write_png(&Frame::new(0, 0.0, pixels), &folder.join(name)).unwrap();
}

#[test]
fn folders_without_images_and_of_mixed_sizes() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("readme.txt"), "nothing").unwrap();
    assert!(error_of(folder.path().to_str().unwrap()).contains("no JPEG or PNG images"));
    png(folder.path(), "1.png", 8, 6);
    png(folder.path(), "2.png", 8, 6);
    png(folder.path(), "10.png", 9, 6);
    let (seen, error) = read_until_broken(folder.path());
    let text = error.to_string();
    assert_eq!((seen, error.frame()), (vec![0, 1], Some(2)));
    assert!(["10.png", "9x6", "8x6"].iter().all(|word| text.contains(word)), "{text}");
}

#[test]
fn annotated_folders_with_slips() {
    let folder = tempfile::tempdir().unwrap();
    let list = folder.path().join("frames.csv");
    let name = folder.path().to_str().unwrap();
    png(folder.path(), "a.png", 8, 6);
    std::fs::write(&list, "index,image,x,y,w,h\n0,a.png,1,1,x,1\n").unwrap();
    assert!(error_of(name).contains("frames.csv: line 2"));
    std::fs::write(&list, "index,image,x,y,w,h\n").unwrap();
    assert!(error_of(name).contains("no images"));
    std::fs::write(&list, "index,image,x,y,w,h\n0,gone.png,1,1,1,1\n").unwrap();
    assert!(error_of(name).contains("gone.png"));
    std::fs::write(&list, "index,image,depth,x,y,w,h\n0,a.png,a.png,1,1,1,1\n").unwrap();
    let (_, error) = read_until_broken(folder.path());
    assert!(error.to_string().contains("16-bit grey"), "{error}");
}

/// A PNG's first chunk, with nothing behind it.
fn png_header(width: u32, height: u32) -> Vec<u8> {
    let mut png = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR".to_vec();
    png.extend(width.to_be_bytes());
    png.extend(height.to_be_bytes());
    png.extend([8, 2, 0, 0, 0]);
    let crc = crc32(&png[12..]);
    png.extend(crc.to_be_bytes());
    png.extend(b"\0\0\0\0IDAT\0\0\0\0");
    png
}

#[test]
fn images_too_large_to_be_meant_are_refused_by_their_headers() {
    assert_refused("bomb.png", &png_header(10_000, 10_000), &["10000x10000", "too large", "scale it down"]);
    assert_refused("wide.png", &png_header(40_000, 1), &["40000x1", "too large"]);
    assert_refused("bomb.y4m", b"YUV4MPEG2 W60000 H60000 F25:1\nFRAME\n", &["60000x60000", "too large"]);
    let mut jpeg = vec![0xFF, 0xD8, 0xFF, 0xC0, 0, 11, 8];
    jpeg.extend([0xFF, 0xFF, 0xFF, 0xFF, 1, 1, 0x11, 0, 0xFF, 0xDA, 0, 8, 1, 1, 0, 0, 63, 0]);
    assert_refused("bomb.jpg", &jpeg, &["65535x65535", "too large"]);
}

#[test]
fn damaged_images() {
    assert_refused("cut.png", &png_header(8, 8), &["PNG"]);
    assert_refused("cut.jpg", &[0xFF, 0xD8, 0xFF, 0xE0], &["JPEG ends"]);
    let avi = std::fs::read(fixture("mjpeg.avi")).unwrap();
    let start = avi.windows(3).position(|w| w == [0xFF, 0xD8, 0xFF]).unwrap();
    assert_refused("half.jpg", &avi[start..start + 900], &["JPEG"]);
}

#[test]
fn y4m_that_is_none() {
    assert_refused("a.y4m", b"YUV4MPEG2 W8 H8 F25:1 C444\nFRAME\n", &["444", "install ffmpeg"]);
    assert_refused("b.y4m", b"YUV4MPEG2 W8 Hx\n", &["\"x\""]);
    let mut endless = b"YUV4MPEG2 ".to_vec();
    endless.resize(100_000, b'X');
    assert_refused("c.y4m", &endless, &["header"]);
}

#[test]
fn hostile_indexes_cost_no_memory() {
    // Four thousand million samples of one byte: believed only as far as the file goes.
    let mut movie = std::fs::read(fixture("baseline.mp4")).unwrap();
    let stsz = movie.windows(4).position(|w| w == b"stsz").unwrap();
    movie[stsz + 8..stsz + 12].copy_from_slice(&1u32.to_be_bytes());
    movie[stsz + 12..stsz + 16].copy_from_slice(&u32::MAX.to_be_bytes());
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("hostile.mp4");
    std::fs::write(&path, movie).unwrap();
    match open(path.to_str().unwrap(), &OpenOptions::default()) {
        Ok(source) => assert!(source.info().frame_count.unwrap() < 10_000),
        Err(error) => assert!(error.to_string().contains("hostile.mp4"), "{error}"),
    }
}
