use super::refine::{FLAT, ROBUST, Refiner};
use super::tests::{errors, flow, similar, warped};
use super::*;
use crate::flow::tests::texture;
use pursuit_imaging::Image;

/// The motions after one round whose equations are solved exactly, by definition and in double precision.
fn slow(images: [&Image<u8>; 2], flow: &Plane, params: &RefinementParams) -> Vec<[f64; 2]> {
    let Size { width, height } = flow.size;
    let n = width * height;
    let clamped = |x: isize, y: isize| {
        (x.clamp(0, width as isize - 1) as usize) + width * (y.clamp(0, height as isize - 1) as usize)
    };
    let pixel = |image: &Image<u8>, x: isize, y: isize| f64::from(image.view().clamped(x, y));
    let motion = |k: usize| [f64::from(flow.u[k]), f64::from(flow.v[k])];
    let place = |k: usize| ((k % width) as f64 + motion(k)[0], (k / width) as f64 + motion(k)[1]);
    let is_known = |k: usize| {
        let (x, y) = place(k);
        (0.0..=width as f64 - 1.0).contains(&x) && (0.0..=height as f64 - 1.0).contains(&y)
    };
    let before = |k: usize| pixel(images[0], (k % width) as isize, (k / width) as isize);
    let after = |k: usize| {
        if !is_known(k) {
            return before(k);
        }
        let (x, y) = place(k);
        let (i, j) = (x.floor(), y.floor());
        let (u, v, i, j) = (x - i, y - j, i as isize, j as isize);
        let at = |dx, dy| pixel(images[1], i + dx, j + dy);
        (1.0 - v) * ((1.0 - u) * at(0, 0) + u * at(1, 0)) + v * ((1.0 - u) * at(0, 1) + u * at(1, 1))
    };
    let mean: Vec<f64> = (0..n).map(|k| 0.5 * (before(k) + after(k))).collect();
    let change: Vec<f64> = (0..n).map(|k| after(k) - before(k)).collect();
    // Along x, or along y.
    let derivative = |plane: &[f64], down: bool| -> Vec<f64> {
        let of = |k: usize| {
            let at = |by: isize| {
                let (x, y) = ((k % width) as isize, (k / width) as isize);
                plane[if down { clamped(x, y + by) } else { clamped(x + by, y) }]
            };
            (at(-2) - 8.0 * at(-1) + 8.0 * at(1) - at(2)) / 12.0
        };
        (0..n).map(of).collect()
    };
    let (ix, iy) = (derivative(&mean, false), derivative(&mean, true));
    let (xt, yt) = (derivative(&change, false), derivative(&change, true));
    let (xx, xy, yy) = (derivative(&ix, false), derivative(&ix, true), derivative(&iy, true));
    let slope = |s: f64| 0.5 / (s + f64::from(ROBUST * ROBUST)).sqrt();
    let flat = f64::from(FLAT);
    // Unknown 2k is the step along x of pixel k, 2k + 1 that along y; the last column is the right-hand side.
    let mut rows = vec![vec![0.0; 2 * n + 1]; 2 * n];
    for k in (0..n).filter(|&k| is_known(k)) {
        // Constancies: s (g · d + t)² each, s being weight times Ψ′ times normalization.
        let by = [
            1.0 / (ix[k].powi(2) + iy[k].powi(2) + flat),
            1.0 / (xx[k].powi(2) + xy[k].powi(2) + flat),
            1.0 / (xy[k].powi(2) + yy[k].powi(2) + flat),
        ];
        let brightness = params.brightness * slope(by[0] * change[k].powi(2));
        let gradients = params.gradients * slope(by[1] * xt[k].powi(2) + by[2] * yt[k].powi(2));
        for (s, g, t) in [
            (brightness * by[0], [ix[k], iy[k]], change[k]),
            (gradients * by[1], [xx[k], xy[k]], xt[k]),
            (gradients * by[2], [xy[k], yy[k]], yt[k]),
        ] {
            for i in 0..2 {
                for j in 0..2 {
                    rows[2 * k + i][2 * k + j] += s * g[i] * g[j];
                }
                rows[2 * k + i][2 * n] -= s * g[i] * t;
            }
        }
    }
    let smooth = |k: usize| {
        let (x, y) = ((k % width) as isize, (k / width) as isize);
        let part = |c: usize| {
            let at = |dx, dy| motion(clamped(x + dx, y + dy))[c];
            (0.5 * (at(1, 0) - at(-1, 0))).powi(2) + (0.5 * (at(0, 1) - at(0, -1))).powi(2)
        };
        params.smoothness * slope(part(0) + part(1))
    };
    for k in 0..n {
        let (x, y) = (k % width, k / width);
        let others = [(x + 1 < width).then_some(k + 1), (y + 1 < height).then_some(k + width)];
        for other in others.into_iter().flatten() {
            // weight · |(m_k + d_k) − (m_o + d_o)|²
            let weight = 0.5 * (smooth(k) + smooth(other));
            for c in 0..2 {
                let off = motion(other)[c] - motion(k)[c];
                for (at, to, off) in [(k, other, off), (other, k, -off)] {
                    rows[2 * at + c][2 * at + c] += weight;
                    rows[2 * at + c][2 * to + c] -= weight;
                    rows[2 * at + c][2 * n] += weight * off;
                }
            }
        }
    }
    let step = solved(rows);
    (0..n).map(|k| [motion(k)[0] + step[2 * k], motion(k)[1] + step[2 * k + 1]]).collect()
}

/// Gauss's elimination of a positive definite system.
fn solved(mut rows: Vec<Vec<f64>>) -> Vec<f64> {
    let n = rows.len();
    for k in 0..n {
        let pivot = rows[k].clone();
        for row in &mut rows[k + 1..] {
            let share = row[k] / pivot[k];
            if share != 0.0 {
                row.iter_mut().zip(&pivot).skip(k).for_each(|(a, b)| *a -= share * b);
            }
        }
    }
    let mut found = vec![0.0; n];
    for k in (0..n).rev() {
        let rest: f64 = (k + 1..n).map(|j| rows[k][j] * found[j]).sum();
        found[k] = (rows[k][n] - rest) / rows[k][k];
    }
    found
}

fn guess(size: Size) -> Plane {
    let at = |k: usize, c: usize| {
        let (x, y) = ((k % size.width) as f32, (k / size.width) as f32);
        [1.4 + 0.3 * (0.5 * x).sin() - 0.02 * y, -0.8 + 0.2 * (0.7 * y).cos() + 0.03 * x][c]
    };
    let plane = |c: usize| (0..size.area()).map(|k| at(k, c)).collect();
    Plane { size, u: plane(0), v: plane(1) }
}

#[test]
fn a_round_solves_the_equations_of_the_definition() {
    let (width, height) = (13, 9);
    let size = Size::new(width, height);
    let first = texture(width, height, [256, 0, 300_000, 0, 256, 300_000]);
    let second = texture(width, height, [256, 0, 299_600, 0, 256, 300_250]);
    for (brightness, gradients, smoothness) in [(5.0, 10.0, 10.0), (5.0, 0.0, 30.0), (0.0, 10.0, 1.0)] {
        let params = RefinementParams { rounds: 1, sweeps: 1000, brightness, gradients, smoothness };
        let mut fast = guess(size);
        let wanted = slow([&first, &second], &fast, &params);
        let before = fast.clone();
        let mut refiner = Refiner::default();
        refiner.run([&first, &second], &mut fast, &params, 0);
        let off = |k: usize| (f64::from(fast.u[k]) - wanted[k][0]).hypot(f64::from(fast.v[k]) - wanted[k][1]);
        let moved = |k: usize| (before.u[k] - fast.u[k]).hypot(before.v[k] - fast.v[k]);
        let most = (0..size.area()).map(off).fold(0.0, f64::max);
        let far = (0..size.area()).map(moved).fold(0.0, f32::max);
        assert!(most < 2e-3 && far > 0.2, "{params:?}: {most} off, moved by {far}");
        // A few sweeps go part of the way: less of it the more a pixel hangs on those around it.
        let mut near = guess(size);
        refiner.run([&first, &second], &mut near, &RefinementParams { sweeps: 5, ..params }, 0);
        let mean = |plane: &Plane| {
            let off = |k: usize| (f64::from(plane.u[k]) - wanted[k][0]).hypot(f64::from(plane.v[k]) - wanted[k][1]);
            (0..size.area()).map(off).sum::<f64>() / size.area() as f64
        };
        assert!(mean(&near) < 0.8 * mean(&before), "{params:?}: {} of {}", mean(&near), mean(&before));
    }
}

fn refined(rounds: usize) -> DenseFlowParams {
    DenseFlowParams {
        refinement: RefinementParams { rounds, ..RefinementParams::kroeger2016() },
        ..DenseFlowParams::default()
    }
}

#[test]
fn refined_flow_is_nearer_to_the_truth() {
    let size = Size::new(320, 240);
    for (name, map) in [
        ("a shift", similar(size, 0.0, 1.0, (5.4, -3.3))),
        ("a turn", similar(size, 4.0, 1.0, (1.0, 2.0))),
        ("a zoom", similar(size, 0.0, 1.06, (0.0, -1.0))),
        ("all of them", similar(size, -3.0, 0.95, (6.0, 4.0))),
    ] {
        let ([first, second], truth) = warped(size, map);
        let error = |rounds| errors(&flow([&first, &second], refined(rounds)), &truth, 12.0).1;
        let (plain, better) = (error(0), error(2));
        println!("{name}: {plain:.4} px, refined {:.4}, {better:.4}", error(1));
        assert!(better < 0.9 * plain, "{name}: {better} refined, {plain} without");
    }
}

#[test]
fn still_flat_and_tiny_pictures_are_refined_to_numbers() {
    let still = texture(100, 80, [256, 0, 300_000, 0, 256, 300_000]);
    let flat = Image::filled(100, 80, 77_u8).unwrap();
    for (a, b) in [(&still, &still), (&flat, &flat)] {
        let found = flow([a, b], refined(3));
        assert!(found.image().as_slice().iter().all(|m| m[0].hypot(m[1]) < 1e-3));
    }
    let found = flow([&still, &flat], DenseFlowParams { damping: 0.0, ..refined(3) });
    assert!(found.image().as_slice().iter().flatten().all(|m| m.is_finite()));
    let mut refiner = Refiner::default();
    for (width, height) in [(1, 1), (1, 7), (3, 2), (5, 4), (6, 1)] {
        let image = |k: usize| Image::from_fn(width, height, |x, y| (x * 50 + y * 31 + k) as u8).unwrap();
        let mut plane = guess(Size::new(width, height));
        plane.u[0] = f32::NAN;
        refiner.run([&image(0), &image(9)], &mut plane, &RefinementParams::kroeger2016(), 2);
        plane = guess(Size::new(width, height));
        refiner.run([&image(0), &image(9)], &mut plane, &RefinementParams::kroeger2016(), 2);
        assert!(plane.u.iter().chain(&plane.v).all(|v| v.is_finite()), "{width} x {height}");
    }
}
