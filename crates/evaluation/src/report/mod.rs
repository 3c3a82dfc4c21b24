//! `report.html`: one file without external resources, with light and dark styles and a layout for narrow screens.

mod html;
mod pictures;
mod sections;

pub(crate) use html::{escape, figure};
pub(crate) use sections::{SCRIPT, STYLE};

use crate::frame_cache::FrameCache;
use crate::metrics::accuracy::overlap;
use crate::run::Passes;
use crate::{EvalOptions, Results, Sequence, Trajectory};
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

/// What a tracker said of one sequence, with the rank that gives it its colour in the report.
pub(crate) struct RankedTrajectory<'a> {
    /// The tracker.
    name: &'a str,
    /// Its rank, which chooses its colour.
    number: usize,
    /// What it said; of several passes the first.
    trajectory: &'a Trajectory,
    /// Frames that were to be had.
    frames: usize,
}

impl RankedTrajectory<'_> {
    /// Every frame with a true box, with the overlap reached.
    fn judged_frames(&self, sequence: &Sequence) -> Vec<(usize, f64)> {
        let start = sequence.first_visible().map_or(0, |(i, _)| i);
        let visible =
            sequence.truth().iter().enumerate().take(self.frames).skip(start).filter(|(_, t)| t.bbox().is_some());
        visible.map(|(i, t)| (i, overlap(t, self.trajectory.get(i)))).collect()
    }
}

/// The page.
pub(crate) fn page(
    options: &EvalOptions,
    sequences: &[Sequence],
    results: &Results,
    kept: &BTreeMap<String, BTreeMap<String, Passes>>,
    stop: &AtomicBool,
) -> String {
    let ranking = results.ranking();
    let trajectories: Vec<Vec<RankedTrajectory<'_>>> = sequences.iter().map(|s| ranked(s, &ranking, kept)).collect();
    let pictures = if options.thumbnails { all_pictures(options, sequences, &trajectories, stop) } else { Vec::new() };
    let mut page = sections::head(results, sequences.len());
    page.push_str(&sections::leaderboard(results, &ranking));
    page.push_str(&sections::comparisons(results));
    page.push_str(&sections::curves(results, &ranking));
    page.push_str(&sections::attribute_table(results, &ranking));
    page.push_str(&sections::sequence_table(results, &ranking, sequences));
    for (i, (sequence, trajectories)) in sequences.iter().zip(&trajectories).enumerate() {
        let pictures = pictures.get(i).map_or("", String::as_str);
        page.push_str(&sections::drill_down(i, sequence, results, trajectories, pictures));
    }
    page.push_str(&sections::foot(results));
    page
}

fn ranked<'a>(
    sequence: &Sequence,
    ranking: &[&'a str],
    kept: &'a BTreeMap<String, BTreeMap<String, Passes>>,
) -> Vec<RankedTrajectory<'a>> {
    let ranked = |(number, name): (usize, &&'a str)| {
        let (trajectory, record) = kept.get(*name)?.get(sequence.name())?.first()?;
        Some(RankedTrajectory { name, number, trajectory, frames: record.frames })
    };
    ranking.iter().enumerate().filter_map(ranked).collect()
}

/// Pictures of all sequences, on as many threads as the runs had. A sequence whose frames cannot be had again has none.
fn all_pictures(
    options: &EvalOptions,
    sequences: &[Sequence],
    trajectories: &[Vec<RankedTrajectory<'_>>],
    stop: &AtomicBool,
) -> Vec<String> {
    let slots: Vec<Mutex<String>> = sequences.iter().map(|_| Mutex::default()).collect();
    let next = AtomicUsize::new(0);
    let work = || {
        while !stop.load(Ordering::Relaxed) {
            let i = next.fetch_add(1, Ordering::Relaxed);
            let (Some(sequence), Some(trajectories), Some(slot)) =
                (sequences.get(i), trajectories.get(i), slots.get(i))
            else {
                break;
            };
            let frames = FrameCache::undecoded(sequence, &options.open);
            let html = pictures::worst_frames(sequence, trajectories, &frames);
            *slot.lock().unwrap_or_else(PoisonError::into_inner) =
                html.unwrap_or_else(|e| format!("<p class=\"error\">{}</p>", html::escape(&e.to_string())));
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..options.jobs.clamp(1, sequences.len().max(1)) {
            scope.spawn(work);
        }
    });
    slots.into_iter().map(|s| s.into_inner().unwrap_or_else(PoisonError::into_inner)).collect()
}
