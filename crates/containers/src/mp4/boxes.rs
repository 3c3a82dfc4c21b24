use crate::Result;
use crate::bytes::{Fields, RandomAccess};

/// A box type.
pub(super) type FourCc = [u8; 4];

/// A box of the file itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct FileBox {
    pub kind: FourCc,
    /// First byte of the box.
    pub start: u64,
    /// First byte of its content.
    pub body: u64,
    /// First byte after it; beyond the file's end when that is missing.
    pub end: u64,
}

/// The box at `start`, or `None` where no whole header is left or its size makes no sense.
pub(super) fn file_box(input: &mut RandomAccess, start: u64) -> Result<Option<FileBox>> {
    let (bytes, available) = input.peek::<16>(start)?;
    let mut fields = Fields(&bytes[..available]);
    let Some((short, kind)) = fields.u32().zip(fields.array::<4>()) else { return Ok(None) };
    let (header, size) = match short {
        0 => (8, input.len() - start),
        1 => match fields.u64() {
            Some(size) => (16, size),
            None => return Ok(None),
        },
        _ => (8, u64::from(short)),
    };
    if size < header {
        return Ok(None);
    }
    Ok(Some(FileBox { kind, start, body: start + header, end: start.saturating_add(size) }))
}

/// The boxes inside a box, as `(type, content)`; ends at the first whose size does not fit.
pub(super) fn children(body: &[u8]) -> impl Iterator<Item = (FourCc, &[u8])> {
    let mut rest = Fields(body);
    std::iter::from_fn(move || {
        let short = rest.u32()?;
        let kind = rest.array::<4>()?;
        let length = match short {
            0 => rest.0.len(),
            1 => usize::try_from(rest.u64()?.checked_sub(16)?).ok()?,
            _ => (short as usize).checked_sub(8)?,
        };
        Some((kind, rest.bytes(length)?))
    })
}

/// The first box of a kind.
pub(super) fn child<'a>(body: &'a [u8], kind: &FourCc) -> Option<&'a [u8]> {
    children(body).find(|(k, _)| k == kind).map(|(_, body)| body)
}

/// The content of a full box: its version, flags, and what follows.
pub(super) fn full(body: &[u8]) -> Option<(u8, u32, Fields<'_>)> {
    let mut fields = Fields(body);
    let word = fields.u32()?;
    Some(((word >> 24) as u8, word & 0x00FF_FFFF, fields))
}
