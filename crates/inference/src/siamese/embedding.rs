use super::SiameseTracker;
use super::network::SiameseNetwork;
use pursuit_geometry::{BBox, Point};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// What a box looks like to a network: the mean of each of its features in the middle of it (average pooling of a region of interest, Girshick 2015,
/// arXiv:1504.08083). How much two boxes look alike is the cosine of their means.
///
/// A score says which place of a window looks most like the template; this says how much of the target itself is in a box, so that it falls where
/// the best of a window is something else.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Embedding(Vec<f32>);

/// The part of a map of features that a box covers, in places of the map.
struct Covered<'a> {
    features: &'a [f32],
    side: usize,
    columns: (f64, f64),
    rows: (f64, f64),
}

/// Of each side of a box so much is looked at: at its edges there is more of what lies behind the target.
const MIDDLE: f64 = 0.75;
/// Less of it than this is nothing to judge it by.
const LEAST_SHARE: f64 = 0.25;

impl Embedding {
    /// Whether it is one that a network gives.
    pub fn is_sound(&self) -> bool {
        !self.0.is_empty() && self.0.iter().all(|v| v.is_finite())
    }
}

impl<N: SiameseNetwork> SiameseTracker<N> {
    /// Has the network keep its features, without which there is no embedding.
    pub fn keep_features(&mut self) {
        self.network.keep_features();
    }

    /// Whether `embedding` is of as many features as the network keeps.
    pub fn has_features_of(&self, embedding: &Embedding) -> bool {
        let side = self.features_side();
        self.network.search_features().len() == embedding.0.len() * side * side
    }

    /// What `bbox` looks like in the last search, which must have been around `center` for `size`. `None` where no features are kept, and of a
    /// box of which the search saw next to nothing.
    pub fn embedding_of(&self, center: Point, size: (f64, f64), bbox: &BBox) -> Option<Embedding> {
        Some(Embedding(self.covered(center, size, bbox)?.means().map(|v| v as f32).collect()))
    }

    /// How much `bbox` in the last search, which must have been around `center` for `size`, looks like `first`: the cosine, −1 to 1. `None` as of
    /// [`embedding_of`](Self::embedding_of).
    pub fn likeness_of(&self, first: &Embedding, center: Point, size: (f64, f64), bbox: &BBox) -> Option<f64> {
        let covered = self.covered(center, size, bbox)?;
        let (mut product, mut squares) = (0.0, (0.0, 0.0));
        for (now, &first) in covered.means().zip(&first.0) {
            let first = f64::from(first);
            product += now * first;
            squares = (squares.0 + now * now, squares.1 + first * first);
        }
        let norm = (squares.0 * squares.1).sqrt();
        Some(product / norm).filter(|likeness| likeness.is_finite())
    }

    /// Rows and columns of the features.
    fn features_side(&self) -> usize {
        (self.config().search_side_px as f64 / self.config().stride_px).ceil() as usize
    }

    fn covered(&self, center: Point, size: (f64, f64), bbox: &BBox) -> Option<Covered<'_>> {
        let (features, config) = (self.network().search_features(), self.config());
        let (side, extent, bbox) = (self.features_side(), self.search_extent(size), bbox.scaled(MIDDLE));
        if features.is_empty() || !bbox.is_finite() {
            return None;
        }
        // The first place is the first pixel of the image, the second one a stride farther on.
        let place = |from_middle: f64, extent: f64| {
            ((from_middle / extent + 0.5) * config.search_side_px as f64 - 0.5) / config.stride_px
        };
        let columns = (place(bbox.left() - center.x, extent.0), place(bbox.right() - center.x, extent.0));
        let rows = (place(bbox.top() - center.y, extent.1), place(bbox.bottom() - center.y, extent.1));
        let covered = Covered { features, side, columns, rows };
        let share = |(from, to): (f64, f64)| covered.sum(from, to) / (to - from).max(1e-9);
        (share(columns) * share(rows) >= LEAST_SHARE).then_some(covered)
    }
}

impl Covered<'_> {
    /// The places that `from` to `to` touches.
    fn touched(&self, from: f64, to: f64) -> Range<usize> {
        let end = |v: f64| v.clamp(0.0, self.side as f64) as usize;
        end((from + 0.5).floor())..end((to + 0.5).ceil())
    }

    /// How many places `from` to `to` covers.
    fn sum(&self, from: f64, to: f64) -> f64 {
        self.touched(from, to).map(|k| share(k, from, to)).sum()
    }

    /// The mean of each feature.
    fn means(&self) -> impl Iterator<Item = f64> {
        let (columns, rows) = (self.columns, self.rows);
        let area = self.sum(columns.0, columns.1) * self.sum(rows.0, rows.1);
        self.features.chunks_exact(self.side * self.side).map(move |map| {
            let mut sum = 0.0;
            for y in self.touched(rows.0, rows.1) {
                let row = &map[y * self.side..][..self.side];
                let of_row = |x: usize| share(x, columns.0, columns.1) * f64::from(row[x]);
                sum += share(y, rows.0, rows.1) * self.touched(columns.0, columns.1).map(of_row).sum::<f64>();
            }
            sum / area
        })
    }
}

/// The share of place `k` that lies between `from` and `to`.
fn share(k: usize, from: f64, to: f64) -> f64 {
    let k = k as f64;
    (to.min(k + 0.5) - from.max(k - 0.5)).clamp(0.0, 1.0)
}
