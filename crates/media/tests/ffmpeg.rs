//! The path through an `ffmpeg` process. Skipped, saying so, where none is found: set `PURSUIT_TEST_FFMPEG` or `PATH`.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]
#![allow(clippy::disallowed_methods, reason = "variables say where ffmpeg is")]

mod common;

use common::{all_frames, fixture, hash, hashes_beside};
use pursuit_imaging::Frame;
use pursuit_media::wrappers::Prefetch;
use pursuit_media::{MediaError, OpenOptions, Source, open};
use std::io::{Read, Write};
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

fn options() -> Option<OpenOptions> {
    let ffmpeg = std::env::var_os("PURSUIT_TEST_FFMPEG").map(PathBuf::from);
    let options = OpenOptions { ffmpeg, search_path: std::env::var_os("PATH"), ..OpenOptions::default() };
    let found = options.find_ffmpeg().is_some();
    if !found {
        println!("skipped: no ffmpeg; set PURSUIT_TEST_FFMPEG to one");
    }
    found.then_some(options)
}

fn open_named(path: &Path, options: &OpenOptions) -> Box<dyn Source> {
    open(path.to_str().unwrap(), options).unwrap_or_else(|e| panic!("{e}"))
}

fn lines(frames: &[Frame]) -> Vec<String> {
    frames.iter().map(|f| format!("{}, {:.6}, {}", f.index(), f.time_s(), hash(f))).collect()
}

#[test]
fn other_codecs_come_through_bit_by_bit() {
    let Some(options) = options() else { return };
    let mut source = open_named(&fixture("vp9.webm"), &options);
    assert_eq!((source.info().decoder.as_str(), source.info().live), ("ffmpeg: vp9", false));
    assert_eq!(lines(&all_frames(&mut *source)), hashes_beside("vp9.webm"));
}

#[test]
fn h264_that_is_not_built_in_falls_back() {
    let Some(options) = options() else { return };
    for name in ["high10.mp4", "interlaced.mp4"] {
        let mut source = open_named(&fixture(name), &options);
        assert!(source.info().decoder.starts_with("ffmpeg"), "{name}");
        let frames = all_frames(&mut *source);
        let times: Vec<_> = frames.iter().map(|f| (f.time_s() * 1000.0).round()).collect();
        assert_eq!(times, [0.0, 40.0, 80.0, 120.0], "{name}");
    }
}

/// Makes a file with the ffmpeg under test.
fn make(options: &OpenOptions, words: &[&str], output: &Path) {
    let mut command = Command::new(options.find_ffmpeg().unwrap());
    let status = command.args(["-nostdin", "-v", "error", "-y"]).args(words).arg(output).status().unwrap();
    assert!(status.success(), "{words:?}");
}

#[test]
fn variable_frame_rates_stay_variable() {
    let Some(options) = options() else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("vfr.mkv");
    // Matroska is not read here, so the same H.264 goes through ffmpeg.
    make(&options, &["-i", fixture("vfr.mp4").to_str().unwrap(), "-c", "copy"], &path);
    assert_eq!(lines(&all_frames(&mut *open_named(&path, &options))), hashes_beside("vfr.mp4"));
}

#[test]
fn sixteen_bit_grey_stays_sixteen_bit() {
    let Some(options) = options() else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("thermal.mkv");
    make(&options, &["-i", fixture("gray16.y4m").to_str().unwrap(), "-c:v", "ffv1"], &path);
    let frames = all_frames(&mut *open_named(&path, &options));
    assert!(frames[0].gray16().is_some());
    let hashes = |frames: &[Frame]| frames.iter().map(hash).collect::<Vec<_>>();
    assert_eq!(hashes(&frames), hashes(&all_frames(&mut *open_named(&fixture("gray16.y4m"), &options))));
}

#[test]
fn names_that_look_like_options_or_addresses_are_names() {
    let Some(options) = options() else { return };
    let folder = tempfile::tempdir().unwrap();
    for name in ["-y.webm", "a b'c$(d).webm", "concat:x.webm", "%03d.webm"] {
        let path = folder.path().join(name);
        std::fs::copy(fixture("vp9.webm"), &path).unwrap();
        assert_eq!(all_frames(&mut *open_named(&path, &options)).len(), 6, "{name}");
    }
}

#[test]
fn what_ffmpeg_says_is_in_the_error() {
    let Some(options) = options() else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("notes.mkv");
    std::fs::write(&path, "hello, this is no video").unwrap();
    let error = open(path.to_str().unwrap(), &options).err().unwrap();
    assert!(matches!(error, MediaError::Unreadable { .. }));
    let text = error.to_string();
    assert!(text.contains("notes.mkv") && text.contains("Invalid data") && !text.contains('\n'), "{text}");

    let options = OpenOptions { ffmpeg: Some("/no/such/ffmpeg".into()), ..options };
    let text = open(path.to_str().unwrap(), &options).err().unwrap().to_string();
    assert!(text.contains("/no/such/ffmpeg cannot be started"), "{text}");
}

#[test]
fn damage_is_reported_after_what_could_be_read() {
    let Some(options) = options() else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("damaged.avi");
    make(&options, &["-f", "lavfi", "-i", "testsrc2=size=320x240:rate=25", "-t", "2", "-c:v", "mpeg4"], &path);
    let mut bytes = std::fs::read(&path).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle..middle + 3000].fill(0xA5);
    std::fs::write(&path, bytes).unwrap();
    let mut source = open_named(&path, &options);
    let mut seen = 0;
    let error = loop {
        match source.next_frame() {
            Ok(Some(_)) => seen += 1,
            Ok(None) => panic!("the damage was not noticed"),
            Err(error) => break error,
        }
    };
    assert!(seen >= 20, "{seen}");
    assert!(error.frame().is_some() && error.to_string().contains("ffmpeg:"), "{error}");
}

/// Serves `content` to every request, on a port of its own.
fn serve(content: Vec<u8>) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = format!("http://{}/clip.webm", listener.local_addr().unwrap());
    std::thread::spawn(move || {
        for mut stream in listener.incoming().flatten() {
            _ = stream.read(&mut [0; 4096]);
            let head = format!("HTTP/1.0 200 OK\r\nContent-Length: {}\r\n\r\n", content.len());
            _ = stream.write_all(head.as_bytes()).and_then(|()| stream.write_all(&content));
        }
    });
    address
}

#[test]
fn web_addresses_are_read() {
    let Some(options) = options() else { return };
    let mut source = open(serve(std::fs::read(fixture("vp9.webm")).unwrap()), &options).unwrap();
    assert_eq!(lines(&all_frames(&mut *source)), hashes_beside("vp9.webm"));
    let refused = open("http://127.0.0.1:9/clip.mp4", &options).err().unwrap().to_string();
    assert!(refused.contains("127.0.0.1") && refused.contains("refused"), "{refused}");
}

/// Serves `content`, by parts where a request names one and `parts` are sent; gives the address and how many parts were asked for.
fn serve_parts(content: Vec<u8>, parts: bool) -> (String, Arc<AtomicUsize>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = format!("http://{}/clip.mp4", listener.local_addr().unwrap());
    let asked = Arc::new(AtomicUsize::new(0));
    let counted = Arc::clone(&asked);
    let content = Arc::new(content);
    std::thread::spawn(move || {
        for mut stream in listener.incoming().flatten() {
            let (content, counted) = (Arc::clone(&content), Arc::clone(&counted));
            std::thread::spawn(move || {
                let mut request = [0; 4096];
                let read = stream.read(&mut request).unwrap_or(0);
                let request = String::from_utf8_lossy(&request[..read]).to_ascii_lowercase();
                let from =
                    request.split_once("range: bytes=").and_then(|(_, rest)| rest.split('-').next()?.parse().ok());
                let (from, all) = (from.unwrap_or(0_usize).min(content.len()), content.len());
                let head = if parts {
                    counted.fetch_add(usize::from(from > 0), Ordering::Relaxed);
                    let last = all - 1;
                    format!("206 Partial Content\r\nAccept-Ranges: bytes\r\nContent-Range: bytes {from}-{last}/{all}")
                } else {
                    "200 OK".to_owned()
                };
                let body = if parts { &content[from..] } else { &content[..] };
                let head = format!("HTTP/1.1 {head}\r\nContent-Length: {}\r\nConnection: close\r\n\r\n", body.len());
                _ = stream.write_all(head.as_bytes()).and_then(|()| stream.write_all(body));
            });
        }
    });
    (address, asked)
}

/// The index of this file is at its end, as cameras and editors leave it: more than anybody reads ahead lies before it.
#[test]
fn mp4_with_its_index_at_the_end_is_read_by_parts() {
    let Some(options) = options() else { return };
    let mut content = std::fs::read(fixture("b_frames.mp4")).unwrap();
    let index = content.windows(4).position(|w| w == b"moov").unwrap() - 4;
    let mut free = vec![0; 2 << 20];
    let len = u32::try_from(free.len()).unwrap();
    free[..4].copy_from_slice(&len.to_be_bytes());
    free[4..8].copy_from_slice(b"free");
    content.splice(index..index, free);

    let (address, asked) = serve_parts(content.clone(), true);
    let mut source = open(address, &options).unwrap_or_else(|e| panic!("{e}"));
    let whole = open_named(&fixture("b_frames.mp4"), &options).info().frame_count.unwrap();
    assert_eq!(all_frames(&mut *source).len() as u64, whole);
    assert!(asked.load(Ordering::Relaxed) >= 1);

    let (address, _) = serve_parts(content, false);
    let refused = open(address, &options).err().unwrap().to_string();
    for word in ["127.0.0.1", "index (moov)", "byte ranges", "download the file", "+faststart"] {
        assert!(refused.contains(word), "{word}: {refused}");
    }
}

/// Whether a process of this system still has this word in its command line.
/// Credentials reach the server, and nobody else: not the list of processes, not the name, not the errors.
#[test]
fn credentials_reach_the_server_alone() {
    let Some(options) = options() else { return };
    let content = std::fs::read(fixture("vp9.webm")).unwrap();
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let host = listener.local_addr().unwrap();
    std::thread::spawn(move || {
        for mut stream in listener.incoming().flatten() {
            let mut request = [0; 4096];
            let read = stream.read(&mut request).unwrap_or(0);
            let request = String::from_utf8_lossy(&request[..read]).into_owned();
            // "watch:it's99" in base64.
            let head = match request.contains("Authorization: Basic d2F0Y2g6aXQnczk5") {
                true => format!("HTTP/1.0 200 OK\r\nContent-Length: {}\r\n\r\n", content.len()),
                false => "HTTP/1.0 401 Unauthorized\r\nWWW-Authenticate: Basic realm=\"x\"\r\n\r\n".to_owned(),
            };
            _ = stream.write_all(head.as_bytes()).and_then(|()| stream.write_all(&content));
        }
    });
    let address = |password: &str| format!("http://watch:{password}@{host}/clip.webm");
    let mut source = open(address("it's99"), &options).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!((source.info().name.as_str(), source.info().live), (address("***").as_str(), false));
    if cfg!(target_os = "linux") {
        assert!(!is_running("it's99"));
    }
    assert_eq!(lines(&all_frames(&mut *source)), hashes_beside("vp9.webm"));
    let refused = open(address("wrong99"), &options).err().unwrap().to_string();
    assert!(refused.contains("401") && refused.contains(&address("***")), "{refused}");
    assert!(!refused.contains("wrong99"), "{refused}");
    let taken = OpenOptions { live: Some(true), ..options };
    assert!(open(address("it's99"), &taken).unwrap().info().live);
}

fn is_running(word: &str) -> bool {
    let processes = std::fs::read_dir("/proc").into_iter().flatten().flatten();
    processes
        .filter_map(|p| std::fs::read(p.path().join("cmdline")).ok())
        .any(|line| String::from_utf8_lossy(&line).contains(word))
}

#[test]
fn dropping_a_source_ends_its_process() {
    let Some(options) = options() else { return };
    if !Path::new("/proc/self/cmdline").exists() {
        return println!("skipped: processes are listed in /proc only on Linux");
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("long_enough.mkv");
    make(&options, &["-f", "lavfi", "-i", "testsrc2=size=640x480:rate=25", "-t", "20", "-c:v", "mpeg4"], &path);
    let word = path.to_str().unwrap().to_owned();
    let mut source = open_named(&path, &options);
    source.next_frame().unwrap().unwrap();
    assert!(is_running(&word), "it waits for us to read on");
    drop(source);
    assert!(!is_running(&word));

    let mut source = Prefetch::new(open_named(&path, &options), 3).unwrap();
    source.next_frame().unwrap().unwrap();
    assert!(is_running(&word));
    drop(source);
    assert!(!is_running(&word), "also from behind another thread");
}
