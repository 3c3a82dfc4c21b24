use super::params::{GateBy, ScanParams};
use pursuit_geometry::{BBox, Size};

/// A window is ten shifts wide and high: neighbours are shifted by 10 % (kalal2012, section 5.3).
pub(super) const SHIFTS: usize = 10;

/// Windows of one size, in rows and columns over the frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Scale {
    /// Whole pixels.
    pub width: usize,
    pub height: usize,
    /// Windows side by side, and above each other.
    pub columns: usize,
    pub rows: usize,
}

impl Scale {
    /// Distance of neighbouring windows along x and y, pixels.
    pub fn shift(&self) -> (f64, f64) {
        (self.width as f64 / SHIFTS as f64, self.height as f64 / SHIFTS as f64)
    }

    pub const fn windows(&self) -> usize {
        self.columns * self.rows
    }

    /// The window of column `i` in row `j`.
    pub fn window(&self, i: usize, j: usize) -> BBox {
        let (dx, dy) = self.shift();
        BBox::from_ltwh(i as f64 * dx, j as f64 * dy, self.width as f64, self.height as f64)
    }

    /// The columns and rows that `region` picks: windows that it touches, or those whose centre lies in it.
    fn picked(&self, region: &BBox, by: GateBy) -> Part {
        let (dx, dy) = self.shift();
        let (reach_x, reach_y) = match by {
            GateBy::Intersection => (self.width as f64 / 2.0, self.height as f64 / 2.0),
            GateBy::Center => (0.0, 0.0),
        };
        // Of centres, which lie half a window from the windows' corners.
        let along = |from: f64, to: f64, reach: f64, side: usize, shift: f64, n: usize| {
            let first = ((from - reach - side as f64 / 2.0) / shift).ceil().clamp(0.0, n as f64) as usize;
            let end = (((to + reach - side as f64 / 2.0) / shift).floor() + 1.0).clamp(0.0, n as f64) as usize;
            (first, end.max(first))
        };
        let (left, right) = along(region.left(), region.right(), reach_x, self.width, dx, self.columns);
        let (top, bottom) = along(region.top(), region.bottom(), reach_y, self.height, dy, self.rows);
        Part { left, right, top, bottom }
    }
}

/// The columns `[left, right)` and rows `[top, bottom)` of a scale.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Part {
    pub left: usize,
    pub right: usize,
    pub top: usize,
    pub bottom: usize,
}

impl Part {
    pub const fn windows(&self) -> usize {
        (self.right - self.left) * (self.bottom - self.top)
    }
}

/// All windows of a frame (kalal2012, section 5.3).
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Grid {
    frame: Size,
    scales: Vec<Scale>,
}

impl Grid {
    /// The windows of the shape `width` × `height` over `frame`; sizes with a side below the least or above the frame's are
    /// left out.
    pub fn new(frame: Size, (width, height): (f64, f64), params: &ScanParams) -> Self {
        let most = params.scales as i32;
        let least = params.least_window_px.min(width.min(height).round().max(1.0));
        let scales = (-most..=most).filter_map(|k| {
            let factor = params.scale_step.powi(k);
            let (w, h) = ((width * factor).round_ties_even(), (height * factor).round_ties_even());
            if w.min(h) < least || w > frame.width as f64 || h > frame.height as f64 {
                return None;
            }
            let count = |all: usize, side: f64| ((all as f64 - side) / (side / SHIFTS as f64)).floor() as usize + 1;
            let (columns, rows) = (count(frame.width, w), count(frame.height, h));
            Some(Scale { width: w as usize, height: h as usize, columns, rows })
        });
        Self { frame, scales: scales.collect() }
    }

    /// Size of the frame.
    pub const fn frame(&self) -> Size {
        self.frame
    }

    pub fn scales(&self) -> &[Scale] {
        &self.scales
    }

    /// Number of all windows.
    pub fn windows(&self) -> usize {
        self.scales.iter().map(Scale::windows).sum()
    }

    /// The window of that number, counted through sizes, rows and columns.
    pub fn window(&self, mut number: usize) -> Option<BBox> {
        for scale in &self.scales {
            if number < scale.windows() {
                return Some(scale.window(number % scale.columns, number / scale.columns));
            }
            number -= scale.windows();
        }
        None
    }

    /// Whether `region` leaves nothing of the frame out.
    pub fn is_whole(&self, region: &BBox) -> bool {
        let all = self.frame.bounds();
        region.left() <= all.left()
            && region.top() <= all.top()
            && region.right() >= all.right()
            && region.bottom() >= all.bottom()
    }

    /// Which scales are near the `expected` width, as a range of indices.
    fn near(&self, expected: &BBox, steps: usize) -> std::ops::Range<usize> {
        let distance = |s: &Scale| (s.width as f64 / expected.width()).ln().abs();
        let nearest = (0..self.scales.len()).min_by(|a, b| {
            let of = |i: &usize| self.scales.get(*i).map_or(f64::INFINITY, distance);
            of(a).total_cmp(&of(b))
        });
        nearest.map_or(0..0, |at| at.saturating_sub(steps)..(at + steps + 1).min(self.scales.len()))
    }

    /// The windows of one of `turns` shares of whole rows, counted anew from 0 after the last: all of the frame in that many. A share
    /// is of one size, or of few: rows that lie together have most of their cells in common. Appended to `out`.
    pub fn pick_band(&self, turn: usize, turns: usize, out: &mut Vec<(Scale, Part)>) {
        let (turns, all) = (turns.max(1), self.windows());
        let turn = turn % turns;
        let (from, to) = (turn * all / turns, (turn + 1) * all / turns);
        let mut before = 0;
        out.extend(self.scales.iter().filter_map(|scale| {
            // The rows whose first window, counted through all of the grid, belongs to the share.
            let row = |window: usize| window.saturating_sub(before).div_ceil(scale.columns.max(1)).min(scale.rows);
            let part = Part { left: 0, right: scale.columns, top: row(from), bottom: row(to) };
            before += scale.windows();
            (part.windows() > 0).then_some((*scale, part))
        }));
    }

    /// The windows that `region`, in which the target is expected at `expected`, picks: parts of scales.
    pub fn pick(&self, region: &BBox, expected: &BBox, params: &ScanParams, out: &mut Vec<(Scale, Part)>) {
        out.clear();
        let whole = self.is_whole(region);
        let near = if whole || params.gate_by == GateBy::Intersection {
            0..self.scales.len()
        } else {
            self.near(expected, params.gate_scales)
        };
        out.extend(self.scales.get(near).unwrap_or_default().iter().filter_map(|scale| {
            let part = if whole {
                Part { left: 0, right: scale.columns, top: 0, bottom: scale.rows }
            } else {
                scale.picked(region, params.gate_by)
            };
            (part.windows() > 0).then_some((*scale, part))
        }));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::Value;

    #[test]
    fn windows_are_as_many_as_in_the_fixture() {
        let fixture: Value = serde_json::from_str(include_str!("../../tests/fixtures/tld_scan_grid.json")).unwrap();
        let params = ScanParams::default();
        for case in fixture["cases"].as_array().unwrap() {
            let number = |key: &str| case[key].as_u64().unwrap() as usize;
            let shape = (number("bw") as f64, number("bh") as f64);
            let grid = Grid::new(Size::new(number("W"), number("H")), shape, &params);
            let want: Vec<usize> =
                case["per_scale"].as_array().unwrap().iter().map(|n| n.as_u64().unwrap() as usize).collect();
            let want: Vec<usize> = want.into_iter().filter(|n| *n > 0).collect();
            assert_eq!(grid.scales().iter().map(Scale::windows).collect::<Vec<_>>(), want);
            assert_eq!(grid.windows(), number("total"));
        }
    }

    fn slow(grid: &Grid, region: &BBox, by: GateBy) -> Vec<(usize, usize, usize)> {
        let mut found = Vec::new();
        for (s, scale) in grid.scales().iter().enumerate() {
            for j in 0..scale.rows {
                for i in 0..scale.columns {
                    let window = scale.window(i, j);
                    let picked = match by {
                        // A touch is enough.
                        GateBy::Intersection => {
                            window.left() <= region.right()
                                && window.right() >= region.left()
                                && window.top() <= region.bottom()
                                && window.bottom() >= region.top()
                        }
                        GateBy::Center => {
                            let c = window.center();
                            (region.left()..=region.right()).contains(&c.x)
                                && (region.top()..=region.bottom()).contains(&c.y)
                        }
                    };
                    if picked {
                        found.push((s, i, j));
                    }
                }
            }
        }
        found
    }

    #[test]
    fn regions_pick_the_windows_of_the_twin() {
        for by in GateBy::ALL.iter().copied() {
            let params = ScanParams { gate_by: by, gate_scales: 40, ..ScanParams::default() };
            let grid = Grid::new(Size::new(160, 120), (31.0, 24.0), &params);
            for region in [
                BBox::from_ltwh(40.3, 20.7, 62.0, 48.0),
                BBox::from_ltwh(-30.0, 80.0, 62.0, 48.0),
                BBox::from_ltwh(500.0, 20.0, 10.0, 10.0),
            ] {
                let mut parts = Vec::new();
                grid.pick(&region, &BBox::from_ltwh(60.0, 30.0, 31.0, 24.0), &params, &mut parts);
                let mut got = Vec::new();
                for (scale, part) in &parts {
                    let s = grid.scales().iter().position(|other| other == scale).unwrap();
                    for j in part.top..part.bottom {
                        got.extend((part.left..part.right).map(|i| (s, i, j)));
                    }
                }
                assert_eq!(got, slow(&grid, &region, by), "{by:?} {region}");
            }
        }
    }

    #[test]
    fn only_the_centre_gate_limits_sizes() {
        let params = ScanParams { gate_scales: 2, ..ScanParams::default() };
        let grid = Grid::new(Size::new(320, 240), (40.0, 40.0), &params);
        let expected = BBox::from_ltwh(100.0, 100.0, 58.0, 58.0);
        let mut parts = Vec::new();
        grid.pick(&expected.scaled(2.0), &expected, &params, &mut parts);
        assert_eq!(parts.iter().map(|(s, _)| s.width).collect::<Vec<_>>(), [40, 48, 58, 69, 83]);
        grid.pick(&Size::new(320, 240).bounds(), &expected, &params, &mut parts);
        assert_eq!(parts.iter().map(|(_, p)| p.windows()).sum::<usize>(), grid.windows());
        assert!(grid.is_whole(&Size::new(320, 240).bounds()) && !grid.is_whole(&expected));
    }

    #[test]
    fn small_targets_have_windows_and_giants_none() {
        let params = ScanParams::default();
        let grid = Grid::new(Size::new(320, 240), (12.0, 11.0), &params);
        assert_eq!(grid.scales().first().map(|s| (s.width, s.height)), Some((12, 11)));
        assert!(Grid::new(Size::new(100, 80), (3000.0, 3000.0), &params).scales().is_empty());
        assert_eq!(Grid::new(Size::new(100, 80), (3000.0, 3000.0), &params).windows(), 0);
    }

    #[test]
    fn bands_take_in_all_windows_once() {
        let grid = Grid::new(Size::new(160, 120), (31.0, 24.0), &ScanParams::default());
        let (mut seen, mut sizes) = (std::collections::BTreeSet::new(), std::collections::BTreeSet::new());
        for turn in 40..47 {
            let mut parts = Vec::new();
            grid.pick_band(turn, 7, &mut parts);
            let scanned = parts.iter().map(|(_, p)| p.windows()).sum::<usize>();
            assert!(scanned.abs_diff(grid.windows() / 7) <= 2 * grid.scales()[0].columns, "{scanned} in turn {turn}");
            for (scale, part) in &parts {
                assert_eq!((part.left, part.right), (0, scale.columns));
                sizes.insert((turn, scale.width));
                for row in part.top..part.bottom {
                    assert!(seen.insert((scale.width, row)), "a row twice");
                }
            }
        }
        assert_eq!(seen.len(), grid.scales().iter().map(|s| s.rows).sum::<usize>());
        // Every size is cut into few shares: rows side by side have most of their cells in common.
        assert!(sizes.len() < grid.scales().len() + 7, "{} pieces", sizes.len());
        let mut whole = Vec::new();
        grid.pick_band(3, 1, &mut whole);
        assert_eq!(whole.iter().map(|(_, p)| p.windows()).sum::<usize>(), grid.windows());
    }

    /// Of a target that moves by up to its own size and grows by up to a step, a gate of twice its sides and a band of the
    /// twenty leave a window of more than half overlap in nearly every case, where all windows do.
    #[test]
    fn a_gate_of_few_windows_holds_the_target() {
        let params = ScanParams::default();
        let frame = Size::new(320, 240);
        let grid = Grid::new(frame, (28.0, 34.0), &params);
        let (mut within, mut kept, mut scanned, mut random) = (0, 0, 0, 11);
        let mut uniform = |from: f64, to: f64| {
            let share = (crate::appearance::draw(&mut random) >> 11) as f64 / (1u64 << 53) as f64;
            from + share * (to - from)
        };
        let found = |parts: &[(Scale, Part)], target: &BBox| {
            parts.iter().any(|(scale, part)| {
                let windows = (part.top..part.bottom).flat_map(|j| (part.left..part.right).map(move |i| (i, j)));
                windows.into_iter().any(|(i, j)| scale.window(i, j).iou(target) > 0.5)
            })
        };
        let mut all = Vec::new();
        grid.pick(&frame.bounds(), &frame.bounds(), &params, &mut all);
        for turn in 0..120 {
            let expected = BBox::from_ltwh(uniform(0.0, 280.0), uniform(0.0, 200.0), 28.0, 34.0);
            let target = expected.translated(uniform(-28.0, 28.0), uniform(-34.0, 34.0)).scaled(uniform(0.83, 1.2));
            let mut parts = Vec::new();
            grid.pick(&expected.scaled(2.0), &expected, &params, &mut parts);
            let gate_found = found(&parts, &target);
            grid.pick_band(turn, params.turn_frames, &mut parts);
            scanned += parts.iter().map(|(_, p)| p.windows()).sum::<usize>();
            if found(&all, &target) {
                within += 1;
                kept += usize::from(gate_found);
            }
        }
        assert!(within > 80 && kept * 100 >= within * 99, "{kept} of {within}");
        assert!(scanned * 100 <= 15 * 120 * grid.windows(), "{} of {}", scanned / 120, grid.windows());
    }
}
