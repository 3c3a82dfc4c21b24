//! MOTChallenge (Leal-Taixé et al. 2015, Milan et al. 2016): `gt/gt.txt` with frame,id,left,top,width,height,conf,…
//! counted from 1, images in `img1/` or where `seqinfo.ini` says. Every object becomes a sequence `NAME.ID` that begins
//! where the object first appears and ends where it is last seen.

use super::text::{self, read_numbers, truth_ltwh};
use super::{IMAGES, Listing, MATLAB_ORIGIN, VIDEOS, count_images, has_extension, listing};
use crate::{EvaluationError, Result, Sequence, Truth};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Frame numbers above this are damage.
const MAX_FRAME: f64 = 1_000_000.0;

fn setting(folder: &Path, key: &str) -> Option<String> {
    let text = text::read(&folder.join("seqinfo.ini")).ok()?;
    text.lines().filter_map(|l| l.split_once('=')).find(|(k, _)| k.trim() == key).map(|(_, v)| v.trim().to_owned())
}

pub(super) fn read(folder: &Path, name: &str) -> Result<Vec<Result<Sequence>>> {
    let file = folder.join("gt/gt.txt");
    let mut objects: BTreeMap<u64, BTreeMap<usize, Truth>> = BTreeMap::new();
    for line in read_numbers(&file, 6)? {
        let [frame, id, left, top, width, height, ref rest @ ..] = line.values[..] else { continue };
        // Objects with confidence 0 are marked "do not evaluate".
        if rest.first() == Some(&0.0) {
            continue;
        }
        if !(1.0..=MAX_FRAME).contains(&frame) || frame.fract() != 0.0 || id < 0.0 || id.fract() != 0.0 {
            let reason = format!("frame {frame} and id {id} must be whole numbers, frames counted from 1");
            return Err(EvaluationError::dataset(&file, line.number, reason));
        }
        let truth = truth_ltwh(&file, line.number, [left - MATLAB_ORIGIN, top - MATLAB_ORIGIN, width, height])?;
        objects.entry(id as u64).or_default().insert(frame as usize - 1, truth);
    }
    let input = input_of(folder)
        .ok_or_else(|| EvaluationError::dataset(&file, None, "has neither a folder of images nor a video beside it"))?;
    let images = count_images(&input);
    let last = objects.values().filter_map(|seen| seen.keys().next_back()).max().map_or(0, |l| l + 1);
    if input.is_dir() && last > images {
        return Err(EvaluationError::dataset(
            &file,
            None,
            format!("speaks of frame {last}, there are {images} images"),
        ));
    }
    let sequence = |(id, seen): (u64, BTreeMap<usize, Truth>)| {
        let first = seen.keys().next().copied().unwrap_or(0);
        let last = seen.keys().next_back().copied().unwrap_or(0);
        // A frame without a line: the object has left the image.
        let truth = (first..=last).map(|i| seen.get(&i).copied().unwrap_or(Truth::Absent)).collect();
        Sequence::from_path(format!("{name}.{id}"), &input, first, truth).published_from(MATLAB_ORIGIN)
    };
    // An object seen once cannot be followed.
    Ok(objects.into_iter().filter(|(_, seen)| seen.len() > 1).map(|o| Ok(sequence(o))).collect())
}

fn input_of(folder: &Path) -> Option<PathBuf> {
    let named = setting(folder, "imDir").map(|d| folder.join(d));
    let candidates = named.into_iter().chain([folder.join("img1"), folder.to_owned()]);
    let Listing { files, .. } = listing(folder);
    candidates
        .into_iter()
        .find(|c| listing(c).files.iter().any(|f| has_extension(f, IMAGES)))
        .or_else(|| files.into_iter().find(|f| has_extension(f, VIDEOS)))
}
