//! Outlines of regions.

use pursuit_geometry::Point;
use pursuit_imaging::ImageView;

/// The eight neighbours, clockwise on the screen (y down) from the left one.
const RING: [(isize, isize); 8] = [(-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0), (1, 1), (0, 1), (-1, 1)];

/// Follows the outer border of the 8-connected region of `mask` whose topmost-leftmost pixel is `first`, and writes the
/// pixels passed, in order, to `outline` (closed implicitly; thin parts are passed twice).
///
/// Border following after Suzuki and Abe (1985), outer borders only. `outline` is left empty when `first` is not set.
pub fn trace(mask: ImageView<'_, u8>, first: (usize, usize), outline: &mut Vec<(usize, usize)>) {
    outline.clear();
    let is_set = |(x, y): (isize, isize)| x >= 0 && y >= 0 && mask.get(x as usize, y as usize).is_some_and(|&v| v != 0);
    let start = (first.0 as isize, first.1 as isize);
    if !is_set(start) {
        return;
    }
    outline.push(first);
    let step = |at: (isize, isize), direction: usize| {
        let (dx, dy) = RING[direction % 8];
        (at.0 + dx, at.1 + dy)
    };
    // The last neighbour, clockwise from the left one, is where the walk will come back from.
    let Some(last) = (0..8).find(|&d| is_set(step(start, d))) else { return };
    let before_start = step(start, last);
    let (mut at, mut from) = (start, last);
    loop {
        // Counter-clockwise from where we came.
        let Some(turn) = (1..=8).find(|turn| is_set(step(at, from + 8 - turn))) else { return };
        let direction = (from + 8 - turn) % 8;
        let next = step(at, direction);
        if next == start && at == before_start {
            return;
        }
        outline.push((next.0 as usize, next.1 as usize));
        at = next;
        from = direction + 4;
    }
}

/// Length of the closed line through the centres of the outline's pixels, in pixels.
pub fn perimeter(outline: &[(usize, usize)]) -> f64 {
    edges(outline).map(|((ax, ay), (bx, by))| (bx - ax).hypot(by - ay)).sum()
}

/// Area enclosed by the closed line through the centres of the outline's pixels, in square pixels: holes count, and the
/// outer half of the border pixels does not.
pub fn enclosed_area(outline: &[(usize, usize)]) -> f64 {
    edges(outline).map(|((ax, ay), (bx, by))| ax * by - bx * ay).sum::<f64>().abs() / 2.0
}

fn edges(outline: &[(usize, usize)]) -> impl Iterator<Item = ((f64, f64), (f64, f64))> + '_ {
    let real = |&(x, y): &(usize, usize)| (x as f64, y as f64);
    outline.iter().map(real).zip(outline.iter().cycle().skip(1).map(real))
}

/// Area of a polygon given by its vertices in order (shoelace formula), in square pixels.
pub fn polygon_area(vertices: &[Point]) -> f64 {
    let next = vertices.iter().cycle().skip(1);
    vertices.iter().zip(next).map(|(a, b)| a.x * b.y - b.x * a.y).sum::<f64>().abs() / 2.0
}

/// Writes the convex hull of the *pixels* of the outline (their four corners, continuous pixels) to `hull`, in order.
pub fn pixel_hull(outline: &[(usize, usize)], hull: &mut Vec<Point>, scratch: &mut Vec<Point>) {
    scratch.clear();
    scratch.extend(outline.iter().map(|&(x, y)| Point::new(x as f64, y as f64)));
    convex_hull(scratch, hull);
    // The hull of the corners is the hull of the corners of the hull's vertices.
    scratch.clear();
    for p in hull.iter() {
        let corners = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)];
        scratch.extend(corners.map(|(dx, dy)| Point::new(p.x + dx, p.y + dy)));
    }
    convex_hull(scratch, hull);
}

/// Writes the convex hull of `points` (which get sorted) to `hull`, in order, without collinear points.
pub fn convex_hull(points: &mut Vec<Point>, hull: &mut Vec<Point>) {
    hull.clear();
    points.sort_unstable_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup();
    if points.len() < 3 {
        hull.extend_from_slice(points);
        return;
    }
    // Andrew's monotone chain: the lower hull from left to right, then the upper one back.
    let extend = |hull: &mut Vec<Point>, floor: usize, p: Point| {
        while hull.len() >= floor + 2 && cross(hull[hull.len() - 2], hull[hull.len() - 1], p) <= 0.0 {
            hull.pop();
        }
        hull.push(p);
    };
    for &p in points.iter() {
        extend(hull, 0, p);
    }
    let floor = hull.len() - 1;
    for &p in points.iter().rev().skip(1) {
        extend(hull, floor, p);
    }
    hull.pop();
}

/// Twice the signed area of the triangle.
fn cross(a: Point, b: Point, c: Point) -> f64 {
    (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::regions::RegionFinder;
    use proptest::prelude::*;
    use pursuit_geometry::Polygon;
    use pursuit_imaging::Image;
    use pursuit_testkit::Noise;

    include!("../tests/fixtures/contours.rs");

    fn mask(rows: &[&str]) -> Image<u8> {
        let data = rows.iter().flat_map(|r| r.bytes().map(|b| if b == b'#' { 255 } else { 0 })).collect();
        Image::from_vec(data, rows[0].len(), rows.len()).unwrap()
    }

    #[test]
    fn perimeter_and_area_are_those_of_opencv() {
        for (rows, expected) in SHAPES {
            let mask = mask(rows);
            let mut finder = RegionFinder::default();
            let mut outline = Vec::new();
            let mut got: Vec<(f64, f64)> = finder
                .find(mask.view(), 1)
                .iter()
                .map(|r| {
                    trace(mask.view(), r.first, &mut outline);
                    (perimeter(&outline), enclosed_area(&outline))
                })
                .collect();
            got.sort_by(|a, b| a.partial_cmp(b).unwrap());
            assert_eq!(got.len(), expected.len(), "{rows:#?}");
            for (g, e) in got.iter().zip(*expected) {
                assert!((g.0 - e.0).abs() < 1e-3 && (g.1 - e.1).abs() < 1e-9, "{g:?} {e:?} {rows:#?}");
            }
        }
    }

    proptest! {
        /// The outline passes exactly the pixels of the region that touch the outside (8-connected region, so the
        /// outside is 4-connected), and steps to neighbours only.
        #[test]
        fn outlines_pass_the_outer_border((w, h) in (1usize..16, 1usize..12), seed in any::<u32>()) {
            let mut noise = Noise::new(seed | 1);
            let image = Image::from_fn(w, h, |_, _| u8::from((noise.draw() >> 16) % 9 < 5)).unwrap();
            let mut finder = RegionFinder::default();
            let mut outline = Vec::new();
            for region in finder.find(image.view(), 1) {
                trace(image.view(), region.first, &mut outline);
                for (a, b) in outline.iter().zip(outline.iter().cycle().skip(1)) {
                    prop_assert!(a.0.abs_diff(b.0) <= 1 && a.1.abs_diff(b.1) <= 1);
                }
                let mut passed = outline.clone();
                passed.sort_unstable();
                passed.dedup();
                let mut border = outer_border(&image, region.first);
                border.sort_unstable();
                prop_assert_eq!(passed, border);
            }
        }

        #[test]
        fn hulls_are_convex_and_hold_every_point(raw in proptest::collection::vec((0i32..30, 0i32..30), 1..60)) {
            let points: Vec<Point> = raw.iter().map(|&(x, y)| Point::new(x.into(), y.into())).collect();
            let mut hull = Vec::new();
            convex_hull(&mut points.clone(), &mut hull);
            let n = hull.len();
            if n >= 3 {
                for i in 0..n {
                    let (a, b) = (hull[i], hull[(i + 1) % n]);
                    prop_assert!(cross(a, b, hull[(i + 2) % n]) > 0.0);
                    prop_assert!(points.iter().all(|&p| cross(a, b, p) >= 0.0));
                }
            }
        }
    }

    /// Pixels of the region of `first` with a 4-neighbour in the unbounded part of what is not the region.
    fn outer_border(image: &Image<u8>, first: (usize, usize)) -> Vec<(usize, usize)> {
        let (w, h) = (image.width() as isize, image.height() as isize);
        let flood = |from: (isize, isize), diagonal: bool, passable: &dyn Fn((isize, isize)) -> bool| {
            let (mut seen, mut stack) = (std::collections::HashSet::from([from]), vec![from]);
            while let Some((x, y)) = stack.pop() {
                for (i, (dx, dy)) in RING.iter().enumerate() {
                    let next = (x + dx, y + dy);
                    if (diagonal || i % 2 == 0) && passable(next) && seen.insert(next) {
                        stack.push(next);
                    }
                }
            }
            seen
        };
        let set = |(x, y): (isize, isize)| {
            x >= 0 && y >= 0 && image.view().get(x as usize, y as usize).is_some_and(|&v| v != 0)
        };
        let region = flood((first.0 as isize, first.1 as isize), true, &set);
        let around = |(x, y): (isize, isize)| x >= -1 && y >= -1 && x <= w && y <= h;
        let outside = flood((-1, -1), false, &|p| around(p) && !region.contains(&p));
        let touches = |&(x, y): &(isize, isize)| {
            [(-1, 0), (1, 0), (0, -1), (0, 1)].iter().any(|(dx, dy)| outside.contains(&(x + dx, y + dy)))
        };
        region.iter().filter(|p| touches(p)).map(|&(x, y)| (x as usize, y as usize)).collect()
    }

    #[test]
    fn the_hull_of_one_pixel_is_its_square() {
        let mut hull = Vec::new();
        pixel_hull(&[(3, 4)], &mut hull, &mut Vec::new());
        let polygon = Polygon::new(hull);
        assert_eq!((polygon.area(), polygon.vertices().len()), (1.0, 4));
    }
}
