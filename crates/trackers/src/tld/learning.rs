//! What the detector learns (kalal2012, sections 4 and 5.4): the box and its warps are the object, what lies elsewhere is not.

use super::cascade::{Cascade, Knowledge, Place};
use super::cells::{SIDE, view};
use super::ferns::Ferns;
use super::grid::Grid;
use super::params::TldParams;
use crate::appearance::{ObjectModel, draw};
use pursuit_geometry::BBox;
use pursuit_imaging::ImageView;
use pursuit_vision::warp::Affine;

/// What learns, and what it learns by.
#[derive(Debug)]
pub(super) struct Learner<'a> {
    pub params: &'a TldParams,
    pub grid: &'a Grid,
    pub ferns: &'a mut Ferns,
    pub model: &'a mut ObjectModel,
    pub least_variance: f64,
    pub random: &'a mut u64,
    pub scratch: &'a mut Scratch,
}

/// Overwritten at every use.
#[derive(Debug, Clone)]
pub(super) struct Scratch {
    near: Vec<(BBox, f64)>,
    view: [u8; SIDE * SIDE],
    outcomes: Vec<u32>,
}

impl Default for Scratch {
    fn default() -> Self {
        Self { near: Vec::new(), view: [0; SIDE * SIDE], outcomes: Vec::new() }
    }
}

/// How strongly views are warped.
#[derive(Debug, Clone, Copy)]
struct Warping {
    count: usize,
    turn_rad: f64,
}

impl Learner<'_> {
    /// Learns from the frame the target is shown in, at `bbox`: ferns by warps of it and by what they take for it elsewhere,
    /// the classifier by the box and by patches from elsewhere.
    pub fn bootstrap(&mut self, cascade: &mut Cascade, gray: ImageView<'_, u8>, bbox: &BBox) {
        cascade.prepare(gray, &gray.size().bounds(), 0.0);
        let l = &self.params.learning;
        let warping = Warping { count: l.first_warps, turn_rad: l.first_turn_deg.to_radians() };
        self.learn_object(cascade, bbox, warping);
        cascade.sampler.normalized(gray, bbox, self.params.neighbor.side, &mut cascade.patch);
        self.model.add_positive(&cascade.patch);
        for _ in 0..l.first_rounds {
            let known = known(self.params, self.grid, self.ferns, self.model, self.least_variance);
            let whole = Place { region: gray.size().bounds(), expected: *bbox, turn: None };
            cascade.scan(gray, &known, &whole, l.most_first);
            self.reject_windows(cascade, bbox);
        }
        self.reject_anywhere(cascade, gray, bbox);
        self.reject_patches(cascade, gray, bbox);
    }

    /// Learns from a box that is believed, and from the candidates of the scan done last.
    pub fn update(&mut self, cascade: &mut Cascade, gray: ImageView<'_, u8>, bbox: &BBox) {
        let known = known(self.params, self.grid, self.ferns, self.model, self.least_variance);
        cascade.sampler.normalized(gray, bbox, self.params.neighbor.side, &mut cascade.patch);
        let form = self.params.neighbor.similarity;
        let similarity = known.model.resemblance(&cascade.patch).similarity;
        let (relative, conservative) = (similarity.relative(form), similarity.conservative(form));
        let margin = bbox.width().max(bbox.height());
        let l = &self.params.learning;
        if relative < l.least_similarity || conservative < l.least_conservative {
            return;
        }
        let patch_is_new = relative <= self.params.neighbor.learn_below;
        if patch_is_new {
            self.model.add_positive(&cascade.patch);
        }
        cascade.prepare(gray, bbox, margin);
        if cascade.variance(bbox) < self.least_variance {
            return;
        }
        let l = &self.params.learning;
        self.learn_object(cascade, bbox, Warping { count: l.warps, turn_rad: l.turn_deg.to_radians() });
        self.reject_windows_of(cascade, gray, bbox);
        self.reject_patches(cascade, gray, bbox);
    }

    /// P-expert: windows nearest to the box, warped, are the object.
    fn learn_object(&mut self, cascade: &Cascade, bbox: &BBox, warping: Warping) {
        self.nearest(bbox);
        let threshold = self.ferns.threshold(self.params.ferns.posterior);
        let sums = cascade.sums();
        let smooth = self.params.ferns.smooth_px;
        for at in 0..self.scratch.near.len() {
            let (window, _) = self.scratch.near[at];
            for warp in 0..=warping.count {
                // The window itself comes first.
                let map = if warp == 0 { Affine::IDENTITY } else { self.warp(&window, warping.turn_rad) };
                view(sums, &window, &map, smooth, self.ferns.used(), &mut self.scratch.view);
                if warp > 0 {
                    self.add_noise(&window);
                }
                self.ferns.outcomes(&self.scratch.view, &mut self.scratch.outcomes);
                if self.ferns.sum(&self.scratch.outcomes) <= threshold {
                    self.ferns.learn(&self.scratch.outcomes, true);
                }
            }
        }
    }

    /// N-expert of the ferns: what passes them far from the box is not the object.
    fn reject_windows(&mut self, cascade: &Cascade, bbox: &BBox) {
        let sums = cascade.sums();
        let threshold = self.ferns.threshold(self.params.ferns.posterior);
        let far = |window: &BBox| window.iou(bbox) < self.params.learning.negative_overlap;
        for candidate in cascade.candidates().iter().filter(|c| far(&c.window)) {
            let smooth = self.params.ferns.smooth_px;
            let used = self.ferns.used();
            view(sums, &candidate.window, &Affine::IDENTITY, smooth, used, &mut self.scratch.view);
            self.ferns.outcomes(&self.scratch.view, &mut self.scratch.outcomes);
            if self.ferns.sum(&self.scratch.outcomes) >= threshold {
                self.ferns.learn(&self.scratch.outcomes, false);
            }
        }
    }

    /// As [`reject_windows`](Self::reject_windows), of a scan whose sums are gone.
    fn reject_windows_of(&mut self, cascade: &mut Cascade, gray: ImageView<'_, u8>, bbox: &BBox) {
        let far = |window: &BBox| window.iou(bbox) < self.params.learning.negative_overlap;
        let area = cascade.candidates().iter().map(|c| c.window).filter(far).reduce(|a, b| a.union(&b));
        if let Some(area) = area {
            cascade.prepare(gray, &area, self.params.ferns.smooth_px + 2.0);
            self.reject_windows(cascade, bbox);
        }
    }

    /// N-expert of the classifier: what it takes for the object far from the box is not.
    fn reject_patches(&mut self, cascade: &mut Cascade, gray: ImageView<'_, u8>, bbox: &BBox) {
        let form = self.params.neighbor.similarity;
        let l = &self.params.learning;
        let mut added = 0;
        for at in 0..cascade.candidates().len() {
            let Some(candidate) = cascade.candidates().get(at).copied() else { return };
            if added == l.most_negatives || candidate.window.iou(bbox) >= l.negative_overlap {
                continue;
            }
            cascade.sampler.normalized(gray, &candidate.window, self.params.neighbor.side, &mut cascade.patch);
            // Judged anew: what was added before counts.
            if self.model.resemblance(&cascade.patch).similarity.relative(form) > l.negative_from {
                self.model.add_negative(&cascade.patch);
                added += 1;
            }
        }
    }

    /// Patches from anywhere but the box that vary enough.
    fn reject_anywhere(&mut self, cascade: &mut Cascade, gray: ImageView<'_, u8>, bbox: &BBox) {
        let wanted = self.params.learning.first_negatives;
        let all = self.grid.windows();
        let mut added = 0;
        for _ in 0..if all > 0 { 10 * wanted } else { 0 } {
            if added == wanted {
                break;
            }
            let Some(window) = self.grid.window((draw(self.random) % all as u64) as usize) else { continue };
            let far = window.iou(bbox) < self.params.learning.negative_overlap;
            if far && cascade.variance(&window) >= self.least_variance {
                cascade.sampler.normalized(gray, &window, self.params.neighbor.side, &mut cascade.patch);
                self.model.add_negative(&cascade.patch);
                added += 1;
            }
        }
    }

    /// The windows of the grid nearest to `bbox`; the box itself where none is near.
    fn nearest(&mut self, bbox: &BBox) {
        let l = &self.params.learning;
        let reach = l.near_reach as isize;
        let near = &mut self.scratch.near;
        near.clear();
        for scale in self.grid.scales() {
            let ratio = scale.width as f64 / bbox.width();
            // No place makes up for such a difference of size.
            if ratio.min(1.0 / ratio) <= l.near_overlap {
                continue;
            }
            let (dx, dy) = scale.shift();
            let column = ((bbox.center().x - scale.width as f64 / 2.0) / dx).round() as isize;
            let row = ((bbox.center().y - scale.height as f64 / 2.0) / dy).round() as isize;
            for j in row - reach..=row + reach {
                for i in column - reach..=column + reach {
                    let inside = (0..scale.columns as isize).contains(&i) && (0..scale.rows as isize).contains(&j);
                    if inside {
                        let window = scale.window(i as usize, j as usize);
                        near.push((window, window.iou(bbox)));
                    }
                }
            }
        }
        near.retain(|(_, overlap)| *overlap > l.near_overlap);
        near.sort_unstable_by(|a, b| b.1.total_cmp(&a.1).then_with(|| a.0.width().total_cmp(&b.0.width())));
        near.truncate(l.closest);
        if near.is_empty() {
            near.push((*bbox, 1.0));
        }
    }

    /// A number uniform in [-1, 1].
    fn symmetric(&mut self) -> f64 {
        (draw(self.random) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    fn warp(&mut self, window: &BBox, turn_rad: f64) -> Affine {
        let shift = self.params.learning.shift;
        let (scale, turn) = (1.0 + shift * self.symmetric(), turn_rad * self.symmetric());
        let (dx, dy) = (shift * window.width() * self.symmetric(), shift * window.height() * self.symmetric());
        Affine::similarity(scale, turn, dx, dy).map_or(Affine::IDENTITY, |map| map.about(window.center()))
    }

    /// Noise of the picture, as it is left in the means of cells.
    fn add_noise(&mut self, window: &BBox) {
        let side = |length: f64| 2.0 * (length / SIDE as f64).max(self.params.ferns.smooth_px);
        let sigma = self.params.learning.noise / (side(window.width()) * side(window.height())).sqrt();
        for &cell in self.ferns.used() {
            // The sum of four uniform numbers of variance 1/12 each is near enough to normal.
            let bits = draw(self.random);
            let sum: u64 = (0..4).map(|k| (bits >> (16 * k)) & 0xffff).sum();
            let sum = sum as f64 / 65536.0 - 2.0;
            let value = &mut self.scratch.view[usize::from(cell)];
            *value = (f64::from(*value) + sigma * sum * 3f64.sqrt() + 0.5).clamp(0.0, 255.0) as u8;
        }
    }
}

/// What a scan goes by, of the parts of a learner.
fn known<'a>(
    params: &'a TldParams,
    grid: &'a Grid,
    ferns: &'a Ferns,
    model: &'a ObjectModel,
    least_variance: f64,
) -> Knowledge<'a> {
    Knowledge { params, grid, ferns, model, least_variance }
}
