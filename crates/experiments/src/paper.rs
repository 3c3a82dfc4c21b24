use crate::ExperimentError;
use serde::Serialize;
use std::fmt;
use std::str::FromStr;

/// The papers: the one list of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Paper {
    /// A ball followed by its colour and a linear Kalman filter.
    Ball,
    /// A constant-acceleration filter that predicts a walking person.
    Qu2010,
    /// Depth, a correlation filter and a particle filter.
    Zhai2024,
    /// TLD with a Kalman filter that corrects at manoeuvres.
    Zhu2014,
    /// A Kalman filter whose transition is learnt by support vector regression.
    Gao2007,
}

impl Paper {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Ball, Self::Qu2010, Self::Zhai2024, Self::Zhu2014, Self::Gao2007];

    /// The key that the project knows the paper by.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Ball => "ball",
            Self::Qu2010 => "qu2010",
            Self::Zhai2024 => "zhai2024",
            Self::Zhu2014 => "zhu2014",
            Self::Gao2007 => "gao2007",
        }
    }

    /// What it is about, in a line.
    pub const fn summary(self) -> &'static str {
        match self {
            Self::Ball => "A ball followed by its colour and a linear Kalman filter",
            Self::Qu2010 => "A constant-acceleration filter that predicts a walking person",
            Self::Zhai2024 => "Depth, a correlation filter and a particle filter, through occlusion",
            Self::Zhu2014 => "TLD with a Kalman filter that corrects at manoeuvres and says where to scan",
            Self::Gao2007 => "A Kalman filter whose transition is learnt by support vector regression",
        }
    }

    /// How many seeds show in a few seconds what the figures are like. Of fewer seeds than
    /// [`default_seeds`](Self::default_seeds) they stray more, and a bar may be missed by chance.
    pub const fn quick_seeds(self) -> u32 {
        match self {
            Self::Ball | Self::Qu2010 | Self::Gao2007 => self.default_seeds(),
            Self::Zhai2024 => 80,
            Self::Zhu2014 => 20,
        }
    }

    /// How many seeds the bars ask for.
    pub const fn default_seeds(self) -> u32 {
        match self {
            Self::Ball => 200,
            Self::Zhu2014 => 300,
            Self::Qu2010 | Self::Zhai2024 | Self::Gao2007 => 1000,
        }
    }
}

impl fmt::Display for Paper {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Paper {
    type Err = ExperimentError;

    fn from_str(name: &str) -> Result<Self, ExperimentError> {
        Self::ALL.into_iter().find(|p| p.name() == name).ok_or_else(|| {
            let all = Self::ALL.map(Self::name).join(", ");
            ExperimentError::usage(format!("there is no paper `{name}`; there are: {all}"))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unknown_names_are_refused_with_a_list() {
        for paper in Paper::ALL {
            assert_eq!(paper.to_string().parse::<Paper>().unwrap(), paper);
            assert_eq!(serde_json::to_value(paper).unwrap(), paper.name());
            assert!(paper.summary().len() > 20 && paper.default_seeds() >= 200);
            assert!((20..=paper.default_seeds()).contains(&paper.quick_seeds()));
        }
        let error = "nobody1999".parse::<Paper>().unwrap_err();
        assert_eq!(error.exit_code(), 2);
        assert!(error.to_string().contains("nobody1999") && error.to_string().contains("ball, qu2010"), "{error}");
    }
}
