/// The probability whose log odds are `log_odds`: the logistic function, in [0, 1].
pub fn sigmoid(log_odds: f64) -> f64 {
    1.0 / (1.0 + (-log_odds).exp())
}

/// The log odds of a probability, the inverse of [`sigmoid`]; of 0 and of 1 they are infinite.
pub fn logit(probability: f64) -> f64 {
    (probability / (1.0 - probability)).ln()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn probabilities_and_log_odds_are_inverse() {
        assert!((sigmoid(0.0) - 0.5).abs() < 1e-15 && (sigmoid(3.0_f64.ln()) - 0.75).abs() < 1e-12);
        assert_eq!((sigmoid(-1e6), sigmoid(1e6)), (0.0, 1.0));
        assert!((logit(sigmoid(-2.5)) + 2.5).abs() < 1e-12);
        assert_eq!((logit(0.0), logit(1.0)), (f64::NEG_INFINITY, f64::INFINITY));
    }
}
