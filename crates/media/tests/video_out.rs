//! What is written can be read back: pictures, times, and everything that was on disk when something went wrong.
#![cfg(all(feature = "encode", feature = "h264"))]
#![allow(clippy::expect_used)] // the helpers belong to the tests

use pursuit_imaging::{Image, Rgb8};
use pursuit_media::output::{Mp4Writer, Storage, VideoOptions, VideoWriter};
use pursuit_media::{OpenOptions, open};
use std::io::{self, Cursor, Seek, SeekFrom, Write};
use std::path::Path;
use std::sync::{Arc, Mutex};

/// A smooth picture with a bright square that moves with the frame number.
fn picture(width: usize, height: usize, k: usize) -> Image<Rgb8> {
    let square = |x: usize, y: usize| x / 16 == (k + 1) % (width / 16).max(1) && y / 16 == 1;
    Image::from_fn(width, height, |x, y| {
        if square(x, y) { [240, 200, 30] } else { [(x * 200 / width) as u8, (y * 200 / height) as u8, 90] }
    })
    .expect("a small picture")
}

/// Memory that can be looked at while the writer holds it, and that can run full.
#[derive(Clone)]
struct Disk {
    content: Arc<Mutex<Cursor<Vec<u8>>>>,
    capacity: u64,
}

impl Disk {
    fn new(capacity: u64) -> Self {
        Self { content: Arc::default(), capacity }
    }

    fn bytes(&self) -> Vec<u8> {
        self.content.lock().expect("unpoisoned").get_ref().clone()
    }
}

impl Write for Disk {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let mut content = self.content.lock().expect("unpoisoned");
        let room = self.capacity.saturating_sub(content.position()) as usize;
        if room == 0 {
            return Err(io::ErrorKind::StorageFull.into());
        }
        content.write(&bytes[..bytes.len().min(room)])
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Seek for Disk {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.content.lock().expect("unpoisoned").seek(to)
    }
}

impl Storage for Disk {
    fn truncate(&mut self, length: u64) -> io::Result<()> {
        self.content.lock().expect("unpoisoned").truncate(length)
    }
}

/// Decodes with the crate's own reader: times and pictures.
fn read(path: &Path) -> Vec<(f64, Image<Rgb8>)> {
    let mut source = open(path, &OpenOptions::default()).expect("readable");
    std::iter::from_fn(|| source.next_frame().expect("unbroken")).map(|f| (f.time_s(), f.color().to_image())).collect()
}

fn read_bytes(bytes: &[u8]) -> Vec<(f64, Image<Rgb8>)> {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("clip.mp4");
    std::fs::write(&path, bytes).expect("written");
    read(&path)
}

/// Peak signal-to-noise ratio of the part that both have, in dB.
fn psnr(a: &Image<Rgb8>, b: &Image<Rgb8>) -> f64 {
    let rows = a.view().rows().zip(b.view().rows()).flat_map(|(p, q)| p.iter().zip(q).collect::<Vec<_>>());
    let (mut sum, mut count) = (0.0, 0.0);
    for (p, q) in rows.flat_map(|(p, q)| p.iter().zip(q)) {
        sum += (f64::from(*p) - f64::from(*q)).powi(2);
        count += 1.0;
    }
    10.0 * (255.0 * 255.0 * count / f64::max(sum, 1.0)).log10()
}

#[test]
fn pictures_and_uneven_times_come_back() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("overlay.mp4");
    let mut writer = Mp4Writer::create(&path, VideoOptions::default()).expect("created");
    let times: Vec<f64> = (0..75).map(|k| 5.0 + f64::from(k) / 30.0 + if k % 3 == 0 { 0.011 } else { 0.0 }).collect();
    for (k, time) in times.iter().enumerate() {
        writer.write(picture(321, 243, k).view(), *time).expect("written");
    }
    writer.finish().expect("finished");
    assert!(writer.write(picture(321, 243, 0).view(), 9.0).is_err(), "finished is finished");
    let back = read(&path);
    assert_eq!(back.len(), times.len());
    for (k, (time, image)) in back.iter().enumerate() {
        assert!((time - back[0].0 - (times[k] - times[0])).abs() < 2e-5, "frame {k} at {time}");
        assert_eq!((image.width(), image.height()), (322, 244));
        assert!(psnr(&picture(321, 243, k), image) > 30.0, "frame {k}: {} dB", psnr(&picture(321, 243, k), image));
    }
}

#[test]
fn the_same_pictures_make_the_same_bytes() {
    let bytes = || {
        let disk = Disk::new(u64::MAX);
        let mut writer = Mp4Writer::new(Box::new(disk.clone()), Path::new("a.mp4"), VideoOptions::default());
        (0..20).for_each(|k| writer.write(picture(160, 120, k).view(), k as f64 / 25.0).expect("written"));
        writer.finish().expect("finished");
        disk.bytes()
    };
    assert_eq!(bytes(), bytes());
}

#[test]
fn what_is_on_disk_plays_up_to_nearly_the_last_frame_without_any_farewell() {
    let disk = Disk::new(u64::MAX);
    let mut writer = Mp4Writer::new(Box::new(disk.clone()), Path::new("a.mp4"), VideoOptions::default());
    for k in 0..100 {
        writer.write(picture(160, 120, k).view(), k as f64 / 30.0).expect("written");
        if k % 17 == 16 {
            let back = read_bytes(&disk.bytes());
            assert!(back.len() + 9 > k, "after {k} frames only {} play", back.len());
            assert!(psnr(&picture(160, 120, back.len() - 1), &back[back.len() - 1].1) > 30.0);
        }
    }
    // Slow sources reach the disk by time, not by number of frames.
    let disk = Disk::new(u64::MAX);
    let mut writer = Mp4Writer::new(Box::new(disk.clone()), Path::new("a.mp4"), VideoOptions::default());
    (0..6).for_each(|k| writer.write(picture(160, 120, k).view(), k as f64).expect("written"));
    assert_eq!(read_bytes(&disk.bytes()).len(), 5);
}

#[test]
fn a_full_disk_costs_nothing_that_was_written() {
    for capacity in [0, 300, 20_000, 20_001, 33_333] {
        let disk = Disk::new(capacity);
        let mut writer = Mp4Writer::new(Box::new(disk.clone()), Path::new("out/a.mp4"), VideoOptions::default());
        let mut accepted = 0;
        let error = loop {
            match writer.write(picture(160, 120, accepted).view(), accepted as f64 / 30.0) {
                Ok(()) => accepted += 1,
                Err(error) => break error,
            }
            assert!(accepted < 2000, "the disk never ran full");
        };
        assert!(
            error.is_output() && error.to_string().contains("out/a.mp4") && error.to_string().contains("disk is full")
        );
        assert!(writer.write(picture(160, 120, 0).view(), 99.0).is_err());
        assert!(writer.finish().is_err(), "finishing must not hide the failure");
        if capacity >= 20_000 {
            let played = read_bytes(&disk.bytes()).len();
            assert!(played + 17 > accepted && played > 0, "{capacity}: {played} of {accepted} play");
        }
    }
}

#[test]
fn strange_times_and_sizes() {
    let disk = Disk::new(u64::MAX);
    let mut writer = Mp4Writer::new(
        Box::new(disk.clone()),
        Path::new("a.mp4"),
        VideoOptions { nominal_fps: f64::NAN, ..VideoOptions::default() },
    );
    for (k, time) in [f64::NAN, 0.0, -3.0, 1.0, 1.0, f64::INFINITY, 1e300].into_iter().enumerate() {
        writer.write(picture(7, 5, k).view(), time).expect("written");
    }
    let error = writer.write(picture(8, 5, 0).view(), 2.0).expect_err("another size");
    assert!(error.to_string().contains("7x5") && error.to_string().contains("8x5"), "{error}");
    assert!(writer.finish().is_err());
    let back = read_bytes(&disk.bytes());
    assert_eq!(back.len(), 7);
    assert!(back.windows(2).all(|w| w[1].0 > w[0].0));

    let mut writer = Mp4Writer::new(Box::new(Disk::new(u64::MAX)), Path::new("a.mp4"), VideoOptions::default());
    let error = writer.write(Image::filled(4000, 20, [0; 3]).expect("wide").view(), 0.0).expect_err("too wide");
    assert!(error.to_string().contains("4000x20"), "{error}");
}

#[test]
fn files_that_cannot_be_created_are_named() {
    let error =
        Mp4Writer::create(Path::new("/nowhere/overlay.mp4"), VideoOptions::default()).err().expect("no such folder");
    assert!(error.is_output() && error.to_string().contains("/nowhere/overlay.mp4"), "{error}");
}

#[test]
fn nothing_written_is_no_error() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut writer = Mp4Writer::create(&folder.path().join("a.mp4"), VideoOptions::default()).expect("created");
    writer.finish().expect("finished");
    writer.finish().expect("finished twice");
}

#[test]
fn stills_can_be_read_back() {
    let folder = tempfile::tempdir().expect("a folder");
    let image = picture(64, 48, 1);
    let (png, jpeg) = (folder.path().join("a.png"), folder.path().join("a.jpg"));
    pursuit_media::output::write_png(&png, image.view()).expect("written");
    pursuit_media::output::write_jpeg(&jpeg, image.view(), 92).expect("written");
    assert_eq!(read(&png)[0].1, image);
    assert!(psnr(&read(&jpeg)[0].1, &image) > 28.0);
}
