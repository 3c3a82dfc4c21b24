//! The pictures of the README and the book: made by our own program from our own scenes. The page that shows one has the
//! command that makes it beside it.

use crate::{peers, run, snippets};
use anyhow::{Context, Result, bail};
use std::path::{Path, PathBuf};

/// Where they are kept.
const SHELF: &str = "docs/pictures";

/// How one picture is made.
struct Picture {
    file: &'static str,
    /// What a reader types.
    command: &'static str,
    /// What it leaves that is the picture.
    product: &'static str,
}

const PICTURES: &[Picture] = &[
    Picture {
        file: "rally.webp",
        command: "pursuit track 'scene:table-tennis?seed=7' --detect ball --set color=yellow --out rally",
        product: "rally/overlay.mp4",
    },
    Picture {
        file: "turn.svg",
        command: "pursuit track 'scene:motion?motion=turn&fps=5&seed=1' --tracker kcf --plots --out turn",
        product: "turn/plots/x.svg",
    },
    Picture {
        file: "hidden.svg",
        command: "pursuit track 'scene:occluding-bar?seed=3&duration=5' --tracker pursuit-light --plots --out hidden",
        product: "hidden/plots/score.svg",
    },
    Picture {
        file: "thrown.svg",
        command: "pursuit calibrate 'scene:motion?motion=throw&fps=240&gravity=1962&duration=1&width=960&height=540&speed=400' --scale 40,500,440,500=2m --true-fps 240\n\
                  pursuit track 'scene:motion?motion=throw&fps=240&gravity=1962&duration=1&width=960&height=540&speed=400' --fps 30 --tracker mosse --out thrown\n\
                  pursuit measure thrown --calibration calibration.toml --measure-fit parabola",
        product: "thrown/plots/measure-acceleration.svg",
    },
    Picture {
        file: "kalman.svg",
        command: "cargo run --release -p pursuit --example tour -- kalman",
        product: "kalman.svg",
    },
    Picture { file: "imm.svg", command: "cargo run --release -p pursuit --example tour -- imm", product: "imm.svg" },
    Picture {
        file: "smooth.svg",
        command: "cargo run --release -p pursuit --example tour -- smooth",
        product: "smooth.svg",
    },
    Picture {
        file: "associate.svg",
        command: "cargo run --release -p pursuit --example tour -- associate",
        product: "associate.svg",
    },
    Picture {
        file: "honesty.svg",
        command: "cargo run --release -p pursuit --example tour -- honesty",
        product: "honesty.svg",
    },
    Picture {
        file: "steer.svg",
        command: "cargo run --release -p pursuit --features ptz --example tour -- steer",
        product: "steer.svg",
    },
];

/// Makes those of these files, or all.
pub fn make(files: &[String]) -> Result<()> {
    run::build_programs()?;
    let path = snippets::path(&snippets::programs()?)?;
    for picture in PICTURES.iter().filter(|p| files.is_empty() || files.iter().any(|f| f == p.file)) {
        let folder = folder()?;
        // The programs of `examples` are built already.
        let command = match picture.command.split_once("--example tour -- ") {
            Some((_, name)) => format!("tour {name}"),
            None => picture.command.to_owned(),
        };
        run::program("bash").args(["-c", &command]).in_folder(&folder).env("PATH", &path).quietly(picture.command)?;
        let (from, to) = (folder.join(picture.product), run::root().join(SHELF).join(picture.file));
        if picture.product.ends_with(".mp4") {
            animate(&from, &to)?;
        } else {
            std::fs::copy(&from, &to).with_context(|| from.display().to_string())?;
        }
        println!("pictures: {}", to.display());
    }
    Ok(())
}

/// An empty folder to make pictures in.
fn folder() -> Result<PathBuf> {
    let folder = std::path::absolute(run::target_dir().join("pictures"))?;
    if folder.exists() {
        std::fs::remove_dir_all(&folder)?;
    }
    std::fs::create_dir_all(&folder)?;
    Ok(folder)
}

/// Seven seconds of a film as an animated picture that web pages show: fewer frames, smaller, again and again.
fn animate(film: &Path, picture: &Path) -> Result<()> {
    let ask = run::program(peers::environment("pictures-tools", "pictures.txt")?)
        .args(["-c", "import imageio_ffmpeg; print(imageio_ffmpeg.get_ffmpeg_exe(), end='')"]);
    let ffmpeg = String::from_utf8(ask.output()?)?;
    run::program(ffmpeg)
        .args(["-loglevel", "error", "-y", "-ss", "2.6", "-t", "7", "-i"])
        .arg(film)
        .args([
            "-vf",
            "fps=12.5,scale=560:-2:flags=lanczos",
            "-c:v",
            "libwebp_anim",
            "-quality",
            "50",
            "-loop",
            "0",
            "-an",
        ])
        .arg(picture)
        .run()
}

/// Whether each picture is there, small enough, and shown by a page that has its command.
pub fn check() -> Result<()> {
    let listed =
        run::program("git").args(["ls-files", "--cached", "--others", "--exclude-standard", "*.md"]).output()?;
    let listed = String::from_utf8(listed)?;
    let read = |path: &str| std::fs::read_to_string(run::root().join(path)).unwrap_or_default();
    let pages: Vec<String> = listed.lines().filter(|p| !p.starts_with("docs/log/")).map(read).collect();
    for Picture { file, command, .. } in PICTURES {
        let size =
            std::fs::metadata(run::root().join(SHELF).join(file)).with_context(|| format!("{SHELF}/{file}"))?.len();
        if size > 1_500_000 {
            bail!("{SHELF}/{file} has {size} bytes; a page should load at once");
        }
        if !pages.iter().any(|page| page.contains(&format!("pictures/{file}")) && page.contains(command)) {
            bail!("no page shows {SHELF}/{file} with the command that makes it: {command}");
        }
    }
    println!("pictures: {} are there, each beside its command", PICTURES.len());
    Ok(())
}
