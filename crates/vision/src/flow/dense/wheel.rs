//! Motions as colours: direction by hue, length by saturation, on the wheel of baker2007 (“A database and evaluation
//! methodology for optical flow”), whose hues are spaced as far as they are told apart.

use pursuit_imaging::Rgb8;

/// Hues between red and yellow, yellow and green, green and cyan, cyan and blue, blue and magenta, magenta and red.
const STEPS: [usize; 6] = [15, 6, 4, 11, 13, 6];
/// All of them.
const HUES: usize = 55;

/// The pure hue at `at` of the wheel's 55, red, green and blue of 0 to 1.
fn hue(at: usize) -> [f32; 3] {
    let mut rest = at % HUES;
    for (k, &steps) in STEPS.iter().enumerate() {
        if rest < steps {
            let part = rest as f32 / steps as f32;
            return match k {
                0 => [1.0, part, 0.0],
                1 => [1.0 - part, 1.0, 0.0],
                2 => [0.0, 1.0, part],
                3 => [0.0, 1.0 - part, 1.0],
                4 => [part, 0.0, 1.0],
                _ => [1.0, 0.0, 1.0 - part],
            };
        }
        rest -= steps;
    }
    [1.0, 0.0, 0.0]
}

/// The colour of a motion of (u, v) where `longest` (> 0, same unit) is fully saturated: white where nothing moves, darker beyond
/// `longest`, black for what is no number. Motion to the right is red, downward yellow, to the left green to cyan, upward blue to
/// violet.
pub fn color([u, v]: [f32; 2], longest: f32) -> Rgb8 {
    let (u, v) = (u / longest, v / longest);
    let length = u.hypot(v);
    if !length.is_finite() {
        return [0; 3];
    }
    let turn = (-v).atan2(-u) / std::f32::consts::PI;
    let at = (turn + 1.0) / 2.0 * (HUES - 1) as f32;
    let first = at.floor();
    let (part, first) = (at - first, first as usize);
    let (a, b) = (hue(first), hue(first + 1));
    std::array::from_fn(|k| {
        let pure = a[k] + part * (b[k] - a[k]);
        let value = if length <= 1.0 { 1.0 - length * (1.0 - pure) } else { 0.75 * pure };
        (255.0 * value) as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_have_the_wheels_colours() {
        assert_eq!(STEPS.iter().sum::<usize>(), HUES);
        assert_eq!(color([0.0, 0.0], 1.0), [255; 3]);
        assert_eq!(color([1.0, 0.0], 1.0), [255, 0, 0]);
        // The wheel's colours as the authors' program has them for unit motions down, left and up.
        let near = |a: Rgb8, b: Rgb8| a.iter().zip(b).all(|(a, b)| a.abs_diff(b) <= 2);
        let at = |i: f32| {
            let (a, b, part) = (hue(i as usize), hue(i as usize + 1), i.fract());
            std::array::from_fn(|k| (255.0 * (a[k] + part * (b[k] - a[k]))) as u8)
        };
        for (motion, place) in [([0.0, 1.0], 13.5), ([-1.0, 0.0], 27.0), ([0.0, -1.0], 40.5)] {
            let place = if motion == [-1.0, 0.0] { 54.0 * 0.5 } else { place };
            assert!(near(color(motion, 1.0), at(place)), "{motion:?} {:?} {:?}", color(motion, 1.0), at(place));
        }
        let [r, g, b] = color([0.0, 1.0], 1.0);
        assert!(r == 255 && g > 200 && b == 0, "downward is yellow: {r} {g} {b}");
    }

    #[test]
    fn length_is_saturation_and_what_is_too_long_is_darker() {
        let half = color([2.0, 0.0], 4.0);
        assert_eq!(half, [255, 127, 127]);
        assert_eq!(color([9.0, 0.0], 4.0), [191, 0, 0]);
        for bad in [[f32::NAN, 0.0], [0.0, f32::INFINITY]] {
            assert_eq!(color(bad, 4.0), [0; 3]);
        }
    }

    #[test]
    fn neighbouring_directions_have_neighbouring_colours() {
        let around = |k: u32| {
            let (s, c) = (k as f32 * std::f32::consts::TAU / 720.0).sin_cos();
            color([c, s], 1.0)
        };
        for k in 0..720 {
            let apart = around(k).iter().zip(around(k + 1)).map(|(a, b)| a.abs_diff(b)).max().unwrap_or(0);
            assert!(apart < 46, "{k}: {:?} {:?}", around(k), around(k + 1));
        }
    }
}
