//! Where ticks stand and what they say.

/// Value and text of one tick.
pub(crate) type Tick = (f64, String);

/// Round values in `[from, to]`, about `wanted` of them, 1, 2 or 5 times a power of ten apart and never nearer than
/// `least_step`.
pub(crate) fn linear(from: f64, to: f64, wanted: usize, least_step: f64) -> Vec<Tick> {
    let step = round_step(to - from, wanted, least_step);
    let (first, last) = ((from / step - 1e-9).ceil(), (to / step + 1e-9).floor());
    // A range that is tiny beside its values has no room for steps that floating point can tell apart.
    if !(first.is_finite() && last.is_finite() && last - first < 1e3) {
        return Vec::new();
    }
    let count = (last - first).max(0.0) as usize;
    let values: Vec<f64> = (0..=count).map(|i| (first + i as f64) * step).collect();
    let greatest = values.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    values.into_iter().map(|v| (v, number(v, step, greatest))).collect()
}

/// The least of 1, 2, 5 times a power of ten that cuts `span` into at most `wanted` parts.
pub(crate) fn round_step(span: f64, wanted: usize, least_step: f64) -> f64 {
    let ideal = (span / wanted.max(1) as f64).max(least_step).max(f64::MIN_POSITIVE);
    let power = 10f64.powf(ideal.log10().floor());
    [1.0, 2.0, 5.0].into_iter().map(|m| m * power).find(|s| *s >= ideal * (1.0 - 1e-9)).unwrap_or(10.0 * power)
}

/// Ticks at 1, 2 and 5 of every decade in `[from, to]` (> 0); only at powers of ten where those are many.
pub(crate) fn logarithmic(from: f64, to: f64, wanted: usize) -> Vec<Tick> {
    let decades = (from.log10().floor() as i32, to.log10().ceil() as i32);
    let with = |multiples: &[f64], every: i32| -> Vec<Tick> {
        let powers = (decades.0..=decades.1).filter(|d| d % every == 0);
        let values = powers.flat_map(|d| multiples.iter().map(move |m| m * 10f64.powi(d)));
        values.filter(|v| (from..=to).contains(v)).map(|v| (v, number(v, v, v))).collect()
    };
    let fine = with(&[1.0, 2.0, 5.0], 1);
    if fine.len() <= wanted.max(3) {
        return fine;
    }
    let powers = with(&[1.0], 1).len();
    with(&[1.0], powers.div_ceil(wanted.max(1)) as i32)
}

/// `value` with as many digits as steps of `step` need; in powers of ten where `greatest`, the greatest value beside it,
/// would be long.
pub(crate) fn number(value: f64, step: f64, greatest: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let digits_of_step = -(step.abs() * (1.0 + 1e-9)).log10().floor();
    if !(1e-3..1e6).contains(&greatest) {
        let exponent = greatest.log10().floor() as i32;
        let digits = (digits_of_step + f64::from(exponent)).clamp(0.0, 12.0) as usize;
        let mantissa = minus(&format!("{:.digits$}", value / 10f64.powi(exponent)));
        let power = superscript(exponent);
        return if mantissa == "1" { format!("10{power}") } else { format!("{mantissa}·10{power}") };
    }
    let digits = digits_of_step.clamp(0.0, 12.0) as usize;
    minus(&format!("{value:.digits$}"))
}

/// The sign of mathematics in place of the hyphen.
fn minus(text: &str) -> String {
    text.replace('-', "−")
}

fn superscript(exponent: i32) -> String {
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    let raised = |c: char| c.to_digit(10).and_then(|d| DIGITS.get(d as usize).copied()).unwrap_or('⁻');
    exponent.to_string().chars().map(raised).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(ticks: &[Tick]) -> Vec<&str> {
        ticks.iter().map(|t| t.1.as_str()).collect()
    }

    #[test]
    fn steps_are_one_two_or_five() {
        for (span, wanted, step) in [(1.0, 5, 0.2), (1.0, 10, 0.1), (7.0, 5, 2.0), (0.03, 4, 0.01), (1234.0, 6, 500.0)]
        {
            let got = round_step(span, wanted, 0.0);
            assert!((got / step - 1.0).abs() < 1e-9, "{span} in {wanted}: {got}");
        }
        assert_eq!(round_step(3.0, 10, 1.0), 1.0);
        assert_eq!(round_step(0.0, 0, 0.0).partial_cmp(&0.0), Some(std::cmp::Ordering::Greater));
    }

    #[test]
    fn linear_ticks_are_round_and_inside() {
        assert_eq!(labels(&linear(0.0, 1.0, 5, 0.0)), ["0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(labels(&linear(0.0, 1234.0, 6, 1.0)), ["0", "500", "1000"]);
        assert_eq!(labels(&linear(0.0, 3.0, 10, 1.0)), ["0", "1", "2", "3"]);
        assert_eq!(labels(&linear(-0.7, 0.3, 4, 0.0)), ["−0.5", "0"]);
        assert_eq!(labels(&linear(0.0, 2.5e7, 3, 0.0)), ["0", "1·10⁷", "2·10⁷"].map(|t| t.trim_start_matches("1·")));
        assert_eq!(labels(&linear(0.0, 5e-5, 2, 0.0)), ["0", "5·10⁻⁵"]);
        assert_eq!(linear(1e300, 1e300, 4, 0.0).len(), 0);
    }

    #[test]
    fn logarithmic_ticks_thin_out_over_many_decades() {
        assert_eq!(labels(&logarithmic(18.0, 160.0, 6)), ["20", "50", "100"]);
        assert_eq!(labels(&logarithmic(0.5, 2e3, 6)), ["1", "10", "100", "1000"]);
        assert_eq!(labels(&logarithmic(1e-3, 1e9, 6)), ["0.001", "1", "1000", "10⁶", "10⁹"]);
        assert_eq!(labels(&logarithmic(0.6, 16.0, 9)), ["1", "2", "5", "10"]);
    }

    #[test]
    fn numbers_have_the_digits_of_their_step() {
        assert_eq!(number(0.3, 0.1, 1.0), "0.3");
        assert_eq!(number(2.0, 0.25, 3.0), "2.0");
        assert_eq!(number(-1500.0, 500.0, 2000.0), "−1500");
        assert_eq!(number(1.5e6, 5e5, 2e6), "1.5·10⁶");
        assert_eq!(number(999_999.0, 1.0, 999_999.0), "999999");
        assert_eq!(number(0.001, 0.001, 0.001), "0.001");
    }
}
