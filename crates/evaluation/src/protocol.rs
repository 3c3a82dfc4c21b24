//! Protocols: what is run on a sequence, before anything is scored.

use crate::{EvaluationError, Sequence, Truth};
use pursuit_geometry::BBox;
use serde::{Deserialize, Serialize};
use std::str::FromStr;

/// How a tracker is put to the test.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Protocol {
    /// One pass: started on the first annotated frame, never helped (OTB's OPE).
    #[default]
    Ope,
    /// One pass, and precision, recall and F for every sequence (VOT-LT).
    LongTerm,
    /// Started again five frames after every failure (VOT's supervised experiment).
    Reset,
    /// Twelve passes from shifted and scaled first boxes (OTB's SRE).
    Sre,
    /// Twenty passes from starts spread over the sequence (OTB's TRE).
    Tre,
}

impl Protocol {
    /// The word that names it on the command line and in files.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Ope => "ope",
            Self::LongTerm => "long-term",
            Self::Reset => "reset",
            Self::Sre => "sre",
            Self::Tre => "tre",
        }
    }

    /// Whether two protocols run the same passes and differ in scoring only.
    pub fn runs_like(self, other: Self) -> bool {
        let plain = |p: Self| if p == Self::LongTerm { Self::Ope } else { p };
        plain(self) == plain(other)
    }

    /// The passes to run on a sequence; none when nothing is annotated.
    pub fn passes(self, sequence: &Sequence) -> Vec<Pass> {
        let Some((start, bbox)) = sequence.first_visible() else { return Vec::new() };
        match self {
            Self::Ope | Self::LongTerm => vec![Pass { label: None, start, bbox }],
            Self::Reset => vec![Pass { label: Some(self.as_str().to_owned()), start, bbox }],
            Self::Sre => spatial_variants(bbox)
                .into_iter()
                .map(|(label, bbox)| Pass { label: Some(label.to_owned()), start, bbox })
                .collect(),
            Self::Tre => temporal_starts(sequence.truth())
                .into_iter()
                .map(|(start, bbox)| Pass { label: Some(format!("from-{start}")), start, bbox })
                .collect(),
        }
    }
}

impl std::fmt::Display for Protocol {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(self.as_str())
    }
}

impl FromStr for Protocol {
    type Err = EvaluationError;

    fn from_str(s: &str) -> Result<Self, EvaluationError> {
        [Self::Ope, Self::LongTerm, Self::Reset, Self::Sre, Self::Tre].into_iter().find(|p| p.as_str() == s).ok_or_else(
            || EvaluationError::Option(format!("unknown protocol `{s}`; there are ope, long-term, reset, sre and tre")),
        )
    }
}

/// One run of a tracker over a sequence, or over its end.
#[derive(Debug, Clone, PartialEq)]
pub struct Pass {
    /// What tells it from the sequence's other passes, under any protocol.
    pub label: Option<String>,
    /// The frame to start on.
    pub start: usize,
    /// The box to start from.
    pub bbox: BBox,
}

/// How far a shifted start is off, in target sizes, and how much a scaled one is too small or large (Wu 2013, sec. 4).
const SHIFT: f64 = 0.1;
/// Passes of the temporal robustness evaluation.
const SEGMENTS: usize = 20;
/// Frames that the last segment has at least.
const SHORTEST_SEGMENT: usize = 20;

/// The twelve first boxes of the spatial robustness evaluation: eight shifts by a tenth of the size, four scales.
pub fn spatial_variants(bbox: BBox) -> [(&'static str, BBox); 12] {
    let moved = |x: f64, y: f64| bbox.translated(x * SHIFT * bbox.width(), y * SHIFT * bbox.height());
    [
        ("left", moved(-1.0, 0.0)),
        ("right", moved(1.0, 0.0)),
        ("up", moved(0.0, -1.0)),
        ("down", moved(0.0, 1.0)),
        ("left-up", moved(-1.0, -1.0)),
        ("right-up", moved(1.0, -1.0)),
        ("left-down", moved(-1.0, 1.0)),
        ("right-down", moved(1.0, 1.0)),
        ("scale-80", bbox.scaled(0.8)),
        ("scale-90", bbox.scaled(0.9)),
        ("scale-110", bbox.scaled(1.1)),
        ("scale-120", bbox.scaled(1.2)),
    ]
}

/// The starts of the temporal robustness evaluation: twenty frames in which the target is visible, evenly spread up to
/// the last one that leaves twenty frames (the benchmark's `splitSeqTRE.m`). Short sequences have fewer.
pub fn temporal_starts(truth: &[Truth]) -> Vec<(usize, BBox)> {
    let visible: Vec<(usize, BBox)> = truth.iter().enumerate().filter_map(|(i, t)| Some((i, t.bbox()?))).collect();
    let long_enough = |(i, _): &(usize, BBox)| truth.len() - i >= SHORTEST_SEGMENT;
    let Some(last) = visible.iter().rposition(long_enough) else {
        return visible.first().copied().into_iter().collect();
    };
    // MATLAB: floor(1 : last/(segments−1) : last) and last, counted from 1.
    let count = last + 1;
    let step = count as f64 / (SEGMENTS - 1) as f64;
    let mut starts: Vec<usize> = (0..SEGMENTS)
        .map(|i| 1.0 + i as f64 * step)
        .take_while(|p| *p <= count as f64)
        .map(|p| p.floor() as usize - 1)
        .collect();
    starts.push(last);
    starts.dedup();
    starts.into_iter().filter_map(|i| visible.get(i).copied()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_round_trip() {
        for p in [Protocol::Ope, Protocol::LongTerm, Protocol::Reset, Protocol::Sre, Protocol::Tre] {
            assert_eq!(p.as_str().parse::<Protocol>().unwrap(), p);
        }
        assert!("opera".parse::<Protocol>().unwrap_err().to_string().contains("there are ope"));
    }

    #[test]
    fn temporal_starts_are_those_of_the_benchmark() {
        let visible = |i: usize| Truth::Visible(BBox::from_ltwh(i as f64, 0.0, 4.0, 4.0));
        let truth: Vec<Truth> = (0..119).map(visible).collect();
        let starts: Vec<usize> = temporal_starts(&truth).into_iter().map(|(i, _)| i).collect();
        // count = 100, step = 100/19: floor(1 : 5.263… : 100) − 1, then 99.
        let expected = [0, 5, 10, 15, 21, 26, 31, 36, 42, 47, 52, 57, 63, 68, 73, 78, 84, 89, 94, 99];
        assert_eq!(starts, expected);
        let hidden: Vec<Truth> = (0..119).map(|i| if i == 0 { Truth::Absent } else { visible(i) }).collect();
        assert_eq!(temporal_starts(&hidden)[0].0, 1, "an unannotated frame cannot be started on");
        assert_eq!(temporal_starts(&truth[..10]).len(), 1);
    }

    #[test]
    fn spatial_variants_shift_and_scale_as_published() {
        let bbox = BBox::from_ltwh(100.0, 50.0, 20.0, 40.0);
        let all = spatial_variants(bbox);
        assert_eq!(all[7].1, BBox::from_ltwh(102.0, 54.0, 20.0, 40.0));
        assert!((all[8].1.area() - bbox.area() * 0.64).abs() < 1e-9 && all[8].1.center() == bbox.center());
    }
}
