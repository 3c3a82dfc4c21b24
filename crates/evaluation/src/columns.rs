//! The figures that every table of an evaluation has a column for: on the terminal, in the report and in files.

use crate::results::{LongTermScore, MeanScore, SupervisedScore};

/// Which end of a column is the better one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Better {
    Higher,
    Lower,
    /// A count or a description.
    Neither,
}

/// How a column's figure is read off the figures of a tracker; `None` where there is no such figure.
#[derive(Clone, Copy)]
pub(crate) enum Reading {
    Figure(fn(&MeanScore) -> Option<f64>),
    Span(fn(&MeanScore) -> Option<[f64; 2]>),
}

/// A column.
pub(crate) struct Column {
    /// Its name in CSV files; a span has `KEY_low` and `KEY_high`.
    pub key: &'static str,
    /// Its heading for readers.
    pub head: &'static str,
    /// What the figure is.
    pub title: &'static str,
    /// Which end is better.
    pub better: Better,
    /// Decimals shown.
    pub digits: usize,
    pub reading: Reading,
}

impl Column {
    const fn share(
        key: &'static str,
        head: &'static str,
        title: &'static str,
        figure: fn(&MeanScore) -> Option<f64>,
    ) -> Self {
        Self { key, head, title, better: Better::Higher, digits: 3, reading: Reading::Figure(figure) }
    }

    const fn span(
        key: &'static str,
        head: &'static str,
        title: &'static str,
        span: fn(&MeanScore) -> Option<[f64; 2]>,
    ) -> Self {
        Self { key, head, title, better: Better::Neither, digits: 3, reading: Reading::Span(span) }
    }

    const fn lower(mut self) -> Self {
        self.better = Better::Lower;
        self
    }

    const fn count(mut self) -> Self {
        self.better = Better::Neither;
        self.with_digits(0)
    }

    const fn with_digits(mut self, digits: usize) -> Self {
        self.digits = digits;
        self
    }

    /// The figure, or for a span its lower end, which it sorts by.
    pub fn value(&self, score: &MeanScore) -> Option<f64> {
        match self.reading {
            Reading::Figure(figure) => figure(score),
            Reading::Span(span) => span(score).map(|[low, _]| low),
        }
    }

    /// The figure as it is read by people.
    pub fn text(&self, score: &MeanScore) -> Option<String> {
        let digits = self.digits;
        match self.reading {
            Reading::Figure(figure) => figure(score).map(|v| format!("{v:.digits$}")),
            Reading::Span(span) => span(score).map(|[low, high]| match low == high {
                true => format!("{low:.digits$}"),
                false => format!("{low:.digits$}–{high:.digits$}"),
            }),
        }
    }
}

fn long(score: &MeanScore) -> Option<&LongTermScore> {
    score.long_term.as_ref()
}

fn vot(score: &MeanScore) -> Option<&SupervisedScore> {
    score.supervised.as_ref()
}

const ALL: &[Column] = &[
    Column::span(
        "rank",
        "rank",
        "by success AUC: behind every tracker that is clearly better, ahead of every one that is clearly worse",
        |s| s.rank.map(|[best, worst]| [best as f64, worst as f64]),
    )
    .with_digits(0),
    Column::share("auc", "AUC", "area under the success curve", |s| Some(s.auc)),
    Column::span("auc_interval", "95 %", "95 % interval of the AUC, by resampling sequences", |s| s.auc_interval),
    Column::share("precision20", "P20", "fraction of frames with a centre error of at most 20 px", |s| {
        Some(s.precision20)
    }),
    Column::share("success50", "SR50", "fraction of frames with overlap above one half", |s| Some(s.success50)),
    Column::share("normalized_precision", "NP", "area under the normalised precision curve", |s| {
        Some(s.normalized_precision)
    }),
    Column::share("fps", "fps", "updates a second on one thread, geometric mean", |s| s.fps).with_digits(1),
    Column::share("calibration_error", "ECE", "expected calibration error of the score; 0 is honest", |s| {
        s.calibration_error
    })
    .lower(),
    Column::share("j_and_f", "J&F", "masks: mean of region similarity and boundary accuracy", |s| {
        s.masks.map(|m| m.j_and_f)
    }),
    Column::share("j_mean", "J", "masks: mean intersection over union", |s| s.masks.map(|m| m.j_mean)),
    Column::share("j_recall", "J recall", "masks: frames with a J above one half", |s| s.masks.map(|m| m.j_recall)),
    Column::share("f_mean", "boundary F", "masks: mean accuracy of the boundary", |s| s.masks.map(|m| m.f_mean)),
    Column::share("f_recall", "F recall", "masks: frames with a boundary F above one half", |s| {
        s.masks.map(|m| m.f_recall)
    }),
    Column::share("f", "F", "long-term F at the state reported", |s| long(s).map(|l| l.f)),
    Column::share("f25", "F25", "F of the TLD evaluation at overlap above .25", |s| long(s).map(|l| l.detection25.f)),
    Column::share("f50", "F50", "F of the TLD evaluation at overlap above .5", |s| long(s).map(|l| l.detection50.f)),
    Column::share(
        "false_alive",
        "false alive",
        "fraction of frames without the target that are reported as tracking",
        |s| long(s).and_then(|l| l.false_alive),
    )
    .lower(),
    Column::share(
        "right_untold",
        "right untold",
        "fraction of the right boxes (overlap of at least one half) that are not reported as tracking",
        |s| long(s).and_then(|l| l.right_untold),
    )
    .lower(),
    Column::share(
        "wrong_told",
        "wrong told",
        "fraction of the wrong boxes of a visible target that are reported as tracking",
        |s| long(s).and_then(|l| l.wrong_told),
    )
    .lower(),
    Column::share("returns", "returns", "how often the target came back", |s| long(s).map(|l| l.returns as f64))
        .count(),
    Column::share("reacquired", "noticed", "returns that were noticed before the target left again", |s| {
        long(s).map(|l| l.reacquired as f64)
    })
    .with_digits(0),
    Column::share("reacquire_frames", "after", "median frames until a return was noticed", |s| {
        long(s).and_then(|l| l.reacquire_frames)
    })
    .lower()
    .with_digits(1),
    Column::share("accuracy", "accuracy", "mean overlap between resets", |s| vot(s).map(|v| v.accuracy)),
    Column::share("failures", "failures", "mean failures, weighted by length", |s| vot(s).map(|v| v.failures))
        .lower()
        .with_digits(2),
    Column::share("robustness", "robustness", "exp(−30 · failures / frames)", |s| vot(s).map(|v| v.robustness)),
    Column::share("eao", "EAO", "expected average overlap over run lengths 100…356", |s| vot(s).and_then(|v| v.eao)),
    Column::share("sequences", "sequences", "sequences counted", |s| Some(s.sequences as f64)).count(),
];

/// The columns that at least one of the trackers has a figure for.
pub(crate) fn filled<'a>(scores: impl Iterator<Item = &'a MeanScore> + Clone) -> Vec<&'static Column> {
    ALL.iter().filter(|c| scores.clone().any(|s| c.value(s).is_some())).collect()
}
