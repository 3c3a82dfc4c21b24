//! Many targets in large pictures, to be timed beside other trackers (`cargo xtask peers crowd`).
//!
//! `crowd write DIR [FRAMES]` films the scene `crowd` (20 targets, 1280x720) as PNG images with `boxes.csv`, the truth;
//! `crowd run DIR TRACKER [THREADS]` follows all targets from their first boxes on and prints what came of it as JSON.
//! Frames are decoded beforehand; planes derived from them (grey, colour) count, and are shared by the targets.

use pursuit::geometry::BBox;
use pursuit::imaging::Frame;
use pursuit::media::OpenOptions;
use pursuit::media::output::write_png;
use pursuit::tracking::{MultiTracker, TargetSet};
use rustix::time::{ClockId, clock_gettime};
use std::collections::BTreeMap;
use std::error::Error;
use std::path::Path;
use std::time::{Duration, Instant};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match &arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["write", folder] => write(Path::new(folder), 30),
        ["write", folder, frames] => write(Path::new(folder), frames.parse()?),
        ["run", folder, tracker] => run(Path::new(folder), tracker, 0),
        ["run", folder, tracker, threads] => run(Path::new(folder), tracker, threads.parse()?),
        _ => Err("usage: crowd write DIR [FRAMES] | crowd run DIR TRACKER [THREADS]".into()),
    }
}

fn write(folder: &Path, frames: u64) -> Result<(), Box<dyn Error>> {
    let scene = pursuit::scenes::open("scene:crowd?duration=3600")?;
    std::fs::create_dir_all(folder.join("images"))?;
    let mut truth = String::from("frame,target,x,y,w,h\n");
    for frame in 0..frames {
        let moment = scene.render(scene.frame_time_s(frame));
        write_png(&folder.join(format!("images/{frame:06}.png")), moment.image.view())?;
        for (target, bbox) in moment.targets.iter().enumerate().filter_map(|(i, t)| Some((i + 1, t.visible()?))) {
            let (x, y, w, h) = (bbox.left(), bbox.top(), bbox.width(), bbox.height());
            truth += &format!("{frame},{target},{x:.4},{y:.4},{w:.4},{h:.4}\n");
        }
    }
    Ok(std::fs::write(folder.join("boxes.csv"), truth)?)
}

/// The true boxes of every frame, in order of the targets.
fn read_truth(folder: &Path) -> Result<Vec<Vec<BBox>>, Box<dyn Error>> {
    let mut frames: BTreeMap<u64, Vec<BBox>> = BTreeMap::new();
    for line in std::fs::read_to_string(folder.join("boxes.csv"))?.lines().skip(1) {
        let cells = line.split(',').map(str::parse).collect::<Result<Vec<f64>, _>>()?;
        let [frame, _, x, y, w, h] = cells[..] else { return Err(format!("`{line}` has not six cells").into()) };
        frames.entry(frame as u64).or_default().push(BBox::from_ltwh(x, y, w, h));
    }
    Ok(frames.into_values().collect())
}

fn read_frames(folder: &Path) -> Result<Vec<Frame>, Box<dyn Error>> {
    let mut source = pursuit::media::open(folder.join("images"), &OpenOptions::default())?;
    let mut frames = Vec::new();
    while let Some(frame) = source.next_frame()? {
        frames.push(frame);
    }
    Ok(frames)
}

fn run(folder: &Path, tracker: &str, threads: usize) -> Result<(), Box<dyn Error>> {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build_global()?;
    let (truth, frames) = (read_truth(folder)?, read_frames(folder)?);
    let recipe = pursuit::recipe(tracker)?;
    let mut targets = TargetSet::new();
    let first = frames.first().ok_or("there are no frames")?;
    for bbox in &truth[0] {
        targets.add(&*recipe, first, *bbox)?;
    }
    let mut tracks = Vec::new();
    let (mut overlaps, mut seconds, mut processor) = (Vec::new(), 0.0, Duration::ZERO);
    for (frame, truth) in frames.iter().zip(&truth).skip(1) {
        let (began, before) = (Instant::now(), processor_time());
        targets.step(frame, &mut tracks)?;
        seconds += began.elapsed().as_secs_f64();
        processor += processor_time() - before;
        overlaps
            .extend(tracks.iter().zip(truth).map(|(track, t)| track.estimate.as_ref().map_or(0.0, |e| e.bbox.iou(t))));
    }
    let updates = frames.len() - 1;
    let good = overlaps.iter().filter(|o| **o > 0.5).count() as f64 / overlaps.len() as f64;
    let mean = overlaps.iter().sum::<f64>() / overlaps.len() as f64;
    println!(
        "{{\"frames\": {updates}, \"targets\": {}, \"seconds\": {seconds:.6}, \"processor_seconds\": {:.6}, \
         \"mean_overlap\": {mean:.4}, \"success50\": {good:.4}}}",
        targets.len(),
        processor.as_secs_f64()
    );
    Ok(())
}

/// Processor time of all threads.
fn processor_time() -> Duration {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    Duration::new(time.tv_sec.unsigned_abs(), time.tv_nsec.unsigned_abs() as u32)
}
