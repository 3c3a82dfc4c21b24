use super::*;
use crate::VisionError;
use pursuit_geometry::{BBox, Point, Size};
use pursuit_imaging::Image;

include!("../../tests/fixtures/flow.rs");

fn lattice(i: i64, j: i64) -> i64 {
    let mut h = (i as u32).wrapping_mul(374_761_393).wrapping_add((j as u32).wrapping_mul(668_265_263));
    h = (h ^ (h >> 13)).wrapping_mul(1_274_126_177);
    i64::from((h ^ (h >> 16)) & 255)
}

fn octave(x: i64, y: i64, cell: i64, salt: i64) -> i64 {
    let (i, j) = (x.div_euclid(cell), y.div_euclid(cell));
    let (fx, fy) = (x.rem_euclid(cell), y.rem_euclid(cell));
    let at = |di: i64, dj: i64| lattice((i + di + salt).rem_euclid(4096), (j + dj).rem_euclid(4096));
    let top = (cell - fx) * at(0, 0) + fx * at(1, 0);
    let bottom = (cell - fx) * at(0, 1) + fx * at(1, 1);
    ((cell - fy) * top + fy * bottom).div_euclid(cell * cell)
}

/// Two octaves of value noise in whole numbers, as `opencv.py` makes it; `m` maps pixels to 1/256 pixels of the texture.
pub(crate) fn texture(width: usize, height: usize, m: [i64; 6]) -> Image<u8> {
    Image::from_fn(width, height, |x, y| {
        let (x, y) = (x as i64, y as i64);
        let (u, v) = (m[0] * x + m[1] * y + m[2], m[3] * x + m[4] * y + m[5]);
        ((octave(u, v, 6 * 256, 0) + 2 * octave(u, v, 15 * 256, 77)) / 3) as u8
    })
    .unwrap()
}

/// One octave of the noise on pixels, for frame `frame`.
pub(crate) fn noise(x: usize, y: usize, frame: i64) -> i64 {
    lattice(x as i64 + 1009 * frame, y as i64 + 31 * frame)
}

fn fixture_images() -> [Image<u8>; 2] {
    [texture(160, 120, [256, 0, 300_000, 0, 256, 300_000]), texture(160, 120, [262, 5, 299_100, -4, 259, 300_700])]
}

pub(super) fn pyramids(images: &[Image<u8>; 2], levels: usize) -> [Pyramid; 2] {
    [0, 1].map(|i| Pyramid::of(images[i].view(), levels).unwrap())
}

fn centered(x: f64, y: f64) -> Point {
    Point::new(x + 0.5, y + 0.5)
}

fn follow(params: LucasKanadeParams, [from, to]: &[Pyramid; 2], points: &[Point]) -> Vec<Track> {
    let mut tracks = Vec::new();
    LucasKanade::new(params).unwrap().track(from, to, points, &mut tracks).unwrap();
    tracks
}

#[test]
fn points_go_where_opencv_says() {
    let pyramids = pyramids(&fixture_images(), 4);
    let points = POINTS.map(|(x, y)| centered(x, y));
    for (window, levels, expected) in [((21, 21), 4, FLOW_21), ((11, 9), 3, FLOW_11X9)] {
        let params = LucasKanadeParams { window: Size::new(window.0, window.1), levels, ..Default::default() };
        let tracks = follow(params, &pyramids, &points);
        let mut compared = 0;
        for ((track, point), (x, y, found, residual)) in tracks.iter().zip(&points).zip(expected) {
            assert_eq!(track.is_found(), found, "{point:?} {track:?}");
            if found {
                let off = track.point.distance(centered(x, y));
                assert!(off < 0.05, "{point:?} {window:?}: {track:?}, OpenCV {x} {y}");
                assert!((f64::from(track.residual) - residual).abs() < 0.2, "{point:?} {track:?} {residual}");
                compared += 1;
            }
        }
        assert!(compared > 50);
    }
}

/// The truth, from the two maps of the texture.
fn truth(p: Point) -> Point {
    let (u, v) = (256.0 * (p.x - 0.5) + 900.0, 256.0 * (p.y - 0.5) - 700.0);
    let det = 262.0 * 259.0 + 5.0 * 4.0;
    centered((259.0 * u - 5.0 * v) / det, (4.0 * u + 262.0 * v) / det)
}

fn inner_points() -> Vec<Point> {
    let mut points = Vec::new();
    grid(&BBox::from_ltwh(30.0, 25.0, 90.0, 70.0), Size::new(7, 6), &mut points);
    points
}

#[test]
fn points_inside_go_where_they_should() {
    let pyramids = pyramids(&fixture_images(), 4);
    for (track, p) in follow(LucasKanadeParams::default(), &pyramids, &inner_points()).iter().zip(inner_points()) {
        // A window that is sheared by a few percent has its best shift somewhat beside its centre's.
        assert!(track.is_found() && track.point.distance(truth(p)) < 0.35, "{p:?} {track:?} {:?}", truth(p));
        assert!(track.min_eigenvalue > 1.0 && track.residual < 8.0, "{track:?}");
    }
}

#[test]
fn gain_and_bias_absorb_light_changes() {
    let [first, second] = fixture_images();
    let mut lit = second.clone();
    lit.as_mut_slice().iter_mut().for_each(|v| *v = (f64::from(*v) * 0.6 + 70.0) as u8);
    let plain = LucasKanadeParams::default();
    let joint = LucasKanadeParams { lighting: Lighting::GainAndBias, ..plain };
    let (same, changed) = (pyramids(&[first.clone(), second], 4), pyramids(&[first, lit], 4));
    let off = |tracks: &[Track]| -> f64 {
        let far = |(t, p): (&Track, Point)| if t.is_found() { t.point.distance(truth(p)) } else { 99.0 };
        tracks.iter().zip(inner_points()).map(far).fold(0.0, f64::max)
    };
    let robust = follow(joint, &changed, &inner_points());
    assert!(off(&follow(joint, &same, &inner_points())) < 0.4);
    assert!(off(&robust) < 0.45, "{}", off(&robust));
    assert!(robust.iter().all(|t| t.residual < 8.0));
    assert!(off(&follow(plain, &changed, &inner_points())) > 1.5);
    // Gain 1/0.6 is undone, too.
    let back = follow(joint, &[changed[1].clone(), changed[0].clone()], &inner_points().map_to(truth));
    let worst = back.iter().zip(inner_points()).map(|(t, p)| t.point.distance(p)).fold(0.0, f64::max);
    assert!(worst < 0.45, "{worst}");
}

trait MapTo {
    fn map_to(self, f: impl Fn(Point) -> Point) -> Self;
}

impl MapTo for Vec<Point> {
    fn map_to(self, f: impl Fn(Point) -> Point) -> Self {
        self.into_iter().map(f).collect()
    }
}

/// The slow, obvious twin of one level: Gauss-Newton with whole-pixel central differences in double precision.
fn slow(first: &Image<u8>, second: &Image<u8>, p: Point, half: i32) -> Point {
    let sample = |image: &Image<u8>, x: f64, y: f64| {
        let at =
            |dx: f64, dy: f64| f64::from(image.view().clamped((x.floor() + dx) as isize, (y.floor() + dy) as isize));
        let (fx, fy) = (x - x.floor(), y - y.floor());
        (1.0 - fy) * ((1.0 - fx) * at(0.0, 0.0) + fx * at(1.0, 0.0))
            + fy * ((1.0 - fx) * at(0.0, 1.0) + fx * at(1.0, 1.0))
    };
    let scharr = |x: f64, y: f64| {
        let d = |a: f64, b: f64| sample(first, x + a, y + b);
        let gx =
            3.0 * (d(1.0, -1.0) - d(-1.0, -1.0) + d(1.0, 1.0) - d(-1.0, 1.0)) + 10.0 * (d(1.0, 0.0) - d(-1.0, 0.0));
        let gy =
            3.0 * (d(-1.0, 1.0) - d(-1.0, -1.0) + d(1.0, 1.0) - d(1.0, -1.0)) + 10.0 * (d(0.0, 1.0) - d(0.0, -1.0));
        (gx / 32.0, gy / 32.0)
    };
    let (mut dx, mut dy) = (0.0, 0.0);
    for _ in 0..60 {
        let (mut xx, mut xy, mut yy, mut bx, mut by) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for j in -half..=half {
            for i in -half..=half {
                let (x, y) = (p.x - 0.5 + f64::from(i), p.y - 0.5 + f64::from(j));
                let (gx, gy) = scharr(x, y);
                let d = sample(second, x + dx, y + dy) - sample(first, x, y);
                (xx, xy, yy) = (xx + gx * gx, xy + gx * gy, yy + gy * gy);
                (bx, by) = (bx + d * gx, by + d * gy);
            }
        }
        let det = xx * yy - xy * xy;
        dx -= (yy * bx - xy * by) / det;
        dy -= (xx * by - xy * bx) / det;
    }
    Point::new(p.x + dx, p.y + dy)
}

#[test]
fn one_level_equals_the_twin() {
    let first = texture(90, 70, [256, 0, 80_000, 0, 256, 9_000]);
    let second = texture(90, 70, [256, 0, 79_800, 0, 256, 9_150]);
    let images = [first, second];
    let params = LucasKanadeParams {
        window: Size::new(13, 13),
        levels: 1,
        epsilon_px: 0.0,
        iterations: 60,
        ..Default::default()
    };
    let points: Vec<Point> =
        (0..12).map(|k| Point::new(20.25 + 4.1 * f64::from(k), 18.5 + 2.7 * f64::from(k))).collect();
    for (track, &p) in follow(params, &pyramids(&images, 1), &points).iter().zip(&points) {
        let want = slow(&images[0], &images[1], p, 6);
        assert!(track.is_found() && track.point.distance(want) < 6e-3, "{track:?} {want:?}");
        assert!(want.distance(Point::new(p.x + 200.0 / 256.0, p.y - 150.0 / 256.0)) < 0.1);
    }
}

#[test]
fn round_trips_close_unless_covered() {
    let [first, mut second] = fixture_images();
    for y in 40..80 {
        second.row_mut(y)[60..110]
            .copy_from_slice(&texture(50, 1, [256, 0, 1_000_000, 0, 256, 77 * y as i64 * 256]).row(0)[..50]);
    }
    let [from, to] = pyramids(&[first, second], 4);
    let mut flow = LucasKanade::new(LucasKanadeParams { window: Size::new(11, 11), ..Default::default() }).unwrap();
    let mut trips = Vec::new();
    let points = [Point::new(30.0, 20.0), Point::new(130.0, 95.0), Point::new(82.0, 60.0), Point::new(f64::NAN, 3.0)];
    flow.track_there_and_back(&from, &to, &points, &mut trips).unwrap();
    assert!(trips[0].error_px < 0.2 && trips[1].error_px < 0.2, "{trips:?}");
    assert!(trips[2].error_px > 2.0, "{trips:?}");
    assert_eq!((trips[3].error_px, trips[3].there.outcome), (f64::INFINITY, Outcome::Outside));
    // The error is the distance of the way back from the start.
    let there = flow.track_point(&from, &to, points[0], points[0]).unwrap();
    let back = flow.track_point(&to, &from, there.point, there.point).unwrap();
    assert_eq!((there, back.point.distance(points[0])), (trips[0].there, trips[0].error_px));
}

#[test]
fn a_guess_bridges_what_the_pyramid_cannot() {
    let first = texture(200, 80, [256, 0, 0, 0, 256, 0]);
    let second = texture(200, 80, [256, 0, -60 * 256, 0, 256, 0]);
    let [from, to] = pyramids(&[first, second], 1);
    let mut flow = LucasKanade::new(LucasKanadeParams { levels: 1, ..Default::default() }).unwrap();
    let (p, want) = (Point::new(60.0, 40.0), Point::new(120.0, 40.0));
    let guided = flow.track_point(&from, &to, p, Point::new(119.0, 41.0)).unwrap();
    assert!(guided.is_found() && guided.point.distance(want) < 0.02, "{guided:?}");
    let alone = flow.track_point(&from, &to, p, p).unwrap();
    assert!(alone.point.distance(want) > 5.0);
}

#[test]
fn flat_and_distant_points_are_reported() {
    let flat = Image::filled(60, 50, 90u8).unwrap();
    let images = [flat.clone(), flat];
    let tracks = follow(
        LucasKanadeParams::default(),
        &pyramids(&images, 3),
        &[Point::new(30.0, 25.0), Point::new(-300.0, 25.0), Point::new(30.0, 1e300), Point::new(30.0, f64::INFINITY)],
    );
    let outcomes: Vec<_> = tracks.iter().map(|t| t.outcome).collect();
    assert_eq!(outcomes, [Outcome::Flat, Outcome::Outside, Outcome::Outside, Outcome::Outside]);
    assert!(!tracks[0].is_found());
    // One pixel is enough of an image.
    let dot = Image::filled(1, 1, 90u8).unwrap();
    let tracks = follow(LucasKanadeParams::default(), &pyramids(&[dot.clone(), dot], 3), &[Point::new(0.5, 0.5)]);
    assert_eq!(tracks[0].outcome, Outcome::Flat);
    // A gradient one way only.
    let ramp = Image::from_fn(60, 50, |x, _| (4 * x) as u8).unwrap();
    let tracks = follow(LucasKanadeParams::default(), &pyramids(&[ramp.clone(), ramp], 1), &[Point::new(30.0, 25.0)]);
    assert_eq!(tracks[0].outcome, Outcome::Flat);
    assert!(tracks[0].min_eigenvalue.abs() < 1e-3);
}

#[test]
fn the_least_eigenvalue_is_a_threshold_per_pixel() {
    // Slopes 2 across and 1 down everywhere: eigenvalues 0 and 5; a checkerboard of slopes gives both.
    let image = Image::from_fn(80, 80, |x, y| {
        let fold = |v: usize| {
            let v = v % 40;
            if v < 20 { v } else { 40 - v }
        };
        (4 * fold(x) + 2 * fold(y)) as u8
    })
    .unwrap();
    let pyramids = pyramids(&[image.clone(), image], 1);
    let at = |min_eigenvalue: f64| {
        let params = LucasKanadeParams { levels: 1, min_eigenvalue, ..Default::default() };
        follow(params, &pyramids, &[Point::new(40.5, 40.5)])[0]
    };
    let track = at(0.0);
    // About the ridge both slopes change sign, so the mean products vanish and 2² is the smaller eigenvalue, but for the
    // pixels on the ridge itself (1 of 21 columns or rows).
    assert!(track.is_found() && (f64::from(track.min_eigenvalue) - 4.0 * 20.0 / 21.0).abs() < 0.02, "{track:?}");
    assert_eq!((at(3.7).outcome, at(3.9).outcome), (Outcome::Found, Outcome::Flat));
}

#[test]
fn parameters_and_sizes_are_checked() {
    let good = LucasKanadeParams::default();
    for bad in [
        LucasKanadeParams { window: Size::new(2, 9), ..good },
        LucasKanadeParams { window: Size::new(9, 256), ..good },
        LucasKanadeParams { levels: 0, ..good },
        LucasKanadeParams { iterations: 0, ..good },
        LucasKanadeParams { epsilon_px: -1.0, ..good },
        LucasKanadeParams { min_eigenvalue: f64::NAN, ..good },
    ] {
        assert!(matches!(LucasKanade::new(bad), Err(VisionError::Parameter { .. })));
    }
    let [a, b] = [(30, 20), (30, 21)].map(|(w, h)| Pyramid::of(Image::filled(w, h, 0).unwrap().view(), 2).unwrap());
    let mut flow = LucasKanade::new(good).unwrap();
    assert!(matches!(flow.track(&a, &b, &[], &mut Vec::new()), Err(VisionError::SizeMismatch { .. })));
    assert!(flow.track_there_and_back(&a, &b, &[], &mut Vec::new()).is_err());
    assert!(flow.track_point(&a, &b, Point::default(), Point::default()).is_err());
    assert_eq!(flow.params(), &good);
}
