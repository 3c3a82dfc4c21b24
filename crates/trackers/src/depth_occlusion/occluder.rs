use super::DepthOcclusionParams;
use super::hypotheses::add_apart;
use pursuit_geometry::{BBox, Point};
use pursuit_imaging::ImageView;
use serde::{Deserialize, Serialize};

/// What hides the target, followed in depth.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Occluder {
    /// Its distance in metres.
    pub distance_m: f64,
}

impl Occluder {
    /// Places at its edges, where the target has to come out, into `places`: beside it, above and below, as far as they are
    /// in reach and in the picture; none where it is not within reach of the place expected, on its row.
    pub fn edges(
        &self,
        params: &DepthOcclusionParams,
        depth: ImageView<'_, u16>,
        expected: &BBox,
        places: &mut Vec<BBox>,
    ) {
        let rules = &params.occluder;
        let (center, w, h) = (expected.center(), expected.width(), expected.height());
        let size = depth.size();
        let own = |x: f64, y: f64| {
            let inside = x >= 0.0 && y >= 0.0 && x < size.width as f64 && y < size.height as f64;
            inside.then(|| {
                let mm = depth.row(y as usize)[x as usize];
                mm > 0 && (f64::from(mm) / 1000.0 - self.distance_m).abs() <= rules.thickness_m
            })
        };
        // A prediction that has run past it starts at its nearest side.
        let sideways = (0..(rules.reach * w).clamp(0.0, 4096.0) as i64).flat_map(|d| [d, -d]);
        let Some(start) = sideways.map(|d| center.x + d as f64).find(|x| own(*x, center.y) == Some(true)) else {
            return;
        };
        for (dx, dy, side) in [(1.0, 0.0, w), (-1.0, 0.0, w), (0.0, 1.0, h), (0.0, -1.0, h)] {
            let at = |d: f64| Point::new(start + d * dx, center.y + d * dy);
            let Some(end) = end_of_run((rules.reach * side, rules.gap_px), |d| own(at(d).x, at(d).y)) else { continue };
            add_apart(places, expected.centered_at(at(end + side / 2.0)), params.apart);
        }
    }
}

/// How far from 0 a run goes on whose points `own` tells (`None` outside of the picture), in whole pixels; `None` where it
/// does not begin here, or reaches the picture's border or `reach`. `most_gap` pixels that are not its own do not end it.
fn end_of_run((reach, most_gap): (f64, usize), own: impl Fn(f64) -> Option<bool>) -> Option<f64> {
    let (mut last, mut gap) = (None, 0);
    for d in 0..reach.clamp(0.0, 4096.0) as usize {
        if own(d as f64)? {
            (last, gap) = (Some(d as f64), 0);
        } else {
            gap += 1;
            if gap > most_gap {
                return last.map(|d: f64| d + 1.0);
            }
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_imaging::Image;

    #[test]
    fn the_target_comes_out_at_the_edges() {
        // A bar from column 80 to 119, from row 20 down to the picture's end, with a crack.
        let depth = Image::from_fn(200, 100, |x, y| match (x, y) {
            (99..102, _) => 0,
            (80..120, 20..) => 1000 + (x as u16),
            _ => 2000,
        });
        let depth = depth.unwrap();
        let expected = BBox::from_center_size(Point::new(95.0, 50.0), 20.0, 16.0);
        let mut places = Vec::new();
        Occluder { distance_m: 1.1 }.edges(&DepthOcclusionParams::default(), depth.view(), &expected, &mut places);
        let centers: Vec<(f64, f64)> = places.iter().map(|p| (p.center().x, p.center().y)).collect();
        // Columns 95 to 119 are its own, 25 pixels; rows 50 to 20, 31 pixels. Below there is no edge.
        assert_eq!(centers, [(95.0 + 25.0 + 10.0, 50.0), (95.0 - 16.0 - 10.0, 50.0), (95.0, 50.0 - 31.0 - 8.0)]);
        assert!(places.iter().all(|p| (p.width(), p.height()) == (20.0, 16.0)));
        // A prediction that has run past it.
        let mut past = Vec::new();
        let ahead = expected.centered_at(Point::new(160.0, 50.0));
        Occluder { distance_m: 1.1 }.edges(&DepthOcclusionParams::default(), depth.view(), &ahead, &mut past);
        let centers: Vec<(f64, f64)> = past.iter().map(|p| (p.center().x, p.center().y)).collect();
        assert_eq!(centers, [(119.0 + 1.0 + 10.0, 50.0), (119.0 - 40.0 - 10.0, 50.0), (119.0, 50.0 - 31.0 - 8.0)]);
        // Something at another distance, and a target expected far away.
        for (distance_m, x) in [(1.6, 95.0), (1.1, 199.9)] {
            let mut none = Vec::new();
            let expected = expected.centered_at(Point::new(x, 50.0));
            Occluder { distance_m }.edges(&DepthOcclusionParams::default(), depth.view(), &expected, &mut none);
            assert_eq!(none, []);
        }
        let mut none = Vec::new();
        Occluder { distance_m: 1.1 }.edges(
            &DepthOcclusionParams::default(),
            depth.view(),
            &expected.translated(f64::NAN, 0.0),
            &mut none,
        );
        assert_eq!(none, []);
    }
}
