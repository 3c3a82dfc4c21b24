//! A JSON object a line, as `--format jsonl` writes them.

use super::lines::each_line;
use super::rows::Builder;
use crate::Result;
use serde::Deserialize;
use serde_json::Value;
use std::io::BufRead;

/// What a line says; more is not looked at.
#[derive(Deserialize)]
struct Line {
    frame: u64,
    #[serde(rename = "box")]
    bbox: Option<[f64; 4]>,
    score: Option<f64>,
    class: Option<Value>,
    target: Option<u64>,
}

pub(super) fn read(bytes: &mut dyn BufRead, builder: &mut Builder) -> Result<()> {
    let path = builder.path().to_owned();
    each_line(bytes, &path, |at, text| {
        let line: Line = serde_json::from_str(text).map_err(|e| {
            let form = r#"{"frame": 0, "box": [left, top, width, height], "score": 0.9, "class": "car"}"#;
            builder.wrong(at, format!("{e}; a line is {form}"))
        })?;
        // A target that is not seen has no box.
        let Some(ltwh) = line.bbox else { return Ok(()) };
        let class = word(line.class.as_ref()).map(|word| builder.class(&word));
        builder.add(Some(at), (line.frame, line.target, class), ltwh, line.score.unwrap_or(1.0))
    })
}

/// A class as a word, or as a number.
pub(super) fn word(class: Option<&Value>) -> Option<String> {
    match class? {
        Value::String(word) => Some(word.clone()),
        Value::Number(number) => Some(number.to_string()),
        _ => None,
    }
}
