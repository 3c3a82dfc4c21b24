use super::text::{Text, TextSink, whole};
use super::{LIST, Sink};
use crate::RunError;
use crate::revise::{Edit, Row};
use pursuit_geometry::Size;
use std::fmt;
use std::path::Path;
use std::str::FromStr;

/// A format of a trajectory: all that is known of it is declared once, beside its code.
#[derive(Clone, Copy)]
pub struct Format(pub(super) &'static Declared);

/// What a format declares of itself.
pub(super) struct Declared {
    pub name: &'static str,
    pub summary: &'static str,
    pub file_name: &'static str,
    pub media_type: &'static str,
    pub kind: Kind,
}

pub(super) enum Kind {
    /// A text about pictures of this size; and how its lines are told apart, where a file of it can be gone on with.
    Text(fn(Size) -> Box<dyn Text>, Option<Lines>),
    /// Any other file.
    #[cfg_attr(
        not(any(feature = "mcap", feature = "parquet", feature = "xlsx")),
        expect(dead_code, reason = "all others are texts")
    )]
    File(fn(&Path) -> Result<Box<dyn Sink>, RunError>),
    /// This build cannot write it, for this reason.
    #[cfg_attr(
        all(feature = "mcap", feature = "parquet", feature = "xlsx"),
        expect(dead_code, reason = "no others may be missing")
    )]
    Missing(&'static str),
}

/// The lines of a text to which can be added.
pub(crate) struct Lines {
    pub has_header: bool,
    /// The frame that a line is about.
    pub frame_of: fn(&str) -> Option<u64>,
}

impl Format {
    /// All of them, built in or not.
    pub const ALL: &'static [Self] = &LIST;
    /// A row for every frame and target; always written.
    pub const CSV: Self = super::csv::FORMAT;
    /// A JSON object a line, which is what standard output takes.
    pub const JSONL: Self = super::jsonl::FORMAT;

    /// MOTChallenge's form.
    pub const MOT: Self = super::mot::FORMAT;

    /// The name that commands and configurations use.
    pub const fn name(self) -> &'static str {
        self.0.name
    }

    /// What it is, in a line.
    pub const fn summary(self) -> &'static str {
        self.0.summary
    }

    /// The file that it is written to, in a run's folder.
    pub const fn file_name(self) -> &'static str {
        self.0.file_name
    }

    /// Its media type, for whoever sends it.
    pub const fn media_type(self) -> &'static str {
        self.0.media_type
    }

    /// Creates its file in `folder`, for pictures of `size`.
    ///
    /// # Errors
    /// [`RunError::Output`] when it cannot be written, [`RunError::Usage`] when this build cannot write the format.
    pub fn create(self, folder: &Path, size: Size) -> Result<Box<dyn Sink>, RunError> {
        self.create_at(&folder.join(self.file_name()), size)
    }

    /// Creates a file of another name.
    ///
    /// # Errors
    /// As [`create`](Self::create).
    pub(crate) fn create_at(self, path: &Path, size: Size) -> Result<Box<dyn Sink>, RunError> {
        match &self.0.kind {
            Kind::Text(text, _) => Ok(Box::new(TextSink::create(path, text(size))?)),
            Kind::File(create) => create(path),
            Kind::Missing(why) => Err(RunError::usage(*why)),
        }
    }

    /// Creates a file of another name, which is told of frames without pixels.
    ///
    /// # Errors
    /// [`RunError::Output`] when it cannot be written, [`RunError::Usage`] for a format that is no text.
    pub(crate) fn create_text(self, path: &Path, size: Size) -> Result<TextSink, RunError> {
        TextSink::create(path, self.text(size)?)
    }

    /// Writes to anything instead of a file, which messages call `name`.
    ///
    /// # Errors
    /// [`RunError::Output`] when it cannot be written, [`RunError::Usage`] for a format that is no text.
    pub fn to_writer(
        self,
        name: &str,
        out: Box<dyn std::io::Write + Send>,
        size: Size,
    ) -> Result<Box<dyn Sink>, RunError> {
        Ok(Box::new(TextSink::to_writer(name, out, self.text(size)?)?))
    }

    /// The text of a trajectory that is known, with what a user did.
    ///
    /// # Errors
    /// [`RunError::Usage`] for a format that is no text.
    pub fn of_rows<'a>(
        self,
        rows: impl IntoIterator<Item = &'a Row>,
        edits: &[Edit],
        size: Size,
    ) -> Result<Vec<u8>, RunError> {
        Ok(whole(self.text(size)?, rows, edits))
    }

    fn text(self, size: Size) -> Result<Box<dyn Text>, RunError> {
        match &self.0.kind {
            Kind::Text(text, _) => Ok(text(size)),
            Kind::File(_) => Err(RunError::usage(format!("the format {self} is no text; it is written to a file"))),
            Kind::Missing(why) => Err(RunError::usage(*why)),
        }
    }

    /// Goes on with its file in `folder`.
    ///
    /// # Errors
    /// [`RunError::Output`] when it cannot be written, [`RunError::Usage`] for a format that cannot be added to.
    pub(crate) fn append(self, folder: &Path, size: Size) -> Result<Box<dyn Sink>, RunError> {
        self.lines()?;
        Ok(Box::new(TextSink::append(&folder.join(self.file_name()), self.text(size)?)?))
    }

    /// How the lines of its file are told apart.
    ///
    /// # Errors
    /// [`RunError::Usage`] for a format that cannot be added to.
    pub(crate) fn lines(self) -> Result<&'static Lines, RunError> {
        match &self.0.kind {
            Kind::Text(_, Some(lines)) => Ok(lines),
            _ => Err(RunError::usage(format!("nothing can be added to a file of the format {self}"))),
        }
    }
}

impl PartialEq for Format {
    fn eq(&self, other: &Self) -> bool {
        self.name() == other.name()
    }
}

impl Eq for Format {}

impl fmt::Debug for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Format").field(&self.name()).finish()
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Format {
    type Err = RunError;

    /// # Errors
    /// [`RunError::Usage`] for a name that is none, or a format that this build cannot write.
    fn from_str(name: &str) -> Result<Self, RunError> {
        match Self::ALL.iter().find(|f| f.name() == name) {
            Some(Self(Declared { kind: Kind::Missing(why), .. })) => Err(RunError::usage(*why)),
            Some(format) => Ok(*format),
            None => {
                let all: Vec<&str> = Self::ALL.iter().map(|f| f.name()).collect();
                let all = all.join(", ");
                Err(RunError::usage(format!("there is no format `{name}`; there are: {all}")))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: Size = Size::new(64, 48);

    #[test]
    fn names_are_read_back() {
        for format in Format::ALL {
            match format.to_string().parse::<Format>() {
                Ok(read) => assert_eq!(read, *format),
                Err(error) => {
                    let optional = [
                        ("mcap", cfg!(feature = "mcap")),
                        ("parquet", cfg!(feature = "parquet")),
                        ("xlsx", cfg!(feature = "xlsx")),
                    ];
                    assert!(optional.contains(&(format.name(), false)), "{error}");
                    assert!(error.to_string().contains(&format!("--features {format}")), "{error}");
                }
            }
        }
        let error = "xml".parse::<Format>().unwrap_err();
        let names = "csv, csv-semicolon, xlsx, jsonl, mot, parquet, predictions, coco, cvat, vot, mcap";
        assert!(error.to_string().contains("`xml`") && error.to_string().contains(names), "{error}");
        assert_eq!(error.exit_code(), 2);
    }

    #[test]
    fn every_format_creates_its_file() {
        let folder = tempfile::tempdir().unwrap();
        for format in Format::ALL.iter().filter(|f| f.name().parse::<Format>().is_ok()) {
            let mut sink = format.create(folder.path(), SIZE).unwrap();
            let path = folder.path().join(format.file_name());
            assert_eq!(sink.files(), std::slice::from_ref(&path));
            sink.finish().unwrap();
            let bytes = std::fs::read(&path).unwrap();
            sink.finish().unwrap();
            assert_eq!(std::fs::read(&path).unwrap(), bytes, "{format} ends once");
        }
        let occupied = folder.path().join("trajectory.csv");
        assert_eq!(Format::CSV.create(&occupied, SIZE).err().unwrap().exit_code(), 4);
    }
}
