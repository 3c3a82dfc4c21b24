use super::*;
use crate::flow::tests::texture;
use crate::flow::{LucasKanadeParams, Pyramid};
use crate::warp::Affine;
use pursuit_geometry::{BBox, Point, Size};
use pursuit_imaging::Image;

/// `second(p) = first(map⁻¹(p))`: the texture seen by a camera that moved, a third of it covered by an object that moves
/// by itself.
fn pair(m: [i64; 6], covered: bool) -> [Image<u8>; 2] {
    let mut first = texture(320, 240, [256, 0, 500_000, 0, 256, 300_000]);
    let mut second = texture(320, 240, m);
    if covered {
        // 176 × 131 of 320 × 240 pixels: 30 %, moving by (−12.4, 9.4).
        let object = [0, 100].map(|shift| texture(176, 131, [256, 0, 5_000_000 + shift, 0, 256, 2_000_000 - shift]));
        for y in 0..131 {
            first.row_mut(60 + y)[40..216].copy_from_slice(object[0].row(y));
            second.row_mut(69 + y)[28..204].copy_from_slice(object[1].row(y));
        }
    }
    [first, second]
}

fn pyramids([first, second]: &[Image<u8>; 2]) -> [Pyramid; 2] {
    [first, second].map(|i| Pyramid::of(i.view(), 5).unwrap())
}

/// The map of frames that belongs to the map `m` of the second texture, in continuous pixels.
fn truth(m: [i64; 6]) -> Affine {
    let m = m.map(|v| v as f64 / 256.0);
    let texture_from_second = Affine::new(m).unwrap();
    let texture_from_first = Affine::translation(500_000.0 / 256.0, 300_000.0 / 256.0).unwrap();
    let whole = texture_from_second.inverse().unwrap().after(&texture_from_first);
    let half = Affine::translation(0.5, 0.5).unwrap();
    half.after(&whole).after(&half.inverse().unwrap())
}

const TURNED: [i64; 6] = [258, 4, 499_000, -4, 258, 301_500];
const SHIFTED: [i64; 6] = [256, 0, 500_000 - 5 * 256 - 77, 0, 256, 300_000 + 3 * 256 + 128];

fn worst(a: &Affine, b: &Affine) -> f64 {
    let corners = [(0.0, 0.0), (320.0, 0.0), (0.0, 240.0), (320.0, 240.0)];
    corners.iter().map(|&(x, y)| a.apply(Point::new(x, y)).distance(b.apply(Point::new(x, y)))).fold(0.0, f64::max)
}

#[test]
fn the_camera_is_followed_whatever_moves_before_it() {
    let mut motion = SparseMotion::new(SparseMotionParams::default()).unwrap();
    for (m, covered, tolerance) in
        [(TURNED, false, 0.1), (TURNED, true, 0.1), (SHIFTED, false, 0.08), (SHIFTED, true, 0.08)]
    {
        let [from, to] = pyramids(&pair(m, covered));
        let got = motion.estimate(&from, &to, &[]).unwrap().unwrap();
        assert!(worst(&got.second_from_first, &truth(m)) < tolerance, "{got:?} {:?}", truth(m));
        let least = if covered { 0.55 } else { 0.9 };
        assert!(got.inliers as f64 > least * got.points as f64 && got.rms_px < 0.3, "{got:?}");
        assert_eq!(got.points, motion.pairs().len());
        assert!(got.points > 120);
    }
}

#[test]
fn points_on_targets_are_not_asked() {
    let mut motion = SparseMotion::new(SparseMotionParams::default()).unwrap();
    let [from, to] = pyramids(&pair(SHIFTED, true));
    let target = BBox::from_ltwh(36.0, 56.0, 184.0, 140.0);
    let got = motion.estimate(&from, &to, &[target]).unwrap().unwrap();
    assert!(motion.pairs().iter().all(|(p, _)| !target.contains(*p)));
    assert!(got.inliers as f64 > 0.9 * got.points as f64);
    // Nothing is left to ask.
    assert_eq!(motion.estimate(&from, &to, &[BBox::from_ltwh(0.0, 0.0, 320.0, 240.0)]).unwrap(), None);
    let small = Pyramid::of(Image::filled(30, 30, 0).unwrap().view(), 2).unwrap();
    assert!(motion.estimate(&from, &small, &[]).is_err());
}

#[test]
fn parameters_are_checked() {
    let good = SparseMotionParams::default();
    for bad in [
        SparseMotionParams { grid: Size::new(1, 5), ..good },
        SparseMotionParams { max_forward_backward_px: 0.0, ..good },
        SparseMotionParams { flow: LucasKanadeParams { levels: 0, ..good.flow }, ..good },
        SparseMotionParams { fit: RobustFitParams { trials: 0, ..good.fit }, ..good },
    ] {
        assert!(SparseMotion::new(bad).is_err());
    }
    assert_eq!(SparseMotion::new(good).unwrap().params(), &good);
    assert_eq!(RobustFit::new(good.fit).unwrap().params(), &good.fit);
}

#[test]
fn phase_correlation_finds_the_shift_of_the_picture() {
    let mut phase = PhaseCorrelation::new(160);
    let [from, to] = pyramids(&pair(SHIFTED, false));
    let got = phase.estimate(&from, &to).unwrap().unwrap();
    let (dx, dy) = (5.0 + 77.0 / 256.0, -3.5);
    assert!((got.dx - dx).abs() < 0.35 && (got.dy - dy).abs() < 0.35, "{got:?} {dx} {dy}");
    assert!(got.peak > 0.1 && got.peak <= 1.01 && got.peak_to_sidelobe > 10.0, "{got:?}");
    // An object that covers 30 % of the picture and goes its own way.
    let [from, to] = pyramids(&pair(SHIFTED, true));
    for longest_side in [160, 320] {
        let got = PhaseCorrelation::new(longest_side).estimate(&from, &to).unwrap().unwrap();
        assert!((got.dx - dx).abs() < 0.35 && (got.dy - dy).abs() < 0.35, "{got:?} {dx} {dy}");
        assert!(got.peak > 0.02 && got.peak_to_sidelobe > 5.0, "{got:?}");
    }
    // At full resolution, and far.
    let mut phase = PhaseCorrelation::new(1000);
    let far = pair([256, 0, 500_000 - 60 * 256, 0, 256, 300_000 + 41 * 256], false);
    let [from, to] = pyramids(&far);
    let got = phase.estimate(&from, &to).unwrap().unwrap();
    assert!((got.dx - 60.0).abs() < 0.1 && (got.dy + 41.0).abs() < 0.1, "{got:?}");
    let same = phase.estimate(&from, &from).unwrap().unwrap();
    assert!(same.dx.abs() < 1e-3 && same.dy.abs() < 1e-3 && (same.peak - 1.0).abs() < 0.02, "{same:?}");
}

#[test]
fn nothing_has_no_phase() {
    let flat = Pyramid::of(Image::filled(50, 40, 77).unwrap().view(), 3).unwrap();
    let mut phase = PhaseCorrelation::new(0);
    assert_eq!(phase.estimate(&flat, &flat).unwrap(), None);
    let small = Pyramid::of(Image::filled(1, 1, 77).unwrap().view(), 3).unwrap();
    assert_eq!(phase.estimate(&small, &small).unwrap(), None);
    assert!(phase.estimate(&flat, &small).is_err());
}
