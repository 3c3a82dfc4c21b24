//! How far depth speaks against a response: equations (20) and (30) of zhai2024.

use pursuit_estimation::sigmoid;

/// Equation (20): the response less ε times the difference of the mean depths, of the patch before and of this one.
///
/// With ε′ it is equation (30) as it must be meant: with the difference taken absolutely. As printed, without the bars,
/// everything *behind* the target gains by its distance, and 94 to 97 % of background windows pass for the target.
/// A mean that is not known says nothing. `epsilon` is per metre.
pub fn penalised(response: f64, epsilon: f64, before_m: Option<f64>, here_m: Option<f64>) -> f64 {
    match (before_m, here_m) {
        (Some(before), Some(here)) => response - epsilon * (before - here).abs(),
        _ => response,
    }
}

/// What a response is judged by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Judged {
    /// The response less what depth says against it.
    pub response: f64,
    /// What it has to be to be the target.
    pub threshold: f64,
}

impl Judged {
    /// The probability that it is the target: one half at the threshold, so that a policy that asks for one half decides as
    /// the paper does. `softness` is the response that changes the odds by e.
    pub fn probability(&self, softness: f64) -> f64 {
        sigmoid((self.response - self.threshold) / softness)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::depth::MeanDepth;

    #[test]
    fn responses_equal_the_fixture() {
        let path = format!("{}/tests/fixtures/depth_response.json", env!("CARGO_MANIFEST_DIR"));
        let fixture: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
        let numbers = |name: &str| -> Vec<f64> {
            let rows = fixture[name].as_array().unwrap();
            rows.iter().flat_map(|r| r.as_array().unwrap()).map(|v| v.as_f64().unwrap()).collect()
        };
        let highest = numbers("response").into_iter().fold(f64::NEG_INFINITY, f64::max);
        let mut patch = MeanDepth::default();
        numbers("patch").into_iter().for_each(|m| patch.add(m));
        let cases = fixture["cases"].as_array().unwrap();
        assert!(!cases.is_empty());
        for case in cases {
            let number = |name: &str| case[name].as_f64().unwrap();
            assert!((patch.mean_m().unwrap() - number("d_p")).abs() < 1e-9);
            let f = penalised(highest, number("eps"), Some(number("d_l")), patch.mean_m());
            assert!((f - number("max_eq20")).abs() < 1e-9, "{f}");
            let judged = Judged { response: f, threshold: 0.2 };
            assert_eq!(judged.probability(0.05) < 0.5, case["occluded_at_0_2"].as_bool().unwrap());
        }
    }

    #[test]
    fn nearer_and_farther_cost_the_same() {
        assert!((penalised(0.5, 0.2, Some(2.0), Some(1.0)) - 0.3).abs() < 1e-12);
        assert!((penalised(0.5, 0.2, Some(2.0), Some(3.0)) - 0.3).abs() < 1e-12);
        assert_eq!((penalised(0.5, 0.2, None, Some(3.0)), penalised(0.5, 0.2, Some(3.0), None)), (0.5, 0.5));
    }

    #[test]
    fn the_probability_is_one_half_at_the_threshold() {
        let p = |response| Judged { response, threshold: 0.3 }.probability(0.05);
        assert!((p(0.3) - 0.5).abs() < 1e-12 && (p(0.35) - 1.0 / (1.0 + (-1.0_f64).exp())).abs() < 1e-12);
        assert_eq!((p(-1e9), p(1e9)), (0.0, 1.0));
    }
}
