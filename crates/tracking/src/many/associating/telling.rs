//! What is said of the targets once a frame was taken.

use super::super::Track;
use super::super::target::Sighting;
use super::Associating;
use crate::Detection;

impl Associating {
    /// Keeps where candidates were seen, and hands it over once they are confirmed: those with ids above `known`.
    pub(super) fn remember(&mut self, index: u64, known: u64) {
        self.back_dated.clear();
        for target in &mut self.targets {
            match target.id() {
                Some(id) if id.0 > known => self.back_dated.extend(target.before.drain(..).map(|seen| (id, seen))),
                Some(_) => {}
                None => {
                    let seen = target.taken.and_then(|d| Some((self.kept.get(d)?, *self.places.get(d)?)));
                    target.before.extend(seen.map(|(seen, place)| {
                        let Detection { bbox, confidence, .. } = *seen;
                        Sighting { index, place, bbox, confidence }
                    }));
                }
            }
        }
    }

    /// Says what is known of every target; those with ids above `known` are new.
    pub(super) fn report(&mut self, known: u64, tracks: &mut Vec<Track>) {
        let figures = self.detector.as_ref().map(|d| d.diagnostics()).unwrap_or_default();
        tracks.clear();
        // Targets stand in order of their births; ids go by the order in which they were confirmed.
        self.order.clear();
        self.order.extend(self.targets.iter().enumerate().filter_map(|(at, t)| Some((t.id()?, at))));
        if !self.order.is_sorted() {
            self.order.sort_unstable();
        }
        for &(id, at) in &self.order {
            let target = &mut self.targets[at];
            if target.answer.is_none() || target.known.is_on_trial(self.params.reported_from) {
                continue;
            }
            let started = id.0 > known;
            let class = target.known.classes.most_likely().cloned();
            let detection = target.taken.and_then(|d| self.places.get(d)).copied();
            tracks.push(Track { id, estimate: None, started, elapsed: target.elapsed, class, detection });
            if let Some(track) = tracks.last_mut() {
                // What is large goes straight to its place.
                std::mem::swap(&mut track.estimate, &mut target.answer);
                track.estimate.iter_mut().for_each(|estimate| estimate.diagnostics.extend(figures.figures()));
            }
        }
    }
}
