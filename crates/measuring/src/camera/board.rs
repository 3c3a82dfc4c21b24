//! A camera by views of a flat board (Zhang 2000): focal lengths, principal point and distortion with their uncertainty.

use super::Camera;
use crate::{Homography, MeasuringError, Result};
use nalgebra::{DMatrix, DVector, Matrix2x3, Matrix3, Rotation3, SMatrix, SVector, Vector2, Vector3};
use serde::Serialize;

/// What is found of the camera: focal lengths, principal point, `k1, k2, p1, p2`.
const SHARED: usize = 8;
/// Of each view: a turn and a shift.
const OWN: usize = 6;
/// Fewer views say too little.
const LEAST_VIEWS: usize = 3;
/// Fewer points of a view say too little of how the board was held.
const LEAST_POINTS: usize = 8;
/// Above this relative standard deviation a focal length is not known.
const UNKNOWN: f64 = 0.05;
const MOST_STEPS: usize = 100;

/// The board as one picture shows it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct BoardView {
    /// Points of the board, `[pixel x, pixel y, place x, place y]`; places in any unit.
    pub points: Vec<[f64; 4]>,
}

/// A camera that was found, and how well it is known.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FoundCamera {
    /// The camera.
    pub camera: Camera,
    /// Root mean square of what is left over across and down, in pixels.
    pub rms_px: f64,
    /// The same of each view.
    pub views_rms_px: Vec<f64>,
    /// Standard deviations of the focal lengths, in pixels.
    pub focal_error: [f64; 2],
    /// Those of the principal point, in pixels.
    pub centre_error: [f64; 2],
    /// Those of the distortion coefficients.
    pub distortion_error: [f64; 4],
}

/// How a view was taken: board coordinates are turned, then shifted, into those of the camera.
#[derive(Debug, Clone, Copy)]
struct Pose {
    turn: Rotation3<f64>,
    shift: Vector3<f64>,
}

impl Camera {
    /// The camera that took these views, on pictures of this width and height. Each view needs a pose of its own, and the board
    /// must be turned out of the picture's plane in some: else distance and focal length cannot be told apart.
    ///
    /// # Errors
    /// Too few views or points, views that are too alike, and points that are of no flat board.
    pub fn from_board(views: &[BoardView], picture: [usize; 2]) -> Result<FoundCamera> {
        let usable = views.iter().filter(|view| view.points.len() >= LEAST_POINTS).count();
        if usable < LEAST_VIEWS || usable < views.len() {
            return Err(wrong(format!(
                "{usable} of {} views show {LEAST_POINTS} points of the board or more; {LEAST_VIEWS} are needed, 10 and more are better",
                views.len()
            )));
        }
        let middle = picture.map(|side| side as f64 / 2.0);
        let maps: Vec<Homography> = views.iter().map(map_of).collect::<Option<_>>().ok_or_else(alike)?;
        let focal = focal_of(&maps, middle).ok_or_else(alike)?;
        let mut found = Solution {
            camera: Camera { picture, focal: [focal; 2], centre: middle, distortion: vec![0.0; 4] },
            poses: maps.iter().map(|map| pose_of(map, focal, middle)).collect::<Option<_>>().ok_or_else(alike)?,
        };
        found.refine(views).ok_or_else(alike)?;
        found.told(views)
    }
}

fn wrong(what: String) -> MeasuringError {
    MeasuringError::Camera(what)
}

fn alike() -> MeasuringError {
    wrong("the views of the board are too alike to tell the camera; show it turned by 30° and more to all sides, near and far, and in the corners of the picture".into())
}

/// From places on the board to pixels.
fn map_of(view: &BoardView) -> Option<Homography> {
    let places: Vec<[f64; 2]> = view.points.iter().map(|p| [p[2], p[3]]).collect();
    let pixels: Vec<[f64; 2]> = view.points.iter().map(|p| [p[0], p[1]]).collect();
    Homography::fitted(&places, &pixels)
}

/// The focal length of a camera of square pixels and without distortion whose principal point is `middle`: that the board's two
/// directions are at right angles and equally long is, of each view, two linear equations for `1/f²` (Zhang 2000, equations 3 and 4).
fn focal_of(maps: &[Homography], middle: [f64; 2]) -> Option<f64> {
    let (mut above, mut below) = (0.0, 0.0);
    for map in maps {
        let h = centred(map, middle);
        let (a, b) = (h.column(0) / h.column(0).norm(), h.column(1) / h.column(0).norm());
        let equations = [
            (a.x * b.x + a.y * b.y, a.z * b.z),
            (a.x * a.x + a.y * a.y - b.x * b.x - b.y * b.y, a.z * a.z - b.z * b.z),
        ];
        for (slope, constant) in equations {
            above -= slope * constant;
            below += slope * slope;
        }
    }
    let inverse_square = above / below;
    (inverse_square > 0.0 && inverse_square.is_finite()).then(|| inverse_square.sqrt().recip())
}

fn centred(map: &Homography, [x, y]: [f64; 2]) -> Matrix3<f64> {
    Matrix3::new(1.0, 0.0, -x, 0.0, 1.0, -y, 0.0, 0.0, 1.0) * map.0
}

fn pose_of(map: &Homography, focal: f64, middle: [f64; 2]) -> Option<Pose> {
    let h = Matrix3::from_diagonal(&Vector3::new(1.0 / focal, 1.0 / focal, 1.0)) * centred(map, middle);
    let scale = 2.0 / (h.column(0).norm() + h.column(1).norm());
    // The board is before the camera.
    let scale = if h[(2, 2)] < 0.0 { -scale } else { scale };
    let (a, b) = (h.column(0) * scale, h.column(1) * scale);
    let near = Matrix3::from_columns(&[a, b, a.cross(&b)]);
    let svd = near.svd(true, true);
    let turn = svd.u? * svd.v_t?;
    let shift = h.column(2) * scale;
    (turn.determinant() > 0.0 && shift.z > 0.0).then(|| Pose { turn: Rotation3::from_matrix_unchecked(turn), shift })
}

/// The camera and the pose of every view.
#[derive(Debug, Clone)]
struct Solution {
    camera: Camera,
    poses: Vec<Pose>,
}

/// What is left over at a point, and how what is seen there changes with the camera and with the pose.
type Row = (Vector2<f64>, SMatrix<f64, 2, SHARED>, SMatrix<f64, 2, OWN>);

impl Solution {
    fn row(&self, pose: &Pose, &[px, py, a, b]: &[f64; 4]) -> Option<Row> {
        let turned = pose.turn * Vector3::new(a, b, 0.0);
        let at = turned + pose.shift;
        if at.z <= 0.0 {
            return None;
        }
        let ray = at.xy() / at.z;
        let (seen, by_ray) = self.camera.distorted(ray);
        let [fx, fy] = self.camera.focal;
        let [cx, cy] = self.camera.centre;
        let left = Vector2::new(px - cx - fx * seen.x, py - cy - fy * seen.y);
        let (x, y) = (ray.x, ray.y);
        let r2 = ray.norm_squared();
        let mut shared = SMatrix::<f64, 2, SHARED>::zeros();
        (shared[(0, 0)], shared[(1, 1)], shared[(0, 2)], shared[(1, 3)]) = (seen.x, seen.y, 1.0, 1.0);
        let by_distortion = [
            [x * r2, y * r2],
            [x * r2 * r2, y * r2 * r2],
            [2.0 * x * y, r2 + 2.0 * y * y],
            [r2 + 2.0 * x * x, 2.0 * x * y],
        ];
        for (column, [u, v]) in by_distortion.into_iter().enumerate() {
            (shared[(0, 4 + column)], shared[(1, 4 + column)]) = (fx * u, fy * v);
        }
        let by_place = Matrix2x3::new(1.0, 0.0, -x, 0.0, 1.0, -y) / at.z;
        let scaled = nalgebra::Matrix2::from_diagonal(&Vector2::new(fx, fy)) * by_ray * by_place;
        let mut own = SMatrix::<f64, 2, OWN>::zeros();
        own.fixed_view_mut::<2, 3>(0, 0).copy_from(&(scaled * -turned.cross_matrix()));
        own.fixed_view_mut::<2, 3>(0, 3).copy_from(&scaled);
        Some((left, shared, own))
    }

    /// Sum of the squares of what is left over; none where a point lies behind the camera.
    fn cost(&self, views: &[BoardView]) -> Option<f64> {
        let mut sum = 0.0;
        for (view, pose) in views.iter().zip(&self.poses) {
            for point in &view.points {
                sum += self.row(pose, point)?.0.norm_squared();
            }
        }
        sum.is_finite().then_some(sum)
    }

    /// The normal equations: what is left over, and how it changes.
    fn equations(&self, views: &[BoardView]) -> Option<(DMatrix<f64>, DVector<f64>)> {
        let size = SHARED + OWN * views.len();
        let (mut normal, mut right) = (DMatrix::zeros(size, size), DVector::zeros(size));
        for (i, (view, pose)) in views.iter().zip(&self.poses).enumerate() {
            let first = SHARED + OWN * i;
            let (mut both, mut own_own) = (SMatrix::<f64, SHARED, OWN>::zeros(), SMatrix::<f64, OWN, OWN>::zeros());
            for point in &view.points {
                let (left, shared, own) = self.row(pose, point)?;
                let mut block = normal.fixed_view_mut::<SHARED, SHARED>(0, 0);
                block += shared.transpose() * shared;
                both += shared.transpose() * own;
                own_own += own.transpose() * own;
                let mut camera = right.fixed_rows_mut::<SHARED>(0);
                camera += shared.transpose() * left;
                let mut pose = right.fixed_rows_mut::<OWN>(first);
                pose += own.transpose() * left;
            }
            normal.fixed_view_mut::<SHARED, OWN>(0, first).copy_from(&both);
            normal.fixed_view_mut::<OWN, SHARED>(first, 0).copy_from(&both.transpose());
            normal.fixed_view_mut::<OWN, OWN>(first, first).copy_from(&own_own);
        }
        Some((normal, right))
    }

    fn moved(&self, step: &DVector<f64>) -> Self {
        let mut moved = self.clone();
        let shared: SVector<f64, SHARED> = step.fixed_rows::<SHARED>(0).into_owned();
        for axis in 0..2 {
            moved.camera.focal[axis] += shared[axis];
            moved.camera.centre[axis] += shared[2 + axis];
        }
        moved.camera.distortion.iter_mut().zip(shared.iter().skip(4)).for_each(|(k, change)| *k += change);
        for (i, pose) in moved.poses.iter_mut().enumerate() {
            let own = step.fixed_rows::<OWN>(SHARED + OWN * i);
            pose.turn = Rotation3::new(Vector3::new(own[0], own[1], own[2])) * pose.turn;
            pose.shift += Vector3::new(own[3], own[4], own[5]);
        }
        moved
    }

    /// Least squares by Levenberg and Marquardt.
    fn refine(&mut self, views: &[BoardView]) -> Option<()> {
        let (mut cost, mut damping) = (self.cost(views)?, 1e-3);
        for _ in 0..MOST_STEPS {
            let (normal, right) = self.equations(views)?;
            let mut damped = normal.clone();
            for i in 0..damped.nrows() {
                damped[(i, i)] *= 1.0 + damping;
            }
            let step = damped.cholesky()?.solve(&right);
            let moved = self.moved(&step);
            match moved.cost(views).filter(|moved_cost| *moved_cost <= cost) {
                Some(better) => {
                    let is_still = cost - better <= 1e-12 * cost;
                    (*self, cost, damping) = (moved, better, (damping / 10.0).max(1e-12));
                    if is_still {
                        break;
                    }
                }
                None if damping > 1e8 => break,
                None => damping *= 10.0,
            }
        }
        Some(())
    }

    fn told(&self, views: &[BoardView]) -> Result<FoundCamera> {
        let points: usize = views.iter().map(|view| view.points.len()).sum();
        let cost = self.cost(views).ok_or_else(alike)?;
        let (normal, _) = self.equations(views).ok_or_else(alike)?;
        let free = (2 * points).saturating_sub(normal.nrows()).max(1) as f64;
        let inverse = normal.cholesky().ok_or_else(alike)?.inverse();
        let error = |i: usize| (cost / free * inverse[(i, i)]).max(0.0).sqrt();
        let focal_error = [error(0), error(1)];
        let is_known = |(focal, error): (&f64, &f64)| *focal > 0.0 && error / focal < UNKNOWN;
        if !self.camera.focal.iter().zip(&focal_error).all(is_known) {
            return Err(alike());
        }
        self.camera.check()?;
        let of_view = |(view, pose): (&BoardView, &Pose)| {
            let left = view.points.iter().filter_map(|point| self.row(pose, point)).map(|row| row.0.norm_squared());
            (left.sum::<f64>() / (2 * view.points.len()) as f64).sqrt()
        };
        Ok(FoundCamera {
            camera: self.camera.clone(),
            rms_px: (cost / (2 * points) as f64).sqrt(),
            views_rms_px: views.iter().zip(&self.poses).map(of_view).collect(),
            focal_error,
            centre_error: [error(2), error(3)],
            distortion_error: [error(4), error(5), error(6), error(7)],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_testkit::SplitMix;

    /// Numbers of a normal distribution (Box and Muller 1958).
    struct Random(SplitMix);

    impl Random {
        fn new(seed: u64) -> Self {
            Self(SplitMix::after(1000 * seed))
        }

        fn normal(&mut self) -> f64 {
            let (radius, angle) = (1.0 - self.0.unit(), self.0.unit());
            (-2.0 * radius.ln()).sqrt() * (std::f64::consts::TAU * angle).cos()
        }
    }

    fn truth() -> Camera {
        Camera {
            picture: [1280, 720],
            focal: [1010.0, 1004.0],
            centre: [655.0, 348.0],
            distortion: vec![-0.21, 0.06, 0.0012, -0.0009],
        }
    }

    /// A board of 9 by 6 corners, turned and shifted so, as the camera sees it with this error of each corner.
    fn view(turn: [f64; 3], shift: [f64; 3], error: f64, random: &mut Random) -> BoardView {
        let (camera, turn) = (truth(), Rotation3::new(Vector3::from(turn)));
        let mut points = Vec::new();
        for j in 0..6 {
            for i in 0..9 {
                let place = [f64::from(i) * 0.025, f64::from(j) * 0.025];
                let at = turn * Vector3::new(place[0] - 0.1, place[1] - 0.0625, 0.0) + Vector3::from(shift);
                let seen = camera.distorted(at.xy() / at.z).0;
                let pixel = [0, 1].map(|k| camera.focal[k] * seen[k] + camera.centre[k] + error * random.normal());
                points.push([pixel[0], pixel[1], place[0], place[1]]);
            }
        }
        BoardView { points }
    }

    fn all_round(error: f64, seed: u64) -> Vec<BoardView> {
        let mut random = Random::new(seed);
        (0..12)
            .map(|k| {
                let angle = f64::from(k) * 0.53;
                let turn = [0.6 * angle.cos(), 0.6 * angle.sin(), 0.2 * (2.0 * angle).sin()];
                let shift = [0.09 * (1.7 * angle).sin(), 0.05 * (2.3 * angle).cos(), 0.32 + 0.01 * f64::from(k)];
                view(turn, shift, error, &mut random)
            })
            .collect()
    }

    #[test]
    fn without_errors_the_camera_is_found_exactly() {
        let found = Camera::from_board(&all_round(0.0, 1), [1280, 720]).unwrap();
        let wanted = truth();
        assert!(found.rms_px < 1e-8, "{found:?}");
        for axis in 0..2 {
            assert!((found.camera.focal[axis] - wanted.focal[axis]).abs() < 1e-4, "{found:?}");
            assert!((found.camera.centre[axis] - wanted.centre[axis]).abs() < 1e-4, "{found:?}");
        }
        for (k, wanted) in found.camera.distortion.iter().zip(&wanted.distortion) {
            assert!((k - wanted).abs() < 1e-6, "{found:?}");
        }
    }

    #[test]
    fn what_it_says_of_its_errors_is_so() {
        let (wanted, mut inside, mut all) = (truth(), 0, 0);
        for seed in 0..60 {
            let found = Camera::from_board(&all_round(0.15, 100 + seed), [1280, 720]).unwrap();
            assert!((found.rms_px - 0.15).abs() < 0.02, "{}", found.rms_px);
            let mut look = |value: f64, truth: f64, error: f64| {
                assert!((value - truth).abs() < 5.0 * error, "{value} ± {error}, {truth}");
                inside += usize::from((value - truth).abs() < 2.0 * error);
                all += 1;
            };
            for axis in 0..2 {
                look(found.camera.focal[axis], wanted.focal[axis], found.focal_error[axis]);
                look(found.camera.centre[axis], wanted.centre[axis], found.centre_error[axis]);
            }
            for (i, k) in found.camera.distortion.iter().enumerate() {
                look(*k, wanted.distortion[i], found.distortion_error[i]);
            }
        }
        let share = inside as f64 / all as f64;
        assert!((0.92..0.985).contains(&share), "{share} within two standard deviations");
    }

    #[test]
    fn views_that_say_nothing_are_refused() {
        let mut random = Random::new(3);
        let flat: Vec<BoardView> =
            (0..8).map(|k| view([0.0; 3], [0.01 * f64::from(k), 0.0, 0.4], 0.1, &mut random)).collect();
        for views in [flat, all_round(0.1, 4)[..2].to_vec(), Vec::new()] {
            let message = Camera::from_board(&views, [1280, 720]).unwrap_err().to_string();
            assert!(message.contains("turned by 30°") || message.contains("are needed"), "{message}");
        }
        let broken = vec![BoardView { points: vec![[f64::NAN; 4]; 20] }; 5];
        assert!(Camera::from_board(&broken, [1280, 720]).is_err());
    }
}
