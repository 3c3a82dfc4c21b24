//! `report.html`: one file that needs nothing else, readable by day, by night and on a phone.

mod html;
mod pictures;
mod sections;

use crate::evaluate::{EvalOptions, Passes};
use crate::film::Film;
use crate::metrics::accuracy::overlap;
use crate::{Results, Sequence, Trajectory};
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

/// A tracker's run over one sequence, as the report shows it.
pub(crate) struct Entry<'a> {
    /// The tracker.
    name: &'a str,
    /// Its rank, which chooses its colour.
    number: usize,
    /// What it said; of several passes the first.
    trajectory: &'a Trajectory,
    /// Frames that were to be had.
    frames: usize,
}

impl Entry<'_> {
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
    let ranking = ranking(results);
    let entries: Vec<Vec<Entry<'_>>> = sequences.iter().map(|s| entries_of(s, &ranking, kept)).collect();
    let pictures = if options.thumbnails { all_pictures(options, sequences, &entries, stop) } else { Vec::new() };
    let mut page = sections::head(results, sequences.len());
    page.push_str(&sections::leaderboard(results, &ranking));
    page.push_str(&sections::curves(results, &ranking));
    page.push_str(&sections::sequence_table(results, &ranking, sequences));
    for (i, (sequence, entries)) in sequences.iter().zip(&entries).enumerate() {
        let pictures = pictures.get(i).map_or("", String::as_str);
        page.push_str(&sections::drill_down(i, sequence, results, entries, pictures));
    }
    page.push_str(&sections::foot(results));
    page
}

/// Trackers, the best success AUC first.
fn ranking(results: &Results) -> Vec<&str> {
    let mut names: Vec<(&str, f64)> = results.trackers.iter().map(|(n, t)| (n.as_str(), t.mean.auc)).collect();
    names.sort_by(|a, b| b.1.total_cmp(&a.1).then_with(|| a.0.cmp(b.0)));
    names.into_iter().map(|(name, _)| name).collect()
}

fn entries_of<'a>(
    sequence: &Sequence,
    ranking: &[&'a str],
    kept: &'a BTreeMap<String, BTreeMap<String, Passes>>,
) -> Vec<Entry<'a>> {
    let entry = |(number, name): (usize, &&'a str)| {
        let (trajectory, record) = kept.get(*name)?.get(sequence.name())?.first()?;
        Some(Entry { name, number, trajectory, frames: record.frames })
    };
    ranking.iter().enumerate().filter_map(entry).collect()
}

/// Pictures of all sequences, on as many threads as the runs had. A sequence whose frames cannot be had again has none.
fn all_pictures(
    options: &EvalOptions,
    sequences: &[Sequence],
    entries: &[Vec<Entry<'_>>],
    stop: &AtomicBool,
) -> Vec<String> {
    let slots: Vec<Mutex<String>> = sequences.iter().map(|_| Mutex::default()).collect();
    let next = AtomicUsize::new(0);
    let work = || {
        while !stop.load(Ordering::Relaxed) {
            let i = next.fetch_add(1, Ordering::Relaxed);
            let (Some(sequence), Some(entries), Some(slot)) = (sequences.get(i), entries.get(i), slots.get(i)) else {
                break;
            };
            let film = Film::undecoded(sequence, &options.open);
            let html = pictures::worst_frames(sequence, entries, &film);
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
