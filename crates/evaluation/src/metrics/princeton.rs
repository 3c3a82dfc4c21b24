//! The Princeton RGB-D benchmark's error types (Song, Xiao 2013).

/// What is known and claimed about one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Claim {
    /// Whether the target is visible.
    pub visible: bool,
    /// Whether the tracker gave a box.
    pub output: bool,
    /// Overlap of the box with the target; 0 where either is missing.
    pub overlap: f64,
}

/// Fractions of all frames; they sum to 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ErrorTypes {
    /// Box on the target (overlap above the threshold), or rightly none.
    pub success: f64,
    /// I: visible, box given, overlap not above the threshold.
    pub wrong_box: f64,
    /// II: not visible, yet a box given.
    pub false_box: f64,
    /// III: visible, no box given.
    pub missing_box: f64,
}

/// Success rate and the three error types at an overlap threshold (the benchmark uses .5).
pub fn error_types(claims: &[Claim], threshold: f64) -> ErrorTypes {
    let fraction = |is: fn(&Claim, f64) -> bool| {
        claims.iter().filter(|c| is(c, threshold)).count() as f64 / claims.len().max(1) as f64
    };
    ErrorTypes {
        success: fraction(|c, r| if c.visible { c.output && c.overlap > r } else { !c.output }),
        wrong_box: fraction(|c, r| c.visible && c.output && c.overlap <= r),
        false_box: fraction(|c, _| !c.visible && c.output),
        missing_box: fraction(|c, _| c.visible && !c.output),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_frame_is_of_one_type() {
        let claim = |visible, output, overlap| Claim { visible, output, overlap };
        let claims = [
            claim(true, true, 0.9),
            claim(true, true, 0.5), // not above the threshold
            claim(true, true, 0.2),
            claim(true, false, 0.0),
            claim(false, true, 0.0),
            claim(false, true, 0.9),
            claim(false, false, 0.0),
            claim(false, false, 0.0),
        ];
        let types = error_types(&claims, 0.5);
        let expected = ErrorTypes { success: 0.375, wrong_box: 0.25, false_box: 0.25, missing_box: 0.125 };
        assert_eq!(types, expected);
        assert_eq!(error_types(&claims, 0.4).success, 0.5);
        let none = error_types(&[], 0.5);
        assert_eq!((none.success, none.wrong_box, none.false_box, none.missing_box), (0.0, 0.0, 0.0, 0.0));
    }
}
