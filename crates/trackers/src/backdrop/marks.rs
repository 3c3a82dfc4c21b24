//! Edges of a background by which a picture is put in its place.

use super::canvas::{Canvas, brightness, sample};
use super::turning::{Maps, mapped};
use pursuit_geometry::{BBox, Point, Size};
use pursuit_imaging::Frame;

/// Points by which a picture is put in its place, about, and the fewest that tell anything.
const POINTS: usize = 600;
const FEWEST: usize = 24;
/// So many beside the target are enough.
const PLENTY: usize = 150;
/// Sum of the differences of brightness across and down, in codes over two pixels, that makes an edge.
const EDGE: f64 = 24.0;
/// Places that are tried at first lie so many pixels apart, but there are no more than so many across.
const FIRST_STEP: f64 = 2.5;
const ACROSS: f64 = 24.0;
/// The first step from one place where no others are tried, pixels.
const FARTHEST_STEP: f64 = 8.0;
/// One of so many marks is compared there, and so many of the places are gone into.
const SOME: usize = 3;
const STARTS: usize = 4;
/// Differences of brightness count up to this many codes: what moves before the background hardly disturbs.
const MOST: f64 = 24.0;

/// A place of the background that is easily found again: where the pose puts it in the picture, and how bright it is.
#[derive(Debug, Clone, Copy)]
pub(super) struct Mark {
    at: Point,
    brightness: f64,
}

/// Looks for edges of the background that lie in the picture, the strongest of each cell of a grid: beside the target at `keep`, and
/// where those are few within it too. Beside a target that fills the picture there is nothing; what it does not hide is in its box.
pub(super) fn find(marks: &mut Vec<Mark>, maps: &Maps, picture: Size, keep: &BBox, canvas: &Canvas) {
    let cell = ((picture.area() as f64 / POINTS as f64).sqrt().ceil() as usize).max(4);
    let Size { width, height } = canvas.size();
    let edge = |x: usize, y: usize| {
        let at = |x: usize, y: usize| canvas.known(y * width + x).map(brightness);
        Some((at(x - 1, y)? - at(x + 1, y)?).abs() + (at(x, y - 1)? - at(x, y + 1)?).abs())
    };
    let seen = BBox::from_ltwh(0.0, 0.0, picture.width as f64, picture.height as f64);
    let place = |x: usize, y: usize| {
        let at = mapped(&maps.back, Point::new(x as f64 + 0.5, y as f64 + 0.5))?;
        seen.contains(at).then_some(at)
    };
    marks.clear();
    // Large cells are not looked at pixel by pixel.
    let step = (cell / 6).max(2);
    let (columns, rows) = maps.in_sight(picture, (0.0, 0.0), canvas.size());
    let from = |first: usize| 1 + first.saturating_sub(1) / cell * cell;
    for top in (from(rows.start)..rows.end.min(height.saturating_sub(1))).step_by(cell) {
        for left in (from(columns.start)..columns.end.min(width.saturating_sub(1))).step_by(cell) {
            let rows = (top..(top + cell).min(height - 1)).step_by(step);
            let pixels = rows.flat_map(|y| (left..(left + cell).min(width - 1)).step_by(step).map(move |x| (x, y)));
            let edges = pixels.filter_map(|(x, y)| edge(x, y).filter(|e| *e > EDGE).map(|e| (e, x, y)));
            let Some((_, x, y)) = edges.max_by(|a, b| a.0.total_cmp(&b.0)) else { continue };
            let Some(mean) = canvas.known(y * width + x) else { continue };
            marks.extend(place(x, y).map(|at| Mark { at, brightness: brightness(mean) }));
        }
    }
    if marks.iter().filter(|mark| !keep.contains(mark.at)).count() >= PLENTY {
        marks.retain(|mark| !keep.contains(mark.at));
    }
}

/// How far the picture lies from where the pose puts it, in pixels, up to `reach` each way: the shift under which the marks are as
/// bright as on the canvas; and the difference of brightness there, in codes: the mean of the smaller half, since what moves before the
/// background hides some of the marks. It is looked for from where the picture lay last and from where it should; `all_over`
/// the reach too, by some of the marks: where the canvas is sure of what it knows.
///
/// Nothing where the marks are too few. `channels` are those of the canvas: 1 for grey, 3 for red, green and blue.
pub(super) fn descend(
    marks: &[Mark],
    (frame, channels): (&Frame, usize),
    last: (f64, f64),
    (reach, all_over): (f64, bool),
) -> Option<(f64, (f64, f64))> {
    if marks.len() < FEWEST || reach <= 0.0 {
        return None;
    }
    let mut value = [0_u16; 3];
    let mut cost = |(dx, dy): (f64, f64), every: usize| {
        let (mut sum, mut count) = (0.0, 0);
        for mark in marks.iter().step_by(every) {
            if sample(frame, Point::new(mark.at.x + dx, mark.at.y + dy), &mut value[..channels]) {
                sum += (brightness(&value[..channels]) - mark.brightness).abs().min(MOST);
                count += 1;
            }
        }
        if count * every < FEWEST { f64::INFINITY } else { sum / count as f64 }
    };
    let apart = FIRST_STEP.max(2.0 * reach / ACROSS);
    let side = (reach / apart).floor() as i32;
    let grid = (-side..=side).flat_map(|y| (-side..=side).map(move |x| (f64::from(x) * apart, f64::from(y) * apart)));
    let mut places: Vec<_> = grid.filter(|_| all_over).map(|at| (cost(at, SOME), at)).collect();
    places.sort_by(|a, b| a.0.total_cmp(&b.0));
    let starts = places.iter().take(STARTS).map(|(_, at)| *at).chain([(0.0, 0.0), last]);
    let mut best = (f64::INFINITY, (0.0, 0.0));
    for start in starts {
        let mut own = (cost(start, 1), start);
        let mut step = if all_over { apart } else { reach.min(FARTHEST_STEP) };
        while step >= 0.2 {
            let about = [(-1, -1), (0, -1), (1, -1), (-1, 0), (1, 0), (-1, 1), (0, 1), (1, 1)];
            let (_, (x, y)) = own;
            let tried = about.map(|(i, j)| (x + f64::from(i) * step, y + f64::from(j) * step));
            let within = tried.into_iter().filter(|(x, y)| x.abs() <= reach && y.abs() <= reach);
            let found = within.map(|at| (cost(at, 1), at)).min_by(|a, b| a.0.total_cmp(&b.0));
            match found.filter(|found| found.0 < own.0) {
                Some(found) => own = found,
                None => step /= 2.0,
            }
        }
        if own.0 < best.0 {
            best = own;
        }
    }
    let (_, off) = best.0.is_finite().then_some(best)?;
    let seen = marks.iter().filter_map(|mark| {
        let is_seen = sample(frame, Point::new(mark.at.x + off.0, mark.at.y + off.1), &mut value[..channels]);
        is_seen.then(|| (brightness(&value[..channels]) - mark.brightness).abs())
    });
    let mut seen: Vec<f64> = seen.collect();
    seen.sort_by(f64::total_cmp);
    let half = seen.len().div_ceil(2);
    let difference = seen.iter().take(half).sum::<f64>() / half.max(1) as f64;
    Some((difference, off))
}
