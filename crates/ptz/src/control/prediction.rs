use crate::Direction;

/// Where the target will be, or where to turn instead: the direction, its speed, and the standard deviation of the direction.
#[derive(Debug, Clone, Copy)]
pub(super) struct Prediction {
    pub direction: Direction,
    pub speed: Direction,
    pub sigma_deg: f64,
    /// Whether that is a place on the way, to which the dead zone does not apply.
    pub is_waypoint: bool,
}

/// How far ahead to predict, seconds, a target that was seen `unseen_s` ago, and which part of its speed it keeps.
///
/// Over the usual latency the prediction is used as it is. Whoever is unseen for longer has mostly turned or stopped, which
/// is why they are unseen: the prediction comes to rest, so that the head does not run away from where they were seen.
pub(super) fn slowed(unseen_s: f64) -> (f64, f64) {
    const AS_IT_IS_S: f64 = 0.6;
    const COMES_TO_REST_S: f64 = 0.3;
    let beyond = (unseen_s - AS_IT_IS_S).max(0.0);
    let part = (-beyond / COMES_TO_REST_S).exp();
    (unseen_s.min(AS_IT_IS_S) + COMES_TO_REST_S * (1.0 - part), part)
}
