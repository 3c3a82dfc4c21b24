//! Values of Python as TOML, and boxes.

use crate::errors::usage;
use pursuit::BBox;
use pursuit::parameters::{Kind, Parameter};
use pursuit::toml::{Table, Value};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict};

/// A box: left, top, width, height in pixels.
pub type Ltwh = (f64, f64, f64, f64);

/// The box as Python gives it: any four numbers.
pub fn bbox(object: &Bound<'_, PyAny>) -> PyResult<BBox> {
    let wrong = || usage("a box is four numbers: left, top, width, height in pixels");
    let mut numbers = [0.0; 4];
    let mut given = object.try_iter().map_err(|_| wrong())?;
    for slot in &mut numbers {
        *slot = given.next().ok_or_else(wrong)?.and_then(|n| n.extract::<f64>()).map_err(|_| wrong())?;
    }
    if given.next().is_some() {
        return Err(wrong());
    }
    let [l, t, w, h] = numbers;
    Ok(BBox::from_ltwh(l, t, w, h))
}

/// Left, top, width, height in pixels.
pub fn ltwh(bbox: BBox) -> Ltwh {
    (bbox.left(), bbox.top(), bbox.width(), bbox.height())
}

/// A value of Python as TOML.
pub fn value(name: &str, object: &Bound<'_, PyAny>) -> PyResult<Value> {
    if object.is_instance_of::<PyBool>() || object.get_type().name()? == "bool" {
        return Ok(Value::Boolean(object.is_truthy()?));
    }
    if let Ok(text) = object.extract::<String>() {
        return Ok(Value::String(text));
    }
    if let Ok(number) = object.extract::<i64>() {
        return Ok(Value::Integer(number));
    }
    if let Ok(number) = object.extract::<f64>() {
        return Ok(Value::Float(number));
    }
    if let Ok(dict) = object.cast::<PyDict>() {
        return Ok(Value::Table(table(dict)?));
    }
    match object.try_iter() {
        Ok(items) => Ok(Value::Array(items.map(|item| value(name, &item?)).collect::<PyResult<_>>()?)),
        Err(_) => {
            Err(usage(format!("`{name}` is a {}; give a number, a text, a flag or a dict", object.get_type().name()?)))
        }
    }
}

/// A dict as a table; `a__b` is the parameter `b` of the group `a`, as `a.b` is, and `lambda_` is `lambda`, which Python keeps
/// for itself. What is `None` is left out.
pub fn table(dict: &Bound<'_, PyDict>) -> PyResult<Table> {
    let mut table = Table::new();
    for (key, given) in dict {
        let key: String = key.extract().map_err(|_| usage("names of parameters are texts"))?;
        if !given.is_none() {
            let value = value(&key, &given)?;
            table.insert(key.trim_end_matches('_').replace("__", "."), value);
        }
    }
    Ok(table)
}

/// Keyword arguments as changes of the parameters of `schema`. A word given for a group names its model: `motion="imm"` is
/// `motion.model = "imm"`.
pub fn parameters(keywords: Option<&Bound<'_, PyDict>>, schema: &[Parameter]) -> PyResult<Table> {
    let Some(keywords) = keywords else { return Ok(Table::new()) };
    let has_model = |name: &str| {
        schema.iter().any(|p| match &p.kind {
            Kind::Group { parameters } => p.name == name && parameters.iter().any(|q| q.name == "model"),
            _ => false,
        })
    };
    let entries = table(keywords)?.into_iter();
    Ok(entries
        .map(|(key, value)| match value {
            Value::String(_) if has_model(&key) => (format!("{key}.model"), value),
            _ => (key, value),
        })
        .collect())
}
