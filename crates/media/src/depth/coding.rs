use pursuit_imaging::Image;
use serde::{Deserialize, Serialize};

/// What the numbers of a depth image mean; 0 is no data in all of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DepthCoding {
    /// Millimetres.
    Millimetres,
    /// Whole metres.
    Metres,
    /// Fifths of a millimetre: 5000 a metre (the TUM RGB-D benchmark).
    FifthMillimetres,
    /// Millimetres, turned left by three bits (the Princeton Tracking Benchmark): `mm = v >> 3 | v << 13`.
    Princeton,
}

impl DepthCoding {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Millimetres, Self::Metres, Self::FifthMillimetres, Self::Princeton];

    /// The word for it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Millimetres => "millimetres",
            Self::Metres => "metres",
            Self::FifthMillimetres => "fifth-millimetres",
            Self::Princeton => "princeton",
        }
    }

    /// One number in millimetres; what does not fit is the largest there is.
    pub const fn millimetres(self, value: u16) -> u16 {
        match self {
            Self::Millimetres => value,
            Self::Metres => value.saturating_mul(1000),
            // Data never becomes none.
            Self::FifthMillimetres if value > 0 && value < 5 => 1,
            Self::FifthMillimetres => value / 5,
            Self::Princeton => value.rotate_right(3),
        }
    }

    /// An image in millimetres.
    pub fn decode(self, mut image: Image<u16>) -> Image<u16> {
        if self != Self::Millimetres {
            image.as_mut_slice().iter_mut().for_each(|v| *v = self.millimetres(*v));
        }
        image
    }

    /// What the numbers of an image mean, by what they look like; `None` where it has too little data to tell.
    ///
    /// Numbers turned left by three bits have what was above 8 m in their lowest three bits: hardly ever anything. Whole
    /// metres are small numbers. Where the middle distance would be above 12 m in millimetres, or all numbers are multiples of
    /// five, which of millimetres a fifth is, and not of ten, which distances in centimetres are, they are fifths of one. All else is millimetres.
    pub fn detect(values: &[u16]) -> Option<Self> {
        let mut data: Vec<u16> = values.iter().copied().filter(|v| *v > 0).collect();
        if data.len() < LEAST_DATA {
            return None;
        }
        let middle_at = data.len() / 2;
        let middle = *data.select_nth_unstable(middle_at).1;
        let plausible = |mm: u16| (PLAUSIBLE_MM.0..=PLAUSIBLE_MM.1).contains(&mm);
        let turned = data.iter().filter(|v| **v & 7 <= 1).count() as f64 >= 0.999 * data.len() as f64;
        let share = |n: u16| data.iter().filter(|v| v.is_multiple_of(n)).count() as f64 / data.len() as f64;
        let by_fives = share(5) >= 0.999 && share(10) < 0.9;
        let differing = data.iter().any(|v| *v & 0xff != middle & 0xff);
        Some(if turned && differing && plausible(Self::Princeton.millimetres(middle)) {
            Self::Princeton
        } else if data.iter().all(|v| *v <= MOST_METRES) {
            Self::Metres
        } else if (middle > PLAUSIBLE_MM.1 || by_fives && differing) && plausible(middle / 5) {
            Self::FifthMillimetres
        } else {
            Self::Millimetres
        })
    }
}

/// Fewer pixels with data tell nothing.
const LEAST_DATA: usize = 64;
/// Where the middle of what such a camera sees lies.
const PLAUSIBLE_MM: (u16, u16) = (300, 12_000);
/// No such camera sees farther; nor is anything nearer than this many millimetres.
const MOST_METRES: u16 = 100;

#[cfg(test)]
mod tests {
    use super::*;

    /// Distances from 0.6 to 7.7 m, with holes.
    fn scene() -> Vec<u16> {
        (0..5000_u32).map(|k| if k % 11 == 0 { 0 } else { (600 + k * 37 % 7100) as u16 }).collect()
    }

    #[test]
    fn numbers_become_millimetres() {
        // From the benchmark's description: (v >> 3) | (v << 13).
        for (v, mm) in [(0, 0), (8, 1), (16_000, 2000), (65_168, 8146), (9, 8193)] {
            assert_eq!(DepthCoding::Princeton.millimetres(v), mm);
        }
        assert_eq!(DepthCoding::Metres.millimetres(3), 3000);
        assert_eq!(DepthCoding::Metres.millimetres(70), u16::MAX);
        assert_eq!([0, 1, 5, 7500].map(|v| DepthCoding::FifthMillimetres.millimetres(v)), [0, 1, 1, 1500]);
        assert_eq!(DepthCoding::Millimetres.millimetres(1234), 1234);
        let image = Image::from_vec(vec![0, 16_000, 8, 80], 2, 2).unwrap();
        assert_eq!(DepthCoding::Princeton.decode(image).as_slice(), [0, 2000, 1, 10]);
    }

    #[test]
    fn codings_are_told_by_their_looks() {
        let of = |f: fn(u16) -> u16| scene().into_iter().map(f).collect::<Vec<_>>();
        assert_eq!(DepthCoding::detect(&of(|v| v)), Some(DepthCoding::Millimetres));
        assert_eq!(DepthCoding::detect(&of(|v| v.rotate_left(3))), Some(DepthCoding::Princeton));
        assert_eq!(DepthCoding::detect(&of(|v| v.div_ceil(1000))), Some(DepthCoding::Metres));
        assert_eq!(DepthCoding::detect(&of(|v| v * 5)), Some(DepthCoding::FifthMillimetres));
        // A room whose middle would be plausible in millimetres too.
        assert_eq!(
            DepthCoding::detect(&scene().iter().map(|v| v % 1900 * 5).collect::<Vec<_>>()),
            Some(DepthCoding::FifthMillimetres)
        );
        assert_eq!(DepthCoding::detect(&[1500; 500]), Some(DepthCoding::Millimetres));
        // A camera that knows centimetres.
        assert_eq!(DepthCoding::detect(&of(|v| v / 10 * 10)), Some(DepthCoding::Millimetres));
        // A wall at one distance that happens to be a multiple of eight, and no data at all.
        assert_eq!(DepthCoding::detect(&[2000; 500]), Some(DepthCoding::Millimetres));
        assert_eq!(DepthCoding::detect(&[0; 500]), None);
        assert_eq!(DepthCoding::detect(&scene()[..60]), None);
    }

    #[test]
    fn names_are_those_of_files() {
        for coding in DepthCoding::ALL {
            assert_eq!(serde_json::to_value(coding).unwrap(), coding.name());
        }
    }
}
