use crate::{PtzError, Result};
use std::io::Read;
use std::path::Path;

/// A password that is never shown: neither by `Debug` nor in any message.
#[derive(Clone, PartialEq, Eq, Default)]
pub struct Password(String);

impl Password {
    /// The longest password read from a file, bytes.
    const LONGEST: u64 = 4096;

    /// A password.
    pub fn new(secret: impl Into<String>) -> Self {
        Self(secret.into())
    }

    /// The first line of a file.
    ///
    /// # Errors
    /// Where the file cannot be read, is not text, or its first line is longer than 4096 bytes.
    pub fn from_file(path: &Path) -> Result<Self> {
        let io = |source| PtzError::Io { head: path.display().to_string(), doing: "reading the password file", source };
        let file = std::fs::File::open(path).map_err(io)?;
        let mut text = String::new();
        file.take(Self::LONGEST).read_to_string(&mut text).map_err(io)?;
        if !text.contains('\n') && text.len() as u64 == Self::LONGEST {
            return Err(PtzError::Address { reason: "the password file has a first line of over 4096 bytes".into() });
        }
        Ok(Self(text.lines().next().unwrap_or_default().to_owned()))
    }

    /// The secret itself, for those who have to prove that they know it.
    pub fn reveal(&self) -> &str {
        &self.0
    }
}

impl std::fmt::Debug for Password {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Password(…)")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_password_is_not_shown() {
        let password = Password::new("sesame");
        assert_eq!(format!("{password:?}"), "Password(…)");
        assert_eq!(password.reveal(), "sesame");
    }

    #[test]
    fn the_first_line_of_a_file_is_read() {
        let folder = std::env::temp_dir().join(format!("pursuit-ptz-password-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let path = folder.join("password");
        std::fs::write(&path, "open sesame\r\nsecond\n").unwrap();
        assert_eq!(Password::from_file(&path).unwrap().reveal(), "open sesame");
        std::fs::write(&path, vec![b'x'; 5000]).unwrap();
        assert!(Password::from_file(&path).is_err());
        std::fs::remove_dir_all(&folder).unwrap();
        assert!(Password::from_file(&path).unwrap_err().to_string().contains("reading the password file"));
    }
}
