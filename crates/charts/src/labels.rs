//! Names beside dots, placed so that they lie neither on each other nor on the dots.

use crate::text::width;

/// Radius of a dot.
pub(crate) const DOT: f64 = 6.0;
const SIZE: f64 = 12.5;
/// Height of capitals above the baseline, and of descenders below it.
const ABOVE: f64 = 9.5;
const BELOW: f64 = 3.0;

/// A rectangle: left, top, right, bottom.
type Area = [f64; 4];

/// Where a name stands: x, baseline, and which point of the text lies there (SVG's `text-anchor`).
pub(crate) type Place = (f64, f64, &'static str);

/// Places for the names of dots, inside `bounds`. A dot's name goes to its right, left, above, below, or one of the corners:
/// where it covers least, the first of these that covers nothing.
pub(crate) fn place(dots: &[(f64, f64, &str)], bounds: Area) -> Vec<Place> {
    let mut taken: Vec<Area> = dots.iter().map(|(x, y, _)| [x - DOT, y - DOT, x + DOT, y + DOT]).collect();
    let mut places = Vec::with_capacity(dots.len());
    for (x, y, name) in dots {
        let wide = width(name, SIZE);
        let cost = |at: Place| {
            let area = area(at, wide);
            let covered: f64 = taken.iter().map(|t| common(area, *t)).sum();
            covered + 4.0 * (size(area) - common(area, bounds))
        };
        let mut best = ((*x, *y, "start"), f64::INFINITY);
        for candidate in candidates(*x, *y) {
            let cost = cost(candidate);
            if cost < best.1 - 1e-9 {
                best = (candidate, cost);
            }
        }
        taken.push(area(best.0, wide));
        places.push(best.0);
    }
    places
}

fn candidates(x: f64, y: f64) -> [Place; 8] {
    let (right, left) = (x + DOT + 4.0, x - DOT - 4.0);
    let (level, above, below) = (y + 4.0, y - DOT - 5.0, y + DOT + ABOVE + 3.0);
    [
        (right, level, "start"),
        (left, level, "end"),
        (x, above, "middle"),
        (x, below, "middle"),
        (right, above, "start"),
        (left, above, "end"),
        (right, below, "start"),
        (left, below, "end"),
    ]
}

fn area((x, baseline, anchor): Place, wide: f64) -> Area {
    let before = match anchor {
        "end" => wide,
        "middle" => wide / 2.0,
        _ => 0.0,
    };
    [x - before, baseline - ABOVE, x - before + wide, baseline + BELOW]
}

fn size([left, top, right, bottom]: Area) -> f64 {
    (right - left).max(0.0) * (bottom - top).max(0.0)
}

/// The size of what two rectangles have in common.
fn common(a: Area, b: Area) -> f64 {
    size([a[0].max(b[0]), a[1].max(b[1]), a[2].min(b[2]), a[3].min(b[3])])
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOUNDS: Area = [0.0, 0.0, 400.0, 300.0];

    #[test]
    fn a_lone_name_stands_right_inside_the_border() {
        assert_eq!(place(&[(100.0, 100.0, "kcf")], BOUNDS), [(110.0, 104.0, "start")]);
        assert_eq!(place(&[(395.0, 100.0, "kcf")], BOUNDS), [(385.0, 104.0, "end")]);
        assert_eq!(area((100.0, 50.0, "middle"), 20.0), [90.0, 40.5, 110.0, 53.0]);
    }

    #[test]
    fn names_of_neighbours_cover_nothing() {
        let dots =
            [(200.0, 150.0, "staple"), (206.0, 158.0, "pursuit"), (216.0, 149.0, "strcf"), (190.0, 152.0, "dsst")];
        let places = place(&dots, BOUNDS);
        let areas: Vec<Area> = places.iter().zip(dots).map(|(at, (.., name))| area(*at, width(name, SIZE))).collect();
        for (i, a) in areas.iter().enumerate() {
            assert_eq!(common(*a, BOUNDS), size(*a), "{a:?} leaves the chart");
            assert!(areas[..i].iter().all(|b| common(*a, *b) == 0.0), "{a:?}");
            let covered: f64 = dots.iter().map(|(x, y, _)| common(*a, [x - DOT, y - DOT, x + DOT, y + DOT])).sum();
            assert!(covered < 40.0, "{a:?} covers {covered} of the dots");
        }
    }

    #[test]
    fn rectangles_apart_have_nothing_in_common() {
        assert_eq!(common([0.0, 0.0, 4.0, 3.0], [2.0, 1.0, 9.0, 9.0]), 4.0);
        assert_eq!(common([0.0, 0.0, 1.0, 1.0], [2.0, 2.0, 3.0, 3.0]), 0.0);
    }
}
