//! Which pixels move otherwise than the scene.

use super::FlowDetectorParams;
use pursuit_geometry::{Point, Size};
use pursuit_imaging::{Image, ImageView};
use pursuit_vision::Result;
use pursuit_vision::flow::dense::FlowField;
use pursuit_vision::warp::Affine;

/// Finds them; owns its scratch.
#[derive(Debug, Default)]
pub(super) struct Residual {
    /// Length of the flow less the camera's motion.
    lengths: Vec<f32>,
    sorted: Vec<f32>,
    /// By how much less the flow leaves of the picture than the camera's motion, codes.
    gains: Vec<f32>,
    sums: Vec<f32>,
    row: Vec<f32>,
}

impl Residual {
    /// Marks (255) in `mask` the pixels of `now` that move: `flow` leads them to `before`, as `camera` leads the scene. Returns the
    /// share that is marked.
    pub fn mark(
        &mut self,
        [now, before]: [ImageView<'_, u8>; 2],
        flow: &FlowField,
        camera: &Affine,
        params: &FlowDetectorParams,
        mask: &mut Image<u8>,
    ) -> Result<f64> {
        let size = now.size();
        mask.resize_for_overwrite(size, 0)?;
        self.lengths.clear();
        self.gains.clear();
        for y in 0..size.height {
            let (row, motions) = (now.row(y), flow.image().row(y));
            for (x, (&code, &[u, v])) in row.iter().zip(motions).enumerate() {
                let at = Point::new(x as f64 + 0.5, y as f64 + 0.5);
                let by_camera = camera.apply(at);
                let by_flow = Point::new(at.x + f64::from(u), at.y + f64::from(v));
                self.lengths.push(by_flow.distance(by_camera) as f32);
                let off = |at: Point| (f32::from(code) - sample(before, at)).abs();
                // What comes from beyond the border tells nothing.
                let seen = (0.0..=size.width as f64).contains(&by_camera.x)
                    && (0.0..=size.height as f64).contains(&by_camera.y);
                self.gains.push(if seen { off(by_camera) - off(by_flow) } else { 0.0 });
            }
        }
        self.sorted.clone_from(&self.lengths);
        let middle = self.sorted.len() / 2;
        let noise = *self.sorted.select_nth_unstable_by(middle, f32::total_cmp).1;
        let least = (params.threshold_px as f32).max(params.noise_ratio as f32 * noise);
        self.smooth(size, params.reach_px);
        let mut count = 0;
        let told = self.lengths.iter().zip(&self.gains);
        for (mark, (length, gain)) in mask.as_mut_slice().iter_mut().zip(told) {
            let moves = *length > least && *gain > params.gain as f32;
            *mark = if moves { 255 } else { 0 };
            count += usize::from(moves);
        }
        Ok(count as f64 / size.area() as f64)
    }

    /// Means of the gains over squares of `2 reach + 1` pixels, of what of them lies in the picture.
    fn smooth(&mut self, Size { width, height }: Size, reach: usize) {
        if reach == 0 {
            return;
        }
        let span = |at: usize, length: usize| (at.saturating_sub(reach), (at + reach + 1).min(length));
        self.sums.clear();
        for row in self.gains.chunks_exact(width) {
            self.row.clear();
            self.row.push(0.0);
            let mut sum = 0.0;
            self.row.extend(row.iter().map(|gain| {
                sum += gain;
                sum
            }));
            let mean = |x: usize| {
                let (from, to) = span(x, width);
                (self.row[to] - self.row[from]) / (to - from) as f32
            };
            self.sums.extend((0..width).map(mean));
        }
        for y in 0..height {
            let (from, to) = span(y, height);
            let out = &mut self.gains[y * width..][..width];
            out.fill(0.0);
            for row in self.sums[from * width..to * width].chunks_exact(width) {
                out.iter_mut().zip(row).for_each(|(sum, mean)| *sum += mean);
            }
            out.iter_mut().for_each(|sum| *sum /= (to - from) as f32);
        }
    }

    /// Mean length of the marked pixels' motion against the scene in a window, and the least that was marked.
    pub fn mean_length(
        &self,
        mask: ImageView<'_, u8>,
        columns: std::ops::Range<usize>,
        rows: std::ops::Range<usize>,
    ) -> f64 {
        let (mut sum, mut count) = (0.0, 0usize);
        for y in rows {
            let lengths = &self.lengths[y * mask.width()..][..mask.width()];
            for x in columns.clone().filter(|&x| mask.row(y)[x] != 0) {
                sum += f64::from(lengths[x]);
                count += 1;
            }
        }
        sum / count.max(1) as f64
    }
}

/// The picture between its pixels; beyond its border that goes on.
fn sample(image: ImageView<'_, u8>, at: Point) -> f32 {
    let (x, y) = (at.x - 0.5, at.y - 0.5);
    let (column, row) = (x.floor(), y.floor());
    let (fx, fy) = ((x - column) as f32, (y - row) as f32);
    let (i, j) = (column as isize, row as isize);
    let pixel = |dx: isize, dy: isize| f32::from(image.clamped(i.saturating_add(dx), j.saturating_add(dy)));
    (1.0 - fy) * ((1.0 - fx) * pixel(0, 0) + fx * pixel(1, 0)) + fy * ((1.0 - fx) * pixel(0, 1) + fx * pixel(1, 1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_testkit::lattice;

    #[test]
    fn gains_are_means_over_squares() {
        let (size, reach) = (Size::new(13, 9), 2);
        let values: Vec<f32> = (0..13 * 9).map(|i| lattice(i, 3, 5) as f32).collect();
        let mut residual = Residual { gains: values.clone(), ..Residual::default() };
        residual.smooth(size, reach);
        for y in 0..9usize {
            for x in 0..13usize {
                let near = |at: usize, length: usize| at.saturating_sub(reach)..(at + reach + 1).min(length);
                let all: Vec<f32> = near(y, 9)
                    .flat_map(|v| near(x, 13).map(move |u| (u, v)))
                    .map(|(u, v)| values[v * 13 + u])
                    .collect();
                let mean = all.iter().sum::<f32>() / all.len() as f32;
                assert!((residual.gains[y * 13 + x] - mean).abs() < 1e-4, "{x} {y}");
            }
        }
    }

    #[test]
    fn only_what_the_camera_does_not_explain_is_marked() {
        let size = Size::new(60, 40);
        let ground = |x: i64, y: i64| (40.0 + 150.0 * lattice(x / 3, y / 3, 1)) as u8;
        let thing = |x: i64, y: i64| (20.0 + 200.0 * lattice(x / 3, y / 3, 9)) as u8;
        // The camera goes right by two pixels, so that the scene goes left; a thing of 12 x 10 stays where it is.
        let hides = |x: usize, y: usize| (24..36).contains(&x) && (14..24).contains(&y);
        let picture = |k: i64| {
            let pixel = |x: usize, y: usize| {
                let (i, j) = (x as i64, y as i64);
                if hides(x, y) { thing(i, j) } else { ground(i + 2 * k, j) }
            };
            Image::from_fn(60, 40, pixel).unwrap()
        };
        let (before, now) = (picture(0), picture(1));
        let flow = FlowField::from_fn(size, |x, y| if hides(x, y) { [0.0, 0.0] } else { [2.0, 0.0] }).unwrap();
        let camera = Affine::translation(2.0, 0.0).unwrap();
        let (mut residual, mut mask) = (Residual::default(), Image::filled(1, 1, 0).unwrap());
        let views = [now.view(), before.view()];
        let share = residual.mark(views, &flow, &camera, &FlowDetectorParams::default(), &mut mask).unwrap();
        let marked = |x: usize, y: usize| mask.row(y)[x] != 0;
        let (mut inside, mut outside) = (0, 0);
        for y in 0..40 {
            for x in 0..60 {
                *(if hides(x, y) { &mut inside } else { &mut outside }) += usize::from(marked(x, y));
            }
        }
        assert!(inside > 90 && outside == 0, "{inside} of 120 inside, {outside} outside");
        assert!((share - inside as f64 / 2400.0).abs() < 1e-12);
        assert!((residual.mean_length(mask.view(), 0..60, 0..40) - 2.0).abs() < 1e-6);
        // Where the flow says so and the picture does not, nothing is marked.
        let wrong = FlowField::from_fn(size, |x, _| if x > 40 { [9.0, 0.0] } else { [2.0, 0.0] }).unwrap();
        let still = picture(1);
        let none = Affine::translation(0.0, 0.0).unwrap();
        let share =
            residual.mark([still.view(), still.view()], &wrong, &none, &FlowDetectorParams::default(), &mut mask);
        assert_eq!(share.unwrap(), 0.0);
    }
}
