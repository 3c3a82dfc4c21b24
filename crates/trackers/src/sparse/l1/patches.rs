use super::{L1MoveParams, L1Params};
use nalgebra::SVector;
use pursuit_geometry::{BBox, Point, Size};
use pursuit_imaging::Frame;
use pursuit_vision::patch::normalize;
use pursuit_vision::sampling::{Planes, Sampler, Window};
use rand_core::Rng;
use std::f64::consts::PI;

/// Six numbers of an affine map of the first box: centre x and y in pixels, logarithm of the size and of the proportion of width to
/// height relative to the first, angle in radians, and how far the top is moved against the bottom in parts of the height.
pub(super) type State = SVector<f64, 6>;

/// Pixels of the view along one pixel of a template.
const FINER: usize = 2;
/// How far the view reaches beyond the box, to each side.
pub(super) const REACH: f64 = 1.0;

/// The upright box of a state.
pub(super) fn bbox(state: &State, first_px: (f64, f64)) -> BBox {
    let (size, root) = (state[2].exp(), (0.5 * state[3]).exp());
    BBox::from_center_size(Point::new(state[0], state[1]), first_px.0 * size * root, first_px.1 * size / root)
}

/// The upright state of a box.
pub(super) fn state(bbox: &BBox, first_px: (f64, f64), moves: &L1MoveParams) -> State {
    let (x, y) = ((bbox.width() / first_px.0).ln(), (bbox.height() / first_px.1).ln());
    let center = bbox.center();
    kept(State::from([center.x, center.y, 0.5 * (x + y), x - y, 0.0, 0.0]), moves)
}

/// Within what is believed.
fn kept(mut state: State, moves: &L1MoveParams) -> State {
    state[2] = state[2].clamp(moves.least_size.ln(), moves.most_size.ln());
    state[3] = state[3].clamp(-1.0, 1.0);
    state[4] = (state[4] + PI).rem_euclid(2.0 * PI) - PI;
    state[5] = state[5].clamp(-0.5, 0.5);
    state
}

/// One step of the random walk over `dt_s` seconds.
pub(super) fn walk(
    state: &State,
    first_px: (f64, f64),
    moves: &L1MoveParams,
    dt_s: f64,
    generator: &mut impl Rng,
) -> State {
    let (root, size_px) = (dt_s.max(0.0).sqrt(), bbox(state, first_px).area().sqrt());
    let place = moves.place * size_px;
    let mut next = *state;
    let steps = [place, place, moves.size, moves.proportion, moves.turn, moves.skew];
    for (pair, steps) in next.as_mut_slice().chunks_exact_mut(2).zip(steps.chunks_exact(2)) {
        // Two independent standard normal numbers (Box and Muller 1958).
        let mut uniform = || (generator.next_u64() >> 11) as f64 / (1_u64 << 53) as f64;
        let (u, v) = (1.0 - uniform(), uniform());
        let (sin, cos) = (std::f64::consts::TAU * v).sin_cos();
        let radius = (-2.0 * u.ln()).sqrt();
        pair[0] += root * steps[0] * radius * cos;
        pair[1] += root * steps[1] * radius * sin;
    }
    kept(next, moves)
}

/// The surroundings of a box, sampled finely enough for templates: where patches are taken from. Overwritten at every use.
#[derive(Debug, Clone, Default)]
pub(super) struct View {
    sampler: Sampler,
    pixels: Planes,
    /// Of the first pixel's corner, and pixels of the frame along one of the view.
    origin: (f64, f64),
    step: (f64, f64),
}

impl View {
    /// Looks about `bbox`, which is as large as a template and all around as much again.
    pub fn look(&mut self, frame: &Frame, bbox: &BBox, params: &L1Params) {
        let side = |pixels: usize| ((1.0 + 2.0 * REACH) * (pixels * FINER) as f64) as usize;
        let patch = Size::new(side(params.columns), side(params.rows));
        let along = |length: f64, pixels: usize| length / (pixels * FINER) as f64;
        self.step = (along(bbox.width(), params.columns), along(bbox.height(), params.rows));
        let center = bbox.center();
        let corner = |c: f64, step: f64, n: usize| c - step * n as f64 / 2.0;
        self.origin = (corner(center.x, self.step.0, patch.width), corner(center.y, self.step.1, patch.height));
        let window = Window { center, step_x: self.step.0, step_y: self.step.1, angle_rad: 0.0, patch };
        self.sampler.gray(frame.gray(), &window, &mut self.pixels);
    }

    /// The patch under a state, less its mean and of length one; false, and nothing, where it has one value only.
    pub fn take(&self, state: &State, first_px: (f64, f64), params: &L1Params, out: &mut Vec<f32>) -> bool {
        let size = self.pixels.size();
        let upright = bbox(state, first_px);
        let (sin, cos) = state[4].sin_cos();
        // Along the width and the height, in pixels of the view: skewed, then turned.
        let along = (upright.width() * cos, upright.width() * sin);
        let skew = state[5] * upright.height();
        let down = (skew * cos - upright.height() * sin, skew * sin + upright.height() * cos);
        let to_view = |v: (f64, f64)| ((v.0 / self.step.0) as f32, (v.1 / self.step.1) as f32);
        let (along, down) = (to_view(along), to_view(down));
        let center = to_view((state[0] - self.origin.0, state[1] - self.origin.1));
        let (columns, rows) = (params.columns, params.rows);
        let plane = self.pixels.plane(0);
        let most = ((size.width - 1) as f32, (size.height - 1) as f32);
        out.clear();
        for j in 0..rows {
            let v = (j as f32 + 0.5) / rows as f32 - 0.5;
            for i in 0..columns {
                let u = (i as f32 + 0.5) / columns as f32 - 0.5;
                let x = (center.0 + u * along.0 + v * down.0 - 0.5).clamp(0.0, most.0);
                let y = (center.1 + u * along.1 + v * down.1 - 0.5).clamp(0.0, most.1);
                let (left, top) = ((x as usize).min(size.width - 2), (y as usize).min(size.height - 2));
                let (fx, fy) = (x - left as f32, y - top as f32);
                let at = top * size.width + left;
                let (above, below) = (&plane[at..at + 2], &plane[at + size.width..at + size.width + 2]);
                let (above, below) = (above[0] + fx * (above[1] - above[0]), below[0] + fx * (below[1] - below[0]));
                out.push(above + fy * (below - above));
            }
        }
        normalize(out)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_imaging::Image;

    const FIRST: (f64, f64) = (24.0, 30.0);

    #[test]
    fn patches_are_those_of_affine_maps() {
        // A plane of light: wherever a pixel lies, its value tells where.
        let image = Image::from_fn(120, 120, |x, y| (x + y / 2) as u8).unwrap();
        let frame = Frame::new(0, 0.0, image);
        let params = L1Params::default();
        let (mut view, mut patch) = (View::default(), Vec::new());
        let bbox = BBox::from_center_size(Point::new(60.0, 60.0), 24.0, 30.0);
        view.look(&frame, &bbox, &params);
        let state = State::from([63.0, 58.0, 0.1, -0.2, 0.3, 0.1]);
        assert!(view.take(&state, FIRST, &params, &mut patch));
        let (w, h) = (24.0 * (0.1_f64 - 0.1).exp(), 30.0 * (0.1_f64 + 0.1).exp());
        let (sin, cos) = 0.3_f64.sin_cos();
        let mut want: Vec<f64> = Vec::new();
        for (j, i) in (0..15).flat_map(|j| (0..12).map(move |i| (j, i))) {
            let (u, v) = (((f64::from(i) + 0.5) / 12.0 - 0.5) * w, ((f64::from(j) + 0.5) / 15.0 - 0.5) * h);
            let (u, v) = (u + 0.1 * v, v);
            want.push((63.0 + cos * u - sin * v) + 0.5 * (58.0 + sin * u + cos * v));
        }
        let mean = want.iter().sum::<f64>() / want.len() as f64;
        want.iter_mut().for_each(|v| *v -= mean);
        let length = want.iter().map(|v| v * v).sum::<f64>().sqrt();
        for (got, want) in patch.iter().zip(&want) {
            assert!((f64::from(*got) - want / length).abs() < 5e-3, "{got} is not {}", want / length);
        }
    }

    #[test]
    fn boxes_and_states_are_each_others() {
        let moves = L1MoveParams::default();
        let bbox_of = BBox::from_ltwh(10.0, 20.0, 30.0, 33.0);
        let again = bbox(&state(&bbox_of, FIRST, &moves), FIRST);
        assert!(again.iou(&bbox_of) > 1.0 - 1e-9);
        let huge = bbox(&state(&BBox::from_ltwh(0.0, 0.0, 1e4, 1e4), FIRST, &moves), FIRST);
        assert!(huge.area() < 25.1 * 24.0 * 30.0 * 1.0001);
    }
}
