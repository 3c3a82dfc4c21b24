use super::srgb_to_lab;
use pursuit_imaging::Rgb8;

/// The eleven basic colour terms of English (Berlin & Kay, "Basic color terms", 1969).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ColorTerm {
    /// Black.
    Black,
    /// Blue.
    Blue,
    /// Brown.
    Brown,
    /// Grey.
    Gray,
    /// Green.
    Green,
    /// Orange.
    Orange,
    /// Pink.
    Pink,
    /// Purple.
    Purple,
    /// Red.
    Red,
    /// White.
    White,
    /// Yellow.
    Yellow,
}

/// How far a term reaches in L*a*b* (standard deviation of the soft assignment): colours half as far apart as neighbouring
/// terms are shared between them.
const REACH: f64 = 14.0;

/// Chroma beyond this counts no further: screens show colours far more vivid than the surfaces the terms are made for.
const VIVID: f64 = 75.0;

impl ColorTerm {
    /// All terms, in the order of the channels.
    pub const ALL: [Self; 11] = [
        Self::Black,
        Self::Blue,
        Self::Brown,
        Self::Gray,
        Self::Green,
        Self::Orange,
        Self::Pink,
        Self::Purple,
        Self::Red,
        Self::White,
        Self::Yellow,
    ];

    /// A typical colour of the term in L*a*b*: our own placement, near the middle of what the term covers among surface
    /// colours; for the chromatic terms as (lightness, chroma, hue in degrees).
    fn focus(self) -> [f64; 3] {
        let polar = |lightness: f64, chroma: f64, hue_deg: f64| {
            let hue = hue_deg.to_radians();
            [lightness, chroma * hue.cos(), chroma * hue.sin()]
        };
        match self {
            Self::Black => [8.0, 0.0, 0.0],
            Self::Gray => [52.0, 0.0, 0.0],
            Self::White => [96.0, 0.0, 0.0],
            Self::Red => polar(42.0, 62.0, 32.0),
            Self::Orange => polar(64.0, 68.0, 62.0),
            Self::Brown => polar(34.0, 30.0, 62.0),
            Self::Yellow => polar(83.0, 74.0, 92.0),
            Self::Green => polar(50.0, 46.0, 148.0),
            Self::Blue => polar(42.0, 54.0, 286.0),
            Self::Purple => polar(38.0, 44.0, 318.0),
            Self::Pink => polar(74.0, 32.0, 0.0),
        }
    }

    /// Probability of each term for a colour: pᵢ ∝ exp(−‖Lab − focusᵢ‖² / 2σ²), summing to 1.
    /// Chroma is limited to what surfaces have.
    pub fn probabilities(rgb: Rgb8) -> [f64; 11] {
        let [lightness, a, b] = srgb_to_lab(rgb);
        let toned = (VIVID / a.hypot(b)).min(1.0);
        let lab = [lightness, toned * a, toned * b];
        let exponents = Self::ALL.map(|term| {
            let square: f64 = lab.iter().zip(term.focus()).map(|(v, f)| (v - f).powi(2)).sum();
            -square / (2.0 * REACH * REACH)
        });
        // Less the largest exponent, so that colours far from every focus keep a sum above zero.
        let largest = exponents.iter().fold(f64::NEG_INFINITY, |a, &b| a.max(b));
        let weights = exponents.map(|e| (e - largest).exp());
        let sum: f64 = weights.iter().sum();
        weights.map(|w| w / sum)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn everyday_colors_get_their_names() {
        use ColorTerm::*;
        for (rgb, term) in [
            ([0, 0, 0], Black),
            ([255, 255, 255], White),
            ([128, 128, 128], Gray),
            ([220, 20, 30], Red),
            ([255, 0, 0], Red),
            ([255, 140, 0], Orange),
            ([240, 220, 30], Yellow),
            ([255, 255, 0], Yellow),
            ([30, 140, 50], Green),
            ([0, 255, 0], Green),
            ([40, 90, 190], Blue),
            ([0, 0, 255], Blue),
            ([110, 50, 130], Purple),
            ([250, 160, 190], Pink),
            ([110, 70, 40], Brown),
        ] {
            let p = ColorTerm::probabilities(rgb);
            let best = (0..11).max_by(|a, b| p[*a].total_cmp(&p[*b])).unwrap();
            assert_eq!(ColorTerm::ALL[best], term, "{rgb:?}: {p:?}");
            assert!((p.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        }
    }
}
