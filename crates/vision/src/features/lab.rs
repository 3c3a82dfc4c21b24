use pursuit_imaging::Rgb8;

/// White point D65 of the 2° observer (IEC 61966-2-1), Y = 1.
const WHITE: [f64; 3] = [0.950_47, 1.0, 1.088_83];

/// CIE 1976 L*a*b* (L* 0–100, a* and b* about ±110) of an sRGB colour (IEC 61966-2-1, D65).
pub fn srgb_to_lab(rgb: Rgb8) -> [f64; 3] {
    let [r, g, b] = rgb.map(|code| {
        let v = f64::from(code) / 255.0;
        if v <= 0.040_45 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
    });
    let xyz = [
        0.412_456_4 * r + 0.357_576_1 * g + 0.180_437_5 * b,
        0.212_672_9 * r + 0.715_152_2 * g + 0.072_175_0 * b,
        0.019_333_9 * r + 0.119_192_0 * g + 0.950_304_1 * b,
    ];
    // CIE 15, with the exact fractions (6/29)³ and (29/6)²/3.
    let f = |t: f64| {
        const DELTA: f64 = 6.0 / 29.0;
        if t > DELTA.powi(3) { t.cbrt() } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 }
    };
    let [x, y, z] = [f(xyz[0] / WHITE[0]), f(xyz[1] / WHITE[1]), f(xyz[2] / WHITE[2])];
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_colors() {
        // Published values of the sRGB primaries (D65, 2°), to the digits they are usually given with.
        for (rgb, want) in [
            ([255, 255, 255], [100.0, 0.0, 0.0]),
            ([0, 0, 0], [0.0, 0.0, 0.0]),
            ([255, 0, 0], [53.24, 80.09, 67.20]),
            ([0, 255, 0], [87.73, -86.18, 83.18]),
            ([0, 0, 255], [32.30, 79.19, -107.86]),
        ] {
            for (got, want) in srgb_to_lab(rgb).iter().zip(want) {
                assert!((got - want).abs() < 0.02, "{rgb:?}: {got} is not {want}");
            }
        }
    }
}
