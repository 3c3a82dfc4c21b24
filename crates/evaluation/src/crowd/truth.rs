//! The truth of a sequence of many targets, as MOTChallenge and KITTI publish it.

use crate::boxes::lines::{cells, corners, each_line, number, whole};
use crate::boxes::{MAX_FRAME, MAX_ROWS};
use crate::{EvaluationError, Result};
use pursuit_geometry::BBox;
use std::collections::BTreeSet;
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

/// KITTI's truth is of targets at most this much hidden (2: largely) and not cut off by the picture's edge.
const MOST_OCCLUDED: f64 = 2.0;
const MOST_TRUNCATED: f64 = 0.0;
/// The class that MOTChallenge scores.
const PEDESTRIAN: i64 = 1;
/// Its classes that a tracker may follow or not: people on vehicles, static people, distractors, reflections.
const DISTRACTORS: [i64; 4] = [2, 7, 8, 12];
/// In MOT20 also vehicles without a motor.
const MOT20_DISTRACTOR: i64 = 6;
/// KITTI's classes that are scored, each with those too alike to count a mistake between them.
const KITTI_CLASSES: [(&str, &[&str]); 3] =
    [("car", &["van"]), ("pedestrian", &["person", "person_sitting"]), ("cyclist", &[])];

/// What a true box counts for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Counts {
    /// It is to be found.
    Yes,
    /// A box matched with it is neither right nor wrong.
    Neutral,
    /// It takes part in the matching of neutral boxes alone.
    No,
}

/// A true box.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct TrueBox {
    pub frame: u64,
    pub id: u64,
    pub bbox: BBox,
    pub counts: Counts,
    /// Of KITTI: the class it is of, or is too alike.
    pub class: Option<&'static str>,
}

/// The truth of one sequence.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct CrowdTruth {
    pub(super) boxes: Vec<TrueBox>,
    /// Where boxes without a match are not counted.
    pub(super) regions: Vec<(u64, BBox)>,
    /// As of [`Boxes`](crate::boxes::Boxes).
    pub(super) origin: f64,
    /// The classes that are scored one by one; none where the file has no classes.
    pub(super) classes: Vec<&'static str>,
}

impl CrowdTruth {
    /// One more than the last frame that has a true box.
    pub(super) fn frames(&self) -> u64 {
        self.boxes.iter().map(|b| b.frame + 1).max().unwrap_or(0)
    }

    /// Reads MOTChallenge's form, or KITTI's where lines are separated by blanks. `name` is that of the sequence: MOT20 has a rule of its own.
    pub fn read(path: &Path, name: &str) -> Result<Self> {
        let file =
            File::open(path).map_err(|e| EvaluationError::dataset(path, None, format!("cannot be read: {e}")))?;
        Self::parse(&mut BufReader::new(file), path, name)
    }

    fn parse(bytes: &mut dyn BufRead, path: &Path, name: &str) -> Result<Self> {
        let mut truth = Self::default();
        each_line(bytes, path, |at, line| {
            let cells = cells(line);
            let kitti = !line.contains(',') && cells.len() >= 10;
            let read = if kitti { truth.kitti(&cells) } else { truth.mot(&cells, name.starts_with("MOT20")) };
            read.map_err(|reason| EvaluationError::dataset(path, at, reason))?;
            if truth.boxes.len() + truth.regions.len() > MAX_ROWS {
                return Err(EvaluationError::dataset(
                    path,
                    at,
                    format!("is the box after {MAX_ROWS}; give the sequence in parts"),
                ));
            }
            truth.origin = if kitti { 0.0 } else { 1.0 };
            Ok(())
        })?;
        let classes: BTreeSet<&str> = truth.boxes.iter().filter_map(|b| b.class).collect();
        truth.classes = classes.into_iter().collect();
        Ok(truth)
    }

    /// `frame,id,left,top,width,height,flag[,class,visibility]`. With a class it is MOT16's form or later: boxes marked 0 and
    /// other classes are not looked for, distractors are neutral. With eight cells or more and no class it is MOT15's: boxes
    /// marked 0 are left out. With seven or less a box marked 0 is neutral. A box of id −1 is a region.
    fn mot(&mut self, cells: &[&str], mot20: bool) -> Result<(), String> {
        if cells.len() < 6 {
            return Err(format!("has {} cells; give frame,id,left,top,width,height,flag", cells.len()));
        }
        let frame = frame(cells[0], 1)? - 1;
        let id = whole(cells[1], "id", -1)?;
        let mut ltwh = [0.0; 4];
        for (place, (cell, name)) in ltwh.iter_mut().zip(cells[2..6].iter().zip(["left", "top", "width", "height"])) {
            *place = number(cell, name)?;
        }
        let bbox = sound(ltwh)?;
        let flag = cells.get(6).map_or(Ok(1.0), |cell| number(cell, "flag"))?;
        let class = cells.get(7).map(|cell| number(cell, "class")).transpose()?;
        let Ok(id) = u64::try_from(id) else {
            self.regions.push((frame, bbox));
            return Ok(());
        };
        let counts = match class {
            Some(class) if class >= 1.0 => match class as i64 {
                PEDESTRIAN if flag != 0.0 => Counts::Yes,
                class if DISTRACTORS.contains(&class) || (mot20 && class == MOT20_DISTRACTOR) => Counts::Neutral,
                _ => Counts::No,
            },
            _ if flag != 0.0 => Counts::Yes,
            Some(_) => Counts::No,
            None => Counts::Neutral,
        };
        self.boxes.push(TrueBox { frame, id, bbox, counts, class: None });
        Ok(())
    }

    /// `frame id type truncated occluded alpha left top right bottom …`.
    fn kitti(&mut self, cells: &[&str]) -> Result<(), String> {
        let frame = frame(cells[0], 0)?;
        let bbox = sound(corners(&cells[6..10])?)?;
        let word = cells[2].to_ascii_lowercase();
        if word == "dontcare" {
            self.regions.push((frame, bbox));
            return Ok(());
        }
        let known = KITTI_CLASSES.into_iter().find(|(class, alike)| *class == word || alike.contains(&word.as_str()));
        let Some((class, _)) = known else { return Ok(()) };
        let id = whole(cells[1], "id", 0)? as u64;
        let (truncated, occluded) = (number(cells[3], "truncated")?, number(cells[4], "occluded")?);
        let whole = word == class && truncated <= MOST_TRUNCATED && occluded <= MOST_OCCLUDED;
        let counts = if whole { Counts::Yes } else { Counts::Neutral };
        self.boxes.push(TrueBox { frame, id, bbox, counts, class: Some(class) });
        Ok(())
    }
}

fn frame(cell: &str, least: i64) -> Result<u64, String> {
    let frame = whole(cell, "frame", least)? as u64;
    if frame > MAX_FRAME { Err(format!("frame {frame} is above {MAX_FRAME}")) } else { Ok(frame) }
}

fn sound([left, top, width, height]: [f64; 4]) -> Result<BBox, String> {
    if [left, top, width, height].iter().all(|v| v.is_finite()) && width >= 0.0 && height >= 0.0 {
        return Ok(BBox::from_ltwh(left, top, width, height));
    }
    Err(format!(
        "the box {left},{top},{width},{height} cannot be one; give left, top, width and height in pixels, sizes not below 0"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn counts(text: &str, name: &str) -> Vec<Counts> {
        let truth = CrowdTruth::parse(&mut text.as_bytes(), Path::new("gt.txt"), name).unwrap();
        truth.boxes.iter().map(|b| b.counts).collect()
    }

    #[test]
    fn marks_and_classes_say_what_counts() {
        use Counts::{Neutral, No, Yes};
        assert_eq!(counts("1,1,1,1,2,2,1\n1,2,1,1,2,2,0\n1,-1,1,1,2,2,0\n1,3,1,1,2,2\n", "a"), [Yes, Neutral, Yes]);
        assert_eq!(counts("1,1,1,1,2,2,1,-1,-1,-1\n1,2,1,1,2,2,0,-1,-1,-1\n", "a"), [Yes, No]);
        let mot17 = "1,1,1,1,2,2,1,1,0.5\n1,2,1,1,2,2,0,1,1\n1,3,1,1,2,2,1,7,1\n1,4,1,1,2,2,0,6,1\n";
        assert_eq!(counts(mot17, "MOT17-02"), [Yes, No, Neutral, No]);
        assert_eq!(counts(mot17, "MOT20-01"), [Yes, No, Neutral, Neutral]);
        let kitti = "0 1 Car 0 0 0 1 1 5 5\n0 2 Van 0 0 0 1 1 5 5\n0 3 Car 1 0 0 1 1 5 5\n0 4 Car 0 3 0 1 1 5 5\n0 5 Tram 0 0 0 1 1 5 5\n0 -1 DontCare -1 -1 0 1 1 5 5\n";
        assert_eq!(counts(kitti, "0000"), [Yes, Neutral, Neutral, Neutral]);
    }

    #[test]
    fn damaged_truth_is_named_with_its_line() {
        for (text, words) in [
            ("1,1,1,1\n", "4 cells"),
            ("1,1,1,1,2,2\n1,1,a,1,2,2\n", "gt.txt:2: left `a`"),
            ("1,1,1,1,-2,2\n", "cannot be"),
        ] {
            let message = CrowdTruth::parse(&mut text.as_bytes(), Path::new("gt.txt"), "").unwrap_err().to_string();
            assert!(message.contains(words), "{message}");
        }
    }
}
