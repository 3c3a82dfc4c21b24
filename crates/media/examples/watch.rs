//! Watches an input for some seconds and prints what came, a line a frame: number, time, width, height. At the end what
//! befell it, as `key=value`; exit status 3 when it ended by a failure.
//!
//!     cargo run --features rtsp --example watch -- rtsp://127.0.0.1:8554/clip.mp4 10 [STALL [RECONNECT [ffmpeg]]]
//!
//! With `ffmpeg` it leaves RTSP to that program.
#![allow(clippy::print_stdout, clippy::print_stderr)]

use pursuit_media::wrappers::{Patience, Prefetch, Reconnect};
use pursuit_media::{OpenOptions, Source, open};
use std::process::ExitCode;
use std::time::Duration;

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [input, numbers @ ..] = words.as_slice() else {
        eprintln!("watch INPUT [SECONDS [STALL [RECONNECT [ffmpeg]]]]");
        return ExitCode::from(2);
    };
    let number = |at: usize, otherwise: f64| numbers.get(at).and_then(|n| n.parse().ok()).unwrap_or(otherwise);
    let seconds = |s: f64| Duration::try_from_secs_f64(s).unwrap_or_default();
    let limit = seconds(number(2, 60.0));
    let reconnect = if limit.is_zero() { Reconnect::Never } else { Reconnect::For(limit) };
    let patience = Patience { stall: seconds(number(1, 5.0)), reconnect };
    let rtsp_by_ffmpeg = numbers.get(3).is_some_and(|word| word == "ffmpeg");
    let result = open(input, &OpenOptions { patience, rtsp_by_ffmpeg, ..OpenOptions::from_env() });
    let source = match result {
        Ok(source) => source,
        Err(error) => {
            eprintln!("error: {error}");
            return ExitCode::from(3);
        }
    };
    println!("# {} live={} {}", source.info().name, source.info().live, source.info().decoder);
    let stats = source.info().stream.clone();
    let failure = match Prefetch::new(source, 8) {
        Ok(mut source) => watch(&mut source, seconds(number(0, 1e9))),
        Err(error) => Some(error),
    };
    if let Some(counts) = stats.map(|s| s.counts()) {
        println!(
            "# stalls={} breaks={} reconnects={} failed_attempts={} damaged={} longest_gap_s={:.3}",
            counts.stalls,
            counts.breaks,
            counts.reconnects,
            counts.failed_attempts,
            counts.damaged,
            counts.longest_gap_s
        );
    }
    match failure {
        Some(error) => {
            eprintln!("error: {error}");
            ExitCode::from(3)
        }
        None => ExitCode::SUCCESS,
    }
}

/// Prints frames until the source ends or the time is over.
fn watch(source: &mut Prefetch, time: Duration) -> Option<pursuit_media::MediaError> {
    let stop = source.stop_handle();
    std::thread::spawn(move || {
        std::thread::sleep(time);
        stop.iter().for_each(pursuit_media::input::StopHandle::stop);
    });
    loop {
        match source.next_frame() {
            Ok(Some(frame)) => {
                let size = frame.size();
                println!("{} {:.6} {} {}", frame.index(), frame.time_s(), size.width, size.height);
            }
            Ok(None) => return None,
            Err(error) if error.is_damage() => eprintln!("{error}"),
            Err(error) => return Some(error),
        }
    }
}
