//! Lines that are crossed and zones that are entered.

use super::{Event, Kind, between, steps};
use crate::{Measured, MeasuringError, Result, State};
use std::str::FromStr;

/// A piece of a line, in the ruler's unit, written `[NAME=]X1,Y1,X2,Y2`.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// Its name.
    pub name: String,
    /// From where.
    pub from: [f64; 2],
    /// To where.
    pub to: [f64; 2],
}

/// A polygon, in the ruler's unit, written `[NAME=]X1,Y1,X2,Y2,X3,Y3,…`.
#[derive(Debug, Clone, PartialEq)]
pub struct Zone {
    /// Its name.
    pub name: String,
    /// Its corners, three or more.
    pub corners: Vec<[f64; 2]>,
}

/// Name and points of a text; the text itself is the name where it has none.
fn named(text: &str) -> Option<(String, Vec<[f64; 2]>)> {
    let (name, numbers) = text.split_once('=').map_or((text, text), |(name, numbers)| (name, numbers));
    let numbers: Vec<f64> =
        numbers.split(',').map(|n| n.trim().parse().ok().filter(|v: &f64| v.is_finite())).collect::<Option<_>>()?;
    let (pairs, rest) = numbers.as_chunks::<2>();
    (rest.is_empty() && !name.trim().is_empty()).then(|| (name.trim().to_owned(), pairs.to_vec()))
}

impl FromStr for Line {
    type Err = MeasuringError;

    fn from_str(text: &str) -> Result<Self> {
        match named(text) {
            Some((name, points)) if points.len() == 2 && points[0] != points[1] => {
                Ok(Self { name, from: points[0], to: points[1] })
            }
            _ => Err(MeasuringError::Option(format!(
                "`{text}` is no line; give [NAME=]X1,Y1,X2,Y2 in the unit of the results, for example goal=2,0,2,1.5"
            ))),
        }
    }
}

impl FromStr for Zone {
    type Err = MeasuringError;

    fn from_str(text: &str) -> Result<Self> {
        match named(text) {
            Some((name, corners)) if corners.len() >= 3 => Ok(Self { name, corners }),
            _ => Err(MeasuringError::Option(format!(
                "`{text}` is no zone; give [NAME=] and three corners or more, X1,Y1,X2,Y2,X3,Y3 in the unit of the results"
            ))),
        }
    }
}

impl Line {
    /// Where a target crossed it.
    pub(super) fn crossings(&self, measured: &Measured) -> Vec<Event> {
        let events = steps(measured).filter_map(|(i, a, b, from, to)| {
            let share = self.share(a.position(), b.position())?;
            let (time_s, time_error_s) = self.when(a, b, (from, to), share);
            Some(Event {
                target: measured.target,
                kind: Kind::Crossing,
                frame: measured.moments[i].frame,
                time_s,
                time_error_s,
                at: between(a, b, to - from, share),
                name: Some(self.name.clone()),
            })
        });
        events.collect()
    }

    /// How far beside the line a point is, positive to its left.
    fn beside(&self, p: [f64; 2]) -> f64 {
        let (dx, dy) = (self.to[0] - self.from[0], self.to[1] - self.from[1]);
        (dx * (p[1] - self.from[1]) - dy * (p[0] - self.from[0])) / dx.hypot(dy)
    }

    /// At which share of the way from `a` to `b` the piece is crossed.
    fn share(&self, a: [f64; 2], b: [f64; 2]) -> Option<f64> {
        let (da, db) = (self.beside(a), self.beside(b));
        if (da < 0.0) == (db < 0.0) {
            return None;
        }
        let share = da / (da - db);
        let at = [a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])];
        let (dx, dy) = (self.to[0] - self.from[0], self.to[1] - self.from[1]);
        let along = ((at[0] - self.from[0]) * dx + (at[1] - self.from[1]) * dy) / (dx * dx + dy * dy);
        (0.0..=1.0).contains(&along).then_some(share)
    }

    /// When it was crossed: the place's error across the line over the speed across it.
    fn when(&self, a: &State, b: &State, (from, to): (f64, f64), share: f64) -> (f64, f64) {
        let (dx, dy) = (self.to[0] - self.from[0], self.to[1] - self.from[1]);
        let normal = nalgebra::Vector2::new(-dy, dx) / dx.hypot(dy);
        let near = if share < 0.5 { a } else { b };
        let block = near.covariance().fixed_view::<2, 2>(0, 0);
        let error = (normal.transpose() * block * normal)[0].max(0.0).sqrt();
        let across = (self.beside(b.position()) - self.beside(a.position())).abs() / (to - from);
        (from + share * (to - from), error / across.max(f64::MIN_POSITIVE))
    }
}

impl Zone {
    /// Where a target came in and went out.
    pub(super) fn passages(&self, measured: &Measured) -> Vec<Event> {
        let mut events = Vec::new();
        for (i, a, b, from, to) in steps(measured) {
            let (was, is) = (self.contains(a.position()), self.contains(b.position()));
            if was == is {
                continue;
            }
            let crossed = self.sides().filter_map(|side| Some((side.share(a.position(), b.position())?, side)));
            let Some((share, side)) = crossed.min_by(|a, b| a.0.total_cmp(&b.0)) else { continue };
            let (time_s, time_error_s) = side.when(a, b, (from, to), share);
            events.push(Event {
                target: measured.target,
                kind: if is { Kind::Entry } else { Kind::Exit },
                frame: measured.moments[i].frame,
                time_s,
                time_error_s,
                at: between(a, b, to - from, share),
                name: Some(self.name.clone()),
            });
        }
        events
    }

    fn sides(&self) -> impl Iterator<Item = Line> {
        let next = self.corners.iter().cycle().skip(1);
        let sides = self.corners.iter().zip(next).filter(|(a, b)| a != b);
        sides.map(|(from, to)| Line { name: String::new(), from: *from, to: *to })
    }

    /// Whether a point lies inside, by how often a ray from it crosses the border.
    pub(super) fn contains(&self, p: [f64; 2]) -> bool {
        let crosses = |side: &Line| {
            let (a, b) = (side.from, side.to);
            (a[1] > p[1]) != (b[1] > p[1]) && p[0] < a[0] + (p[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0])
        };
        self.sides().filter(crosses).count() % 2 == 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_and_zones_are_read_with_and_without_names() {
        let line: Line = "goal=2,0,2,1.5".parse().unwrap();
        assert_eq!((line.name.as_str(), line.from, line.to), ("goal", [2.0, 0.0], [2.0, 1.5]));
        assert_eq!("0,0,1,1".parse::<Line>().unwrap().name, "0,0,1,1");
        let zone: Zone = "box = 0,0, 2,0, 2,2, 0,2".parse().unwrap();
        assert!(zone.contains([1.0, 1.0]) && !zone.contains([3.0, 1.0]) && !zone.contains([1.0, -1.0]));
        for wrong in ["", "a=", "1,2,3", "1,2,1,2", "1,2,x,4", "1,2,3,inf", "=1,2,3,4"] {
            assert!(wrong.parse::<Line>().unwrap_err().to_string().contains("for example goal="), "{wrong}");
        }
        assert!("0,0,1,1".parse::<Zone>().is_err());
    }

    #[test]
    fn only_the_piece_is_crossed() {
        let line: Line = "0,0,1,0".parse().unwrap();
        assert_eq!(line.share([0.5, -1.0], [0.5, 3.0]), Some(0.25));
        assert_eq!(line.share([1.5, -1.0], [1.5, 3.0]), None);
        assert_eq!(line.share([0.5, 1.0], [0.5, 3.0]), None);
    }
}
