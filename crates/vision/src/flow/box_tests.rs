//! Tests of the motion of a box.

use super::tests::{pyramids, texture};
use super::*;
use pursuit_geometry::{BBox, Point, Size};
use pursuit_imaging::Image;

#[test]
fn parameters_are_checked() {
    let good = MedianFlowParams::default();
    for bad in [
        MedianFlowParams { grid: Size::new(1, 9), ..good },
        MedianFlowParams { patch_px: 2, ..good },
        MedianFlowParams { max_residual_px: -1.0, ..good },
        MedianFlowParams { max_forward_backward_px: f64::NAN, ..good },
    ] {
        assert!(MedianFlow::new(bad).is_err());
    }
    assert_eq!(MedianFlow::new(good).unwrap().params(), &good);
}

fn numbers(value: &serde_json::Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
}

#[test]
fn box_motion_equals_the_reference() {
    let oracle: serde_json::Value =
        serde_json::from_str(include_str!("../../tests/fixtures/median_flow.json")).unwrap();
    let points = |key: &str| -> Vec<Point> {
        oracle[key]
            .as_array()
            .unwrap()
            .iter()
            .map(|p| {
                let p = numbers(p);
                Point::new(p[0], p[1])
            })
            .collect()
    };
    let (before, after, back, ncc) = (points("p0"), points("p1"), points("back"), numbers(&oracle["ncc"]));
    let pairings: Vec<Pairing> = (0..before.len())
        .map(|i| Pairing {
            before: before[i],
            after: after[i],
            error_px: back[i].distance(before[i]),
            correlation: ncc[i],
        })
        .collect();
    let b = numbers(&oracle["box"]);
    let bbox = BBox::from_ltwh(b[0], b[1], b[2], b[3]);
    let motion = box_motion(&pairings, &bbox, ScaleRule::Median, &mut Vec::new()).unwrap();
    let near = |got: f64, want: f64| assert!((got - want).abs() < 1e-9 * want.abs().max(1.0), "{got} {want}");
    let want = numbers(&oracle["displacement"]);
    near(motion.displacement.0, want[0]);
    near(motion.displacement.1, want[1]);
    near(motion.scale, oracle["scale_median"].as_f64().unwrap());
    near(motion.forward_backward_px, oracle["median_fb"].as_f64().unwrap());
    near(motion.correlation, oracle["median_ncc"].as_f64().unwrap());
    near(motion.residual_px, oracle["residual"].as_f64().unwrap());
    let (left, top, width, height) = motion.bbox.ltwh();
    for (got, want) in [left, top, width, height].into_iter().zip(numbers(&oracle["new_box"])) {
        near(got, want);
    }
    let kept = oracle["keep"].as_array().unwrap().iter().filter(|k| k.as_bool() == Some(true)).count();
    assert_eq!(motion.kept, kept);
    let mean = box_motion(&pairings, &bbox, ScaleRule::Mean, &mut Vec::new()).unwrap();
    near(mean.scale, oracle["scale_mean"].as_f64().unwrap());
}

#[test]
fn too_few_points_are_no_motion() {
    let bbox = BBox::from_ltwh(0.0, 0.0, 9.0, 9.0);
    let pairing =
        Pairing { before: Point::new(1.0, 1.0), after: Point::new(2.0, 1.0), error_px: 0.0, correlation: 1.0 };
    let motion = |points: &[Pairing], rule| box_motion(points, &bbox, rule, &mut Vec::new());
    for rule in [ScaleRule::Median, ScaleRule::Mean] {
        assert_eq!(motion(&[], rule), Err(FlowFailure::FewPoints { kept: 0 }));
        assert_eq!(motion(&[pairing], rule), Err(FlowFailure::FewPoints { kept: 1 }));
        // Both at one place: no distance, no scale.
        assert_eq!(motion(&[pairing, pairing], rule), Err(FlowFailure::FewPoints { kept: 2 }));
    }
}

#[test]
fn boxes_follow_texture_or_say_why_not() {
    let first = texture(220, 160, [256, 0, 400_000, 0, 256, 100_000]);
    // Magnified by 256/240 about (110, 80), and moved by (4, −3).
    let second = texture(220, 160, [240, 0, 400_000 + 16 * 110 - 240 * 4, 0, 240, 100_000 + 16 * 80 + 240 * 3]);
    let other = texture(220, 160, [256, 0, 9_000_000, 0, 256, 7_000_000]);
    let [from, to] = pyramids(&[first, second], 5);
    let mut flow = MedianFlow::new(MedianFlowParams::default()).unwrap();
    let bbox = BBox::from_ltwh(70.5, 50.5, 80.0, 60.0);
    let motion = flow.estimate(&from, &to, &bbox).unwrap().unwrap();
    let want = BBox::from_center_size(Point::new(114.5, 77.5), 80.0 * 256.0 / 240.0, 60.0 * 256.0 / 240.0);
    assert!(motion.bbox.iou(&want) > 0.985, "{motion:?} {want:?}");
    assert!((motion.scale - 256.0 / 240.0).abs() < 5e-3 && motion.forward_backward_px < 0.1, "{motion:?}");
    assert!(motion.correlation > 0.95 && motion.residual_px < 4.0 && motion.kept >= 20, "{motion:?}");
    assert!(flow.pairings().len() > 90);
    let other = Pyramid::of(other.view(), 5).unwrap();
    assert!(flow.estimate(&from, &other, &bbox).unwrap().is_err());
    // Limits are limits.
    let strict = |max_residual_px, max_forward_backward_px| {
        let params = MedianFlowParams { max_residual_px, max_forward_backward_px, ..Default::default() };
        MedianFlow::new(params).unwrap().estimate(&from, &to, &bbox).unwrap()
    };
    assert!(
        matches!(strict(0.1, 10.0), Err(FlowFailure::Scattered { residual_px }) if residual_px == motion.residual_px)
    );
    assert!(matches!(strict(10.0, 1e-9), Err(FlowFailure::Inconsistent { .. })));
    let small = Pyramid::of(Image::filled(9, 9, 0).unwrap().view(), 1).unwrap();
    assert!(flow.estimate(&from, &small, &bbox).is_err());
}

#[test]
fn the_grid_reaches_the_corners() {
    let mut points = Vec::new();
    grid(&BBox::from_ltwh(10.0, 20.0, 30.0, 6.0), Size::new(4, 3), &mut points);
    assert_eq!(points.len(), 12);
    assert_eq!(
        (points[0], points[1], points[4], points[11]),
        (Point::new(10.0, 20.0), Point::new(20.0, 20.0), Point::new(10.0, 23.0), Point::new(40.0, 26.0))
    );
}

#[test]
fn distant_points_are_found_from_their_guess() {
    let window = Size::new(8, 8);
    let flow = LucasKanadeParams { window, levels: 5, ..LucasKanadeParams::default() };
    let mut estimator = MedianFlow::new(MedianFlowParams { flow, ..MedianFlowParams::default() }).unwrap();
    let [a, b] =
        [(0, 0), (-24, 19)].map(|(dx, dy)| texture(160, 120, [256, 0, 300_000 - 256 * dx, 0, 256, 300_000 - 256 * dy]));
    let [from, to] = pyramids(&[a, b], 5);
    let bbox = BBox::from_ltwh(60.0, 30.0, 40.0, 36.0);
    let mut estimate = |shift, levels| {
        let start = Start { shift, levels };
        estimator.estimate_from(&from, &to, &bbox, start).unwrap()
    };
    let near = estimate((-23.0, 18.0), 1).unwrap();
    assert!((near.displacement.0 + 24.0).hypot(near.displacement.1 - 19.0) < 0.05, "{near:?}");
    // Out of reach of one level.
    assert!(estimate((0.0, 0.0), 1).map_or(true, |m| m.forward_backward_px > 0.5 || m.displacement.0 > -20.0));
    let far = estimate((0.0, 0.0), usize::MAX).unwrap();
    let plain = estimator.estimate(&from, &to, &bbox).unwrap().unwrap();
    assert_eq!(far, plain);
}
