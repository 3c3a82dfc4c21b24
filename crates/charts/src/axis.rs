//! An axis: its label, its range, and where a value lies on it.

use crate::ticks::{self, Tick};

/// One axis of a chart, as it is asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    pub(crate) label: String,
    range: Option<(f64, f64)>,
    logarithmic: bool,
    whole: bool,
    snug: bool,
}

impl Axis {
    /// A linear axis that holds all data.
    pub fn new(label: impl Into<String>) -> Self {
        Self { label: label.into(), range: None, logarithmic: false, whole: false, snug: false }
    }

    /// With this range whatever the data; what lies outside is drawn on the border. A range without extent, or that is
    /// not finite, is not taken.
    #[must_use]
    pub fn over(mut self, from: f64, to: f64) -> Self {
        self.range = Some((from, to)).filter(|_| from.is_finite() && to.is_finite() && from < to);
        self
    }

    /// With ticks at whole numbers only.
    #[must_use]
    pub const fn whole(mut self) -> Self {
        self.whole = true;
        self
    }

    /// On a logarithmic scale; values of 0 and below are drawn on the border.
    #[must_use]
    pub const fn logarithmic(mut self) -> Self {
        self.logarithmic = true;
        self
    }

    /// From the least value to the greatest, with no room beyond: for time.
    #[must_use]
    pub(crate) const fn snug(mut self) -> Self {
        self.snug = true;
        self
    }

    /// The axis with a range that holds `values` (finite).
    pub(crate) fn fitted(&self, values: impl Iterator<Item = f64>, wanted: usize) -> Scale {
        let usable = values.filter(|v| !self.logarithmic || *v > 1e-290);
        let (low, high) = usable.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        let least_step = if self.whole { 1.0 } else { 0.0 };
        let (from, to) = match (self.range, self.logarithmic) {
            (Some(range), _) => range,
            (None, true) if low <= high => (low / 1.6, high * 1.6),
            (None, true) => (0.6, 16.0),
            (None, false) if low > high => (0.0, 1.0),
            (None, false) if self.snug => widened(low, high),
            (None, false) => rounded(widened(low, high), wanted, least_step),
        };
        Scale { from, to, logarithmic: self.logarithmic && from > 0.0, least_step }
    }
}

/// A range with an extent, in the middle of which a lone value lies.
fn widened(low: f64, high: f64) -> (f64, f64) {
    // Values nearer to each other than this are one.
    let least = (1e-9 * low.abs().max(high.abs())).max(1e-290);
    if high - low > least {
        return (low, high);
    }
    let around = if low.abs() <= least { 0.5 } else { 0.05 * low.abs() };
    (low - around, high + around)
}

/// A range from tick to tick.
fn rounded((low, high): (f64, f64), wanted: usize, least_step: f64) -> (f64, f64) {
    let step = ticks::round_step(high - low, wanted, least_step);
    ((low / step + 1e-9).floor() * step, (high / step - 1e-9).ceil() * step)
}

/// A range that values are placed in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Scale {
    pub from: f64,
    pub to: f64,
    logarithmic: bool,
    least_step: f64,
}

impl Scale {
    /// Where a value lies, 0 … 1; beyond the ends at the ends.
    pub fn place(&self, value: f64) -> f64 {
        let scale = |v: f64| if self.logarithmic { v.max(f64::MIN_POSITIVE).log10() } else { v };
        ((scale(value) - scale(self.from)) / (scale(self.to) - scale(self.from))).clamp(0.0, 1.0)
    }

    pub fn ticks(&self, wanted: usize) -> Vec<Tick> {
        if self.logarithmic {
            ticks::logarithmic(self.from, self.to, wanted)
        } else {
            ticks::linear(self.from, self.to, wanted, self.least_step)
        }
    }

    /// The same middle with an extent `factor` (≥ 1) times as large.
    pub fn stretched(self, factor: f64) -> Self {
        let more = (self.to - self.from) * (factor - 1.0) / 2.0;
        Self { from: self.from - more, to: self.to + more, ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn range(axis: &Axis, values: &[f64]) -> (f64, f64) {
        let scale = axis.fitted(values.iter().copied(), 5);
        (scale.from, scale.to)
    }

    #[test]
    fn ranges_hold_the_data_and_end_on_ticks() {
        let axis = Axis::new("a");
        assert_eq!(range(&axis, &[0.3, 9.2]), (0.0, 10.0));
        assert_eq!(range(&axis, &[-3.0, 1.0]), (-3.0, 1.0));
        assert_eq!(range(&axis.clone().snug(), &[0.3, 9.2]), (0.3, 9.2));
        assert_eq!(range(&axis.clone().over(0.0, 1.0), &[7.0]), (0.0, 1.0));
        assert_eq!(range(&axis.clone().over(1.0, 1.0), &[0.0, 4.0]), (0.0, 4.0));
        assert_eq!(range(&axis.clone().over(0.0, f64::NAN), &[0.0, 4.0]), (0.0, 4.0));
        assert_eq!(range(&axis, &[]), (0.0, 1.0));
    }

    #[test]
    fn a_lone_value_lies_in_the_middle() {
        for value in [0.0, 7.0, -200.0, 1e-12] {
            let scale = Axis::new("a").snug().fitted([value].into_iter(), 5);
            assert!((scale.place(value) - 0.5).abs() < 1e-9, "{value}: {scale:?}");
        }
    }

    #[test]
    fn logarithmic_scales_place_by_ratio() {
        let scale = Axis::new("a").logarithmic().fitted([10.0, 1000.0, 0.0, -4.0].into_iter(), 5);
        assert_eq!((scale.from, scale.to), (6.25, 1600.0));
        assert!((scale.place(100.0) - 0.5).abs() < 1e-12);
        assert_eq!((scale.place(0.0), scale.place(1e9)), (0.0, 1.0));
        assert_eq!(scale.ticks(4).len(), 3);
        let empty = Axis::new("a").logarithmic().fitted(std::iter::empty(), 5);
        assert_eq!(empty.ticks(5).len(), 4);
        let from_zero = Axis::new("a").logarithmic().over(0.0, 2.0).fitted(std::iter::empty(), 5);
        assert_eq!(from_zero.place(1.0), 0.5);
    }

    #[test]
    fn whole_axes_have_no_ticks_between() {
        let scale = Axis::new("a").whole().over(0.0, 3.0).fitted(std::iter::empty(), 9);
        assert_eq!(scale.ticks(9).iter().map(|t| t.1.as_str()).collect::<Vec<_>>(), ["0", "1", "2", "3"]);
    }

    #[test]
    fn stretching_keeps_the_middle() {
        let scale = Axis::new("a").over(2.0, 4.0).fitted(std::iter::empty(), 5).stretched(3.0);
        assert_eq!((scale.from, scale.to), (0.0, 6.0));
    }
}
