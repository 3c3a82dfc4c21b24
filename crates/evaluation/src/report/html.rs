//! HTML: escaping, Base64, table cells.

pub(crate) use pursuit_charts::escape;

/// Base64 with padding (RFC 4648).
pub(super) fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let byte = |i: usize| u32::from(chunk.get(i).copied().unwrap_or(0));
        let group = byte(0) << 16 | byte(1) << 8 | byte(2);
        for i in 0..4 {
            let digit = DIGITS[(group >> (18 - 6 * i) & 63) as usize];
            text.push(if i <= chunk.len() { char::from(digit) } else { '=' });
        }
    }
    text
}

/// A table cell that sorts by its value; empty where there is none.
pub(crate) fn figure(value: Option<f64>, digits: usize) -> String {
    shown(value, value.map(|v| format!("{v:.digits$}")))
}

/// The same with a text of its own.
pub(super) fn shown(value: Option<f64>, text: Option<String>) -> String {
    match (value, text) {
        (Some(v), Some(text)) if v.is_finite() => format!(r#"<td data-v="{v}">{text}</td>"#),
        _ => r#"<td class="none" data-v="">–</td>"#.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_is_that_of_the_standard() {
        for (plain, coded) in [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foobar", "Zm9vYmFy")] {
            assert_eq!(base64(plain.as_bytes()), coded);
        }
    }
}
