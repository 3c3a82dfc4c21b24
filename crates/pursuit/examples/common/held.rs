//! What the process holds, looked at again and again.

use std::error::Error;
use std::fmt;

/// Resident memory in KiB, threads, file descriptors.
#[derive(Debug, Clone, Copy)]
pub struct Held {
    pub kib: u64,
    pub threads: usize,
    pub files: usize,
}

impl Held {
    /// Now; only Linux says so in files.
    ///
    /// # Errors
    /// Where nothing is said.
    pub fn now() -> Result<Self, Box<dyn Error>> {
        let status = std::fs::read_to_string("/proc/self/status")?;
        let kib = status.lines().find_map(|l| l.strip_prefix("VmRSS:")?.split_whitespace().next()?.parse().ok());
        let count = |folder: &str| Ok::<_, std::io::Error>(std::fs::read_dir(folder)?.count());
        let kib = kib.ok_or("no VmRSS")?;
        Ok(Self { kib, threads: count("/proc/self/task")?, files: count("/proc/self/fd")? })
    }
}

impl fmt::Display for Held {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { kib, threads, files } = self;
        write!(f, "{:.1} MiB, {threads} threads, {files} files", *kib as f64 / 1024.0)
    }
}
