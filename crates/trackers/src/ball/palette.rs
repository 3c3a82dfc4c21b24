//! Colours of balls: presets, and ranges learned from a box.

use super::color_blobs::ColorBlobFinder;
use pursuit_geometry::BBox;
use pursuit_vision::color::{HUES, Hsv8, HsvRange};

pursuit_parameters::choices! {
    /// Which colour to look for.
    pub enum BallColor {
        /// Learned from the box.
        Auto = "auto",
        /// Table-tennis and tennis balls, dandelions.
        Yellow = "yellow",
        /// Table-tennis balls, basketballs, oranges.
        Orange = "orange",
        /// From yellowish green to turquoise.
        Green = "green",
        /// Bright and hardly saturated.
        White = "white",
        /// Through the wrap of hue.
        Red = "red",
        /// From cyan to violet.
        Blue = "blue",
    }
}

/// The presets that have a hue.
pub(super) const SATURATED: [BallColor; 5] =
    [BallColor::Orange, BallColor::Yellow, BallColor::Green, BallColor::Red, BallColor::Blue];

impl BallColor {
    /// The preset's range; `None` for [`Auto`](Self::Auto).
    ///
    /// Wide on purpose, and overlapping where people's words do (a tennis ball is yellow or green): cameras and lamps
    /// shift hues by ten codes and more. Shape, motion and the learned range do the rest.
    pub fn range(self) -> Option<HsvRange> {
        let hue = |hue_low, hue_high, saturation_low, value_low| {
            Some(HsvRange { hue_low, hue_high, saturation_low, value_low, ..HsvRange::ALL })
        };
        match self {
            Self::Auto => None,
            Self::Yellow => hue(17, 44, 80, 70),
            Self::Orange => hue(3, 22, 90, 70),
            Self::Green => hue(29, 92, 55, 40),
            Self::Red => hue(166, 9, 90, 50),
            Self::Blue => hue(92, 132, 80, 40),
            Self::White => Some(HsvRange { saturation_high: 60, value_low: 150, ..HsvRange::ALL }),
        }
    }

    /// The range at increasing strictness, for detection: a like-coloured, paler background (skin behind an orange ball,
    /// dry grass behind a yellow one) parts from the ball at one of the levels.
    pub(super) fn ladder(self) -> impl Iterator<Item = HsvRange> {
        let steps: [u8; 4] = [0, 35, 60, 90];
        self.range().into_iter().flat_map(move |range| {
            steps.into_iter().map(move |step| {
                if matches!(self, Self::White) {
                    HsvRange {
                        value_low: range.value_low.saturating_add(step),
                        saturation_high: 60 - step / 3,
                        ..range
                    }
                } else {
                    HsvRange { saturation_low: range.saturation_low.saturating_add(step), ..range }
                }
            })
        })
    }
}

/// Inner part of a box, as a fraction of its half axes, that surely shows the ball.
const CORE: f64 = 0.6;
/// The ring around a box that shows its surroundings, in half axes.
const RING: (f64, f64) = (1.35, 1.9);
/// Below this median saturation a thing has no hue worth the name.
const GRAY: u8 = 45;

/// The range of colours that tells what is in the middle of `bbox` from what is around it; `blobs` has looked at the box and
/// its surroundings. Within `prior`'s hues where there is a prior.
pub(super) fn learn(blobs: &ColorBlobFinder, bbox: &BBox, prior: Option<HsvRange>) -> HsvRange {
    let mut core = Vec::new();
    blobs.sample(bbox, 0.0..CORE, |hsv| core.push(hsv));
    if let Some(prior) = prior {
        let fitting: Vec<Hsv8> = core.iter().copied().filter(|c| prior.contains(*c)).collect();
        // A box that hardly shows the colour named (a loose box, a hand before the ball) teaches nothing about it.
        if fitting.len() * 5 < core.len() || fitting.is_empty() {
            return prior;
        }
        core = fitting;
    }
    let mut around = Vec::new();
    blobs.sample(bbox, RING.0..RING.1, |hsv| around.push(hsv));

    let median = quantile(core.iter().map(|c| c[1]), 0.5).unwrap_or(0);
    let white = prior.is_some_and(|p| p.saturation_high < 255);
    if white || (prior.is_none() && median < GRAY) { gray_range(&core) } else { hue_range(&core, &around, prior) }
}

fn gray_range(core: &[Hsv8]) -> HsvRange {
    let value = |q| quantile(core.iter().map(|c| c[2]), q).unwrap_or(128);
    let (low, high) = (value(0.1), value(0.9));
    let saturation = quantile(core.iter().map(|c| c[1]), 0.9).unwrap_or(0);
    HsvRange {
        saturation_high: saturation.saturating_add(20).max(40),
        value_low: low.saturating_sub(35),
        // Bright things have brighter highlights.
        value_high: if high > 150 { 255 } else { high.saturating_add(35) },
        ..HsvRange::ALL
    }
}

fn hue_range(core: &[Hsv8], around: &[Hsv8], prior: Option<HsvRange>) -> HsvRange {
    let middle = mean_hue(core);
    let apart = quantile(core.iter().filter(|c| c[1] >= GRAY / 2).map(|c| hue_distance(c[0], middle)), 0.9);
    let reach = apart.unwrap_or(8).saturating_add(4).clamp(8, 16);
    let mut range = HsvRange {
        hue_low: hue_at(middle, -i16::from(reach)),
        hue_high: hue_at(middle, i16::from(reach)),
        ..HsvRange::ALL
    };
    if let Some(prior) = prior {
        // Walk each end inwards to the prior's hues.
        let inside = |hue| prior.contains([hue, prior.saturation_low, prior.value_low]);
        let end = |from: u8, step: i16| (0..=i16::from(reach)).map(|k| hue_at(from, k * step)).find(|h| inside(*h));
        range.hue_low = end(range.hue_low, 1).unwrap_or(prior.hue_low);
        range.hue_high = end(range.hue_high, -1).unwrap_or(prior.hue_high);
    }
    let value = quantile(core.iter().map(|c| c[2]), 0.1).unwrap_or(80);
    range.value_low = (value / 2).max(25);

    let saturation = |q| quantile(core.iter().map(|c| c[1]), q).map_or(0.0, f64::from);
    let (least, low, middle) = (saturation(0.1), saturation(0.25), saturation(0.5));
    // Half way to the like-coloured surroundings where they are paler, else half the ball's own.
    let rivals = || around.iter().filter(|c| range.contains(**c)).map(|c| c[1]);
    let rival = (rivals().count() * 20 > around.len()).then(|| quantile(rivals(), 0.95)).flatten().map(f64::from);
    let cut = match rival {
        Some(rival) if rival < low => f64::midpoint(rival, least.max(rival)),
        _ => 0.5 * middle,
    };
    range.saturation_low = cut.clamp(0.5 * middle, 0.85 * middle).max(25.0) as u8;
    range
}

/// Mean direction of hue, weighed by saturation.
fn mean_hue(colors: &[Hsv8]) -> u8 {
    let angle = |hue: u8| f64::from(hue) * std::f64::consts::TAU / f64::from(HUES);
    let (x, y) = colors
        .iter()
        .fold((0.0, 0.0), |(x, y), &[h, s, _]| (x + f64::from(s) * angle(h).cos(), y + f64::from(s) * angle(h).sin()));
    let hue = y.atan2(x).rem_euclid(std::f64::consts::TAU) / std::f64::consts::TAU * f64::from(HUES);
    hue.round() as u8 % HUES
}

/// The hue `offset` codes on, around the circle.
fn hue_at(hue: u8, offset: i16) -> u8 {
    (i16::from(hue) + offset).rem_euclid(i16::from(HUES)) as u8
}

fn hue_distance(a: u8, b: u8) -> u8 {
    let apart = a.abs_diff(b);
    apart.min(HUES - apart)
}

/// The value below which the fraction `q` of `values` lies; `None` without values.
fn quantile(values: impl Iterator<Item = u8>, q: f64) -> Option<u8> {
    let mut histogram = [0usize; 256];
    let mut count = 0;
    for v in values {
        histogram[usize::from(v)] += 1;
        count += 1;
    }
    let wanted = (q * count as f64) as usize;
    let mut seen = 0;
    (0..=255u8).find(|v| {
        seen += histogram[usize::from(*v)];
        seen > wanted
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_and_mean_hue() {
        assert_eq!(quantile(0..=99, 0.5), Some(50));
        assert_eq!(quantile([7].into_iter(), 0.95), Some(7));
        assert_eq!(quantile([].into_iter(), 0.5), None);
        assert_eq!(mean_hue(&[[178, 200, 9], [4, 200, 9]]), 1, "red wraps");
        assert_eq!(hue_distance(178, 4), 6);
        assert_eq!((hue_at(179, 16), hue_at(4, -16), hue_at(120, 16)), (15, 168, 136));
    }

    #[test]
    fn every_preset_holds_its_own_colour() {
        let examples = [
            (BallColor::Yellow, [240, 220, 20]),
            (BallColor::Orange, [235, 130, 30]),
            (BallColor::Green, [40, 160, 60]),
            (BallColor::White, [235, 235, 225]),
            (BallColor::Red, [200, 25, 40]),
            (BallColor::Blue, [30, 60, 190]),
            // A tennis ball is both.
            (BallColor::Yellow, [200, 220, 60]),
            (BallColor::Green, [190, 220, 60]),
        ];
        for (color, rgb) in examples {
            assert!(color.range().unwrap().contains(pursuit_vision::color::rgb_to_hsv(rgb)), "{color:?}");
            assert_eq!(color.ladder().count(), 4);
        }
        assert_eq!(BallColor::Auto.ladder().count(), 0);
    }
}
