use crate::RunError;

/// Reads `KEY=VALUE`; the value is read as TOML (`3`, `0.5`, `true`, `[1, 2]`, `"word"`) and, failing that, as a number
/// (`.5`, which TOML does not know) or a word.
///
/// # Errors
/// [`RunError::Usage`] without `=` or without a key.
pub fn parse_setting(text: &str) -> Result<(String, toml::Value), RunError> {
    let Some((key, value)) = text.split_once('=').map(|(k, v)| (k.trim(), v.trim())).filter(|(k, _)| !k.is_empty())
    else {
        return Err(RunError::usage(format!("`{text}` is not KEY=VALUE, for example color=orange")));
    };
    let as_toml = format!("v = {value}")
        .parse::<toml::Table>()
        .ok()
        .and_then(|mut t| if t.len() == 1 { t.remove("v") } else { None });
    let as_number = || value.parse().ok().filter(|v: &f64| v.is_finite()).map(toml::Value::Float);
    let value = as_toml.or_else(as_number).unwrap_or_else(|| toml::Value::String(value.to_owned()));
    Ok((key.to_owned(), value))
}

/// Reads `left,top,width,height` in pixels.
///
/// # Errors
/// [`RunError::Usage`] unless there are four numbers.
pub fn parse_box(text: &str) -> Result<[f64; 4], RunError> {
    let numbers: Vec<f64> = text.split(',').filter_map(|n| n.trim().parse().ok()).collect();
    match <[f64; 4]>::try_from(numbers) {
        Ok(ltwh) if text.split(',').count() == 4 => Ok(ltwh),
        _ => Err(RunError::usage(format!(
            "box `{text}` is not LEFT,TOP,WIDTH,HEIGHT in pixels, for example 120,80,40,40"
        ))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_are_toml_or_words() {
        assert_eq!(parse_setting("a=3").unwrap(), ("a".into(), toml::Value::Integer(3)));
        assert_eq!(parse_setting("a = 0.5").unwrap(), ("a".into(), toml::Value::Float(0.5)));
        assert_eq!(parse_setting("a=-.5").unwrap(), ("a".into(), toml::Value::Float(-0.5)));
        assert_eq!(parse_setting("color=orange").unwrap(), ("color".into(), "orange".into()));
        assert_eq!(parse_setting("x=a\nb=1").unwrap().1, toml::Value::String("a\nb=1".into()));
        assert!(parse_setting("color").is_err() && parse_setting("=3").is_err());
    }

    #[test]
    fn boxes_are_four_numbers() {
        assert_eq!(parse_box("1, 2.5,3,4").unwrap(), [1.0, 2.5, 3.0, 4.0]);
        for bad in ["", "1,2,3", "1,2,3,4,5", "1,2,x,4", "1,,3,4"] {
            assert!(parse_box(bad).is_err(), "{bad}");
        }
    }
}
