//! For tests: the Fourier transform by its definition in `f64`, and readers of fixtures.

use serde_json::Value;

/// A complex number as (real, imaginary).
pub type C = (f64, f64);

pub fn mul(a: C, b: C) -> C {
    (a.0 * b.0 - a.1 * b.1, a.0 * b.1 + a.1 * b.0)
}

pub fn div(a: C, b: C) -> C {
    let n = b.0 * b.0 + b.1 * b.1;
    let (re, im) = mul(a, conj(b));
    (re / n, im / n)
}

pub fn conj(a: C) -> C {
    (a.0, -a.1)
}

/// The two-dimensional transform of `h` × `w` values, forward (sign −1, no factor) or back (sign +1, divided by `h · w`).
pub fn dft(values: &[C], (h, w): (usize, usize), back: bool) -> Vec<C> {
    let sign = if back { 1.0 } else { -1.0 };
    let factor = if back { 1.0 / (h * w) as f64 } else { 1.0 };
    let bin = |v: usize, u: usize| {
        let mut sum = (0.0, 0.0);
        for (i, value) in values.iter().enumerate() {
            let turns = (v * (i / w) % h) as f64 / h as f64 + (u * (i % w) % w) as f64 / w as f64;
            let (sin, cos) = (sign * std::f64::consts::TAU * turns).sin_cos();
            sum = (sum.0 + value.0 * cos - value.1 * sin, sum.1 + value.0 * sin + value.1 * cos);
        }
        (sum.0 * factor, sum.1 * factor)
    };
    (0..h * w).map(|i| bin(i / w, i % w)).collect()
}

pub fn real(values: &[f64]) -> Vec<C> {
    values.iter().map(|v| (*v, 0.0)).collect()
}

/// All numbers of a nested list in order.
pub fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(items) => items.iter().flat_map(numbers).collect(),
        number => vec![number.as_f64().unwrap()],
    }
}

/// Complex numbers given as `{re, im}` of nested lists.
pub fn complex(value: &Value) -> Vec<C> {
    numbers(&value["re"]).into_iter().zip(numbers(&value["im"])).collect()
}

pub fn assert_close(got: &[f64], want: &[f64], tolerance: f64, what: &str) {
    assert_eq!(got.len(), want.len(), "{what}");
    let largest = want.iter().fold(1.0_f64, |a, b| a.max(b.abs()));
    for (i, (g, w)) in got.iter().zip(want).enumerate() {
        assert!((g - w).abs() <= tolerance * largest, "{what} [{i}]: {g} is not {w}");
    }
}

pub fn fixture(name: &str) -> Vec<Value> {
    let path = format!("{}/tests/fixtures/{name}.json", env!("CARGO_MANIFEST_DIR"));
    let whole: Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    whole["cases"].as_array().unwrap().clone()
}
