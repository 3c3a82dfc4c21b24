//! Reading the independent fixtures.
#![allow(dead_code)]

use nalgebra::{SMatrix, SVector};
use serde_json::Value;

/// The fixture `name`.
pub fn fixture(name: &str) -> Value {
    let path = format!("{}/tests/fixtures/{name}.json", env!("CARGO_MANIFEST_DIR"));
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

pub fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("not a number: {value}"))
}

pub fn numbers(value: &Value) -> Vec<f64> {
    list(value).iter().map(number).collect()
}

pub fn list(value: &Value) -> &[Value] {
    value.as_array().unwrap_or_else(|| panic!("not a list: {value}"))
}

pub fn vector<const N: usize>(value: &Value) -> SVector<f64, N> {
    assert_eq!(list(value).len(), N);
    SVector::from_iterator(numbers(value))
}

pub fn matrix<const R: usize, const C: usize>(value: &Value) -> SMatrix<f64, R, C> {
    assert_eq!((list(value).len(), list(&value[0]).len()), (R, C));
    SMatrix::from_fn(|r, c| number(&value[r][c]))
}

/// Equal to `tolerance`, relative to max(1, |expected|), entry by entry.
#[track_caller]
pub fn assert_close<const R: usize, const C: usize>(
    what: &str,
    ours: &SMatrix<f64, R, C>,
    expected: &SMatrix<f64, R, C>,
    tolerance: f64,
) {
    for (a, b) in ours.iter().zip(expected.iter()) {
        assert!((a - b).abs() <= tolerance * b.abs().max(1.0), "{what}: {a} is not {b}");
    }
}

#[track_caller]
pub fn assert_near(what: &str, ours: f64, expected: f64, tolerance: f64) {
    assert!((ours - expected).abs() <= tolerance * expected.abs().max(1.0), "{what}: {ours} is not {expected}");
}
