#[cfg(feature = "h264")]
use pursuit_containers::mp4::ColorTags;
use pursuit_geometry::Size;
use pursuit_imaging::{ColorMatrix, ColorRange};

/// What a stream says about its colours; `None` where it says nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct ColorInfo {
    pub matrix: Option<ColorMatrix>,
    pub range: Option<ColorRange>,
}

impl ColorInfo {
    /// Of a stream that says at most whether samples use their full range.
    pub fn of_range(full: Option<bool>) -> Self {
        Self { matrix: None, range: full.map(|full| if full { ColorRange::Full } else { ColorRange::Limited }) }
    }

    /// Of what a container says.
    #[cfg(feature = "h264")]
    pub fn of_tags(tags: ColorTags) -> Self {
        Self { matrix: tags.matrix_code.and_then(matrix_of_code), ..Self::of_range(tags.full_range) }
    }

    /// This, and `other` where this says nothing.
    pub fn or(self, other: Self) -> Self {
        Self { matrix: self.matrix.or(other.matrix), range: self.range.or(other.range) }
    }

    /// Always an answer: video range, and the matrix usual for the size.
    pub fn resolve(self, size: Size) -> (ColorMatrix, ColorRange) {
        (self.matrix.unwrap_or_else(|| likely_matrix(size)), self.range.unwrap_or_default())
    }
}

/// The matrix of a `matrix_coefficients` code (ITU-T H.273 table 4).
#[cfg(feature = "h264")]
pub(crate) const fn matrix_of_code(code: u8) -> Option<ColorMatrix> {
    match code {
        1 => Some(ColorMatrix::Bt709),
        4..=6 => Some(ColorMatrix::Bt601), // FCC, BT.470 B/G, SMPTE 170M: the 601 weights but for rounding
        _ => None,
    }
}

/// Players' common guess where a stream is silent: high definition uses BT.709, the rest BT.601.
pub(crate) const fn likely_matrix(size: Size) -> ColorMatrix {
    if size.width >= 1280 || size.height > 576 { ColorMatrix::Bt709 } else { ColorMatrix::Bt601 }
}
