//! Sets of pixels, by runs.

mod coco;
mod runs;
mod vot;

pub use coco::CocoMask;

use crate::{BBox, Size};
use runs::push;

/// Consecutive pixels of one row.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Span {
    /// The row, from 0 at the top.
    pub row: u32,
    /// The first column.
    pub from: u32,
    /// One more than the last column, > `from`.
    pub to: u32,
}

/// Which pixels are a target's: any set of pixels of an image, kept as runs along its rows.
///
/// Columns and rows count from the image's left top pixel, which is (0, 0). The image's size is no part of it: where a format
/// needs one, it is given.
///
/// ```
/// use pursuit_geometry::{Mask, Size};
///
/// let size = Size::new(6, 4);
/// let square = Mask::from_fn(size, |x, y| (1..4).contains(&x) && (1..3).contains(&y));
/// assert_eq!(square.area(), 6);
/// assert_eq!(square.to_vot(), "m1,1,3,2,0,6");
/// assert_eq!(square.to_coco(size)?.counts, "5220007");
/// assert_eq!(Mask::from_vot("m1,1,3,2,0,6")?.iou(&square), 1.0);
/// # Ok::<(), pursuit_geometry::MaskError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Hash, Default)]
pub struct Mask {
    /// In order of rows and columns; none touches the next.
    spans: Vec<Span>,
}

/// Text that is no mask, or a mask that does not fit where it is to go.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum MaskError {
    /// Text that cannot be read.
    #[error("{text:?} is no mask of {format}: {problem}")]
    Text {
        /// The format it was read as.
        format: &'static str,
        /// The beginning of the text.
        text: String,
        /// What is wrong with it.
        problem: String,
    },
    /// An image that is larger than masks may be.
    #[error("a mask of {width}x{height} pixels is too large: sides go to {side}, images to {pixels} pixels",
        side = Mask::MOST_SIDE, pixels = Mask::MOST_PIXELS)]
    Size {
        /// Its columns.
        width: u64,
        /// Its rows.
        height: u64,
    },
    /// A mask that reaches over the border of the image it is to be written for.
    #[error("the mask reaches over the border of the {size} image; clip it to the image first")]
    Outside {
        /// Size of the image.
        size: Size,
    },
}

impl MaskError {
    /// About a text of which the beginning is shown.
    fn text(format: &'static str, text: &str, problem: impl Into<String>) -> Self {
        const SHOWN: usize = 40;
        let mut shown: String = text.chars().take(SHOWN).collect();
        if shown.len() < text.len() {
            shown.push('…');
        }
        Self::Text { format, text: shown, problem: problem.into() }
    }
}

impl Mask {
    /// The longest side of an image whose masks are read, in pixels.
    pub const MOST_SIDE: usize = 1 << 15;
    /// The largest image whose masks are read, in pixels.
    pub const MOST_PIXELS: usize = 1 << 26;

    /// Whether masks of images of this size are read.
    fn check_size(width: u64, height: u64) -> Result<(), MaskError> {
        let side = Self::MOST_SIDE as u64;
        let fits = width <= side && height <= side && width * height <= Self::MOST_PIXELS as u64;
        if fits { Ok(()) } else { Err(MaskError::Size { width, height }) }
    }

    /// The pixels of an image of `size` for whose column and row `is_set` holds.
    pub fn from_fn(size: Size, mut is_set: impl FnMut(usize, usize) -> bool) -> Self {
        let mut mask = Self::default();
        for y in 0..size.height {
            mask.extend_row(y, 0, (0..size.width).map(|x| is_set(x, y)));
        }
        mask
    }

    /// Adds pixels of row `y` from column `x` on. Rows must come in order, and columns within a row.
    pub fn extend_row(&mut self, y: usize, x: usize, pixels: impl IntoIterator<Item = bool>) {
        let Ok(row) = u32::try_from(y) else { return };
        let mut open = None;
        let mut end = x;
        for (column, set) in (x..).zip(pixels) {
            match (open, set) {
                (None, true) => open = Some(column),
                (Some(from), false) => {
                    self.add(row, from, column);
                    open = None;
                }
                _ => {}
            }
            end = column + 1;
        }
        if let Some(from) = open {
            self.add(row, from, end);
        }
    }

    fn add(&mut self, row: u32, from: usize, to: usize) {
        if let (Ok(from), Ok(to)) = (u32::try_from(from), u32::try_from(to)) {
            push(&mut self.spans, Span { row, from, to });
        }
    }

    /// The pixels whose centres lie in `bbox`, as far as they lie in an image of `size`.
    pub fn from_bbox(bbox: &BBox, size: Size) -> Self {
        let mut mask = Self::default();
        let Some(inside) = bbox.clipped_to(size).filter(BBox::is_finite) else { return mask };
        // The centre of column j is j + ½.
        let first = |edge: f64| (edge - 0.5).ceil().max(0.0) as usize;
        for y in first(inside.top())..first(inside.bottom()) {
            if let Ok(row) = u32::try_from(y) {
                mask.add(row, first(inside.left()), first(inside.right()));
            }
        }
        mask
    }

    /// Its runs, in order of rows and columns.
    pub fn spans(&self) -> &[Span] {
        &self.spans
    }

    /// Whether it has no pixel.
    pub const fn is_empty(&self) -> bool {
        self.spans.is_empty()
    }

    /// How many pixels it has.
    pub fn area(&self) -> u64 {
        self.spans.iter().map(|s| u64::from(s.to - s.from)).sum()
    }

    /// The smallest rectangle of pixels that holds it; `None` of an empty one.
    pub fn bounds(&self) -> Option<BBox> {
        let [left, top, right, bottom] = self.window()?.map(f64::from);
        Some(BBox::from_ltrb(left, top, right, bottom))
    }

    /// Left, top, right and bottom of the same rectangle.
    fn window(&self) -> Option<[u32; 4]> {
        let (first, last) = (self.spans.first()?, self.spans.last()?);
        let left = self.spans.iter().map(|s| s.from).min()?;
        let right = self.spans.iter().map(|s| s.to).max()?;
        Some([left, first.row, right, last.row + 1])
    }

    /// Whether the pixel in column `x`, row `y` is one of them.
    pub fn contains(&self, x: u32, y: u32) -> bool {
        let after = self.spans.partition_point(|s| (s.row, s.from) <= (y, x));
        after.checked_sub(1).is_some_and(|k| self.spans[k].row == y && x < self.spans[k].to)
    }

    /// How many pixels both have.
    pub fn common_area(&self, other: &Self) -> u64 {
        let (mut a, mut b) = (self.spans.as_slice(), other.spans.as_slice());
        let mut common = 0;
        while let ([first, rest @ ..], [second, others @ ..]) = (a, b) {
            if first.row == second.row {
                common += u64::from(first.to.min(second.to).saturating_sub(first.from.max(second.from)));
            }
            // The one that ends first meets no other.
            if (first.row, first.to) < (second.row, second.to) { a = rest } else { b = others }
        }
        common
    }

    /// Intersection over union, in `[0, 1]`: the share of the pixels of either that both have; 1 of two empty ones, which agree.
    pub fn iou(&self, other: &Self) -> f64 {
        let common = self.common_area(other);
        let union = self.area() + other.area() - common;
        if union == 0 { 1.0 } else { common as f64 / union as f64 }
    }

    /// Those of its pixels that lie in an image of `size`.
    #[must_use]
    pub fn clipped_to(&self, size: Size) -> Self {
        let limit = |side: usize| u32::try_from(side).unwrap_or(u32::MAX);
        let (width, height) = (limit(size.width), limit(size.height));
        let inside = self.spans.iter().filter(|s| s.row < height && s.from < width);
        Self { spans: inside.map(|s| Span { to: s.to.min(width), ..*s }).collect() }
    }

    /// Those of its pixels of which one of the four neighbours is not in it: its outline, a pixel wide.
    #[must_use]
    pub fn outline(&self) -> Self {
        let mut outline = Self::default();
        let row_of = |row: Option<u32>| {
            let begin = row.map_or(0, |row| self.spans.partition_point(|s| s.row < row));
            let end = row.map_or(0, |row| self.spans.partition_point(|s| s.row <= row));
            &self.spans[begin..end]
        };
        let (mut row, mut above, mut below): (_, &[Span], &[Span]) = (None, &[], &[]);
        for span in &self.spans {
            if row != Some(span.row) {
                row = Some(span.row);
                (above, below) = (row_of(span.row.checked_sub(1)), row_of(span.row.checked_add(1)));
            }
            // What lies between the ends, below a pixel and above another, is inside.
            let mut at = span.from;
            for a in above.iter().filter(|a| a.from < span.to && a.to > span.from) {
                for b in below.iter().filter(|b| b.from < a.to && b.to > a.from) {
                    let from = (span.from + 1).max(a.from).max(b.from);
                    let to = (span.to - 1).min(a.to).min(b.to);
                    if from < to {
                        push(&mut outline.spans, Span { row: span.row, from: at, to: from });
                        at = to;
                    }
                }
            }
            push(&mut outline.spans, Span { row: span.row, from: at, to: span.to });
        }
        outline
    }

    /// The mask in an image of `size` where the point (x, y) of the present one is at (`scale[0]` · x + `shift[0]`, `scale[1]` · y +
    /// `shift[1]`): a pixel is set where its centre comes from a set one. Scales must be above 0; with others it is empty.
    #[must_use]
    pub fn mapped(&self, scale: [f64; 2], shift: [f64; 2], size: Size) -> Self {
        let mut mapped = Self::default();
        let sensible = scale.iter().all(|s| s.is_finite() && *s > 0.0) && shift.iter().all(|s| s.is_finite());
        let Some([_, top, _, bottom]) = self.window().filter(|_| sensible) else { return mapped };
        // The first pixel whose centre is at `edge` or beyond, inside of the image.
        let first = |edge: u32, k: usize, side: usize| {
            (f64::from(edge) * scale[k] + shift[k] - 0.5).ceil().clamp(0.0, side as f64) as usize
        };
        for y in first(top, 1, size.height)..first(bottom, 1, size.height) {
            let Ok(row) = u32::try_from(y) else { break };
            let from = ((y as f64 + 0.5 - shift[1]) / scale[1]).floor().max(0.0) as u32;
            let begin = self.spans.partition_point(|s| s.row < from);
            for span in self.spans[begin..].iter().take_while(|s| s.row == from) {
                mapped.add(row, first(span.from, 0, size.width), first(span.to, 0, size.width));
            }
        }
        mapped
    }
}

#[cfg(test)]
mod tests;
