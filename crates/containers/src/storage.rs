use std::fs::File;
use std::io::{self, Cursor, Seek, Write};

/// Something a video can be written to: a file, memory, or a stand-in that fails on purpose.
pub trait Storage: Write + Seek + Send {
    /// Cuts off everything from byte `length` on, so that half a write leaves no rubbish behind.
    ///
    /// # Errors
    /// Whatever the system says.
    fn truncate(&mut self, length: u64) -> io::Result<()>;
}

impl Storage for File {
    fn truncate(&mut self, length: u64) -> io::Result<()> {
        self.set_len(length)
    }
}

impl Storage for Cursor<Vec<u8>> {
    fn truncate(&mut self, length: u64) -> io::Result<()> {
        self.get_mut().truncate(usize::try_from(length).unwrap_or(usize::MAX));
        Ok(())
    }
}
