//! COCO's runs: down the columns, from the left one on, through the whole image; as numbers, or as a compressed string.

use super::{Mask, MaskError, Span, runs};
use crate::Size;

/// A mask as COCO has it: `{"size": [height, width], "counts": "…"}`.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct CocoMask {
    /// Rows and columns of the image.
    pub size: [u64; 2],
    /// The lengths, compressed.
    pub counts: String,
}

impl CocoMask {
    /// The mask.
    ///
    /// # Errors
    /// [`MaskError`] for an image that is too large and text that is damaged.
    pub fn mask(&self) -> Result<Mask, MaskError> {
        let problem = |problem: String| MaskError::text("COCO", &self.counts, problem);
        let lengths = decompressed(&self.counts).map_err(problem)?;
        Mask::from_coco_lengths(self.size, lengths.into_iter()).map_err(problem)
    }
}

impl Mask {
    /// As COCO has it, compressed, in an image of `size`.
    ///
    /// # Errors
    /// [`MaskError::Outside`] when it reaches over the border.
    pub fn to_coco(&self, size: Size) -> Result<CocoMask, MaskError> {
        let lengths = self.to_coco_counts(size)?;
        Ok(CocoMask { size: [size.height as u64, size.width as u64], counts: compressed(&lengths) })
    }

    /// COCO's lengths uncompressed, alternately of unset and set pixels, down the columns.
    ///
    /// # Errors
    /// As [`to_coco`](Self::to_coco).
    pub fn to_coco_counts(&self, size: Size) -> Result<Vec<u64>, MaskError> {
        let limit = |side: usize| u32::try_from(side).map_err(|_| MaskError::Outside { size });
        let (width, height) = (limit(size.width)?, limit(size.height)?);
        if self.window().is_some_and(|[_, _, right, bottom]| right > width || bottom > height) {
            return Err(MaskError::Outside { size });
        }
        let mut lengths = runs::lengths(&runs::transposed(&self.spans), [0, 0, height, width]);
        let rest = size.area() as u64 - lengths.iter().sum::<u64>();
        if rest > 0 || lengths.is_empty() {
            lengths.push(rest);
        }
        Ok(lengths)
    }

    /// The mask of COCO's uncompressed lengths in an image of `size`.
    ///
    /// # Errors
    /// [`MaskError`] for an image that is too large and lengths that do not fit it.
    pub fn from_coco_counts(size: Size, counts: &[u64]) -> Result<Self, MaskError> {
        let shown = || counts.iter().take(12).map(u64::to_string).collect::<Vec<_>>().join(",");
        Self::from_coco_lengths([size.height as u64, size.width as u64], counts.iter().copied())
            .map_err(|problem| MaskError::text("COCO", &shown(), problem))
    }

    fn from_coco_lengths([height, width]: [u64; 2], lengths: impl Iterator<Item = u64>) -> Result<Self, String> {
        let down: Vec<Span> = runs::spans([0, 0], [height, width], lengths.map(Ok))?;
        Ok(Self { spans: runs::transposed(&down) })
    }
}

/// Numbers of five bits a character, the lowest first, with a bit that says that more follow: each length from the third on less
/// the one two before it.
fn compressed(lengths: &[u64]) -> String {
    let mut text = String::new();
    for (k, &length) in lengths.iter().enumerate() {
        let before = if k > 2 { lengths[k - 2] } else { 0 };
        let mut value = length.cast_signed() - before.cast_signed();
        loop {
            let low = (value & 0x1f) as u8;
            value >>= 5;
            // The sign is the highest of the bits written.
            let more = if low & 0x10 == 0 { value != 0 } else { value != -1 };
            text.push(char::from(48 + low + if more { 0x20 } else { 0 }));
            if !more {
                break;
            }
        }
    }
    text
}

fn decompressed(text: &str) -> Result<Vec<u64>, String> {
    let mut lengths: Vec<u64> = Vec::new();
    let (mut value, mut bits) = (0_i64, 0_u32);
    for byte in text.bytes() {
        let code = byte.checked_sub(48).filter(|c| *c < 64);
        let code = code.ok_or_else(|| format!("the character {:?} is none of its own", char::from(byte)))?;
        value |= i64::from(code & 0x1f) << bits;
        bits += 5;
        if code & 0x20 != 0 {
            if bits > 40 {
                return Err("a number in it is too long".to_owned());
            }
            continue;
        }
        if code & 0x10 != 0 {
            value |= -1 << bits;
        }
        let before = if lengths.len() > 2 { lengths[lengths.len() - 2].cast_signed() } else { 0 };
        let length = u64::try_from(value + before).map_err(|_| "a run in it is shorter than nothing".to_owned())?;
        // Lengths of an image that can be read are far below.
        lengths.push(length.min(1 << 40));
        (value, bits) = (0, 0);
    }
    if bits > 0 { Err("it ends within a number".to_owned()) } else { Ok(lengths) }
}
