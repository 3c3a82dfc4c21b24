use super::super::tests::{SIZE, at, confirmed, expectation, params, seen};
use super::super::{Association, Claimant, Expectation};
use crate::class::Classes;
use crate::many::branches::{Branch, Branches, Past};
use crate::many::death::Unseen;
use crate::motion::{Motion, MotionParams};
use crate::{BoxCovariance, Detection, Prior};
use pursuit_testkit::SplitMix;

#[test]
fn in_one_frame_the_best_hypothesis_is_the_nearest() {
    let (near, classes, mut numbers) =
        (expectation(Some(BoxCovariance::identity() * 30.0)), Classes::default(), SplitMix(3));
    for trial in 0..60 {
        let targets: Vec<Claimant<'_>> = (0..1 + trial % 4).map(|_| confirmed(&near, &classes)).collect();
        let mut off = || 16.0 * (numbers.unit() - 0.5);
        let detections: Vec<Detection> = (0..trial % 5).map(|_| seen(at(off(), off(), 0.0, 0.0))).collect();
        // Targets that are alike may be swapped: what is taken is the same.
        let taken = |changes: &str| {
            let mut association = Association::new(params(changes)).unwrap();
            association.associate(&targets, &detections, SIZE).unwrap();
            let mut taken: Vec<usize> = association.shares().iter().flatten().map(|(d, _)| *d).collect();
            taken.sort_unstable();
            taken
        };
        let nearest = taken("gate = 60.0");
        for scans in [0, 1, 4] {
            let changes = format!("gate = 60.0\nmodel = 'hypotheses'\nhypotheses.n_scan = {scans}");
            assert_eq!(taken(&changes), nearest, "trial {trial}, {scans} frames");
        }
    }
}

/// A target that was missed in the frame before, or else was what has started a candidate then; and that candidate.
#[test]
fn a_candidate_may_turn_out_to_be_a_target() {
    let classes = Classes::default();
    let far =
        Prior { bbox: at(300.0, 0.0, 0.0, 0.0), innovation_covariance: Some(BoxCovariance::identity()), dt_s: 0.1 };
    let own = Expectation::new(&far, &MotionParams::default()).unwrap();
    let here = Prior { bbox: at(0.0, 0.0, 0.0, 0.0), ..far.clone() };
    let sure = Expectation::new(&here, &MotionParams::default()).unwrap();
    let wide = expectation(Some(BoxCovariance::identity() * 400.0));
    let one = |behind: f64| {
        let motion = Motion::new(MotionParams::default(), here.bbox).unwrap();
        let past = Past::started(0).scored(-behind);
        let branch = Branch { past, motion, unseen: Unseen::default(), expected: Some((here.clone(), sure)) };
        let of_target = Branches { own: Past::default(), others: vec![branch] };
        let of_candidate = Branches::started(0);
        let target = Claimant { branches: &of_target, ..confirmed(&own, &classes) };
        let candidate = Claimant { branches: &of_candidate, confirmed: false, ..confirmed(&wide, &classes) };
        let mut association = Association::new(params("model = 'hypotheses'\ngate = 60.0")).unwrap();
        association.associate(&[target, candidate], &[seen(at(0.0, 0.0, 0.0, 0.0))], SIZE).unwrap();
        let given: Vec<Vec<usize>> = association.shares().iter().map(|s| s.iter().map(|(d, _)| *d).collect()).collect();
        let (first, second) = (association.goes_on(0).unwrap(), association.goes_on(1).unwrap());
        assert_eq!(first.branches.first().map(|(next, _)| next.detection), Some(given[0].first().copied()));
        (given, first.branches[0].0.parent, second.refuted)
    };
    assert_eq!(one(1.0), (vec![vec![0], vec![]], 1, true), "it is the target, which was not missed");
    assert_eq!(one(30.0), (vec![vec![], vec![0]], 0, false), "too little speaks for that");
}

#[test]
fn a_past_that_contradicts_itself_is_forgotten() {
    let (near, classes) = (expectation(Some(BoxCovariance::identity() * 30.0)), Classes::default());
    let both = Branches::started(7);
    let target = || Claimant { branches: &both, ..confirmed(&near, &classes) };
    let detections = [seen(at(-3.0, 0.0, 0.0, 0.0)), seen(at(3.0, 0.0, 0.0, 0.0))];
    let mut association = Association::new(params("model = 'hypotheses'\ngate = 60.0")).unwrap();
    association.associate(&[target(), target()], &detections, SIZE).unwrap();
    assert!(association.shares().iter().all(|shares| shares.len() == 1));
    let taken: Vec<_> = (0..2).map(|t| association.goes_on(t).unwrap().branches[0].1.all().count()).collect();
    assert_eq!(taken, [1, 1], "only what was taken now is remembered");
}

#[test]
fn branches_are_few() {
    let (near, classes) = (expectation(Some(BoxCovariance::identity() * 100.0)), Classes::default());
    let none = Branches::default();
    let detections: Vec<_> = (0..60).map(|k| seen(at(0.2 * f64::from(k) - 6.0, 0.0, 0.0, 0.0))).collect();
    let mut association =
        Association::new(params("model = 'hypotheses'\ngate = 60.0\nhypotheses.within = 100.0")).unwrap();
    let targets: Vec<_> = (0..5).map(|_| Claimant { branches: &none, ..confirmed(&near, &classes) }).collect();
    association.associate(&targets, &detections, SIZE).unwrap();
    assert!((0..5).all(|t| association.goes_on(t).unwrap().branches.len() == 12));
    // The one reported first, then the best.
    let nats: Vec<f64> = association.goes_on(0).unwrap().branches[1..].iter().map(|(_, past)| past.nats).collect();
    assert!(nats.windows(2).all(|w| w[0] >= w[1]), "{nats:?}");
}
