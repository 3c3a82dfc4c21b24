//! What a chart shows: lines and points in colours with a meaning.

/// A colour by what it stands for; how it looks depends on the background (see the style sheet).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Color {
    /// What was measured: green.
    Measured,
    /// What was predicted before the frame was seen: red.
    Predicted,
    /// The estimate: blue.
    Estimate,
    /// The truth: grey.
    Truth,
    /// Anything else to compare with: purple.
    Other,
    /// One of many of a kind, by number: eight colours; lines of later numbers are dashed.
    Number(usize),
}

impl Color {
    /// The class of the style sheet.
    pub(crate) fn class(self) -> String {
        match self {
            Self::Measured => "measured".into(),
            Self::Predicted => "predicted".into(),
            Self::Estimate => "estimate".into(),
            Self::Truth => "truth".into(),
            Self::Other => "other".into(),
            Self::Number(n) => format!("t{}", n % 8),
        }
    }

    /// The dashes of a line by which numbers of one colour are told apart.
    pub(crate) fn dashes(self) -> &'static str {
        match self {
            Self::Number(n) => ["", "7 4", "2 3", "9 3 2 3"][n / 8 % 4],
            _ => "",
        }
    }
}

/// How a series is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Marks {
    Line {
        dashed: bool,
    },
    Points,
    /// Large dots with the series' name beside them.
    Named,
    /// The area between two curves: the points of the lower one follow those of the upper one.
    Area,
}

/// One curve or cloud of points.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    pub(crate) name: String,
    pub(crate) color: Color,
    pub(crate) marks: Marks,
    pub(crate) points: Vec<(f64, f64)>,
}

impl Series {
    /// A line through `points`; a coordinate that is not a number, or is beyond ±1e300, interrupts it.
    pub fn line(name: impl Into<String>, color: Color, points: Vec<(f64, f64)>) -> Self {
        Self { name: name.into(), color, marks: Marks::Line { dashed: false }, points }
    }

    /// A dashed line.
    pub fn dashed(name: impl Into<String>, color: Color, points: Vec<(f64, f64)>) -> Self {
        Self { marks: Marks::Line { dashed: true }, ..Self::line(name, color, points) }
    }

    /// Separate points.
    pub fn points(name: impl Into<String>, color: Color, points: Vec<(f64, f64)>) -> Self {
        Self { marks: Marks::Points, ..Self::line(name, color, points) }
    }

    /// Large dots, each with the name beside it; the legend leaves them out.
    pub fn named(name: impl Into<String>, color: Color, points: Vec<(f64, f64)>) -> Self {
        Self { marks: Marks::Named, ..Self::line(name, color, points) }
    }

    /// The area between two curves over the same x, `(x, lower, upper)`: what is uncertain around a line. What is not a number
    /// interrupts it.
    pub fn area(name: impl Into<String>, color: Color, points: &[(f64, f64, f64)]) -> Self {
        let upper = points.iter().map(|p| (p.0, if p.1.is_finite() { p.2 } else { f64::NAN }));
        let lower = points.iter().map(|p| (p.0, if p.2.is_finite() { p.1 } else { f64::NAN }));
        let both = upper.chain(lower).collect();
        Self { marks: Marks::Area, ..Self::line(name, color, both) }
    }

    /// Upper and lower curve of an area, stretch by stretch.
    pub(crate) fn areas(&self) -> impl Iterator<Item = [&[(f64, f64)]; 2]> {
        let (upper, lower) = self.points.split_at(self.points.len() / 2);
        let stretches = |points: &'_ [(f64, f64)]| -> Vec<(usize, usize)> {
            let mut at = 0;
            let all = points.split(|p| !can_be_drawn(*p)).map(|s| {
                let span = (at, at + s.len());
                at += s.len() + 1;
                span
            });
            all.filter(|(from, to)| to > from).collect()
        };
        let spans = stretches(upper);
        spans.into_iter().filter_map(move |(from, to)| Some([upper.get(from..to)?, lower.get(from..to)?]))
    }

    /// The points that can be drawn.
    pub(crate) fn finite(&self) -> impl Iterator<Item = (f64, f64)> {
        self.points.iter().copied().filter(|p| can_be_drawn(*p))
    }

    /// Stretches of points that can be drawn.
    pub(crate) fn segments(&self) -> impl Iterator<Item = &[(f64, f64)]> {
        self.points.split(|p| !can_be_drawn(*p)).filter(|s| !s.is_empty())
    }

    /// The dashes of its line, as SVG wants them.
    pub(crate) fn dashes(&self) -> &'static str {
        match self.marks {
            Marks::Line { dashed: true } => "6 4",
            _ => self.color.dashes(),
        }
    }
}

/// Whether both coordinates are numbers, of which there can be a difference.
fn can_be_drawn((x, y): (f64, f64)) -> bool {
    x.abs() <= 1e300 && y.abs() <= 1e300
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_a_number_interrupts() {
        let points = vec![(0.0, 1.0), (1.0, 2.0), (2.0, f64::NAN), (f64::INFINITY, 1.0), (4.0, 5.0)];
        let series = Series::line("s", Color::Truth, points);
        assert_eq!(series.segments().map(<[_]>::len).collect::<Vec<_>>(), [2, 1]);
        assert_eq!(series.finite().last(), Some((4.0, 5.0)));
    }

    #[test]
    fn numbers_beyond_the_colours_are_dashed() {
        assert_eq!((Color::Number(9).class().as_str(), Color::Number(9).dashes()), ("t1", "7 4"));
        assert_eq!(
            (Color::Number(7).dashes(), Color::Number(16).dashes(), Color::Number(24).dashes()),
            ("", "2 3", "9 3 2 3")
        );
        assert_eq!((Color::Measured.dashes(), Color::Other.class().as_str()), ("", "other"));
        assert_eq!(Series::dashed("s", Color::Number(9), Vec::new()).dashes(), "6 4");
        assert_eq!(Series::points("s", Color::Number(9), Vec::new()).dashes(), "7 4");
    }
}
