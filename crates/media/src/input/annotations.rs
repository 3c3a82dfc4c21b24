use super::folder::{FolderSource, Row};
use super::source::StopHandle;
use crate::{MediaError, OpenOptions, Result, Source, SourceInfo, Truth};
use csv::StringRecord;
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use std::fs::File;
use std::io::Read;
use std::path::{Component, Path, PathBuf};

/// The name of the list that makes a folder an annotated sequence.
pub(crate) const LIST_NAME: &str = "frames.csv";

/// The largest list read: a million frames with long names.
const MAX_LIST_BYTES: u64 = 256 << 20;

/// A frame index beyond this in a truth file is an error in the file: no video is that long.
const MAX_INDEX: u64 = 1 << 24;

/// Opens a folder with `frames.csv`: `index,image[,depth],x,y,w,h`, one row a frame in order; images are named relative to
/// the folder.
pub(crate) fn open_list(folder: &Path, name: &str, options: &OpenOptions) -> Result<FolderSource> {
    let path = folder.join(LIST_NAME);
    let file = File::open(&path).map_err(|e| MediaError::unreadable(path.display().to_string(), e.to_string()))?;
    let list = read_list(file, &path.display().to_string())?;
    let rows = list
        .iter()
        .map(|row| Row { image: folder.join(&row.image), depth: row.depth.as_ref().map(|depth| folder.join(depth)) });
    let mut source = FolderSource::new(rows.collect(), name, options.default_fps, "frames.csv (built in)")?
        .with_depth(&options.depth, None)?;
    source.info_mut().truth = Some(list.into_iter().map(|row| row.truth).collect());
    Ok(source)
}

/// The truth beside a video: `NAME.csv` with `index,x,y,w,h` beside `NAME.mp4`. `None` where there is no such file, or
/// where it is a table of something else.
pub(crate) fn truth_beside(video: &Path) -> Result<Option<Vec<Truth>>> {
    let path = video.with_extension("csv");
    if path == video || !path.is_file() {
        return Ok(None);
    }
    let name = path.display().to_string();
    let file = File::open(&path).map_err(|e| MediaError::unreadable(&name, e.to_string()))?;
    read_truth(file, &name)
}

/// A source with the truth that lay beside it.
pub(crate) struct Annotated {
    source: Box<dyn Source>,
    info: SourceInfo,
}

impl Annotated {
    pub fn new(source: Box<dyn Source>, truth: Vec<Truth>) -> Self {
        let info = SourceInfo { truth: Some(truth), ..source.info().clone() };
        Self { source, info }
    }
}

impl Source for Annotated {
    fn info(&self) -> &SourceInfo {
        &self.info
    }

    fn next_frame(&mut self) -> Result<Option<Frame>> {
        self.source.next_frame()
    }

    fn seek(&mut self, index: u64) -> Result<()> {
        self.source.seek(index)
    }

    fn stop_handle(&self) -> Option<StopHandle> {
        self.source.stop_handle()
    }
}

/// One row of `frames.csv`.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ListRow {
    image: PathBuf,
    depth: Option<PathBuf>,
    truth: Truth,
}

/// Reads `frames.csv`.
pub(crate) fn read_list(file: impl Read, name: &str) -> Result<Vec<ListRow>> {
    let mut table = Table::read(file, name)?;
    let image = table.column("image").ok_or_else(|| {
        MediaError::unreadable(name, "its first line must name the columns index,image[,depth],x,y,w,h")
    })?;
    let (depth, boxes) = (table.column("depth"), table.box_columns());
    table.rows(|record| {
        let field = |column: usize| record.get(column).map(str::trim).filter(|text| !text.is_empty());
        let image = field(image).ok_or("it names no image")?;
        let truth = boxes.map_or(Ok(Truth::Unknown), |columns| truth_of(record, columns))?;
        let depth = depth.and_then(field).map(inside).transpose()?;
        Ok(ListRow { image: inside(image)?, depth, truth })
    })
}

/// A path that stays in the folder of the list: a list from elsewhere must not name other files of this machine.
fn inside(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    let stays = path.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
    if stays {
        Ok(path)
    } else {
        Err(format!("{text:?} leads out of the folder; put the images, or a link to them, into it"))
    }
}

/// Reads `NAME.csv`; `None` when its columns are not `index,x,y,w,h`.
pub(crate) fn read_truth(file: impl Read, name: &str) -> Result<Option<Vec<Truth>>> {
    let mut table = Table::read(file, name)?;
    let (Some(index), Some(boxes)) = (table.column("index"), table.box_columns()) else { return Ok(None) };
    let rows = table.rows(|record| {
        let text = record.get(index).unwrap_or_default().trim();
        let index = text.parse::<u64>().ok().filter(|&i| i <= MAX_INDEX);
        let index = index.ok_or_else(|| format!("{text:?} is no frame index"))?;
        Ok((index as usize, truth_of(record, boxes)?))
    })?;
    let mut truth = vec![Truth::Unknown; rows.iter().map(|row| row.0 + 1).max().unwrap_or(0)];
    for (index, value) in rows {
        truth[index] = value;
    }
    Ok(Some(truth))
}

/// Left, top, width, height: all `nan` or an empty area is absent, all empty is unknown.
fn truth_of(record: &StringRecord, columns: [usize; 4]) -> Result<Truth, String> {
    let texts = columns.map(|column| record.get(column).unwrap_or_default().trim());
    if texts.iter().all(|text| text.is_empty()) {
        return Ok(Truth::Unknown);
    }
    let mut values = [0.0; 4];
    for (value, text) in values.iter_mut().zip(texts) {
        *value = text.parse::<f64>().map_err(|_| format!("{text:?} is no number"))?;
    }
    let [x, y, w, h] = values;
    if values.iter().any(|v| v.is_nan()) || w <= 0.0 || h <= 0.0 {
        return Ok(Truth::Absent);
    }
    let bbox = BBox::from_ltwh(x, y, w, h);
    if bbox.is_finite() { Ok(Truth::Visible(bbox)) } else { Err("a box must be finite".to_owned()) }
}

/// A CSV file with a line of column names.
struct Table<'a, R> {
    reader: csv::Reader<std::io::Take<R>>,
    columns: StringRecord,
    name: &'a str,
}

impl<'a, R: Read> Table<'a, R> {
    fn read(file: R, name: &'a str) -> Result<Self> {
        let mut reader = csv::ReaderBuilder::new().flexible(true).from_reader(file.take(MAX_LIST_BYTES));
        let columns = reader.headers().map_err(|e| MediaError::unreadable(name, e.to_string()))?.clone();
        Ok(Self { reader, columns, name })
    }

    fn column(&self, wanted: &str) -> Option<usize> {
        // Spreadsheets put a byte order mark before the first name.
        self.columns.iter().position(|c| c.trim_start_matches('\u{feff}').trim() == wanted)
    }

    fn box_columns(&self) -> Option<[usize; 4]> {
        Some([self.column("x")?, self.column("y")?, self.column("w")?, self.column("h")?])
    }

    fn rows<T>(&mut self, row: impl Fn(&StringRecord) -> Result<T, String>) -> Result<Vec<T>> {
        let mut rows = Vec::new();
        for record in self.reader.records() {
            let record = record.map_err(|e| MediaError::unreadable(self.name, e.to_string()))?;
            rows.push(row(&record).map_err(|reason| {
                let line = record.position().map_or(0, csv::Position::line);
                MediaError::unreadable(self.name, format!("line {line}: {reason}"))
            })?);
        }
        Ok(rows)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_give_images_depth_and_truth() {
        let text = "index,image,depth,x,y,w,h\n0,a.png,d.png,1,2,3,4\n1,b.png,,nan,nan,nan,nan\n2,c.png,,,,,\n";
        let rows = read_list(text.as_bytes(), "t").unwrap();
        assert_eq!(rows[0].depth, Some(PathBuf::from("d.png")));
        let truth: Vec<_> = rows.iter().map(|r| r.truth).collect();
        assert_eq!(truth, [Truth::Visible(BBox::from_ltwh(1.0, 2.0, 3.0, 4.0)), Truth::Absent, Truth::Unknown]);
    }

    #[test]
    fn truth_goes_by_index() {
        let truth = read_truth("\u{feff}index,x,y,w,h\n2,1,2,3,4\n0,5,6,0,0\n".as_bytes(), "t").unwrap().unwrap();
        assert_eq!(truth, [Truth::Absent, Truth::Unknown, Truth::Visible(BBox::from_ltwh(1.0, 2.0, 3.0, 4.0))]);
        assert_eq!(read_truth("frame,price\n1,2\n".as_bytes(), "t").unwrap(), None);
    }

    #[test]
    fn slips_are_named_with_their_line() {
        for (text, want) in [
            ("index,x,y,w,h\n0,1,2,3,4\n1,1,two,3,4\n", "line 3: \"two\" is no number"),
            ("index,x,y,w,h\n-1,1,2,3,4\n", "line 2: \"-1\" is no frame index"),
            ("index,x,y,w,h\n99999999999,1,2,3,4\n", "is no frame index"),
        ] {
            let error = read_truth(text.as_bytes(), "truth.csv").unwrap_err().to_string();
            assert!(error.contains("truth.csv") && error.contains(want), "{error}");
        }
        let error = read_list("index,picture\n".as_bytes(), "frames.csv").unwrap_err().to_string();
        assert!(error.contains("index,image"), "{error}");
    }
}
