//! The TLD sequences (Kalal, Mikolajczyk, Matas 2010): images or one video beside `gt.txt` with left,top,right,bottom;
//! `NaN` where the target is away. The edges are taken as continuous coordinates, as later users of the data did.

use super::text::{Line, read_numbers, truth_ltwh};
use super::{Listing, vot};
use crate::{EvaluationError, Result, Sequence, Truth};
use std::path::Path;

pub(super) fn read(folder: &Path, name: &str, inside: &Listing) -> Result<Sequence> {
    let file = folder.join("gt.txt");
    let truth: Vec<Truth> = read_numbers(&file, 4)?.into_iter().map(|l| truth_of(&file, &l)).collect::<Result<_>>()?;
    let input = vot::input_of(folder, inside)
        .ok_or_else(|| EvaluationError::dataset(&file, None, "has neither images nor one video beside it"))?;
    Ok(Sequence::from_path(name, &input, 0, truth))
}

fn truth_of(file: &Path, line: &Line) -> Result<Truth> {
    match line.values[..] {
        [left, top, right, bottom, ..] => truth_ltwh(file, line.number, [left, top, right - left, bottom - top]),
        _ => Ok(Truth::Unknown), // cannot be: `read_numbers` checked the length
    }
}
