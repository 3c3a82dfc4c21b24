use super::*;
use crate::motion::MotionParams;
use crate::{BoxCovariance, Prior};
use nalgebra::Vector4;
use pursuit_geometry::{BBox, Point};

fn prior(covariance: Option<BoxCovariance>) -> Prior {
    Prior { bbox: BBox::from_ltwh(100.0, 50.0, 20.0, 20.0), innovation_covariance: covariance, dt_s: 0.25 }
}

pub(super) fn expectation(covariance: Option<BoxCovariance>) -> Expectation {
    Expectation::new(&prior(covariance), &MotionParams::default()).unwrap()
}

/// The expected box, moved and resized.
pub(super) fn at(dx: f64, dy: f64, dw: f64, dh: f64) -> BBox {
    BBox::from_center_size(Point::new(110.0 + dx, 60.0 + dy), 20.0 + dw, 20.0 + dh)
}

pub(super) fn params(changes: &str) -> AssociationParams {
    use pursuit_parameters::Parameters;
    let mut params = AssociationParams { gate: 9.0, reach: 2.0, buffer: 1.0, ..AssociationParams::default() };
    // What nobody else can mean is given beside the gates: of that another test speaks.
    params.nearest.alone_s = 0.0;
    params.with("association", &changes.parse().unwrap()).unwrap()
}

/// Nothing was learned.
static LOOK: std::sync::LazyLock<Look> = std::sync::LazyLock::new(Look::default);

/// Nothing was observed.
static OBSERVED: std::sync::LazyLock<Observed> = std::sync::LazyLock::new(Observed::default);

/// Nothing was put off.
static BRANCHES: std::sync::LazyLock<Branches> = std::sync::LazyLock::new(Branches::default);

pub(super) const SIZE: Size = Size::new(320, 200);

/// Standard deviations of 2, 3, 4 and 5 px.
fn uneven() -> Option<BoxCovariance> {
    Some(BoxCovariance::from_diagonal(&Vector4::new(4.0, 9.0, 16.0, 25.0)))
}

pub(super) fn confirmed<'a>(expectation: &'a Expectation, classes: &'a Classes) -> Claimant<'a> {
    let (state, observed) = (TrackState::Tracking, &*OBSERVED);
    Claimant { expectation, confirmed: true, state, unseen_s: 0.0, classes, look: &LOOK, observed, branches: &BRANCHES }
}

/// What each target is given, detections by their numbers.
fn given(params: AssociationParams, targets: &[Claimant<'_>], detections: &[Detection]) -> Vec<Vec<usize>> {
    let mut association = Association::new(params).unwrap();
    association.associate(targets, detections, SIZE).unwrap();
    association.shares().iter().map(|shares| shares.iter().map(|(d, _)| *d).collect()).collect()
}

pub(super) fn seen(bbox: BBox) -> Detection {
    Detection::new(bbox, 0.8)
}

#[test]
fn distances_are_in_standard_deviations() {
    let expected = expectation(uneven());
    for (bbox, want) in [
        (at(2.0, 0.0, 0.0, 0.0), 1.0),
        (at(0.0, 3.0, 0.0, 0.0), 1.0),
        (at(0.0, 0.0, 4.0, 0.0), 1.0),
        (at(0.0, 0.0, 0.0, -5.0), 1.0),
        (at(4.0, 0.0, 8.0, 0.0), 8.0),
    ] {
        assert!((expected.distance2(&bbox) - want).abs() < 1e-9);
    }
    let classes = Classes::default();
    let one = |bbox| given(params(""), &[confirmed(&expected, &classes)], &[seen(bbox)]);
    assert_eq!(one(at(4.0, 0.0, 8.0, 0.0)), [[0]]);
    assert!(one(at(4.0, 0.0, 8.0, 5.1))[0].is_empty(), "9.04 is beyond the gate");
}

#[test]
fn another_class_counts_as_distance() {
    let expected = expectation(uneven());
    let mut classes = Classes::default();
    classes.count(&"dog".into(), 1.0);
    let cat = |bbox| vec![Detection { class: Some("cat".into()), ..seen(bbox) }];
    let one = |bbox, share: &str| given(params(share), &[confirmed(&expected, &classes)], &cat(bbox));
    // A class that one in e detections has wrong is two farther: 6.9 and 7.1 of 9.
    let (inside, beyond) = (at(6.9_f64.sqrt() * 2.0, 0.0, 0.0, 0.0), at(7.1_f64.sqrt() * 2.0, 0.0, 0.0, 0.0));
    assert_eq!(one(inside, "other_class = 0.36787944117144233"), [[0]]);
    assert!(one(beyond, "other_class = 0.36787944117144233")[0].is_empty());
    assert_eq!(one(beyond, "other_class = 1.0"), [[0]]);
}

#[test]
fn overlap_has_the_say_its_weight_gives() {
    // Nearer by size alone, but off to the side; and in place, but larger.
    let expected = expectation(Some(BoxCovariance::identity() * 100.0));
    let classes = Classes::default();
    let detections = [seen(at(9.0, 0.0, 0.0, 0.0)), seen(at(0.0, 0.0, 6.0, 7.2))];
    let one = |changes| given(params(changes), &[confirmed(&expected, &classes)], &detections);
    assert_eq!(one("gate = 20.0\nnearest.iou_weight = 0.0"), [[0]]);
    assert_eq!(one("gate = 20.0\nnearest.iou_weight = 10.0"), [[1]]);
}

#[test]
fn nothing_is_found_out_of_reach() {
    let wide = expectation(Some(BoxCovariance::identity() * 1e6));
    let classes = Classes::default();
    // Where nothing else is to be expected any pair has its price.
    let one = |dx| {
        given(
            params("buffer = 3.0\nnearest.others = 1e-12"),
            &[confirmed(&wide, &classes)],
            &[seen(at(dx, 0.0, 0.0, 0.0))],
        )
    };
    assert_eq!(one(40.0), [[0]]);
    assert!(one(40.5)[0].is_empty(), "reach is two sizes of 20 px");
}

#[test]
fn without_a_model_the_starting_speed_measures() {
    let motion = MotionParams {
        position_noise: 0.0,
        size_noise: 0.1,
        size_change: 0.2,
        start_speed: 0.4,
        noise_floor_px: 0.5,
        ..MotionParams::default()
    };
    // 0.4 sizes/s for a quarter of a second are 2 px; sizes: 2 px and 0.2 · 20 · ½ = 2 px.
    let want = BoxCovariance::from_diagonal(&Vector4::new(4.25, 4.25, 8.25, 8.25));
    // A covariance that is none counts as no model.
    for covariance in [None, Some(BoxCovariance::identity() * -1.0)] {
        let expected = Expectation::new(&prior(covariance), &motion).unwrap();
        let determinant = want.determinant().ln() - 4.0 * 400.0_f64.ln();
        assert!((expected.log_determinant() - determinant).abs() < 1e-9);
        assert!((expected.distance2(&at(2.0, 0.0, 0.0, 0.0)) - 4.0 / 4.25).abs() < 1e-9);
    }
}

#[test]
fn two_stages_give_sure_detections_first() {
    let near = expectation(Some(BoxCovariance::identity() * 100.0));
    let classes = Classes::default();
    let (sure, weak) = (|bbox| Detection::new(bbox, 0.9), |bbox| Detection::new(bbox, 0.3));
    let two =
        |targets: &[Claimant<'_>], detections: &[Detection]| given(params("model = 'two-stage'"), targets, detections);
    let target = || confirmed(&near, &classes);
    // The weak one is nearer, the sure one counts more.
    let both = [weak(at(0.0, 0.0, 0.0, 0.0)), sure(at(6.0, 0.0, 0.0, 0.0))];
    assert_eq!(two(&[target()], &both), [[1]]);
    assert_eq!(two(&[target()], &both[..1]), [[0]]);
    // A lost target is given no weak detection, a candidate only what targets leave.
    let lost = Claimant { state: TrackState::Lost, ..target() };
    let candidate = || Claimant { confirmed: false, ..target() };
    assert!(two(&[lost], &both[..1])[0].is_empty());
    assert!(two(&[candidate()], &both[..1])[0].is_empty());
    assert_eq!(two(&[candidate()], &both), [[1]]);
    assert_eq!(two(&[candidate(), target()], &both[1..]), [vec![], vec![0]]);
    // Overlap .1 is too little of a sure one (.2), .4 of a weak one (.5).
    assert!(two(&[target()], &[sure(at(16.4, 0.0, 0.0, 0.0))])[0].is_empty());
    assert!(two(&[target()], &[weak(at(8.6, 0.0, 0.0, 0.0))])[0].is_empty());
}

#[test]
fn joint_shares_are_probabilities() {
    let near = expectation(Some(BoxCovariance::identity() * 100.0));
    let classes = Classes::default();
    let mut joint = Association::new(params("model = 'joint'")).unwrap();
    let pair = [seen(at(-5.0, 0.0, 0.0, 0.0)), seen(at(5.0, 0.0, 0.0, 0.0))];
    joint.associate(&[confirmed(&near, &classes)], &pair, SIZE).unwrap();
    let [(0, left), (1, right)] = joint.shares()[0].as_slice() else { panic!("{:?}", joint.shares()) };
    assert!((left - right).abs() < 1e-9 && left + right > 0.9 && left + right < 1.0, "{left} {right}");
    // Detection 0 is of either target alike, and so of one of them almost surely: it starts no other.
    joint.associate(&[confirmed(&near, &classes), confirmed(&near, &classes)], &pair[..1], SIZE).unwrap();
    let each: Vec<_> = joint.shares().iter().map(|shares| shares[0]).collect();
    assert!(each.iter().all(|(d, p)| *d == 0 && (p - 0.5).abs() < 0.01), "{each:?}");
    assert_eq!(joint.left().collect::<Vec<_>>(), [false]);
}

#[test]
fn no_pair_has_a_price() {
    let (near, classes) = (expectation(uneven()), Classes::default());
    let beside = [seen(at(3.0, 0.0, 0.0, 0.0))];
    let one = |changes| given(params(changes), &[confirmed(&near, &classes)], &beside);
    assert_eq!(one("nearest.others = 0.3"), [[0]]);
    assert!(one("nearest.others = 1e5")[0].is_empty(), "where others are dense it is rather one of them");
    // A target that was long out of sight may be anywhere near: what is seen two sizes beside it is something new.
    let lost = expectation(Some(BoxCovariance::from_diagonal(&Vector4::new(900.0, 900.0, 50.0, 50.0))));
    let long = Claimant { state: TrackState::Lost, unseen_s: 2.0, ..confirmed(&lost, &classes) };
    let (default, newcomer) = (AssociationParams::default(), [seen(at(38.0, 0.0, 0.0, 0.0))]);
    assert!(given(default.clone(), &[long], &newcomer)[0].is_empty());
    let long = Claimant { state: TrackState::Lost, unseen_s: 2.0, ..confirmed(&lost, &classes) };
    assert_eq!(given(default, &[long], &[seen(at(2.0, 0.0, 0.0, 0.0))]), [[0]], "in its place it is found again");
}

#[test]
fn embeddings_tell_neighbours_apart() {
    let (near, classes) = (expectation(Some(BoxCovariance::identity() * 100.0)), Classes::default());
    let (mut red, mut blue) = (Look::default(), Look::default());
    red.learn(&[1.0, 0.1]);
    blue.learn(&[0.1, 1.0]);
    let looks = |bbox, embedding: [f32; 2]| Detection { embedding: Some(embedding.into()), ..seen(bbox) };
    let both = [looks(at(-1.0, 0.0, 0.0, 0.0), [0.0, 1.0]), looks(at(1.0, 0.0, 0.0, 0.0), [1.0, 0.0])];
    let target = |look| Claimant { look, ..confirmed(&near, &classes) };
    assert_eq!(given(params(""), &[target(&red), target(&blue)], &both), [[1], [0]]);
    assert_eq!(given(params(""), &[target(&blue), target(&red)], &both), [[0], [1]]);
}

#[test]
fn buffered_boxes_reach_farther() {
    let (near, classes) = (expectation(Some(BoxCovariance::identity() * 100.0)), Classes::default());
    // Apart by 4 px: .3 of 20 px on each side bridge 12.
    let beside = [seen(at(24.0, 0.0, 0.0, 0.0))];
    let one = |model: &str| {
        let changes = format!("model = '{model}'\ngate = 60.0");
        given(params(&changes), &[confirmed(&near, &classes)], &beside)
    };
    assert_eq!(one("buffered"), [[0]]);
    assert!(one("two-stage")[0].is_empty());
}

#[test]
fn dense_clusters_are_shared_by_propagation() {
    let near = expectation(Some(BoxCovariance::identity() * 100.0));
    let classes = Classes::default();
    let targets: Vec<_> = (0..6).map(|_| confirmed(&near, &classes)).collect();
    let detections: Vec<_> = (0..6).map(|k| seen(at(f64::from(k), 0.0, 0.0, 0.0))).collect();
    let found = given(params("model = 'joint'\njoint.most_events = 10"), &targets, &detections);
    assert!(found.iter().all(|given| given.len() == 6), "{found:?}");
}

/// A target that walked to the right in steps of `step` pixels and was seen last in its expected place.
fn walked(step: f64) -> Observed {
    let mut observed = Observed::default();
    for k in (0..8).rev() {
        observed.wait(None);
        observed.see(at(-step * f64::from(k), 0.0, 0.0, 0.0));
    }
    observed
}

#[test]
fn direction_decides_between_two_as_near() {
    let (near, classes) = (expectation(Some(BoxCovariance::identity() * 100.0)), Classes::default());
    let observed = walked(3.0);
    // The direction is measured from 9 px back.
    let both = [seen(at(-9.5, 0.0, 0.0, 0.0)), seen(at(9.5, 0.0, 0.0, 0.0))];
    let one = |weight: f64, back: &[Detection]| {
        let target = Claimant { observed: &observed, ..confirmed(&near, &classes) };
        given(params(&format!("model = 'observation'\nobservation.direction_weight = {weight:?}")), &[target], back)
    };
    // Both overlap alike: the first is taken unless direction has a say.
    assert_eq!(one(0.0, &both), [[0]]);
    assert_eq!(one(0.2, &both), [[1]]);
    assert!(one(0.2, &[Detection::new(at(0.0, 0.0, 0.0, 0.0), 0.5)])[0].is_empty(), "it is not sure enough");
}

#[test]
fn what_is_left_is_sought_where_it_was_seen() {
    // Predicted on, but it stands where it was.
    let (astray, classes) = (expectation(Some(BoxCovariance::identity() * 100.0)), Classes::default());
    let mut observed = Observed::default();
    observed.see(at(-40.0, 0.0, 0.0, 0.0));
    let there = [seen(at(-38.0, 0.0, 0.0, 0.0))];
    let one = |changes: &str| {
        let target = Claimant { observed: &observed, ..confirmed(&astray, &classes) };
        given(params(&format!("model = 'observation'\n{changes}")), &[target], &there)
    };
    assert_eq!(one(""), [[0]]);
    assert!(one("observation.recovery_overlap = 0.9")[0].is_empty());
}

#[test]
fn observations_are_assigned_as_by_trying_all() {
    // Up to five walkers and detections anywhere: the first turn has the greatest sum of all ways to pair them.
    let mut random = 7_u64;
    let mut uniform = move || {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (random >> 11) as f64 / (1_u64 << 53) as f64
    };
    let (wide, classes) = (expectation(Some(BoxCovariance::identity() * 1e4)), Classes::default());
    for trial in 0..40 {
        let observed: Vec<Observed> = (0..1 + trial % 5).map(|_| walked(1.0 + 5.0 * uniform())).collect();
        let targets: Vec<_> =
            observed.iter().map(|observed| Claimant { observed, ..confirmed(&wide, &classes) }).collect();
        let detections: Vec<_> = (0..1 + trial % 4)
            .map(|_| seen(at(20.0 * (uniform() - 0.5), 20.0 * (uniform() - 0.5), 0.0, 0.0)))
            .collect();
        let worth = |t: usize, d: usize| {
            let overlap = wide.bbox().iou(&detections[d].bbox);
            let agreement = observed[t].agreement(&detections[d].bbox, 3).unwrap();
            (overlap >= 0.3).then_some(1.0 + overlap + 0.2 * agreement * 0.8)
        };
        fn best(from: usize, free: &mut [bool], targets: usize, worth: &dyn Fn(usize, usize) -> Option<f64>) -> f64 {
            if from == targets {
                return 0.0;
            }
            let mut most = best(from + 1, free, targets, worth);
            for d in 0..free.len() {
                if let (true, Some(own)) = (free[d], worth(from, d)) {
                    free[d] = false;
                    most = most.max(own + best(from + 1, free, targets, worth));
                    free[d] = true;
                }
            }
            most
        }
        let most = best(0, &mut vec![true; detections.len()], targets.len(), &worth);
        let changes = "model = 'observation'\nobservation.recovery_overlap = 1.0";
        let found = given(params(changes), &targets, &detections);
        let sum: f64 = found
            .iter()
            .enumerate()
            .flat_map(|(t, own)| own.iter().map(move |d| (t, *d)))
            .map(|(t, d)| worth(t, d).unwrap())
            .sum();
        assert!((sum - most).abs() < 1e-9, "trial {trial}: {sum} for {most}");
    }
}
