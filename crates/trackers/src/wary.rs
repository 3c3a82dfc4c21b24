use pursuit_tracking::policy::PolicyParams;

/// The judgement of methods whose score says too much once they have learnt something else: they believe only what leaves little doubt, and
/// learn nothing less. Measured on targets that go away, with the usual thresholds: the background is learnt in the first frames without the
/// target, and looks right from then on.
pub fn wary(policy: PolicyParams) -> PolicyParams {
    PolicyParams { occluded_below: 0.5, seen_from: 0.6, found_from: 0.6, learn_from: 0.6, ..policy }
}
