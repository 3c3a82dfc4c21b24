use super::*;
use crate::BoxCovariance;
use pursuit_geometry::BBox;

const FRAME: Size = Size::new(40, 30);

fn prior(bbox: BBox) -> Prior {
    Prior { bbox, innovation_covariance: Some(BoxCovariance::identity() * 4.0), dt_s: 0.1 }
}

fn inside() -> BBox {
    BBox::from_ltwh(10.0, 10.0, 8.0, 8.0)
}

fn judge_at(policy: &mut Policy, state: TrackState, found: Option<&Measurement>, bbox: BBox) -> Verdict {
    policy.judge(&Evidence { frame: FRAME, prior: &prior(bbox), found, state })
}

fn judge(policy: &mut Policy, state: TrackState, confidence: f64) -> Verdict {
    judge_at(policy, state, Some(&Measurement::new(inside(), confidence)), inside())
}

fn policy(model: PolicyModel) -> Policy {
    Policy::new(PolicyParams {
        model,
        occluded_below: 0.2,
        seen_from: 0.3,
        found_from: 0.6,
        learn_from: 0.25,
        lost_after_s: 0.15,
        probation_s: 0.0,
        occluded_score: 0.15,
        calibrated: CalibratedParams { learn_unsure_from: 2.0, lost_below: 0.3, ..CalibratedParams::default() },
        gated: GatedParams { far_from: 0.9, outside_haste: 2.0 },
        paper: PaperParams { psr_from: 7.0 },
    })
}

#[test]
fn what_is_followed_in_doubt_is_learned_where_the_policy_says_so() {
    let doubtful = |model, confidence| {
        let policy = policy(model);
        let calibrated = CalibratedParams { learn_unsure_from: 0.15, lost_below: 0.0, ..CalibratedParams::default() };
        let mut policy = Policy::new(PolicyParams { calibrated, ..policy.params().clone() });
        judge(&mut policy, TrackState::Occluded, confidence)
    };
    let verdict = doubtful(PolicyModel::Calibrated, 0.15);
    assert_eq!((verdict.state, verdict.follow, verdict.learn), (TrackState::Unsure, true, true));
    assert!(!doubtful(PolicyModel::Calibrated, 0.14).learn);
    assert!(!doubtful(PolicyModel::Gated, 0.15).learn, "what is not followed is not learned");
    // What is seen goes by its own threshold.
    assert!(!judge(&mut policy(PolicyModel::Calibrated), TrackState::Tracking, 0.2).learn);
}

#[test]
fn seen_occluded_lost_and_found() {
    let mut policy = policy(PolicyModel::Calibrated);
    let seen = judge(&mut policy, TrackState::Tracking, 0.22);
    assert_eq!(seen, Verdict { state: TrackState::Tracking, score: 0.22, follow: true, learn: false });
    assert!(judge(&mut policy, TrackState::Tracking, 0.25).learn);
    let unsure = judge(&mut policy, TrackState::Tracking, 0.1);
    assert_eq!(unsure, Verdict { state: TrackState::Unsure, score: 0.1, follow: true, learn: false });
    let lost = judge(&mut policy, TrackState::Unsure, 0.29);
    assert_eq!(lost, Verdict { state: TrackState::Lost, score: 0.0, follow: false, learn: false });
    assert_eq!(judge(&mut policy, TrackState::Lost, 0.59).state, TrackState::Lost);
    assert_eq!(judge(&mut policy, TrackState::Lost, 0.6).state, TrackState::Tracking);
    // Seen in between, the time not seen starts over.
    assert_eq!(judge(&mut policy, TrackState::Tracking, 0.1).state, TrackState::Unsure);
    assert_eq!(judge(&mut policy, TrackState::Unsure, 0.3).state, TrackState::Tracking);
    assert_eq!(judge_at(&mut policy, TrackState::Tracking, None, inside()).state, TrackState::Occluded);
}

#[test]
fn what_is_followed_is_unsure_and_what_coasts_occluded() {
    let found = |model| judge(&mut policy(model), TrackState::Tracking, 0.1).state;
    let missed = |model| judge_at(&mut policy(model), TrackState::Tracking, None, inside()).state;
    assert_eq!(found(PolicyModel::Calibrated), TrackState::Unsure);
    assert_eq!(missed(PolicyModel::Calibrated), TrackState::Occluded);
    for coasts in [PolicyModel::Gated, PolicyModel::Paper, PolicyModel::Always] {
        assert_eq!(missed(coasts), TrackState::Occluded, "{coasts:?}");
    }
    assert_eq!(found(PolicyModel::Gated), TrackState::Occluded, "what is found and not followed moves nothing");
    // To be seen again, both must prove the same.
    for state in [TrackState::Unsure, TrackState::Occluded] {
        assert_eq!(judge(&mut policy(PolicyModel::Calibrated), state, 0.29).state, TrackState::Unsure);
        assert_eq!(judge(&mut policy(PolicyModel::Calibrated), state, 0.3).state, TrackState::Tracking);
    }
}

#[test]
fn scores_of_doubted_targets_are_capped() {
    let mut policy = policy(PolicyModel::Calibrated);
    assert_eq!(judge(&mut policy, TrackState::Unsure, 0.29).score, 0.15);
    assert_eq!(judge_at(&mut policy, TrackState::Tracking, None, inside()).score, 0.0);
}

#[test]
fn a_target_that_may_be_there_is_not_given_up() {
    let mut policy = policy(PolicyModel::Calibrated);
    policy.change(PolicyParams { occluded_below: 0.5, seen_from: 0.5, ..policy.params().clone() });
    let mut state = TrackState::Tracking;
    for _ in 0..10 {
        state = judge(&mut policy, state, 0.3).state;
        assert_eq!(state, TrackState::Unsure);
    }
    assert_eq!(judge(&mut policy, state, 0.29).state, TrackState::Unsure);
    assert_eq!(judge(&mut policy, state, 0.29).state, TrackState::Lost);
    policy.restart();
    assert_eq!(judge(&mut policy, TrackState::Unsure, 0.29).state, TrackState::Unsure);
}

#[test]
fn the_gate_asks_more_of_what_is_far() {
    let mut policy = policy(PolicyModel::Gated);
    let at = |confidence, share| Measurement { gate_share: Some(share), ..Measurement::new(inside(), confidence) };
    let mut believed = |confidence, share, state| {
        judge_at(&mut policy, state, Some(&at(confidence, share)), inside()).state == TrackState::Tracking
    };
    assert!(believed(0.2, 0.0, TrackState::Tracking) && believed(0.25, 0.25, TrackState::Tracking));
    assert!(!believed(0.24, 0.25, TrackState::Tracking));
    // Missed in the frame before: from .3 at the prediction to .9 at the gate's edge.
    assert!(!believed(0.29, 0.0, TrackState::Occluded));
    assert!(believed(0.61, 0.25, TrackState::Occluded));
    assert!(!believed(0.1, 0.0, TrackState::Tracking) && !believed(0.59, 0.25, TrackState::Occluded));
    assert_eq!(judge(&mut policy, TrackState::Lost, 0.59).state, TrackState::Lost);
    assert_eq!(judge(&mut policy, TrackState::Lost, 0.6).state, TrackState::Tracking);
}

#[test]
fn coasting_is_worth_less_as_the_doubt_grows_and_ends_sooner_outside() {
    let mut policy = policy(PolicyModel::Gated);
    let verdict = judge_at(&mut policy, TrackState::Tracking, None, inside());
    // A deviation of 2 px in half a side of 4.
    assert_eq!((verdict.state, verdict.follow), (TrackState::Occluded, false));
    assert!((verdict.score - 0.15 / 1.5).abs() < 1e-12);
    policy.restart();
    let outside = BBox::from_ltwh(50.0, 10.0, 8.0, 8.0);
    assert_eq!(judge_at(&mut policy, TrackState::Tracking, None, outside).state, TrackState::Lost);
}

#[test]
fn the_papers_rule_asks_for_a_clear_peak_and_always_asks_nothing() {
    let mut paper = policy(PolicyModel::Paper);
    let found = |psr| Measurement { psr: Some(psr), ..Measurement::new(inside(), 0.01) };
    let verdict = judge_at(&mut paper, TrackState::Tracking, Some(&found(7.0)), inside());
    assert_eq!(verdict, Verdict { state: TrackState::Tracking, score: 0.01, follow: true, learn: true });
    let verdict = judge_at(&mut paper, TrackState::Tracking, Some(&found(6.9)), inside());
    assert_eq!((verdict.state, verdict.follow, verdict.learn), (TrackState::Occluded, false, false));
    let mut always = policy(PolicyModel::Always);
    for state in [TrackState::Tracking, TrackState::Unsure, TrackState::Occluded, TrackState::Lost] {
        let verdict = judge(&mut always, state, 0.0);
        assert_eq!((verdict.state, verdict.learn), (TrackState::Tracking, true));
        assert_eq!(judge_at(&mut always, state, None, inside()).state, TrackState::Occluded);
    }
}

#[test]
fn only_judging_policies_are_ever_unsure() {
    let sure = |model| policy(model).sure_from();
    assert_eq!([sure(PolicyModel::Calibrated), sure(PolicyModel::Gated)], [0.3, 0.3]);
    assert_eq!([sure(PolicyModel::Paper), sure(PolicyModel::Always)], [0.0, 0.0]);
}

#[test]
fn what_is_neither_tracked_nor_in_the_picture_is_gone() {
    let doubt = |bbox, concluded| {
        let evidence = Evidence { frame: FRAME, prior: &prior(bbox), found: None, state: TrackState::Tracking };
        evidence.doubt(concluded, || Some(Doubt::Confused))
    };
    assert_eq!(doubt(inside(), TrackState::Occluded), Some(Doubt::Confused), "the method says why");
    assert_eq!(doubt(inside(), TrackState::Unsure), Some(Doubt::Confused));
    assert_eq!(doubt(inside(), TrackState::Tracking), None);
    assert_eq!(doubt(inside(), TrackState::Lost), Some(Doubt::Gone));
    let outside = BBox::from_ltwh(-9.0, 10.0, 8.0, 8.0);
    assert_eq!(doubt(outside, TrackState::Occluded), Some(Doubt::Gone));
    assert_eq!(doubt(outside, TrackState::Tracking), None);
}

fn calibrated(change: impl Fn(&mut CalibratedParams)) -> Policy {
    let mut params = policy(PolicyModel::Calibrated).params().clone();
    params.lost_after_s = 10.0;
    change(&mut params.calibrated);
    Policy::new(params)
}

#[test]
fn what_is_implausible_moves_no_box() {
    let mut policy = calibrated(|p| p.follow_from = 0.12);
    assert!(!judge(&mut policy, TrackState::Occluded, 0.11).follow);
    assert!(judge(&mut policy, TrackState::Occluded, 0.12).follow);
}

#[test]
fn long_doubt_asks_for_a_look_elsewhere() {
    let mut policy = calibrated(|p| p.elsewhere_after_s = 0.25);
    for (confidence, want) in [(0.15, false), (0.15, false), (0.15, true), (0.4, false), (0.1, false)] {
        judge(&mut policy, TrackState::Occluded, confidence);
        assert_eq!(policy.looks_elsewhere(), want, "{confidence}");
    }
    let mut patient = calibrated(|_| {});
    for _ in 0..100 {
        judge(&mut patient, TrackState::Occluded, 0.15);
    }
    assert!(!patient.looks_elsewhere());
}

#[test]
fn what_was_found_is_on_probation() {
    let mut params = calibrated(|_| {}).params().clone();
    params.probation_s = 0.25;
    let mut policy = Policy::new(params);
    let found = judge(&mut policy, TrackState::Lost, 0.9);
    assert_eq!((found.state, found.learn), (TrackState::Tracking, false));
    assert!(!judge(&mut policy, TrackState::Tracking, 0.9).learn);
    assert_eq!(judge(&mut policy, TrackState::Tracking, 0.1).state, TrackState::Lost, "doubted on probation");
    judge(&mut policy, TrackState::Lost, 0.9);
    let learnt = [0.9, 0.9, 0.9].map(|confidence| judge(&mut policy, TrackState::Tracking, confidence).learn);
    assert_eq!(learnt, [false, false, true]);
    assert_eq!(judge(&mut policy, TrackState::Tracking, 0.1).state, TrackState::Unsure, "probation is over");
}
