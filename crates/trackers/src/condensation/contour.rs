use pursuit_geometry::BBox;
use pursuit_imaging::ImageView;

pursuit_parameters::parameters! {
    /// The likelihood of an outline: an ellipse in the box, looked at along its normals.
    pub struct ContourParams {
        /// Normals, M.
        pub normals: usize = 24, in 4..=360, source "isard1998: about as many";
        /// How far along a normal an edge is looked for either way, μ.
        pub reach: f64 = 0.2, in above(0.0).at_most(2.0), unit "target sizes", source "ours; isard1998 in pixels";
        /// Places looked at along each half of a normal.
        pub places: usize = 6, in 2..=64, source "ours";
        /// Standard deviation of an edge from the outline.
        pub sigma: f64 = 0.1, in above(0.0), unit "target sizes", source "ours; isard1998 in pixels";
        /// Grey levels between neighbouring places from which on there is an edge.
        pub least_edge: u8 = 20, in 1..=255, unit "levels", source "ours";
    }
}

/// Directions of the normals of a circle, kept from frame to frame.
#[derive(Debug, Clone, Default)]
pub struct Outline {
    directions: Vec<(f64, f64)>,
}

impl Outline {
    /// As many as there are `normals`, one after the other round the circle.
    pub fn new(normals: usize) -> Self {
        let angle = |k: usize| std::f64::consts::TAU * (k as f64 + 0.5) / normals.max(1) as f64;
        Self { directions: (0..normals).map(|k| (angle(k).cos(), angle(k).sin())).collect() }
    }

    /// How far the outline in `bbox` is from edges: (1/M) Σ min(d², μ²) / μ², where d is the distance of the nearest edge along a
    /// normal (isard1998, section 4). 0: an edge everywhere, 1: none anywhere.
    pub fn distance(&self, gray: ImageView<'_, u8>, bbox: &BBox, p: &ContourParams) -> f64 {
        let center = bbox.center();
        let (a, b) = (bbox.width() / 2.0, bbox.height() / 2.0);
        let spacing = p.reach * bbox.area().sqrt() / p.places as f64;
        let mut sum = 0.0;
        for &(cos, sin) in &self.directions {
            // The normal of an ellipse at (a cos, b sin) points to (cos / a, sin / b).
            let (nx, ny) = (cos * b, sin * a);
            let length = nx.hypot(ny).max(1e-9);
            let (nx, ny) = (nx / length * spacing, ny / length * spacing);
            let (x, y) = (center.x + a * cos, center.y + b * sin);
            let at = |k: f64| i16::from(gray.clamped((x + k * nx).floor() as isize, (y + k * ny).floor() as isize));
            sum += nearest(at, p).powi(2);
        }
        sum / self.directions.len().max(1) as f64
    }
}

/// The distance of the nearest edge, as a share of the reach; 1 where there is none.
fn nearest(at: impl Fn(f64) -> i16, p: &ContourParams) -> f64 {
    let edge = |k: f64| (at(k + 0.5) - at(k - 0.5)).unsigned_abs() >= u16::from(p.least_edge);
    (0..=p.places).map(|k| k as f64).find(|&k| edge(k) || edge(-k)).map_or(1.0, |k| k / p.places as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_imaging::Image;

    fn disc(radius: f64) -> Image<u8> {
        let inside = |x: usize, y: usize| (x as f64 + 0.5 - 60.0).hypot(y as f64 + 0.5 - 50.0) < radius;
        Image::from_fn(120, 100, |x, y| if inside(x, y) { 200 } else { 60 }).unwrap()
    }

    fn around(radius: f64) -> BBox {
        BBox::from_ltwh(60.0 - radius, 50.0 - radius, 2.0 * radius, 2.0 * radius)
    }

    #[test]
    fn the_outline_of_a_disc_lies_on_edges() {
        let (image, outline, p) = (disc(20.0), Outline::new(24), ContourParams::default());
        let of = |bbox| outline.distance(image.view(), &bbox, &p);
        assert!(of(around(20.0)) < 0.05, "{}", of(around(20.0)));
        assert!(of(around(20.0)) < of(around(22.0)) && of(around(22.0)) < of(around(24.0)));
        assert!(of(around(20.0)) < of(around(18.0)) && of(around(20.0)) < of(around(20.0).translated(3.0, 1.0)));
        // No edge within a fifth of forty pixels.
        assert_eq!(of(around(9.0)), 1.0);
    }

    /// The sum over normals, with every place of each looked at.
    #[test]
    fn distances_are_those_of_the_nearest_edges() {
        let (image, p) = (disc(20.0), ContourParams { normals: 7, ..ContourParams::default() });
        let bbox = BBox::from_ltwh(38.0, 33.0, 46.0, 31.0);
        let spacing = 0.2 * (46.0_f64 * 31.0).sqrt() / 6.0;
        let mut sum = 0.0;
        for k in 0..7 {
            let t = std::f64::consts::TAU * (f64::from(k) + 0.5) / 7.0;
            let (x, y) = (61.0 + 23.0 * t.cos(), 48.5 + 15.5 * t.sin());
            let (nx, ny) = (t.cos() / 23.0, t.sin() / 15.5);
            let n = nx.hypot(ny);
            let gray = |d: f64| {
                let (x, y) = (x + d * spacing * nx / n, y + d * spacing * ny / n);
                f64::from(image.view().clamped(x.floor() as isize, y.floor() as isize))
            };
            let mut least: f64 = 1.0;
            for place in -6..=6 {
                let d = f64::from(place);
                if (gray(d + 0.5) - gray(d - 0.5)).abs() >= 20.0 {
                    least = least.min(d.abs() / 6.0);
                }
            }
            sum += least * least / 7.0;
        }
        let got = Outline::new(7).distance(image.view(), &bbox, &p);
        assert!((got - sum).abs() < 1e-9 && got > 0.0 && got < 1.0, "{got} is not {sum}");
    }

    #[test]
    fn outlines_outside_of_the_picture_have_no_edges() {
        let outline = Outline::new(24);
        assert_eq!(
            outline.distance(disc(20.0).view(), &BBox::from_ltwh(-300.0, 500.0, 40.0, 40.0), &ContourParams::default()),
            1.0
        );
    }
}
