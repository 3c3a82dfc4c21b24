//! The frames in which trackers did worst, as small JPEGs inside the page, truth and estimates drawn over them.

use super::RankedTrajectory;
use super::html::{base64, escape};
use crate::frame_cache::FrameCache;
use crate::metrics::accuracy::{believed, overlap};
use crate::{EvaluationError, Result, Sequence};
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use std::fmt::Write as _;
use std::ops::ControlFlow;

/// Width of a picture in pixels.
const WIDTH: usize = 320;
/// Height of a picture in pixels.
const HEIGHT: usize = 240;
const JPEG_QUALITY: u8 = 72;
/// Pictures of one tracker, and of a whole sequence.
const PER_TRACKER: usize = 2;
const PER_SEQUENCE: usize = 6;
/// The window shown is this many times as large as what it must hold.
const MARGIN: f64 = 1.7;
/// No less than this part of the frame is shown: without surroundings one cannot see where the target is.
const LEAST_PART: f64 = 0.22;

/// Pictures of a sequence's worst frames as HTML; empty where there is nothing to show.
pub(super) fn worst_frames(
    sequence: &Sequence,
    trajectories: &[RankedTrajectory<'_>],
    frames: &FrameCache<'_>,
) -> Result<String> {
    let wanted = choose(sequence, trajectories);
    let Some(last) = wanted.last().copied() else { return Ok(String::new()) };
    let mut html = String::new();
    let mut failed = None;
    frames.show(0, |i, frame| {
        if wanted.contains(&i) {
            match picture(sequence, trajectories, i, &frame) {
                Ok(figure) => html.push_str(&figure),
                Err(e) => failed = Some(e),
            }
        }
        if i >= last || failed.is_some() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    })?;
    match failed {
        Some(reason) => Err(EvaluationError::encoding("a picture of the report", reason)),
        None => Ok(html),
    }
}

/// The worst frames of every tracker, well apart, in order of time.
fn choose(sequence: &Sequence, trajectories: &[RankedTrajectory<'_>]) -> Vec<usize> {
    let apart = (sequence.truth().len() / 10).max(3);
    let mut chosen: Vec<usize> = Vec::new();
    for round in 0..PER_TRACKER {
        for ranked in trajectories {
            if chosen.len() >= PER_SEQUENCE {
                break;
            }
            let mut frames = ranked.judged_frames(sequence);
            frames.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
            let far = |i: usize| chosen.iter().all(|c| c.abs_diff(i) >= apart);
            let next = frames.iter().map(|(i, _)| *i).find(|i| far(*i));
            // Perfect frames are not worth a picture beyond the first.
            let worth = |i: &usize| round == 0 || frames.iter().any(|(j, o)| j == i && *o < 0.8);
            chosen.extend(next.filter(worth));
        }
    }
    chosen.sort_unstable();
    chosen
}

fn picture(
    sequence: &Sequence,
    trajectories: &[RankedTrajectory<'_>],
    index: usize,
    frame: &Frame,
) -> Result<String, String> {
    let truth = sequence.truth().get(index).and_then(|t| t.bbox());
    let boxes: Vec<(usize, BBox)> =
        trajectories.iter().filter_map(|e| Some((e.number, believed(e.trajectory.get(index))?))).collect();
    let window = window(frame, truth, &boxes);
    let jpeg = encode(frame, window)?;
    let (left, top, width, height) = window.ltwh();
    let stroke = width / WIDTH as f64 * 2.0;
    let mut html = format!(
        r#"<figure><svg viewBox="{left:.2} {top:.2} {width:.2} {height:.2}" role="img" aria-label="frame {index}"><image x="{left:.2}" y="{top:.2}" width="{width:.2}" height="{height:.2}" preserveAspectRatio="none" href="data:image/jpeg;base64,{}"/>"#,
        base64(&jpeg)
    );
    let mut outline = |class: &str, data: &str, b: &BBox| {
        let (x, y, w, h) = b.ltwh();
        let _ = write!(
            html,
            r#"<rect class="{class}"{data} x="{x:.2}" y="{y:.2}" width="{w:.2}" height="{h:.2}" stroke-width="{stroke:.2}"/>"#
        );
    };
    if let Some(truth) = &truth {
        outline("truth", "", truth);
    }
    for (number, bbox) in &boxes {
        outline(&format!("series box t{}", number % 8), &format!(r#" data-t="{number}""#), bbox);
    }
    html.push_str("</svg><figcaption>");
    let _ = write!(html, "<b>frame {index}</b>");
    for ranked in trajectories {
        let truth = sequence.truth().get(index).copied().unwrap_or(crate::Truth::Unknown);
        let output = ranked.trajectory.get(index);
        let (iou, state) = (overlap(&truth, output), output.map_or("no output", |o| o.state.as_str()));
        let _ = write!(
            html,
            r#" <span class="series t{}" data-t="{}"><i class="dot"></i>{} {iou:.2} {state}</span>"#,
            ranked.number % 8,
            ranked.number,
            escape(ranked.name)
        );
    }
    html.push_str("</figcaption></figure>\n");
    Ok(html)
}

/// The part of the frame to show: truth and estimates with some room, in the picture's proportions, inside the frame.
fn window(frame: &Frame, truth: Option<BBox>, boxes: &[(usize, BBox)]) -> BBox {
    let whole = frame.size().bounds();
    let shown = boxes.iter().filter_map(|(_, b)| b.intersection(&whole)).chain(truth);
    let Some(hold) = shown.reduce(|a, b| a.union(&b)) else { return whole };
    let aspect = WIDTH as f64 / HEIGHT as f64;
    let width = (hold.width() * MARGIN).max(hold.height() * MARGIN * aspect).max(whole.width() * LEAST_PART);
    let width = width.min(whole.width()).min(whole.height() * aspect);
    let height = width / aspect;
    let center = hold.center();
    let left = (center.x - width / 2.0).clamp(0.0, (whole.width() - width).max(0.0));
    let top = (center.y - height / 2.0).clamp(0.0, (whole.height() - height).max(0.0));
    BBox::from_ltwh(left, top, width, height)
}

/// The window, averaged down (or repeated up) to the picture's size.
fn encode(frame: &Frame, window: BBox) -> Result<Vec<u8>, String> {
    let image = frame.color();
    let span = |from: f64, step: f64, i: usize, limit: usize| {
        let start = ((from + step * i as f64) as usize).min(limit - 1);
        let end = ((from + step * (i + 1) as f64).ceil() as usize).clamp(start + 1, limit);
        start..end
    };
    let (dx, dy) = (window.width() / WIDTH as f64, window.height() / HEIGHT as f64);
    let mut pixels = Vec::with_capacity(WIDTH * HEIGHT * 3);
    for row in 0..HEIGHT {
        let rows = span(window.top(), dy, row, image.height());
        for column in 0..WIDTH {
            let columns = span(window.left(), dx, column, image.width());
            let count = (rows.len() * columns.len()) as u32;
            let mut sums = [count / 2; 3];
            for y in rows.clone() {
                for pixel in &image.row(y)[columns.clone()] {
                    sums.iter_mut().zip(pixel).for_each(|(s, p)| *s += u32::from(*p));
                }
            }
            pixels.extend(sums.map(|s| (s / count) as u8));
        }
    }
    let mut jpeg = Vec::new();
    jpeg_encoder::Encoder::new(&mut jpeg, JPEG_QUALITY)
        .encode(&pixels, WIDTH as u16, HEIGHT as u16, jpeg_encoder::ColorType::Rgb)
        .map_err(|e| e.to_string())?;
    Ok(jpeg)
}
