//! Where the results of a run go in its folder.

use crate::RunError;
use crate::config::RunConfig;
#[cfg(feature = "encode")]
use crate::events::RecorderSink;
use crate::events::{EventFile, EventRules};
use crate::resume::Earlier;
use crate::run_folder::{OVERLAY, RunFolder};
use crate::segments::{EVENTS, SegmentedSink, Shelf};
use crate::sinks::{self, Format, Sink};
use pursuit_media::SourceInfo;
use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

/// Where what is cut, and what is of events, goes, where there is something.
pub fn shelf(
    config: &RunConfig,
    rules: &EventRules,
    folder: &RunFolder,
    goes_on: bool,
) -> Result<Option<Shelf>, RunError> {
    if config.segment.is_none() && rules.clips.is_none() {
        return Ok(None);
    }
    let now = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0.0, |d| d.as_secs_f64());
    let open = if goes_on { Shelf::reopen } else { Shelf::open };
    open(folder.path(), config.stretch(), now).map(Some)
}

/// Where a run writes.
#[derive(Clone, Copy)]
pub struct Place<'a> {
    pub folder: &'a RunFolder,
    pub shelf: Option<&'a Shelf>,
    pub earlier: Option<&'a Earlier>,
}

/// What writes the run's files.
pub fn create_sinks(
    config: &RunConfig,
    info: &SourceInfo,
    rules: &EventRules,
    place: Place<'_>,
) -> Result<Vec<Box<dyn Sink>>, RunError> {
    let mut formats = formats(config)?;
    formats.retain(|f| *f != Format::CSV);
    formats.insert(0, Format::CSV);
    #[cfg_attr(not(feature = "encode"), expect(unused_mut, reason = "nothing else is added"))]
    let mut all = match place.shelf.filter(|_| config.segment.is_some()) {
        Some(shelf) => {
            place.earlier.map_or(Ok(()), |earlier| earlier.cut_segments(shelf, &formats))?;
            create_segmented(config, info, rules, &formats, shelf)?
        }
        None => create_whole(config, info, rules, &formats, place)?,
    };
    #[cfg(feature = "encode")]
    if let Some(clips) = &rules.clips {
        all.push(Box::new(RecorderSink::new(info, config.overlay.unwrap_or_default(), clips.before_s)?));
    }
    Ok(all)
}

/// Of files that are one from the first frame to the last.
fn create_whole(
    config: &RunConfig,
    info: &SourceInfo,
    rules: &EventRules,
    formats: &[Format],
    Place { folder, earlier, .. }: Place<'_>,
) -> Result<Vec<Box<dyn Sink>>, RunError> {
    let video = earlier.map_or_else(|| Ok(folder.file(OVERLAY)), |earlier| earlier.cut(formats))?;
    let mut all = Vec::new();
    for format in formats {
        let sink = match earlier {
            Some(_) => format.append(folder.path(), info.input_size()),
            None => format.create(folder.path(), info.input_size()),
        };
        all.push(sink?);
    }
    if rules.file {
        let path = folder.file(EVENTS);
        earlier.map_or(Ok(()), |earlier| earlier.cut_file(&path, &EventFile::LINES))?;
        all.push(Box::new(EventFile::open(&path, earlier.is_some())?));
    }
    all.extend(sinks::overlay(&video, info, config.video, config.overlay.unwrap_or_default())?);
    Ok(all)
}

/// The same, of files that are cut.
fn create_segmented(
    config: &RunConfig,
    info: &SourceInfo,
    rules: &EventRules,
    formats: &[Format],
    shelf: &Shelf,
) -> Result<Vec<Box<dyn Sink>>, RunError> {
    let mut all: Vec<Box<dyn Sink>> = Vec::new();
    for format in formats.iter().copied() {
        let size = info.input_size();
        all.push(Box::new(SegmentedSink::new(shelf.clone(), format.file_name(), move |p| format.create_at(p, size))));
    }
    if rules.file {
        let make = |path: &Path| Ok(Box::new(EventFile::open(path, false)?) as Box<dyn Sink>);
        all.push(Box::new(SegmentedSink::new(shelf.clone(), EVENTS, make)));
    }
    if sinks::has_overlay(config.video)? {
        let (info, style) = (info.clone(), config.overlay.unwrap_or_default());
        let make = move |path: &Path| Ok(sinks::overlay(path, &info, None, style)?.unwrap_or_else(sinks::nothing));
        all.push(Box::new(SegmentedSink::new(shelf.clone(), OVERLAY, make)));
    }
    Ok(all)
}

/// The files' formats beside the first.
pub fn formats(config: &RunConfig) -> Result<Vec<Format>, RunError> {
    config.formats.iter().map(|name| name.parse()).collect()
}
