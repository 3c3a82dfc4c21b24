//! Pictures with what is known of their flow.

use super::{Shown, grid};
use crate::sinks::{TRAIL_S, color_of, step};
use pursuit_geometry::{Point, Size};
use pursuit_imaging::{Frame, Image, ImagingError, Rgb8};
use pursuit_media::output::{Canvas, Stroke};
use pursuit_tracking::TargetId;
use pursuit_vision::flow::FollowedPoint;
use pursuit_vision::flow::dense::{FlowField, wheel};
use std::collections::{BTreeMap, VecDeque};

/// Where a point was lost.
const GONE: Rgb8 = [255, 190, 40];
/// For how long that is shown, seconds.
const GONE_S: f64 = 0.5;
/// Most places of a trail.
const MOST_PLACES: usize = 250;
/// How much of a field's colours covers the picture.
const COVER: f32 = 0.7;
/// Motions shorter than this are not shown in full colour, pixels: noise would fill the picture with colours.
const LEAST_LONGEST_PX: f32 = 1.0;

/// The picture of a frame, every so many pixels one, and how many that is.
fn reduced(frame: &Frame) -> Result<(Image<Rgb8>, f64), ImagingError> {
    let (size, mut picture) = (frame.size(), Image::filled(1, 1, [0; 3])?);
    let step = step(size);
    frame.reduced_color([0, 0, size.width, size.height], step, &mut picture)?;
    Ok((picture, step as f64))
}

/// Where points have been lately, and where some were lost.
#[derive(Default)]
pub(super) struct Trails {
    places: BTreeMap<usize, VecDeque<(f64, Point)>>,
    gone: Vec<(f64, Point)>,
}

impl Trails {
    /// The picture with points, trails, and crosses where points were lost.
    ///
    /// # Errors
    /// A picture that cannot be made.
    pub fn draw(&mut self, frame: &Frame, told: &[FollowedPoint]) -> Result<Image<Rgb8>, ImagingError> {
        let (picture, step) = reduced(frame)?;
        let now = frame.time_s();
        for point in told {
            match point.point {
                Some(at) => {
                    let trail = self.places.entry(point.id).or_default();
                    trail.push_back((now, at));
                    while trail.front().is_some_and(|(t, _)| now - t > TRAIL_S || trail.len() > MOST_PLACES) {
                        trail.pop_front();
                    }
                }
                None => {
                    let last = self.places.remove(&point.id).and_then(|mut trail| trail.pop_back());
                    self.gone.extend(last.map(|(_, at)| (now, at)));
                }
            }
        }
        self.gone.retain(|(since, _)| (0.0..=GONE_S).contains(&(now - since)));
        let mut canvas = Canvas::new(picture);
        let width = 1.5 * canvas.scale();
        let shown = |at: &Point| Point::new(at.x / step, at.y / step);
        for (id, trail) in &self.places {
            // The colours of targets.
            let color = color_of(TargetId(*id as u64));
            let places: Vec<Option<Point>> = trail.iter().map(|(_, at)| Some(shown(at))).collect();
            canvas.trail(&places, &Stroke::new(color, width).with_opacity(0.7));
            if let Some(Some(at)) = places.last() {
                canvas.dot(*at, 1.5 * width, color, 1.0);
            }
        }
        for (_, at) in &self.gone {
            canvas.cross(shown(at), 3.0 * width, &Stroke::new(GONE, width));
        }
        Ok(canvas.into_image())
    }
}

/// Fields over pictures.
pub(super) struct Fields {
    shown: Shown,
    fixed: Option<f32>,
    longest: f32,
    lengths: Vec<f32>,
}

impl Fields {
    pub fn new(shown: Shown, longest_px: Option<f64>) -> Self {
        Self { shown, fixed: longest_px.map(|px| px as f32), longest: LEAST_LONGEST_PX, lengths: Vec::new() }
    }

    /// The picture of the frame that the motions start in, with them.
    ///
    /// # Errors
    /// A picture that cannot be made.
    pub fn draw(&mut self, frame: &Frame, field: &FlowField) -> Result<Image<Rgb8>, ImagingError> {
        let (mut picture, step) = reduced(frame)?;
        let longest = self.longest(field);
        match self.shown {
            Shown::Wheel => {
                for y in 0..picture.height() {
                    let from = (y as f64 * step) as usize;
                    for (x, pixel) in picture.row_mut(y).iter_mut().enumerate() {
                        let motion = field.get((x as f64 * step) as usize, from).unwrap_or_default();
                        let color = wheel::color(motion, longest);
                        let mixed = |k: usize| COVER * f32::from(color[k]) + (1.0 - COVER) * f32::from(pixel[k]);
                        *pixel = [0, 1, 2].map(|k| mixed(k) as u8);
                    }
                }
                Ok(picture)
            }
            Shown::Arrows(apart) => {
                let mut canvas = Canvas::new(picture);
                let size = Size::new(field.size().width, field.size().height);
                let width = 1.2 * canvas.scale();
                for from in grid(size, apart).1 {
                    let [u, v] = field.at(from);
                    let scaled = |p: Point| Point::new(p.x / step, p.y / step);
                    let to = Point::new(from.x + f64::from(u), from.y + f64::from(v));
                    arrow(&mut canvas, scaled(from), scaled(to), &Stroke::new(wheel::color([u, v], longest), width));
                }
                Ok(canvas.into_image())
            }
        }
    }

    /// The motion with the fullest colour: that of the fastest fiftieth of the pixels, remembered for a while.
    fn longest(&mut self, field: &FlowField) -> f32 {
        if let Some(fixed) = self.fixed {
            return fixed;
        }
        self.lengths.clear();
        // Every 16th pixel tells as much.
        let lengths = field.image().as_slice().iter().step_by(16).map(|[u, v]| u.hypot(*v));
        self.lengths.extend(lengths.filter(|l| l.is_finite()));
        if let Some(last) = self.lengths.len().checked_sub(1) {
            let (_, fast, _) = self.lengths.select_nth_unstable_by(last * 49 / 50, f32::total_cmp);
            self.longest = (0.95 * self.longest).max(*fast).max(LEAST_LONGEST_PX);
        }
        self.longest
    }
}

/// An arrow; of a motion too short for one a dot.
fn arrow(canvas: &mut Canvas, from: Point, to: Point, stroke: &Stroke) {
    let (dx, dy) = (to.x - from.x, to.y - from.y);
    let length = dx.hypot(dy);
    if length < 1.0 || !length.is_finite() {
        canvas.dot(from, 0.75 * stroke.width_px, stroke.color, 1.0);
        return;
    }
    canvas.line(from, to, stroke);
    let head = (length / 3.0).min(4.0 * stroke.width_px);
    for side in [-1.0, 1.0] {
        let (s, c) = (side * 2.6f64).sin_cos();
        let (ux, uy) = (dx / length, dy / length);
        let tip = Point::new(to.x + head * (c * ux - s * uy), to.y + head * (s * ux + c * uy));
        canvas.line(to, tip, stroke);
    }
}
