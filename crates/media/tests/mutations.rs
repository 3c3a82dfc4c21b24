//! Spoiled copies of every fixture through every parser: no panic, no hang, bounded memory. The same every time; the
//! fuzz targets under `fuzz/` search further from the same functions.
#![cfg(feature = "h264")]
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use common::fixture;
use pursuit_media::fuzz_entry;
use pursuit_testkit::SplitMix;
use std::time::Duration;

/// A parser, the fixtures that go through it, and spoiled copies of each.
type Case = (fn(&[u8]) -> usize, &'static [&'static str], usize);

const CASES: [Case; 5] = [
    (
        fuzz_entry::mp4,
        &["b_frames.mp4", "baseline.mp4", "cropped.mp4", "dash.mp4", "edited.mp4", "rotated.mp4", "high10.mp4"],
        150,
    ),
    (fuzz_entry::avi, &["mjpeg.avi"], 300),
    (fuzz_entry::mjpeg, &["mjpeg.avi"], 100),
    (fuzz_entry::y4m, &["color.y4m", "gray.y4m", "gray16.y4m"], 100),
    (fuzz_entry::list, &["frames.csv"], 100),
];

/// Flips bits, overwrites, cuts, repeats and removes pieces: one to four of these.
fn spoiled(bytes: &[u8], random: &mut SplitMix) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    for _ in 0..=random.below(4) {
        if bytes.is_empty() {
            break;
        }
        let at = random.below(bytes.len());
        // Headers are small and matter most: every other change goes there.
        let at = if random.below(2) == 0 { at.min(random.below(1200)) } else { at };
        let end = (at + 1 + random.below(64)).min(bytes.len());
        match random.below(7) {
            0 => bytes[at] ^= 1 << random.below(8),
            1 => bytes[at] = [0, 0xFF, 0x7F, 0x80][random.below(4)],
            2 => bytes[at..end].fill(random.draw() as u8),
            3 => bytes.truncate(at),
            4 => drop(bytes.drain(at..end)),
            5 => {
                let piece = bytes[at..end].to_vec();
                let to = random.below(bytes.len());
                bytes.splice(to..to, piece);
            }
            _ => bytes[at..end].iter_mut().for_each(|b| *b = random.draw() as u8),
        }
    }
    bytes
}

fn run_all() -> usize {
    let mut random = SplitMix(2026);
    let mut decoded = 0;
    for (parse, fixtures, copies) in CASES {
        for name in fixtures {
            let whole = std::fs::read(fixture(name)).unwrap();
            (0..copies).for_each(|_| decoded += parse(&spoiled(&whole, &mut random)));
        }
    }
    decoded
}

#[test]
fn spoiled_videos_never_panic_hang_or_swell() {
    let (done, finished) = std::sync::mpsc::channel();
    let worker = std::thread::spawn(move || done.send(run_all()).unwrap());
    // Takes seconds; minutes mean that some input is never finished with.
    let decoded = finished.recv_timeout(Duration::from_secs(300));
    let decoded = decoded.unwrap_or_else(|_| panic!("an input hangs or panicked: {:?}", worker.is_finished()));
    assert!(decoded > 1000, "only {decoded} frames: the copies are spoiled beyond use");
    if let Some(peak_kib) = peak_memory_kib() {
        assert!(peak_kib < 1 << 20, "{peak_kib} KiB");
    }
}

/// The most memory this process ever had, where the system tells.
fn peak_memory_kib() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?.split_whitespace().next()?.parse().ok()
}

#[test]
fn spoiled_images_never_panic() {
    let avi = std::fs::read(fixture("mjpeg.avi")).unwrap();
    let start = avi.windows(3).position(|w| w == [0xFF, 0xD8, 0xFF]).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let mut seeds = vec![avi[start..start + 3000].to_vec()];
    for (name, pixels) in pngs() {
        let path = folder.path().join(name);
        pursuit_media::wrappers::write_png(&pursuit_imaging::Frame::new(0, 0.0, pixels), &path).unwrap();
        seeds.push(std::fs::read(path).unwrap());
    }
    let mut random = SplitMix(7);
    for seed in &seeds {
        (0..300).for_each(|_| _ = fuzz_entry::image(&spoiled(seed, &mut random)));
    }
}

fn pngs() -> [(&'static str, pursuit_imaging::Pixels); 3] {
    use pursuit_imaging::Image;
    [
        ("gray.png", Image::from_fn(31, 17, |x, y| (x * y) as u8).unwrap().into()),
        ("gray16.png", Image::from_fn(31, 17, |x, y| (x * y * 99) as u16).unwrap().into()),
        ("rgb.png", Image::from_fn(31, 17, |x, y| [x as u8, y as u8, 7]).unwrap().into()),
    ]
}
