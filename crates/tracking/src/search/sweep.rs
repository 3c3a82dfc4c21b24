//! Going over the frame, window by window, for a target that is lost.

use super::{SearchParams, Situation};
use crate::{Look, Search, ViewSize};
use pursuit_geometry::{BBox, Point, Size};
use serde::{Deserialize, Serialize};

/// Most columns, and most rows, of the grid of windows.
const MOST_LINES: usize = 64;
/// Share of a new size in the size that is remembered.
const SIZE_RATE: f64 = 0.1;
/// A box whose side is this near to the frame's border may show a part of the target, in pixels.
const BORDER_PX: f64 = 2.0;
/// Before the first window of a pass.
const AT_START: usize = usize::MAX;

/// How far going over the frame has come, and how large what is looked for.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Sweep {
    /// The window looked at last.
    cursor: usize,
    /// Passes over the frame since the target was seen.
    pass: usize,
    /// Width and height of the target when it was seen whole, smoothed.
    whole: (f64, f64),
    /// The windows in the order in which they are looked at, where that is not row by row, and the columns of their grid.
    order: Vec<usize>,
    columns: usize,
}

/// The windows of a pass: a grid over the frame.
struct Grid {
    bounds: BBox,
    columns: usize,
    rows: usize,
}

impl Grid {
    /// Windows that take in `view` each and overlap by half: what lies near the edge of one is weakened by the localizer's own window.
    fn new(bounds: BBox, view: ViewSize) -> Self {
        let lines = |whole: f64, part: f64| ((2.0 * whole / part).ceil() as usize).clamp(1, MOST_LINES);
        Self { bounds, columns: lines(bounds.width(), view.width), rows: lines(bounds.height(), view.height) }
    }

    const fn len(&self) -> usize {
        self.columns * self.rows
    }

    fn center(&self, window: usize) -> Point {
        let share = |i: usize, n: usize| (i as f64 + 0.5) / n as f64;
        Point::new(
            self.bounds.left() + share(window % self.columns, self.columns) * self.bounds.width(),
            self.bounds.top() + share(window / self.columns, self.rows) * self.bounds.height(),
        )
    }
}

impl Sweep {
    /// For a target that is at `bbox` now.
    pub fn new(bbox: &BBox) -> Self {
        Self { cursor: 0, pass: 0, whole: (bbox.width(), bbox.height()), order: Vec::new(), columns: 0 }
    }

    /// The target is seen for certain at `bbox` of a frame of that size.
    pub fn sure(&mut self, bbox: &BBox, frame: Size) {
        self.pass = 0;
        self.order.clear();
        let inside = frame.bounds().expanded(-BORDER_PX);
        let corners = [Point::new(bbox.left(), bbox.top()), Point::new(bbox.right(), bbox.bottom())];
        if corners.iter().all(|corner| inside.contains(*corner)) {
            let towards = |old: f64, new: f64| old + SIZE_RATE * (new - old);
            self.whole = (towards(self.whole.0, bbox.width()), towards(self.whole.1, bbox.height()));
        }
    }

    /// Adds the next windows to `searches`, `windows` or as many as a hurried pass takes; `view` is what a look for a target of the
    /// size expected takes in, `last` where it was last.
    pub fn windows(
        &mut self,
        params: &SearchParams,
        situation: &Situation<'_>,
        view: ViewSize,
        windows: usize,
        last: Point,
        searches: &mut Vec<Search>,
    ) {
        let (expected, grown) = self.sought(params, &situation.prior.bbox);
        let view = ViewSize { width: view.width * grown, height: view.height * grown };
        let grid = Grid::new(situation.frame.bounds(), view);
        let hurried = match params.pass_frames {
            0 => windows,
            frames => windows.max(grid.len().div_ceil(frames).min(params.most_windows)),
        };
        if params.whole_size && (self.order.len(), self.columns) != (grid.len(), grid.columns) {
            self.arrange(&grid, last);
        }
        for _ in 0..hurried.min(grid.len()) {
            self.cursor = self.cursor.wrapping_add(1) % grid.len();
            let window = self.order.get(self.cursor).filter(|_| params.whole_size).copied().unwrap_or(self.cursor);
            let center = grid.center(window);
            let region = BBox::from_center_size(center, view.width, view.height);
            let expected = expected.centered_at(center);
            searches.push(Search { expected, region, gate: None, look: Look::Sweep, keep_inside: params.keep_inside });
            if self.cursor + 1 == grid.len() {
                self.pass = self.pass.wrapping_add(1);
                if params.sizes > 1 {
                    // The next pass is at another size.
                    break;
                }
            }
        }
    }

    /// Begins a pass over `grid` with the windows nearest to `last`.
    fn arrange(&mut self, grid: &Grid, last: Point) {
        self.cursor = AT_START;
        self.columns = grid.columns;
        self.order.clear();
        self.order.extend(0..grid.len());
        self.order.sort_by(|&a, &b| grid.center(a).distance(last).total_cmp(&grid.center(b).distance(last)));
    }

    /// The size at which the frame is gone over, as a box, and how much larger that is than `prior`.
    fn sought(&self, params: &SearchParams, prior: &BBox) -> (BBox, f64) {
        if !params.whole_size {
            return (*prior, 1.0);
        }
        let factor = match (params.sizes, self.pass % params.sizes.max(1)) {
            (_, 1) => 2.0,
            (3, 2) => 0.5,
            _ => 1.0,
        };
        let sought = BBox::from_center_size(prior.center(), factor * self.whole.0, factor * self.whole.1);
        (sought, (sought.area() / prior.area().max(1e-9)).sqrt())
    }
}
