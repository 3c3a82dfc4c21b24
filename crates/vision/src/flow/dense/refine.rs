//! The variational refinement of a level (section 2.3 of kroeger2016, after Brox, Bruhn, Papenberg and Weickert 2004, “High accuracy
//! optical flow estimation based on a theory for warping”): of all fields near the one that the search found, that whose brightness and
//! gradients stay most constant and which is smoothest, each by a robust measure.

use super::{Plane, RefinementParams};
use multiversion::multiversion;
use pursuit_geometry::Size;
use pursuit_imaging::Image;

/// ε of the robust measure Ψ(s²) = √(s² + ε²), pixels of motion or normalized differences.
pub(super) const ROBUST: f32 = 0.001;
/// ζ² by which the squared gradient that a constancy is divided by is kept from zero, (grey codes per pixel)².
pub(super) const FLAT: f32 = 0.01;
/// Over-relaxation ω of the solver.
pub(super) const RELAXATION: f32 = 1.6;

/// Refines; owns its scratch.
#[derive(Debug, Clone, Default)]
pub(super) struct Refiner {
    /// Mean of the first picture and the second one moved back, and the second less the first; where the second is not known both are 0.
    mean: Vec<f32>,
    change: Vec<f32>,
    known: Vec<bool>,
    /// Derivatives along x and y of the mean and of the change, and of the derivatives of the mean: xx, xy, yy.
    mean_x: Vec<f32>,
    mean_y: Vec<f32>,
    change_x: Vec<f32>,
    change_y: Vec<f32>,
    xx: Vec<f32>,
    xy: Vec<f32>,
    yy: Vec<f32>,
    /// Of each pixel the equations of its step, and the weight of smoothness to the right and below.
    equations: Vec<Equation>,
    right: Vec<f32>,
    below: Vec<f32>,
    /// The step, and the motion with it.
    step: Vec<[f32; 2]>,
}

/// `a du + b dv = p`, `b du + c dv = q`, without smoothness.
#[derive(Debug, Clone, Copy, Default)]
struct Equation {
    a: f32,
    b: f32,
    c: f32,
    p: f32,
    q: f32,
}

impl Refiner {
    /// Refines the flow from `first` to `second` on a level, θ_vo = rounds · (level + 1) times from new derivatives.
    pub fn run(&mut self, [first, second]: [&Image<u8>; 2], flow: &mut Plane, params: &RefinementParams, level: usize) {
        for _ in 0..params.rounds * (level + 1) {
            self.move_back(first, second, flow);
            self.derive(flow.size);
            self.weigh(flow, params);
            self.step.clear();
            self.step.resize(flow.size.area(), [0.0; 2]);
            for _ in 0..params.sweeps {
                for color in 0..2 {
                    sweep(&self.equations, [&self.right, &self.below], &mut self.step, flow, color);
                }
            }
            for (k, [du, dv]) in self.step.iter().enumerate() {
                flow.u[k] += du;
                flow.v[k] += dv;
            }
        }
    }

    /// The second picture where the flow leads, as it would be where it comes from.
    fn move_back(&mut self, first: &Image<u8>, second: &Image<u8>, flow: &Plane) {
        let Size { width, height } = flow.size;
        for plane in [&mut self.mean, &mut self.change] {
            plane.clear();
        }
        self.known.clear();
        let (right, bottom) = ((width - 1) as f32, (height - 1) as f32);
        for y in 0..height {
            for (x, before) in first.row(y).iter().enumerate() {
                let (before, k) = (f32::from(*before), y * width + x);
                let (px, py) = (x as f32 + flow.u[k], y as f32 + flow.v[k]);
                // What is no number is not inside.
                let inside = (0.0..=right).contains(&px) && (0.0..=bottom).contains(&py);
                let after = if inside { between(second, px, py) } else { before };
                self.known.push(inside);
                self.mean.push(0.5 * (before + after));
                self.change.push(after - before);
            }
        }
    }

    fn derive(&mut self, size: Size) {
        derivative_x(&self.mean, size, &mut self.mean_x);
        derivative_y(&self.mean, size, &mut self.mean_y);
        derivative_x(&self.change, size, &mut self.change_x);
        derivative_y(&self.change, size, &mut self.change_y);
        derivative_x(&self.mean_x, size, &mut self.xx);
        derivative_y(&self.mean_x, size, &mut self.xy);
        derivative_y(&self.mean_y, size, &mut self.yy);
    }

    /// The equations of every pixel, weighed by what is robust about them now.
    fn weigh(&mut self, flow: &Plane, params: &RefinementParams) {
        let Size { width, height } = flow.size;
        let (delta, gamma, alpha) = (params.brightness as f32, params.gradients as f32, params.smoothness as f32);
        self.equations.clear();
        for k in 0..flow.size.area() {
            if !self.known[k] {
                self.equations.push(Equation::default());
                continue;
            }
            let (ix, iy, it) = (self.mean_x[k], self.mean_y[k], self.change[k]);
            let (xx, xy, yy) = (self.xx[k], self.xy[k], self.yy[k]);
            let (xt, yt) = (self.change_x[k], self.change_y[k]);
            let by = 1.0 / (ix * ix + iy * iy + FLAT);
            let by_x = 1.0 / (xx * xx + xy * xy + FLAT);
            let by_y = 1.0 / (xy * xy + yy * yy + FLAT);
            let brightness = delta * by * slope(by * it * it);
            let gradients = gamma * slope(by_x * xt * xt + by_y * yt * yt);
            let (of_x, of_y) = (gradients * by_x, gradients * by_y);
            self.equations.push(Equation {
                a: brightness * ix * ix + of_x * xx * xx + of_y * xy * xy,
                b: brightness * ix * iy + of_x * xx * xy + of_y * xy * yy,
                c: brightness * iy * iy + of_x * xy * xy + of_y * yy * yy,
                p: -(brightness * ix * it + of_x * xx * xt + of_y * xy * yt),
                q: -(brightness * iy * it + of_x * xy * xt + of_y * yy * yt),
            });
        }
        // Smoothness of a pixel by the differences to its neighbours; between two it is the mean of theirs.
        let at = |plane: &[f32], x: usize, y: usize| plane[y * width + x];
        self.change.clear();
        for y in 0..height {
            for x in 0..width {
                let (l, r) = (x.saturating_sub(1), (x + 1).min(width - 1));
                let (t, b) = (y.saturating_sub(1), (y + 1).min(height - 1));
                let squared = |plane: &[f32]| {
                    let (dx, dy) =
                        (0.5 * (at(plane, r, y) - at(plane, l, y)), 0.5 * (at(plane, x, b) - at(plane, x, t)));
                    dx * dx + dy * dy
                };
                self.change.push(alpha * slope(squared(&flow.u) + squared(&flow.v)));
            }
        }
        let weights = &self.change;
        self.right.clear();
        self.below.clear();
        for y in 0..height {
            for x in 0..width {
                let own = at(weights, x, y);
                self.right.push(if x + 1 < width { 0.5 * (own + at(weights, x + 1, y)) } else { 0.0 });
                self.below.push(if y + 1 < height { 0.5 * (own + at(weights, x, y + 1)) } else { 0.0 });
            }
        }
    }
}

/// Ψ′ of the robust measure.
fn slope(squared: f32) -> f32 {
    0.5 / (squared + ROBUST * ROBUST).sqrt()
}

/// A picture between its pixels, bilinear, at a place inside, whole numbers the middles of pixels.
fn between(image: &Image<u8>, x: f32, y: f32) -> f32 {
    let (i, j) = (x as usize, y as usize);
    let (u, v) = (x - i as f32, y - j as f32);
    let next = (i + 1).min(image.width() - 1);
    let along = |row: &[u8]| {
        let (a, b) = (f32::from(row[i]), f32::from(row[next]));
        a + u * (b - a)
    };
    let (above, below) = (along(image.row(j)), along(image.row((j + 1).min(image.height() - 1))));
    above + v * (below - above)
}

/// (1, −8, 0, 8, −1)/12 along the rows; the border goes on.
fn derivative_x(plane: &[f32], Size { width, height }: Size, out: &mut Vec<f32>) {
    out.clear();
    for y in 0..height {
        let row = &plane[y * width..(y + 1) * width];
        let at = |x: usize, by: isize| row[x.saturating_add_signed(by).min(width - 1)];
        let of = |x: usize| (8.0 * (at(x, 1) - at(x, -1)) - (at(x, 2) - at(x, -2))) / 12.0;
        let middle = width.saturating_sub(2).max(2);
        out.extend((0..width.min(2)).map(of));
        out.extend(row.windows(5).map(|w| (8.0 * (w[3] - w[1]) - (w[4] - w[0])) / 12.0));
        out.extend((middle..width).map(of));
    }
}

/// The same down the columns.
fn derivative_y(plane: &[f32], Size { width, height }: Size, out: &mut Vec<f32>) {
    out.clear();
    for y in 0..height {
        let row = |by: isize| {
            let y = y.saturating_add_signed(by).min(height - 1);
            &plane[y * width..(y + 1) * width]
        };
        let (a, b, c, d) = (row(-2), row(-1), row(1), row(2));
        out.extend((0..width).map(|x| (8.0 * (c[x] - b[x]) - (d[x] - a[x])) / 12.0));
    }
}

/// One half of a sweep of successive over-relaxation: the pixels of one colour of a chess board, whose neighbours all have the other.
#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
fn sweep(equations: &[Equation], [right, below]: [&[f32]; 2], step: &mut [[f32; 2]], flow: &Plane, color: usize) {
    let Size { width, height } = flow.size;
    for y in 0..height {
        for x in ((y + color) % 2..width).step_by(2) {
            let k = y * width + x;
            let Equation { a, b, c, p, q } = equations[k];
            let (u, v) = (flow.u[k], flow.v[k]);
            let (mut sum, mut to_u, mut to_v) = (0.0, 0.0, 0.0);
            let mut join = |weight: f32, at: usize| {
                sum += weight;
                to_u += weight * (flow.u[at] + step[at][0] - u);
                to_v += weight * (flow.v[at] + step[at][1] - v);
            };
            if x > 0 {
                join(right[k - 1], k - 1);
            }
            if x + 1 < width {
                join(right[k], k + 1);
            }
            if y > 0 {
                join(below[k - width], k - width);
            }
            if y + 1 < height {
                join(below[k], k + width);
            }
            // A picture of one pixel has no neighbours, and where it says nothing either it stays.
            let (of_u, of_v) = ((a + sum).max(f32::MIN_POSITIVE), (c + sum).max(f32::MIN_POSITIVE));
            let [du, dv] = step[k];
            let du = du + RELAXATION * ((p + to_u - b * dv) / of_u - du);
            let dv = dv + RELAXATION * ((q + to_v - b * du) / of_v - dv);
            step[k] = [du, dv];
        }
    }
}
