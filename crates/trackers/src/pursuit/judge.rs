//! One judge over what both witnesses say of a box.

use pursuit_tracking::{Figure, Taken, Weight};

/// Declares the terms of the judge's regression, each once: a sentence, its name, its column in the files, how it is taken, and
/// the sentence and the default of its weight. From the table follow the evidence, the parameters, the sum and the figures, and
/// from those the columns that `cargo xtask tune` fits.
macro_rules! evidence {
    (
        constant $bias:expr;
        $($(#[doc = $doc:literal])+ $term:ident as $column:literal: $taken:ident, $weight_doc:literal = $weight:expr;)+
    ) => {
        /// What is known of a box.
        #[derive(Debug, Clone, Copy, PartialEq, Default)]
        pub struct JointEvidence {
            $($(#[doc = $doc])+ pub $term: f64,)+
        }

        pursuit_parameters::parameters! {
            /// The judge: a logistic regression of what both witnesses say of a box, fitted as `docs/papers/pursuit.md` says.
            pub struct JudgeParams {
                /// Constant.
                pub bias: f64 = $bias, in Bounds::default(), source "ours, fitted";
                $(
                    #[doc = $weight_doc]
                    pub $term: f64 = $weight, in Bounds::default(), source "ours, fitted";
                )+
            }
        }

        impl JudgeParams {
            /// ln of p / (1 − p) of the probability p that the box is right.
            pub fn log_odds(&self, evidence: &JointEvidence) -> f64 {
                self.bias $(+ self.$term * Taken::$taken.of(evidence.$term))+
            }
        }

        impl JointEvidence {
            /// All of it, in the order of the columns.
            pub(super) fn values(&self) -> impl Iterator<Item = f64> {
                [$(self.$term),+].into_iter()
            }
        }

        /// What is said of the filter's box: left, top, width, height, and the evidence.
        pub(super) const FILTER: &[Figure] = evidence!(@figures "filter_", "filter's", $(($term, $column, $taken, $($doc),+))+);
        /// The same of the network's box.
        pub(super) const NETWORK: &[Figure] = evidence!(@figures "network_", "network's", $(($term, $column, $taken, $($doc),+))+);
        /// The same of the expert's box.
        pub(super) const EXPERT: &[Figure] = evidence!(@figures "expert_", "expert's", $(($term, $column, $taken, $($doc),+))+);
    };
    (@figures $witness:literal, $whose:literal, $(($term:ident, $column:literal, $taken:ident, $($doc:literal),+))+) => {
        &[
            evidence!(@side concat!($witness, "x"), concat!("Left edge of the ", $whose, " box.")),
            evidence!(@side concat!($witness, "y"), concat!("Top edge of the ", $whose, " box.")),
            evidence!(@side concat!($witness, "w"), concat!("Width of the ", $whose, " box.")),
            evidence!(@side concat!($witness, "h"), concat!("Height of the ", $whose, " box.")),
            $(Figure {
                name: concat!($witness, $column),
                unit: "",
                text: concat!($($doc),+).trim_ascii(),
                weight: Some(Weight { parameter: concat!("judge.", stringify!($term)), taken: Taken::$taken }),
            }),+
        ]
    };
    (@side $name:expr, $text:expr) => {
        Figure { name: $name, unit: "px", text: $text, weight: None }
    };
}

evidence! {
    constant -5.77;
    /// Height of the filter's peak.
    peak as "peak": Ln, "Weight of ln of the filter's peak." = 0.0;
    /// Likeness to the initial template, −1 to 1.
    likeness as "likeness": AsIs, "Weight of the likeness to the initial template." = 5.3;
    /// Mean likelihood of the colours in the box, 0 to 1.
    color as "color": Ln, "Weight of ln of the mean likelihood of the colours in the box." = 0.0;
    /// ln of s / (1 − s) of the network's score s there.
    network as "score": AsIs, "Weight of the log odds of the network's score." = 0.26;
    /// Peak-to-sidelobe ratio of the filter's response.
    psr as "psr": Ln, "Weight of ln of the response's peak-to-sidelobe ratio." = 0.0;
    /// Overlap of the two witnesses' boxes.
    overlap as "overlap": AsIs, "Weight of the overlap of the two witnesses' boxes." = 0.36;
    /// Distance from where it was expected, in target sizes.
    moved as "moved": Ln1p, "Weight of ln of 1 and the distance from where the target was expected." = 0.0;
    /// ln of s / (1 − s) of LightFC's score s when it was asked last.
    lightfc as "lightfc": AsIs, "Weight of the log odds of LightFC's score." = 1.15;
    /// Likeness less what is usual while the target is sure.
    likeness_fall as "likeness_fall": AsIs, "Weight of the likeness less what is usual." = 0.0;
    /// Log odds of LightFC's score less what is usual while the target is sure.
    lightfc_fall as "lightfc_fall": AsIs, "Weight of the log odds of LightFC's score less what is usual." = 0.0;
    /// Likeness to the first colours less what is usual, in deviations of what is usual, −6 to 2; nearer 0 of a small target that is followed.
    colors_fall as "colors_fall": AsIs, "Weight of the likeness to the first colours less what is usual." = 0.0;
    /// The same of what the target looks like to LightFC.
    embedding_fall as "embedding_fall": AsIs, "Weight of the likeness to LightFC's first features less what is usual." = 0.0;
    /// Overlap of LightFC's box with the other witnesses' when it was asked last.
    lightfc_overlap as "lightfc_overlap": AsIs, "Weight of the overlap of LightFC's box with the other witnesses'." = 1.9;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_log_odds_are_the_weighted_sum() {
        let judge = JudgeParams {
            bias: -1.5,
            peak: 0.7,
            likeness: 3.0,
            color: 1.1,
            psr: -0.4,
            network: 0.25,
            overlap: 1.7,
            moved: -0.9,
            lightfc: 0.6,
            lightfc_overlap: 1.2,
            likeness_fall: 0.8,
            lightfc_fall: 0.5,
            colors_fall: 0.3,
            embedding_fall: 0.7,
        };
        let evidence = JointEvidence {
            peak: 0.5,
            likeness: 0.6,
            color: 0.7,
            network: 4.0,
            psr: 12.0,
            overlap: 0.8,
            moved: 0.3,
            lightfc: -2.0,
            lightfc_overlap: 0.4,
            likeness_fall: -0.2,
            lightfc_fall: -1.5,
            colors_fall: -2.0,
            embedding_fall: 1.5,
        };
        let want =
            -1.5 + 0.7 * 0.5_f64.ln() + 3.0 * 0.6 + 1.1 * 0.7_f64.ln() - 0.4 * 12.0_f64.ln() + 0.25 * 4.0 + 1.7 * 0.8
                - 0.9 * 1.3_f64.ln()
                - 0.6 * 2.0
                + 1.2 * 0.4
                - 0.8 * 0.2
                - 0.5 * 1.5
                - 0.3 * 2.0
                + 0.7 * 1.5;

        assert!((judge.log_odds(&evidence) - want).abs() < 1e-12);
        let silent = JointEvidence { peak: -0.1, psr: 0.0, color: 0.0, ..evidence };
        assert!(judge.log_odds(&silent).is_finite());
    }

    #[test]
    fn columns_name_their_weights() {
        let score = FILTER.iter().find(|f| f.name == "filter_score").unwrap();
        assert_eq!(score.weight, Some(Weight { parameter: "judge.network", taken: Taken::AsIs }));
        assert_eq!((FILTER.len(), NETWORK.len()), (4 + 13, 4 + 13));
        assert_eq!((NETWORK[0].name, NETWORK[0].text), ("network_x", "Left edge of the network's box."));
    }
}
