//! Where a corner, a crossing or an edge truly is, near a place that somebody pointed at.

use pursuit_geometry::Point;
use pursuit_imaging::ImageView;

/// What was found near a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Sharp {
    /// Where edges of several directions meet: a corner, a crossing, the middle of a ring.
    Corner(Point),
    /// The nearest place on an edge, which says nothing of where along it.
    Edge(Point),
}

impl Sharp {
    /// Where it is, in continuous pixels.
    pub const fn at(self) -> Point {
        match self {
            Self::Corner(at) | Self::Edge(at) => at,
        }
    }
}

/// The sharpest place within `radius` pixels of `at` (continuous pixels): the point that is nearest to the tangents of all
/// edges around it, by least squares (Förstner and Gülch 1987), looked for again around what was found until it stays. A tangent
/// counts as its gradient is strong. None where the picture is flat, where the point runs away, near the border, and for a radius
/// outside of 1 to 64.
pub fn sharpened(gray: ImageView<'_, u8>, at: Point, radius: f64) -> Option<Sharp> {
    /// Steps in which it stays, or never will.
    const MOST_STEPS: usize = 20;
    /// The largest radius, pixels.
    const MOST_RADIUS: f64 = 64.0;
    /// Where it has moved by less it stays, pixels.
    const STILL: f64 = 0.005;
    let inside = (0.0..=gray.width() as f64).contains(&at.x) && (0.0..=gray.height() as f64).contains(&at.y);
    if !inside || !(1.0..=MOST_RADIUS).contains(&radius) {
        return None;
    }
    let mut found = Sharp::Corner(at);
    for _ in 0..MOST_STEPS {
        let from = found.at();
        found = Tangents::around(gray, from, radius)?.nearest(from)?;
        let to = found.at();
        if to.distance(at) > radius {
            return None;
        }
        if to.distance(from) < STILL {
            break;
        }
    }
    Some(found)
}

/// Sums over the tangents of edges: their normals' products, the same with their places, and their weights.
#[derive(Debug, Clone, Copy, Default)]
struct Tangents {
    normals: [f64; 3],
    places: [f64; 2],
    gradients: f64,
    weights: f64,
}

impl Tangents {
    fn around(gray: ImageView<'_, u8>, center: Point, radius: f64) -> Option<Self> {
        let (left, top) = ((center.x - radius).floor() as isize, (center.y - radius).floor() as isize);
        let (right, bottom) = ((center.x + radius).ceil() as isize, (center.y + radius).ceil() as isize);
        let mut sums = Self::default();
        for y in top..bottom {
            for x in left..right {
                // Of the middle of the pixel, from the centre.
                let (u, v) = (x as f64 + 0.5 - center.x, y as f64 + 0.5 - center.y);
                let near = 1.0 - (u * u + v * v) / (radius * radius);
                if near > 0.0 && x >= 1 && y >= 1 {
                    let (gx, gy) = gradient(gray, x.unsigned_abs(), y.unsigned_abs())?;
                    sums.add((u, v), (gx, gy), near * near);
                }
            }
        }
        Some(sums)
    }

    fn add(&mut self, (u, v): (f64, f64), (gx, gy): (f64, f64), weight: f64) {
        let strength = gx.hypot(gy);
        self.weights += weight;
        self.gradients += weight * strength;
        if strength <= 0.0 {
            return;
        }
        let [xx, xy, yy] = [gx * gx, gx * gy, gy * gy].map(|product| weight * product / strength);
        self.normals = [self.normals[0] + xx, self.normals[1] + xy, self.normals[2] + yy];
        self.places = [self.places[0] + xx * u + xy * v, self.places[1] + xy * u + yy * v];
    }

    /// The point nearest to all of them; where they all run one way, the nearest on the edge.
    fn nearest(self, from: Point) -> Option<Sharp> {
        /// Below this mean gradient there is noise and nothing else, grey levels a pixel.
        const FLAT: f64 = 3.0;
        /// Edges run one way where their normals spread by less than this share across.
        const ONE_WAY: f64 = 0.08;
        if self.gradients < FLAT * self.weights {
            return None;
        }
        let [xx, xy, yy] = self.normals;
        let (mean, half) = ((xx + yy) / 2.0, ((xx - yy) / 2.0).hypot(xy));
        let (most, least) = (mean + half, mean - half);
        if least > ONE_WAY * most {
            let determinant = xx * yy - xy * xy;
            let [a, b] = self.places;
            let (u, v) = ((yy * a - xy * b) / determinant, (xx * b - xy * a) / determinant);
            return Some(Sharp::Corner(Point::new(from.x + u, from.y + v)));
        }
        // Along the normal that they have in common.
        let angle = (2.0 * xy).atan2(xx - yy) / 2.0;
        let (s, c) = angle.sin_cos();
        let across = (c * self.places[0] + s * self.places[1]) / most;
        Some(Sharp::Edge(Point::new(from.x + c * across, from.y + s * across)))
    }
}

/// The gradient at a pixel that is not on the border, grey levels a pixel (Scharr's filter).
fn gradient(gray: ImageView<'_, u8>, x: usize, y: usize) -> Option<(f64, f64)> {
    let at = |dx: usize, dy: usize| gray.get(x + dx - 1, y + dy - 1).map(|&level| f64::from(level));
    let [[a, b, c], [d, _, e], [f, g, h]] =
        [[at(0, 0)?, at(1, 0)?, at(2, 0)?], [at(0, 1)?, 0.0, at(2, 1)?], [at(0, 2)?, at(1, 2)?, at(2, 2)?]];
    let across = 3.0 * (c - a) + 10.0 * (e - d) + 3.0 * (h - f);
    let down = 3.0 * (f - a) + 10.0 * (g - b) + 3.0 * (h - c);
    Some((across / 32.0, down / 32.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_imaging::Image;

    /// What `inside` says of a point, each pixel the mean of 8 × 8 points of it.
    fn picture(inside: impl Fn(f64, f64) -> bool) -> Image<u8> {
        const N: usize = 8;
        let sample = |k: usize, i: usize| k as f64 + (i as f64 + 0.5) / N as f64;
        Image::from_fn(48, 40, |x, y| {
            let hits = (0..N * N).filter(|i| inside(sample(x, i % N), sample(y, i / N))).count();
            (40.0 + 170.0 * hits as f64 / (N * N) as f64).round() as u8
        })
        .unwrap()
    }

    /// Places from the point toward two directions.
    fn turned(at: Point, degrees: f64) -> impl Fn(f64, f64) -> (f64, f64) {
        let (s, c) = degrees.to_radians().sin_cos();
        move |x, y| (c * (x - at.x) + s * (y - at.y), c * (y - at.y) - s * (x - at.x))
    }

    #[test]
    fn a_crossing_and_a_corner_are_found_to_a_fraction_of_a_pixel() {
        for (i, degrees) in [0.0, 12.0, 30.0, 45.0, 71.0].into_iter().enumerate() {
            let truth = Point::new(23.3 + 0.17 * i as f64, 19.6 - 0.13 * i as f64);
            let place = turned(truth, degrees);
            let crossing = picture(|x, y| {
                let (u, v) = place(x, y);
                (u > 0.0) == (v > 0.0)
            });
            let corner = picture(|x, y| {
                let (u, v) = place(x, y);
                u > 0.0 && v > 0.0
            });
            for (du, dv) in [(0.0, 0.0), (2.0, -1.5), (-2.5, 1.0), (1.0, 2.5)] {
                let from = Point::new(truth.x + du, truth.y + dv);
                for (name, image, within) in [("crossing", &crossing, 0.1), ("corner", &corner, 0.4)] {
                    let found = sharpened(image.view(), from, 6.0).unwrap();
                    let off = found.at().distance(truth);
                    assert!(matches!(found, Sharp::Corner(_)) && off < within, "{name} {degrees} {from:?}: {off}");
                }
            }
        }
    }

    #[test]
    fn an_edge_is_met_across_and_nothing_is_moved_along_it() {
        for degrees in [0.0, 27.0, 90.0] {
            let place = turned(Point::new(22.4, 20.3), degrees);
            let edge = picture(|x, y| place(x, y).0 > 0.0);
            let from = Point::new(24.0, 21.5);
            let found = sharpened(edge.view(), from, 6.0).unwrap();
            let (off, (_, along), (_, before)) =
                (place(found.at().x, found.at().y).0, place(found.at().x, found.at().y), place(from.x, from.y));
            assert!(matches!(found, Sharp::Edge(_)), "{degrees}: {found:?}");
            assert!(off.abs() < 0.1 && (along - before).abs() < 0.1, "{degrees}: {off} {along} {before}");
        }
    }

    #[test]
    fn where_nothing_is_sharp_nothing_is_found() {
        let flat = Image::filled(40, 40, 90_u8).unwrap();
        assert_eq!(sharpened(flat.view(), Point::new(20.0, 20.0), 6.0), None);
        let edge = picture(|x, _| x > 20.0);
        for at in [Point::new(f64::NAN, 3.0), Point::new(-1e18, 1e18), Point::new(0.0, 0.0), Point::new(48.0, 40.0)] {
            assert_eq!(sharpened(edge.view(), at, 6.0), None, "{at:?}");
        }
        for radius in [0.0, f64::INFINITY, f64::NAN, 1e9] {
            assert_eq!(sharpened(edge.view(), Point::new(20.0, 20.0), radius), None);
        }
    }
}
