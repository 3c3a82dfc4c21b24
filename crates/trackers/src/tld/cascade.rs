use super::ferns::Ferns;
use super::grid::{Grid, Part, Scale};
use super::params::{RefineBy, RefineParams, TldParams};
use super::worker::{Summed, Worker, divide};
use crate::appearance::{ObjectModel, PatchSampler, Similarity};
use pursuit_geometry::BBox;
use pursuit_imaging::ImageView;
use pursuit_vision::PixelWindow;
use pursuit_vision::integral::IntegralImage;

/// A window that the ferns take for the object.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Candidate {
    pub window: BBox,
    /// Sum of the ferns' posteriors.
    pub sum: u16,
    /// What the nearest-neighbour classifier says.
    pub similarity: Similarity,
}

/// What of a frame is scanned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Place {
    /// Windows are picked that lie in it.
    pub region: BBox,
    /// Where the target is expected in it.
    pub expected: BBox,
    /// Which band of the rest of the frame has its turn, if any.
    pub turn: Option<usize>,
}

/// What a scan may go by: learned, and fixed at the start.
#[derive(Debug, Clone, Copy)]
pub(super) struct Knowledge<'a> {
    pub params: &'a TldParams,
    pub grid: &'a Grid,
    pub ferns: &'a Ferns,
    pub model: &'a ObjectModel,
    /// Windows of less variance, grey codes squared, are left out.
    pub least_variance: f64,
}

/// The cascade (kalal2012, section 5.3): variance, ferns, nearest neighbour. Scratch alone: nothing of it is state.
#[derive(Debug, Clone, Default)]
pub(super) struct Cascade {
    integral: IntegralImage,
    /// First column and row of the part of the frame that `integral` sums up.
    origin: (usize, usize),
    parts: Vec<(Scale, Part)>,
    /// Where the parts of each worker end.
    ends: Vec<usize>,
    workers: Vec<Worker>,
    candidates: Vec<Candidate>,
    windows: usize,
    pub sampler: PatchSampler,
    pub patch: Vec<f32>,
}

impl Cascade {
    /// Sums up the part of `gray` that boxes and windows within `region` need.
    pub fn prepare(&mut self, gray: ImageView<'_, u8>, region: &BBox, margin_px: f64) {
        let area = PixelWindow::of(&region.expanded(margin_px), gray.size()).unwrap_or(PixelWindow::full(gray.size()));
        self.origin = (area.x, area.y);
        self.integral.build(gray.crop(area.x, area.y, area.width, area.height).unwrap_or(gray));
    }

    /// The integral image, and the pixel of the frame that its first is.
    pub const fn sums(&self) -> (&IntegralImage, (usize, usize)) {
        (&self.integral, self.origin)
    }

    /// The windows that the ferns take for the object, of the scan done last; the likeliest first after
    /// [`judge`](Self::judge).
    pub fn candidates(&self) -> &[Candidate] {
        &self.candidates
    }

    /// Windows that the last scan looked at.
    pub const fn windows(&self) -> usize {
        self.windows
    }

    /// Looks at the windows that `at` picks; at most `most` pass.
    pub fn scan(&mut self, gray: ImageView<'_, u8>, known: &Knowledge<'_>, at: &Place, most: usize) {
        let scan = &known.params.scan;
        known.grid.pick(&at.region, &at.expected, scan, &mut self.parts);
        if let Some(turn) = at.turn
            && scan.turn_frames > 0
            && !known.grid.is_whole(&at.region)
        {
            known.grid.pick_band(turn, scan.turn_frames, &mut self.parts);
        }
        self.candidates.clear();
        self.windows = 0;
        let Some(area) = self.parts.iter().map(|(scale, part)| extent(scale, part)).reduce(|a, b| a.union(&b)) else {
            return;
        };
        self.prepare(gray, &area, known.params.ferns.smooth_px + 2.0);
        self.windows = self.parts.iter().map(|(_, part)| part.windows()).sum();
        // More pass at times than are handed on: room for most such cases from the start on.
        self.candidates.reserve(2 * known.params.ferns.most_windows);
        self.scan_parts(known);
        if self.candidates.len() > most {
            self.candidates.select_nth_unstable_by(most, order);
            self.candidates.truncate(most);
        }
    }

    /// Scans the parts, `scan.threads` shares of them side by side. What is found does not depend on how they are shared
    /// out: the order is that of the windows.
    fn scan_parts(&mut self, known: &Knowledge<'_>) {
        divide(&mut self.parts, known.params.scan.threads, &mut self.ends);
        self.workers.resize_with(self.ends.len(), Worker::default);
        let image = Summed { integral: &self.integral, origin: self.origin };
        let mut from = 0;
        let shares = self.workers.iter_mut().zip(&self.ends).map(|(worker, &end)| {
            let share = &self.parts[from..end];
            from = end;
            (worker, share)
        });
        if known.params.scan.threads == 1 {
            shares.for_each(|(worker, share)| worker.scan(image, known, share));
        } else {
            rayon::scope(|scope| {
                shares.for_each(|(worker, share)| scope.spawn(move |_| worker.scan(image, known, share)));
            });
        }
        self.workers.iter().for_each(|worker| self.candidates.extend_from_slice(&worker.candidates));
    }

    /// Has the nearest-neighbour classifier judge the candidates, and puts the likeliest first.
    pub fn judge(&mut self, gray: ImageView<'_, u8>, known: &Knowledge<'_>) {
        for candidate in &mut self.candidates {
            self.sampler.normalized(gray, &candidate.window, known.params.neighbor.side, &mut self.patch);
            candidate.similarity = known.model.resemblance(&self.patch).similarity;
        }
        let form = known.params.neighbor.similarity;
        self.candidates.sort_unstable_by(|a, b| {
            let of = |c: &Candidate| c.similarity.relative(form);
            of(b).total_cmp(&of(a)).then_with(|| order(a, b))
        });
    }

    /// What `bbox` resembles.
    pub fn similarity(&mut self, gray: ImageView<'_, u8>, known: &Knowledge<'_>, bbox: &BBox) -> Similarity {
        self.sampler.normalized(gray, bbox, known.params.neighbor.side, &mut self.patch);
        known.model.resemblance(&self.patch).similarity
    }

    /// `bbox` moved and resized, a little at a time, to where it resembles the object more, and what it resembles there.
    pub fn refine(
        &mut self,
        gray: ImageView<'_, u8>,
        known: &Knowledge<'_>,
        p: &RefineParams,
        bbox: &BBox,
    ) -> (BBox, Similarity) {
        let similarity = self.similarity(gray, known, bbox);
        if p.by == RefineBy::Nothing || similarity.conservative(known.params.neighbor.similarity) < p.from {
            return (*bbox, similarity);
        }
        let mut best = *bbox;
        let likeness = |this: &mut Self, bbox: &BBox, own: Option<usize>| {
            this.sampler.normalized(gray, bbox, known.params.neighbor.side, &mut this.patch);
            let own = own.or_else(|| known.model.nearest(&this.patch, p.by == RefineBy::Early))?;
            Some((own, known.model.likeness(own, &this.patch)))
        };
        for _ in 0..p.rounds {
            // What a round climbs to is one patch of the object, the nearest where it begins.
            let Some((own, from)) = likeness(self, &best, None) else { break };
            let (dx, dy) = (p.shift * best.width(), p.shift * best.height());
            let (larger, smaller) = (best.scaled(1.0 + p.resize), best.scaled(1.0 / (1.0 + p.resize)));
            let moved = [(dx, 0.0), (-dx, 0.0), (0.0, dy), (0.0, -dy)].map(|(x, y)| best.translated(x, y));
            let mut most = from + p.gain;
            for tried in moved.into_iter().chain([larger, smaller]) {
                if let Some((_, there)) = likeness(self, &tried, Some(own))
                    && there > most
                {
                    (best, most) = (tried, there);
                }
            }
            if most <= from + p.gain {
                break;
            }
        }
        (best, self.similarity(gray, known, &best))
    }

    /// Variance of the pixels under `bbox`, of the part that was summed up; 0 outside of it.
    pub fn variance(&self, bbox: &BBox) -> f64 {
        let inside = bbox.translated(-(self.origin.0 as f64), -(self.origin.1 as f64));
        PixelWindow::of(&inside, self.integral.size()).and_then(|w| self.integral.variance(&w)).unwrap_or(0.0)
    }
}

/// The likelier by the ferns first; of equals the one that was scanned first, so that the order is one.
fn order(a: &Candidate, b: &Candidate) -> std::cmp::Ordering {
    let place = |c: &Candidate| (c.window.width(), c.window.top(), c.window.left());
    b.sum.cmp(&a.sum).then_with(|| {
        let ((aw, at, al), (bw, bt, bl)) = (place(a), place(b));
        aw.total_cmp(&bw).then(at.total_cmp(&bt)).then(al.total_cmp(&bl))
    })
}

/// The part of the frame under the windows `part` of `scale`.
fn extent(scale: &Scale, part: &Part) -> BBox {
    scale.window(part.left, part.top).union(&scale.window(part.right.saturating_sub(1), part.bottom.saturating_sub(1)))
}
