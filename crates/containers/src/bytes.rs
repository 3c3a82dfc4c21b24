//! Reading anywhere in a file, and fields from the front of a slice.

use crate::{ContainerError, Result};
use std::io::{Read, Seek, SeekFrom};

/// A file, or bytes in memory, that can be read anywhere.
pub trait ReadSeek: Read + Seek + Send {}
impl<T: Read + Seek + Send> ReadSeek for T {}

/// Random access to an input of known length.
pub struct RandomAccess {
    reader: Box<dyn ReadSeek>,
    len: u64,
}

impl RandomAccess {
    /// Takes the input's length by its end.
    ///
    /// # Errors
    /// Those of the reader.
    pub fn new(mut reader: Box<dyn ReadSeek>) -> std::io::Result<Self> {
        let len = reader.seek(SeekFrom::End(0))?;
        Ok(Self { reader, len })
    }

    /// Bytes of the input.
    pub const fn len(&self) -> u64 {
        self.len
    }

    /// Whether the input has no bytes.
    pub const fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Reads `len` bytes at `offset` into `out`, replacing what it held; never allocates beyond the file's length.
    ///
    /// # Errors
    /// [`ContainerError::Malformed`] when the input ends before.
    pub fn read_at(&mut self, offset: u64, len: u64, out: &mut Vec<u8>) -> Result<()> {
        out.clear();
        if offset.checked_add(len).is_none_or(|end| end > self.len) {
            return Err(ContainerError::malformed(
                "the file ends early; it may not have been copied or recorded to its end",
            ));
        }
        self.reader.seek(SeekFrom::Start(offset))?;
        out.resize(len as usize, 0);
        Ok(self.reader.read_exact(out)?)
    }

    /// The bytes at `offset` and how many there are, fewer than `N` at the end of the file.
    ///
    /// # Errors
    /// Those of the reader.
    pub fn peek<const N: usize>(&mut self, offset: u64) -> Result<([u8; N], usize)> {
        let mut bytes = [0; N];
        let available = self.len.saturating_sub(offset).min(N as u64) as usize;
        self.reader.seek(SeekFrom::Start(offset))?;
        self.reader.read_exact(&mut bytes[..available])?;
        Ok((bytes, available))
    }
}

/// Reads big-endian and little-endian fields from the front of a slice; `None` when it ends.
#[derive(Debug, Clone, Copy)]
pub struct Fields<'a>(pub &'a [u8]);

impl<'a> Fields<'a> {
    /// The next `count` bytes.
    pub fn bytes(&mut self, count: usize) -> Option<&'a [u8]> {
        let (head, tail) = self.0.split_at_checked(count)?;
        self.0 = tail;
        Some(head)
    }

    /// The next `N` bytes.
    pub fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (head, tail) = self.0.split_first_chunk::<N>()?;
        self.0 = tail;
        Some(*head)
    }

    /// Passes over `count` bytes.
    pub fn skip(&mut self, count: usize) -> Option<()> {
        self.bytes(count).map(|_| ())
    }

    /// One byte.
    pub fn u8(&mut self) -> Option<u8> {
        self.array::<1>().map(|[b]| b)
    }

    /// Two bytes, big-endian.
    pub fn u16(&mut self) -> Option<u16> {
        self.array().map(u16::from_be_bytes)
    }

    /// Four bytes, big-endian.
    pub fn u32(&mut self) -> Option<u32> {
        self.array().map(u32::from_be_bytes)
    }

    /// Eight bytes, big-endian.
    pub fn u64(&mut self) -> Option<u64> {
        self.array().map(u64::from_be_bytes)
    }

    /// Four bytes, little-endian.
    pub fn u32_le(&mut self) -> Option<u32> {
        self.array().map(u32::from_le_bytes)
    }
}
