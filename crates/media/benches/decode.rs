//! Decoding 1280×720 H.264 to grey, the way a grey-only tracker reads a video.
//!
//! The clip (120 frames of ffmpeg's test picture, x264 at its defaults, 2.5 Mbit/s) is made with an `ffmpeg` from `PATH`;
//! without one the bench says so and does nothing. For comparison the same clip goes through the ffmpeg process, too.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use pursuit_media::wrappers::Prefetch;
use pursuit_media::{OpenOptions, Source, open};
use std::hint::black_box;
use std::path::Path;
use std::process::Command;

const FRAMES: u64 = 120;

fn decode_all(mut source: impl Source) {
    let mut frames = 0;
    while let Ok(Some(frame)) = source.next_frame() {
        black_box(frame.gray().row(0));
        frames += 1;
    }
    assert_eq!(frames, FRAMES);
}

fn decode(c: &mut Criterion) {
    let options = OpenOptions::from_env();
    let (Some(ffmpeg), Ok(folder)) = (options.find_ffmpeg(), tempfile::tempdir()) else {
        return println!("skipped: no ffmpeg on the PATH to make the clip with");
    };
    let make = |name: &str, words: &[&str]| {
        let path = folder.path().join(name);
        let made = Command::new(&ffmpeg).args(["-nostdin", "-v", "error"]).args(words).arg(&path).status();
        made.is_ok_and(|status| status.success()).then_some(path)
    };
    let picture = ["-f", "lavfi", "-i", "testsrc2=size=1280x720:rate=30", "-frames:v", "120"];
    let codec = ["-pix_fmt", "yuv420p", "-c:v", "libx264", "-b:v", "2500k"];
    let Some(mp4) = make("clip.mp4", &[&picture[..], &codec[..]].concat()) else {
        return println!("skipped: this ffmpeg cannot encode H.264");
    };
    let mp4_name = mp4.to_string_lossy().into_owned();
    let Some(mkv) = make("clip.mkv", &["-i", &mp4_name, "-c", "copy"]) else { return };
    let source = |path: &Path| open(path, &options);

    let mut group = c.benchmark_group("h264_720p_to_gray");
    group.throughput(Throughput::Elements(FRAMES)).sample_size(10);
    group.bench_function("built_in", |b| b.iter(|| source(&mp4).map(decode_all)));
    group.bench_function("built_in_prefetched", |b| {
        b.iter(|| source(&mp4).and_then(|s| Prefetch::new(s, 4)).map(decode_all));
    });
    group.bench_function("ffmpeg_process", |b| b.iter(|| source(&mkv).map(decode_all)));
    group.finish();
}

criterion_group!(benches, decode);
criterion_main!(benches);
