//! Runs as formats have them: lengths, alternately of unset and set pixels, through a rectangle.

use super::{MaskError, Span};

/// Appends a run behind all others, joined to the last where they touch; an empty one is left out.
pub(super) fn push(spans: &mut Vec<Span>, span: Span) {
    match spans.last_mut() {
        _ if span.from >= span.to => {}
        Some(last) if last.row == span.row && last.to >= span.from => last.to = last.to.max(span.to),
        _ => spans.push(span),
    }
}

/// The lengths through the rectangle (left, top, right, bottom), which holds all spans, row by row; the first is of unset pixels and
/// may be 0.
pub(super) fn lengths(spans: &[Span], [left, top, right, _]: [u32; 4]) -> Vec<u64> {
    let width = u64::from(right - left);
    let mut lengths: Vec<u64> = Vec::with_capacity(2 * spans.len() + 1);
    let mut end = 0;
    for span in spans {
        let row = u64::from(span.row - top) * width;
        let (from, to) = (row + u64::from(span.from - left), row + u64::from(span.to - left));
        match lengths.last_mut() {
            // A run that ends with its row and one that begins the next are one.
            Some(last) if from == end => *last += to - from,
            _ => lengths.extend([from - end, to - from]),
        }
        end = to;
    }
    lengths
}

/// The spans of such lengths in a rectangle of `width` columns and `height` rows whose left top pixel is (`left`, `top`); what lies
/// left of or above the image is left out. The lengths may end early, not late.
///
/// # Errors
/// A rectangle that is too large, and lengths that do not fit it.
pub(super) fn spans(
    [left, top]: [i64; 2],
    [width, height]: [u64; 2],
    lengths: impl Iterator<Item = Result<u64, String>>,
) -> Result<Vec<Span>, String> {
    super::Mask::check_size(width, height).map_err(|e: MaskError| e.to_string())?;
    let (mut at, mut spans) = (0_u64, Vec::new());
    for (k, length) in lengths.enumerate() {
        let length = length?;
        let end = at.checked_add(length).filter(|end| *end <= width * height);
        let end = end.ok_or_else(|| format!("its runs are longer than its {width}x{height} pixels"))?;
        while k % 2 == 1 && at < end {
            // Below `MOST_SIDE` each, far from where these wrap.
            let (row, column) = ((at / width).cast_signed() + top, (at % width).cast_signed() + left);
            let piece = (width - at % width).min(end - at);
            if let (Ok(row), Ok(to)) = (u32::try_from(row), u32::try_from(column + piece.cast_signed())) {
                let from = u32::try_from(column.max(0)).unwrap_or(to);
                push(&mut spans, Span { row, from, to });
            }
            at += piece;
        }
        at = end;
    }
    Ok(spans)
}

/// The spans with columns and rows exchanged.
pub(super) fn transposed(spans: &[Span]) -> Vec<Span> {
    let width = spans.iter().map(|s| s.to).max().unwrap_or(0);
    // Of each column the rows of the run that goes on.
    let mut open = vec![(0_u32, 0_u32); width as usize];
    let mut out = Vec::new();
    for span in spans {
        for (x, (from, to)) in (span.from..span.to).zip(&mut open[span.from as usize..span.to as usize]) {
            if *to != span.row || from == to {
                push(&mut out, Span { row: x, from: *from, to: *to });
                *from = span.row;
            }
            *to = span.row + 1;
        }
    }
    for (x, (from, to)) in (0..width).zip(open) {
        push(&mut out, Span { row: x, from, to });
    }
    out.sort_unstable();
    out
}
