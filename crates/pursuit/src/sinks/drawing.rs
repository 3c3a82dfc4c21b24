use super::overlay::Trails;
use super::{OverlayStyle, depth_inset};
use crate::Record;
use pursuit_geometry::{BBox, Mask, Point};
use pursuit_imaging::{Frame, Image, ImagingError, Rgb8};
use pursuit_media::output::{Canvas, Stroke};
use pursuit_tracking::{Estimate, TargetId, TrackState};

const MEASURED: Rgb8 = [40, 220, 60];
const PREDICTED: Rgb8 = [240, 50, 50];
const ESTIMATE: Rgb8 = [255, 255, 255];
const COASTING: Rgb8 = [255, 190, 40];
const UNSURE: Rgb8 = [235, 130, 200];
/// With more targets than this, each has its number alone: more words would cover the others.
const MOST_WITH_WORDS: usize = 8;

/// How much is drawn of each target.
#[derive(Clone, Copy)]
struct Detail {
    /// Predicted and measured boxes.
    boxes: bool,
    /// State and score in words.
    words: bool,
    /// Numbers, and a colour for each.
    many: bool,
}

/// The picture, every `step` × `step` pixels one, with what is known drawn into it; boxes are in pixels of the result.
pub(super) fn draw(
    frame: &Frame,
    step: usize,
    records: &[Record],
    trails: &Trails,
    style: OverlayStyle,
) -> Result<Image<Rgb8>, ImagingError> {
    let (size, mut picture) = (frame.size(), Image::filled(1, 1, [0; 3])?);
    // Converted for this one picture: a frame that is waited for elsewhere is not to keep its colour as well.
    frame.reduced_color([0, 0, size.width, size.height], step, &mut picture)?;
    if let Some(depth) = frame.depth_mm() {
        depth_inset::draw(&mut picture, depth, records.iter().filter_map(|r| r.estimate.as_ref().map(|e| e.bbox)));
    }
    let mut canvas = Canvas::new(picture);
    let few = style == OverlayStyle::Full && records.len() <= MOST_WITH_WORDS;
    let detail = Detail { boxes: few, words: few, many: records.len() > 1 };
    for record in records {
        match &record.estimate {
            Some(estimate) => draw_target(&mut canvas, estimate, record, detail, &trails.of(record.target)),
            None => canvas.label(&BBox::from_ltwh(0.0, 0.0, 1.0, 1.0), "looking for a target", COASTING),
        }
    }
    Ok(canvas.into_image())
}

fn draw_target(canvas: &mut Canvas, estimate: &Estimate, record: &Record, detail: Detail, trail: &[Option<Point>]) {
    let width = 2.0 * canvas.scale();
    let own = if detail.many { color_of(record.target) } else { ESTIMATE };
    canvas.trail(trail, &Stroke::new(own, width).with_opacity(0.6));
    if let Some(mask) = &estimate.mask {
        draw_mask(canvas, mask, if estimate.state == TrackState::Unsure { UNSURE } else { color_of(record.target) });
    }
    // What is measured while a target is lost are candidates that were not believed.
    let believed = detail.boxes && estimate.state != TrackState::Lost;
    if let Some(predicted) = estimate.prediction.as_ref().filter(|_| believed) {
        canvas.rectangle(predicted, &Stroke::new(PREDICTED, width));
    }
    if let Some(measured) = estimate.measurement.as_ref().filter(|_| believed) {
        canvas.rectangle(measured, &Stroke::new(MEASURED, width));
        canvas.dot(measured.center(), 1.5 * width, MEASURED, 1.0);
    }
    // Each state has a pattern besides its colour, for those who see colours otherwise.
    let stroke = |color| Stroke::new(color, 0.75 * width);
    let (color, stroke) = match estimate.state {
        TrackState::Tracking => (own, stroke(own)),
        TrackState::Unsure => (UNSURE, stroke(UNSURE).dashed(8.0 * width, 3.0 * width)),
        TrackState::Occluded => (COASTING, stroke(COASTING)),
        TrackState::Lost => (COASTING, stroke(COASTING).dashed(3.0 * width, 2.0 * width)),
    };
    canvas.rectangle(&estimate.bbox, &stroke);
    let words = match (detail.many, detail.words) {
        (false, false) => return,
        (true, false) => record.target.to_string(),
        (many, true) => {
            let number = if many { format!("{} ", record.target) } else { String::new() };
            let class = record.class.as_ref().map_or_else(String::new, |class| format!("{class} "));
            let doubt = estimate.doubt.map_or_else(String::new, |doubt| format!(" ({})", doubt.as_str()));
            format!("{number}{class}{}{doubt} {:.2}", estimate.state, estimate.score)
        }
    };
    canvas.label(&estimate.bbox, &words, color);
}

/// The target's pixels tinted, with a line about them.
fn draw_mask(canvas: &mut Canvas, mask: &Mask, color: Rgb8) {
    const TINT: f64 = 0.35;
    const LINE: f64 = 0.9;
    for (spans, opacity) in [(mask.spans(), TINT), (mask.outline().spans(), LINE)] {
        for span in spans {
            let [top, left, right] = [span.row, span.from, span.to].map(f64::from);
            canvas.fill(&BBox::from_ltrb(left, top, right, top + 1.0), color, opacity);
        }
    }
}

/// A bright colour for each target: hues a golden section of the circle apart, so that neighbours in number differ most.
pub(crate) fn color_of(target: TargetId) -> Rgb8 {
    const GOLDEN: f64 = 0.618_033_988_749_895;
    let hue = (target.0 as f64 * GOLDEN).fract() * 6.0;
    // Full brightness, two thirds of saturation.
    let channel = |offset: f64| {
        let k = (offset + hue) % 6.0;
        (255.0 * (1.0 - 0.66 * k.min(4.0 - k).clamp(0.0, 1.0))) as u8
    };
    [channel(5.0), channel(3.0), channel(1.0)]
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;

    fn record(target: u64, left: f64, state: TrackState) -> Record {
        let bbox = BBox::from_ltwh(left, 60.0, 40.0, 30.0);
        let far = Some(BBox::from_ltwh(left, 150.0, 40.0, 30.0));
        let estimate = Estimate { state, prediction: far, measurement: far, ..Estimate::started(0.0, bbox, 1.0) };
        Record {
            frame: 0,
            time_s: 0.0,
            target: TargetId(target),
            class: None,
            estimate: Some(estimate),
            update_ms: None,
        }
    }

    /// The colours that a black picture has after drawing: those of at least 10 pixels.
    fn colors(records: &[Record], style: OverlayStyle) -> Vec<Rgb8> {
        let frame = Frame::new(0, 0.0, Image::filled(640, 200, [0_u8; 3]).unwrap());
        let picture = draw(&frame, 1, records, &Trails::default(), style).unwrap();
        let mut counts = std::collections::BTreeMap::new();
        picture.view().rows().flatten().for_each(|&p| *counts.entry(p).or_insert(0) += 1);
        counts.into_iter().filter(|(_, count)| *count >= 10).map(|(color, _)| color).collect()
    }

    #[test]
    fn one_target_has_the_three_boxes_and_minimal_the_estimate_alone() {
        let one = [record(1, 20.0, TrackState::Tracking)];
        let full = colors(&one, OverlayStyle::Full);
        assert!([MEASURED, ESTIMATE].iter().all(|c| full.contains(c)), "{full:?}");
        let minimal = colors(&one, OverlayStyle::Minimal);
        let grey = |[r, g, b]: &Rgb8| r == g && g == b;
        assert!(minimal.iter().any(|c| c[0] > 100) && minimal.iter().all(grey), "{minimal:?}");
    }

    #[test]
    fn candidates_of_a_lost_target_are_not_drawn() {
        let lost = colors(&[record(1, 20.0, TrackState::Lost)], OverlayStyle::Full);
        assert!(lost.contains(&COASTING) && !lost.contains(&MEASURED) && !lost.contains(&PREDICTED), "{lost:?}");
    }

    #[test]
    fn an_unsure_box_has_a_colour_of_its_own_and_gaps() {
        let shown = |state, many: u64| {
            let records: Vec<_> = (1..=many).map(|t| record(t, 60.0 * t as f64, state)).collect();
            colors(&records, OverlayStyle::Full)
        };
        for many in [1, 3] {
            let (unsure, occluded) = (shown(TrackState::Unsure, many), shown(TrackState::Occluded, many));
            assert!(unsure.contains(&UNSURE) && !unsure.contains(&COASTING), "{many}: {unsure:?}");
            assert!(occluded.contains(&COASTING) && !occluded.contains(&UNSURE), "{many}: {occluded:?}");
        }
        // One line of the box's left side: solid where it is occluded, broken where it is unsure.
        let drawn = |state| {
            let frame = Frame::new(0, 0.0, Image::filled(640, 200, [0_u8; 3]).unwrap());
            let picture =
                draw(&frame, 1, &[record(1, 100.0, state)], &Trails::default(), OverlayStyle::Minimal).unwrap();
            (62..88).filter(|&y| picture.view().get(100, y).is_some_and(|p| p[0] > 100)).count()
        };
        assert!(drawn(TrackState::Unsure) < drawn(TrackState::Occluded));
    }

    #[test]
    fn several_targets_have_colours_of_their_own_and_many_only_numbers() {
        let targets = |n: u64| (1..=n).map(|t| record(t, 45.0 * t as f64, TrackState::Tracking)).collect::<Vec<_>>();
        let few = colors(&targets(3), OverlayStyle::Full);
        assert!((1..=3).all(|t| few.contains(&color_of(TargetId(t)))) && few.contains(&MEASURED), "{few:?}");
        let many = colors(&targets(9), OverlayStyle::Full);
        assert!((1..=9).all(|t| many.contains(&color_of(TargetId(t)))) && !many.contains(&MEASURED), "{many:?}");
    }

    #[test]
    fn colours_of_neighbours_are_far_apart_and_bright() {
        for target in 1..50 {
            let [a, b] = [target, target + 1].map(|t| color_of(TargetId(t)));
            let apart: i32 = a.iter().zip(b).map(|(x, y)| (i32::from(*x) - i32::from(y)).abs()).sum();
            assert!(apart > 150 && a.contains(&255), "{target}: {a:?} {b:?}");
        }
    }
}
