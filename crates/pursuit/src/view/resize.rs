use crate::RunError;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// To what size pictures are brought before trackers see them; written `640x360`, or as a factor, `0.5`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum Resize {
    /// To this many columns and rows, whatever that does to the shape.
    To(usize, usize),
    /// By this factor, > 0, both ways.
    By(f64),
}

impl Resize {
    /// The size that a picture of `width` × `height` pixels gets.
    pub(super) fn of(self, width: usize, height: usize) -> [usize; 2] {
        match self {
            Self::To(width, height) => [width, height],
            // A cast saturates, so that absurd factors give absurd sizes, which are refused.
            Self::By(factor) => [width, height].map(|side| (side as f64 * factor).round() as u32 as usize),
        }
    }
}

impl FromStr for Resize {
    type Err = RunError;

    fn from_str(text: &str) -> Result<Self, RunError> {
        let whole = |side: &str| side.trim().parse::<u32>().ok().filter(|&s| s > 0).map(|s| s as usize);
        let to = || {
            let (width, height) = text.split_once(['x', 'X', '×'])?;
            Some(Self::To(whole(width)?, whole(height)?))
        };
        let by = || text.trim().parse().ok().filter(|f: &f64| f.is_finite() && *f > 0.0).map(Self::By);
        to().or_else(by).ok_or_else(|| {
            RunError::usage(format!("size `{text}` is neither WIDTHxHEIGHT, as 640x360, nor a factor, as 0.5"))
        })
    }
}

impl fmt::Display for Resize {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::To(width, height) => write!(f, "{width}x{height}"),
            Self::By(factor) => write!(f, "{factor}"),
        }
    }
}

impl TryFrom<String> for Resize {
    type Error = RunError;

    fn try_from(text: String) -> Result<Self, RunError> {
        text.parse()
    }
}

impl From<Resize> for String {
    fn from(resize: Resize) -> Self {
        resize.to_string()
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;

    #[test]
    fn sizes_and_factors_are_read_and_written_alike() {
        for (text, size) in
            [("640x360", [640, 360]), ("0.5", [50, 25]), ("2", [200, 100]), ("1e300", [u32::MAX as usize; 2])]
        {
            let resize: Resize = text.parse().unwrap();
            assert_eq!(resize.of(100, 50), size);
            assert_eq!(resize.to_string().parse::<Resize>().unwrap(), resize);
        }
        for bad in ["", "x", "640x", "0x3", "-1", "0", "nan", "inf", "640x360x2", "1.5x2"] {
            assert_eq!(bad.parse::<Resize>().unwrap_err().exit_code(), 2, "{bad}");
        }
    }
}
