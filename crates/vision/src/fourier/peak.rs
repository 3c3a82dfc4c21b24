use super::{Complex32, RealFft2};
use std::f64::consts::TAU;

/// A peak of a response plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Peak {
    /// Column, from 0, may lie between cells.
    pub x: f64,
    /// Row, from 0, may lie between cells.
    pub y: f64,
    /// The response there.
    pub value: f64,
}

/// Index `i` of a plane that wraps around after `n`, as a shift in `[−n/2, n/2)`.
pub const fn signed_shift(i: usize, n: usize) -> isize {
    if 2 * i >= n { i as isize - n as isize } else { i as isize }
}

/// Column, row and value of the highest value of a plane with rows of `width`; the first of equals. Values that are not
/// numbers never win; an empty plane gives `(0, 0, −∞)`.
pub fn highest(plane: &[f32], width: usize) -> (usize, usize, f32) {
    let mut best = (0, f32::NEG_INFINITY);
    for (y, row) in plane.chunks_exact(width.max(1)).enumerate() {
        let top = row.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        if top > best.1 {
            let x = row.iter().position(|&v| v == top).unwrap_or(0);
            best = (y * width + x, top);
        }
    }
    (best.0 % width.max(1), best.0 / width.max(1), best.1)
}

/// The peak of the plane (rows of `width`, wrapping around) near the cell `(x, y)`: the apex of the parabola through the
/// cell and its two neighbours, for each axis by itself.
pub fn parabola_peak(plane: &[f32], width: usize, x: usize, y: usize) -> Peak {
    let height = plane.len() / width.max(1);
    if width == 0 || x >= width || y >= height {
        return Peak { x: x as f64, y: y as f64, value: f64::NEG_INFINITY };
    }
    let at = |x: usize, y: usize| f64::from(plane[(y % height) * width + x % width]);
    let (dx, gain_x) = apex(at(x + width - 1, y), at(x, y), at(x + 1, y));
    let (dy, gain_y) = apex(at(x, y + height - 1), at(x, y), at(x, y + 1));
    Peak { x: x as f64 + dx, y: y as f64 + dy, value: at(x, y) + gain_x + gain_y }
}

/// Offset of the apex from the middle of three values, within ±½, and how much higher it is.
fn apex(before: f64, middle: f64, after: f64) -> (f64, f64) {
    let curvature = before - 2.0 * middle + after;
    let slope = 0.5 * (after - before);
    if curvature < 0.0 {
        let offset = (-slope / curvature).clamp(-0.5, 0.5);
        (offset, offset * slope + 0.5 * offset * offset * curvature)
    } else {
        (0.0, 0.0)
    }
}

/// The peak near `(x, y)` of the response whose spectrum is given, by at most `steps` Newton steps on its Fourier series
/// (danelljan2017eco, section 3.4, after C-COT): the response between the cells is the trigonometric polynomial through
/// them. A step that leaves the neighbourhood of one cell or does not climb is not taken.
pub fn newton_peak(plan: &RealFft2, spectrum: &[Complex32], x: f64, y: f64, steps: usize) -> Peak {
    let mut here = (x, y);
    let mut local = derivatives(plan, spectrum, here);
    for _ in 0..steps {
        let determinant = local.xx * local.yy - local.xy * local.xy;
        if !(determinant > 0.0 && local.xx < 0.0) {
            break;
        }
        let next = (
            here.0 - (local.yy * local.x - local.xy * local.y) / determinant,
            here.1 - (local.xx * local.y - local.xy * local.x) / determinant,
        );
        let moved = derivatives(plan, spectrum, next);
        if (next.0 - x).abs() > 1.0 || (next.1 - y).abs() > 1.0 || moved.value < local.value {
            break;
        }
        let done = (next.0 - here.0).abs().max((next.1 - here.1).abs()) < 1e-4;
        (here, local) = (next, moved);
        if done {
            break;
        }
    }
    Peak { x: here.0, y: here.1, value: local.value }
}

#[derive(Default)]
struct Local {
    value: f64,
    x: f64,
    y: f64,
    xx: f64,
    xy: f64,
    yy: f64,
}

/// Value, gradient and Hessian of the Fourier series at a point.
fn derivatives(plan: &RealFft2, spectrum: &[Complex32], (x, y): (f64, f64)) -> Local {
    let (size, mut sum) = (plan.size(), Local::default());
    let (width, height) = (size.width as f64, size.height as f64);
    let turn_y = (TAU * y / height).sin_cos();
    for (u, column) in spectrum.chunks_exact(size.height).enumerate() {
        let wave_x = TAU * u as f64 / width;
        // The column's own series in y, by recurrence over v = 0, 1, … and −1, −2, …
        let (mut c, mut cy, mut cyy) = ((0.0, 0.0), (0.0, 0.0), (0.0, 0.0));
        let (mut re, mut im) = (1.0f64, 0.0f64);
        let mut term = |bin: Complex32, v: f64, weight: f64, (re, im): (f64, f64)| {
            let (a, b) = (f64::from(bin.re) * weight, f64::from(bin.im) * weight);
            let (r, i) = (a * re - b * im, a * im + b * re);
            let w = TAU * v / height;
            c = (c.0 + r, c.1 + i);
            cy = (cy.0 - w * i, cy.1 + w * r);
            cyy = (cyy.0 - w * w * r, cyy.1 - w * w * i);
        };
        for v in 0..=size.height / 2 {
            if v == 0 {
                term(column[0], 0.0, 1.0, (1.0, 0.0));
            } else if 2 * v == size.height {
                // The Nyquist bin stands for both signs.
                term(column[v], v as f64, 0.5, (re, im));
                term(column[v], -(v as f64), 0.5, (re, -im));
            } else {
                term(column[v], v as f64, 1.0, (re, im));
                term(column[size.height - v], -(v as f64), 1.0, (re, -im));
            }
            (re, im) = (re * turn_y.1 - im * turn_y.0, re * turn_y.0 + im * turn_y.1);
        }
        // Columns above the middle mirror these: their sum with these is twice the real part.
        let weight = plan.multiplicity(u) as f64 / (width * height);
        let (sin, cos) = (wave_x * x).sin_cos();
        let real = |z: (f64, f64)| weight * (z.0 * cos - z.1 * sin);
        let real_turned = |z: (f64, f64)| weight * (-z.1 * cos - z.0 * sin);
        sum.value += real(c);
        sum.y += real(cy);
        sum.yy += real(cyy);
        sum.x += wave_x * real_turned(c);
        sum.xy += wave_x * real_turned(cy);
        sum.xx -= wave_x * wave_x * real(c);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fourier::FftScratch;

    /// A periodic bump with its peak at `(px, py)`.
    fn bump(w: usize, h: usize, px: f64, py: f64) -> Vec<f32> {
        let value = |x: usize, y: usize| {
            let (a, b) = (TAU * (x as f64 - px) / w as f64, TAU * (y as f64 - py) / h as f64);
            (2.0 * (a.cos() + b.cos()) + 0.3 * (a + b).cos()).exp() / 60.0
        };
        (0..w * h).map(|i| value(i % w, i / w) as f32).collect()
    }

    fn spectrum(plan: &RealFft2, plane: &[f32]) -> Vec<Complex32> {
        let mut bins = vec![Complex32::default(); plan.spectrum_len()];
        plan.forward(plane, &mut bins, &mut FftScratch::default());
        bins
    }

    #[test]
    fn peaks_between_the_cells_are_found() {
        for (w, h) in [(32, 24), (33, 25)] {
            for (px, py) in [(10.3, 7.8), (0.45, 23.6), (16.0, 12.0), (31.7, 0.2)] {
                let plane = bump(w, h, px, py);
                let plan = RealFft2::new(w, h);
                let (x, y, value) = highest(&plane, w);
                let shift = |a: f64, b: f64, n: usize| {
                    let d = (a - b).rem_euclid(n as f64);
                    d.min(n as f64 - d)
                };
                let parabola = parabola_peak(&plane, w, x, y);
                assert!(shift(parabola.x, px, w) < 0.1 && shift(parabola.y, py, h) < 0.1, "{parabola:?} {px} {py}");
                let newton = newton_peak(&plan, &spectrum(&plan, &plane), x as f64, y as f64, 5);
                assert!(shift(newton.x, px, w) < 2e-3 && shift(newton.y, py, h) < 2e-3, "{newton:?} {px} {py}");
                assert!(newton.value >= f64::from(value) - 1e-6);
            }
        }
    }

    #[test]
    fn derivatives_are_those_of_the_series() {
        let plan = RealFft2::new(16, 12);
        let bins = spectrum(&plan, &bump(16, 12, 5.2, 6.7));
        let at = |x: f64, y: f64| derivatives(&plan, &bins, (x, y));
        let (x, y, e) = (4.6, 7.1, 1e-5);
        let d = at(x, y);
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-6 * (1.0 + a.abs()), "{a} {b}");
        near(d.x, (at(x + e, y).value - at(x - e, y).value) / (2.0 * e));
        near(d.y, (at(x, y + e).value - at(x, y - e).value) / (2.0 * e));
        near(d.xx, (at(x + e, y).x - at(x - e, y).x) / (2.0 * e));
        near(d.xy, (at(x, y + e).x - at(x, y - e).x) / (2.0 * e));
        near(d.yy, (at(x, y + e).y - at(x, y - e).y) / (2.0 * e));
    }

    #[test]
    fn nothing_is_no_peak() {
        assert_eq!(highest(&[], 0), (0, 0, f32::NEG_INFINITY));
        assert_eq!(highest(&[f32::NAN, 1.0, 3.0, 3.0], 2), (0, 1, 3.0));
        assert_eq!((signed_shift(0, 8), signed_shift(3, 8), signed_shift(4, 8), signed_shift(7, 8)), (0, 3, -4, -1));
        let flat = parabola_peak(&[1.0; 16], 4, 2, 2);
        assert_eq!((flat.x, flat.y, flat.value), (2.0, 2.0, 1.0));
    }
}
