//! Bad input and bad output: a one-line error that names the thing and the mend, the right exit status, nothing lost.

use crate::common::{command, fails, pursuit, rows, stderr};
use std::io::Write;
use std::path::Path;
use std::process::{Output, Stdio};

fn track(input: &Path, more: &[&str]) -> Output {
    let out = tempfile::tempdir().unwrap();
    let args = ["track", input.to_str().unwrap(), "--out", out.path().to_str().unwrap(), "--no-video"];
    pursuit(&[&args[..], more].concat())
}

fn detect(input: &Path) -> Output {
    track(input, &["--detect", "ball", "--set", "color=orange"])
}

/// A grey PNG, made row by row.
fn png(width: u32, height: u32) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_compression(png::Compression::Fast);
    let mut writer = encoder.write_header().unwrap();
    let mut rows = writer.stream_writer().unwrap();
    let row = vec![90; 3 * width as usize];
    (0..height).for_each(|_| rows.write_all(&row).unwrap());
    rows.finish().unwrap();
    drop(writer);
    bytes
}

#[test]
fn files_that_are_not_video() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        path
    };
    fails(&detect(&folder.path().join("absent.mp4")), 3, &["absent.mp4"]);
    fails(&detect(&file("empty.mp4", b"")), 3, &["empty.mp4", "empty"]);
    fails(&detect(&file("words.mp4", b"these are words, not a video, and quite a few of them")), 3, &["words.mp4"]);
    fails(&detect(&file("box.mp4", b"\0\0\0\x18ftypisom\0\0\x02\0isomiso2")), 3, &["box.mp4"]);
    fails(&detect(folder.path().join("nothing").as_path()), 3, &["nothing"]);
    let empty = folder.path().join("no-images");
    std::fs::create_dir(&empty).unwrap();
    fails(&detect(&empty), 3, &["no-images"]);
}

#[test]
fn a_png_bomb_is_refused_from_its_header() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("0001.png"), png(10_000, 10_000)).unwrap();
    fails(&detect(folder.path()), 3, &["0001.png", "10000"]);
}

#[test]
fn a_folder_of_mixed_sizes_keeps_what_was_tracked() {
    let folder = tempfile::tempdir().unwrap();
    let (images, out) = (folder.path().join("images"), folder.path().join("out"));
    std::fs::create_dir(&images).unwrap();
    for (i, size) in [(64, 48), (64, 48), (80, 48), (64, 48)].into_iter().enumerate() {
        std::fs::write(images.join(format!("{i}.png")), png(size.0, size.1)).unwrap();
    }
    let args = [
        "track",
        images.to_str().unwrap(),
        "--out",
        out.to_str().unwrap(),
        "--box",
        "10,10,20,20",
        "--tracker",
        "ball",
    ];
    fails(&pursuit(&args), 3, &["2.png", "80x48", "64x48"]);
    assert_eq!(rows(&out.join("trajectory.csv")).len(), 2);
    let run: serde_json::Value = serde_json::from_slice(&std::fs::read(out.join("run.json")).unwrap()).unwrap();
    assert_eq!(run["status"], "broken");
    assert!(std::fs::metadata(out.join("overlay.mp4")).unwrap().len() > 500);
}

#[test]
fn boxes_that_cannot_be_started_on() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("1.png"), png(64, 48)).unwrap();
    for (bbox, problem) in [
        ("10,10,0,5", "empty"),
        ("10,10,-4,5", "empty"),
        ("100,10,5,5", "outside"),
        ("-50,-50,20,20", "outside"),
        ("NaN,1,5,5", "finite"),
    ] {
        fails(&track(folder.path(), &["--box", bbox, "--tracker", "ball"]), 2, &[problem, "64x48"]);
    }
    fails(&track(folder.path(), &[]), 2, &["--box", "--detect"]);
}

#[test]
fn outputs_that_cannot_be_written() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    std::fs::write(&file, "in the way").unwrap();
    let to = |out: &Path| {
        let out = out.to_str().unwrap();
        pursuit(&[
            "track",
            "scene:table-tennis",
            "--detect",
            "ball",
            "--set",
            "color=yellow",
            "--to",
            "30",
            "--out",
            out,
        ])
    };
    fails(&to(&file.join("under")), 4, &["file"]);
    // Read-only even for the administrator.
    if Path::new("/proc/self").exists() {
        fails(&to(Path::new("/proc/pursuit")), 4, &["/proc/pursuit"]);
    }
}

/// A full disk: the file is there, writing to it fails. Everything written elsewhere is kept.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_loses_nothing_that_was_written() {
    let folder = tempfile::tempdir().unwrap();
    let run = |full: &str| {
        let out = folder.path().join(full);
        std::fs::create_dir(&out).unwrap();
        std::os::unix::fs::symlink("/dev/full", out.join(full)).unwrap();
        let args = ["track", "scene:table-tennis", "--detect", "ball", "--set", "color=yellow", "--to", "30", "--out"];
        fails(&pursuit(&[&args[..], &[out.to_str().unwrap()]].concat()), 4, &[full]);
        out
    };
    run("trajectory.csv");
    let out = run("overlay.mp4");
    assert!(out.join("trajectory.csv").exists());
}

#[cfg(unix)]
#[test]
fn signals_close_every_file() {
    interrupted(rustix::process::Signal::INT, 130);
    interrupted(rustix::process::Signal::TERM, 143);
}

#[cfg(unix)]
fn interrupted(signal: rustix::process::Signal, status: i32) {
    let out = tempfile::tempdir().unwrap();
    let mut child =
        command(&["track", "-", "--tracker", "ball", "--box", "4,4,16,16", "--out", out.path().to_str().unwrap()])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
    let mut input = child.stdin.take().unwrap();
    input.write_all(b"YUV4MPEG2 W64 H48 F30:1 Ip C420jpeg\n").unwrap();
    for i in 0..40u8 {
        input.write_all(b"FRAME\n").unwrap();
        let frame: Vec<u8> = (0..64 * 48 * 3 / 2).map(|p| (p as u8).wrapping_mul(31).wrapping_add(i)).collect();
        input.write_all(&frame).unwrap();
    }
    input.flush().unwrap();
    // The source stays open: the program must not wait for it. It has seen frames once the trajectory has rows.
    let trajectory = out.path().join("trajectory.csv");
    let seen = || std::fs::read_to_string(&trajectory).is_ok_and(|t| t.lines().count() > 5);
    (0..600).take_while(|_| !seen()).for_each(|_| std::thread::sleep(std::time::Duration::from_millis(50)));
    assert!(seen());
    let process = rustix::process::Pid::from_child(&child);
    rustix::process::kill_process(process, signal).unwrap();
    let output = child.wait_with_output().unwrap();
    drop(input);
    assert_eq!(output.status.code(), Some(status), "{}", stderr(&output));
    let run: serde_json::Value = serde_json::from_slice(&std::fs::read(out.path().join("run.json")).unwrap()).unwrap();
    assert_eq!(run["status"], "interrupted");
    assert_eq!(run["frame_count"].as_u64().unwrap() as usize, rows(&trajectory).len());
    assert!(crate::common::stdout(&output).contains("overlay.mp4"), "it says where the files are");
}

#[test]
fn no_password_is_said() {
    let folder = tempfile::tempdir().unwrap();
    for input in ["rtsp://watch:sesame99@127.0.0.1:9/x", "http://127.0.0.1:9/x?token=sesame99", "smb://a:sesame99@b/c"]
    {
        for more in [&["--box", "1,1,9,9"][..], &["--box", "x"], &["-vv"], &["--depth", input, "--box", "1,1,9,9"]] {
            let mut run = command(&[&["track", input], more].concat());
            let output = run.current_dir(folder.path()).output().unwrap();
            assert_ne!(output.status.code(), Some(0));
            let said = crate::common::stdout(&output) + &stderr(&output);
            assert!(!said.contains("sesame99"), "{said}");
        }
    }
    let left = walk(folder.path());
    assert!(left.iter().all(|name| !name.contains("sesame99")), "{left:?}");
}

/// The names of everything below a folder.
fn walk(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    entries.flat_map(|e| [vec![e.path().display().to_string()], walk(&e.path())].concat()).collect()
}

#[test]
fn no_more_threads_than_the_machine_can_use() {
    let output = pursuit(&["trackers", "--threads", "100000"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(stderr(&output).contains("--threads 100000"), "{}", stderr(&output));
    assert_eq!(stderr(&pursuit(&["trackers", "--threads", "2"])), "");
}

#[test]
fn configurations_with_nonsense() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("run.toml");
    std::fs::write(&file, "inputt = 'x'").unwrap();
    let output = pursuit(&["track", "--config", file.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("inputt") && stderr(&output).contains("run.toml"), "{}", stderr(&output));
    fails(&pursuit(&["track", "--config", "absent.toml"]), 2, &["absent.toml"]);
    for (flag, value) in [("--fps", "0"), ("--fps", "NaN"), ("--fps", "-5")] {
        fails(&pursuit(&["track", "scene:table-tennis", "--detect", "ball", flag, value]), 2, &["frames"]);
    }
}

/// A picture folder of textured frames, and a depth folder with `depth` images (`Sixteen` bits of `mm`, or eight).
fn rgbd(folder: &Path, names: [fn(u32) -> String; 2], depths: u32, bits: png::BitDepth, mm: u16) -> [String; 2] {
    let write = |sub: &str, name: String, color, bits, data: &[u8]| {
        std::fs::create_dir_all(folder.join(sub)).unwrap();
        let file = std::fs::File::create(folder.join(sub).join(name)).unwrap();
        let mut encoder = png::Encoder::new(file, 64, 48);
        encoder.set_color(color);
        encoder.set_depth(bits);
        encoder.write_header().unwrap().write_image_data(data).unwrap();
    };
    for k in 0..8 {
        let at = 12 + 2 * k;
        let pixel = |i: u32| {
            let (x, y) = (i % 64, i / 64);
            let on = (at..at + 20).contains(&x) && (12..36).contains(&y);
            [if on { (x - at) * 11 % 200 + y * 5 % 50 } else { 30 + x % 5 * 4 } as u8, 90, 40]
        };
        let data: Vec<u8> = (0..64 * 48).flat_map(pixel).collect();
        write("rgb", names[0](k), png::ColorType::Rgb, png::BitDepth::Eight, &data);
    }
    for k in 0..depths {
        let data: Vec<u8> = match bits {
            png::BitDepth::Sixteen => (0..64 * 48).flat_map(|_| mm.to_be_bytes()).collect(),
            _ => vec![100; 64 * 48],
        };
        write("depth", names[1](k), png::ColorType::Grayscale, bits, &data);
    }
    ["rgb", "depth"].map(|sub| folder.join(sub).to_str().unwrap().to_owned())
}

#[test]
fn depth_that_is_short_or_empty_is_borne_and_said() {
    let number: fn(u32) -> String = |k| format!("{k:04}.png");
    let later: fn(u32) -> String = |k| format!("{:04}.png", k + 3);
    // Shorter than the pictures; only in part for the same frames; zeros alone.
    for (names, depths, mm, paired) in
        [([number, number], 3, 1500, 3), ([number, later], 8, 1500, 5), ([number, number], 8, 0, 8)]
    {
        let (folder, out) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        let [rgb, depth] = rgbd(folder.path(), names, depths, png::BitDepth::Sixteen, mm);
        let out = out.path().join("out");
        let output = pursuit(&[
            "track",
            &rgb,
            "--depth",
            &depth,
            "--tracker",
            "depth-occlusion",
            "--box",
            "12,12,20,24",
            "--no-video",
            "--out",
            out.to_str().unwrap(),
        ]);
        assert!(output.status.success(), "{depths} {mm}: {}", stderr(&output));
        assert_eq!(rows(&out.join("trajectory.csv")).len(), 8, "nothing is lost");
        let run: serde_json::Value = serde_json::from_slice(&std::fs::read(out.join("run.json")).unwrap()).unwrap();
        let said = run["input"]["depth"].to_string();
        assert!(said.contains(&format!("\"paired\":{paired}")), "{said}");
        assert!(said.contains(&format!("\"unpaired\":{}", 8 - paired)), "{said}");
        let empty = if mm == 0 { 8 } else { 0 };
        assert_eq!(run["empty_depth_frames"], empty);
        assert_eq!(crate::common::stdout(&output).contains("8 of those looked at have no data in it"), empty > 0);
    }
}

#[test]
fn depth_that_makes_no_sense_is_told() {
    let number: fn(u32) -> String = |k| format!("{k:04}.png");
    let stranger: fn(u32) -> String = |k| format!("{}.png", 90_000 + 7 * k);
    let folder = tempfile::tempdir().unwrap();
    let [rgb, depth] = rgbd(folder.path(), [number, number], 8, png::BitDepth::Eight, 0);
    let follow = |rgb: &str, more: &[&str]| {
        let method = ["--tracker", "depth-occlusion", "--box", "12,12,20,24"];
        track(Path::new(rgb), &[&method[..], more].concat())
    };
    fails(&follow(&rgb, &["--depth", &depth]), 3, &["16-bit grey PNG", "0000.png"]);
    let folder = tempfile::tempdir().unwrap();
    let [rgb, depth] = rgbd(folder.path(), [number, number], 8, png::BitDepth::Sixteen, 1500);
    fails(&follow(&rgb, &["--depth", &depth, "--intrinsics", "nan,500,32,24"]), 2, &["finite numbers"]);
    fails(&follow(&rgb, &["--depth", "/no/such/depth"]), 3, &["/no/such/depth"]);
    let folder = tempfile::tempdir().unwrap();
    let [rgb, depth] = rgbd(folder.path(), [number, stranger], 8, png::BitDepth::Sixteen, 1500);
    let output = follow(&rgb, &["--depth", &depth]);
    // Numbers that nobody shares: by order, said, or refused; never silently wrong.
    assert!(output.status.success() || stderr(&output).contains("belongs"), "{}", stderr(&output));
}
