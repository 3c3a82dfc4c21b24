//! Text in SVG: escaping, and how wide it will be.

/// Text with the five characters that mean something to XML escaped, for content and attributes; control characters
/// become U+FFFD.
pub fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            c if c.is_control() && c != '\n' => escaped.push('\u{fffd}'),
            c => escaped.push(c),
        }
    }
    escaped
}

/// By how much DejaVu Sans, the sans-serif face of many Linux systems, is wider than Helvetica.
const WIDEST: f64 = 1.15;

/// How wide `text` is at most in the sans-serif faces that a reader may have, at that size. The widths are those of
/// Helvetica, rounded up by class of character, and enlarged to those of DejaVu Sans.
pub(crate) fn width(text: &str, size: f64) -> f64 {
    let em = |c: char| match c {
        'i' | 'j' | 'l' | 'I' | '.' | ',' | ':' | ';' | '\'' | '|' | '!' | ' ' | '·' => 0.28,
        'f' | 't' | 'r' | '(' | ')' | '[' | ']' | '/' | '-' => 0.34,
        'm' | 'M' | 'w' | 'W' | '@' | '%' => 0.86,
        '−' => 0.73,
        c if c.is_uppercase() => 0.70,
        c if c.is_ascii() => 0.56,
        // Not Latin: as wide as it is high, to be safe.
        c if c as u32 >= 0x1100 => {
            if is_wide(c) {
                1.0
            } else {
                0.6
            }
        }
        _ => 0.58,
    };
    size * WIDEST * text.chars().map(em).sum::<f64>()
}

/// Whether the character is one of East Asia's full-width ones (Hangul, kana, Han, full-width forms).
fn is_wide(c: char) -> bool {
    matches!(c as u32, 0x1100..=0x11ff | 0x2e80..=0xa4cf | 0xac00..=0xd7a3 | 0xf900..=0xfaff | 0xff00..=0xff60 | 0x1_f300..)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_cannot_break_out() {
        assert_eq!(escape("<img src='x' & \"y\">"), "&lt;img src=&#39;x&#39; &amp; &quot;y&quot;&gt;");
        assert_eq!(escape("a\u{7}b\nc"), "a\u{fffd}b\nc");
    }

    #[test]
    fn widths_are_near_those_of_helvetica() {
        // Sums of Helvetica's own widths: w .722, i .222, d .556, t .278, h .556 and so on.
        for (text, em) in [("width", 2.334), ("0123456789", 5.56), ("Illinois", 2.778), ("MMMM", 3.332), ("(−)", 1.25)]
        {
            let got = width(text, 10.0) / WIDEST;
            assert!((got / (10.0 * em) - 1.0).abs() < 0.16, "{text}: {got}");
        }
        assert!((width("漢字", 10.0) - 23.0).abs() < 1e-9);
        assert!((width("·", 10.0) - 3.22).abs() < 1e-9);
    }

    #[test]
    fn no_text_is_wider_in_dejavu_sans() {
        // Sums of DejaVu Sans's own widths: digits .636, minus .838, the point .318 and so on.
        for (text, em) in [("−350", 2.746), ("predicted", 4.744), ("0.25", 2.226)] {
            let got = width(text, 10.0);
            assert!(got >= 10.0 * em && got < 11.5 * em, "{text}: {got}");
        }
    }
}
