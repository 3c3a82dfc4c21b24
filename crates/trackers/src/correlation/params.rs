//! Parameter groups that the correlation trackers are composed of.

pursuit_parameters::choices! {
    /// The window's shape.
    pub enum WindowShape {
        /// Proportional to the target's box.
        Proportional = "proportional",
        /// A square, whatever the target's shape, in proportion to the square of equal area.
        Square = "square",
        /// The target's box with the same margin on all sides, in proportion to the mean of its sides (bertinetto2016, released
        /// code).
        Margin = "margin",
    }
}

pursuit_parameters::parameters! {
    /// The window that is searched, and the patch sampled from it.
    pub struct WindowParams {
        /// The window's shape.
        pub shape: WindowShape = WindowShape::Proportional;
        /// How much larger the window is than the target: surroundings as a multiple of its size.
        pub padding: f64 = 1.5, in 0.0..=8.0, unit "target sizes", source "henriques2015, section 8: 1.5";
        /// Side of a feature cell in patch pixels; grey values have cells of one pixel.
        pub cell_px: usize = 4, in 2..=16, unit "px", source "henriques2015, section 8: 4";
        /// Smallest area of the patch: windows of smaller targets are enlarged.
        pub smallest_area_px: f64 = 2500.0, in 256.0..=1e6, unit "px²", source "ours";
        /// Largest area of the patch: windows of larger targets are shrunk.
        pub largest_area_px: f64 = 9216.0, in 256.0..=1e6, unit "px²", source "ours";
        /// The shorter side of a proportional window is at least this share of the longer one, so that thin targets have
        /// surroundings.
        pub thinnest: f64 = 0.3, in above(0.0).at_most(1.0), source "ours";
        /// Smallest size of the target relative to its size at the start.
        pub smallest_scale: f64 = 0.1, in above(0.0).at_most(1.0), source "ours";
        /// Largest size of the target relative to its size at the start.
        pub largest_scale: f64 = 12.0, in 1.0..=100.0, source "ours";
    }
    ordered { smallest_area_px <= largest_area_px }
}

pursuit_parameters::parameters! {
    /// Sizes that are simply tried.
    pub struct ScaleLadderParams {
        /// Sizes tried on either side of the last one; 0 keeps the size.
        pub levels: usize = 0, in 0..=8, source "li2014 (SAMF)";
        /// Ratio of neighbouring sizes.
        pub step: f64 = 1.05, in above(1.0).at_most(2.0), source "li2014 (SAMF)";
        /// What responses at another than the last size are multiplied by.
        pub penalty: f64 = 0.95, in above(0.0).at_most(1.0), source "ours";
    }
}

impl ScaleLadderParams {
    /// Sizes tried relative to the last one, 1 first, and what each one's response is multiplied by.
    pub(crate) fn sizes(&self) -> impl Iterator<Item = (f64, f64)> {
        let (step, penalty) = (self.step, self.penalty);
        let others = (1..=self.levels as i32).flat_map(|k| [-k, k]);
        std::iter::once((1.0, 1.0)).chain(others.map(move |k| (step.powi(k), penalty)))
    }

    /// The number of sizes tried.
    pub(crate) const fn count(&self) -> usize {
        2 * self.levels + 1
    }
}

pursuit_parameters::parameters! {
    /// The correlation filter along scale.
    pub struct ScaleFilterParams {
        /// Sizes sampled, S; 1 keeps the size.
        pub scales: usize = 17, in Bounds::from(1..=63).in_steps_of(2.0), source "danelljan2017, section 5.2: 17; danelljan2014: 33";
        /// Whether the response is interpolated to about twice as many sizes.
        pub interpolate: bool = true, source "danelljan2017, section 4.2";
        /// Ratio of neighbouring sizes after interpolation, a.
        pub step: f64 = 1.02, in above(1.0).at_most(1.2), source "danelljan2014, section 5.1: 1.02";
        /// Standard deviation of the label in sampled sizes.
        pub label_sigma: f64 = 1.0625, in above(0.0), source "danelljan2017, section 5.2: 1/16 of their number";
        /// Share of the new sample per frame, η.
        pub learning_rate: f64 = 0.025, in 0.0..=1.0, source "danelljan2014, section 5.1: 0.025";
        /// Regularisation λ.
        pub lambda: f64 = 0.01, in above(0.0), source "danelljan2014, section 5.1: 0.01";
        /// Largest area of a sample.
        pub area_px: f64 = 1024.0, in 64.0..=65536.0, unit "px²", source "danelljan2017: 512; ours: 1024";
        /// Side of a HOG cell.
        pub cell_px: usize = 4, in 2..=16, unit "px", source "danelljan2017, section 5.2: 4";
        /// Whether the size of a target that was found elsewhere is measured at once; if not, it has the size it had.
        pub on_return: bool = false, source "ours";
        /// Changes of the size of a target with this side (square root of its area) or less are not believed: of a target of a
        /// few pixels, a step of the filter is a small part of one.
        pub size_kept_px: f64 = 0.0, in 0.0.., unit "px", source "ours";
        /// Changes of the size of a target with this side or more are believed in full, in between in part.
        pub size_followed_px: f64 = 1.0, in above(0.0), unit "px", source "ours";
    }
    ordered { size_kept_px <= size_followed_px }
}

pursuit_parameters::choices! {
    /// How the peak between the cells is found.
    pub enum Subpixel {
        /// By the parabola through the peak's neighbours.
        Parabola = "parabola",
        /// By Newton's steps on the response's own Fourier series (danelljan2017eco).
        Series = "series",
    }
}

pursuit_parameters::parameters! {
    /// How a response is read.
    pub struct PeakParams {
        /// Peaks of a response that are looked at; the likeliest is believed.
        pub candidates: usize = 1, in 1..=16, source "ours";
        /// Least height of a further peak as a share of the highest.
        pub runner_up: f64 = 0.5, in 0.0..=1.0, source "ours";
        /// Half the side of the square around a peak in which there is no other.
        pub apart: usize = 3, in 0..=16, unit "cells", source "ours";
        /// How the peak between the cells is found.
        pub subpixel: Subpixel = Subpixel::Parabola;
        /// Of `series`: Newton's steps at most.
        pub newton_steps: usize = 3, in 1..=20, source "danelljan2017eco: 5";
        /// Half the side of the square around the peak that does not count as sidelobe, as a share of the response's shorter
        /// side.
        pub sidelobe_share: f64 = 0.0859375, in 0.0..=0.5, source "bolme2010, section 3.5: 11 of 64 pixels";
    }
}

pursuit_parameters::choices! {
    /// What two views have to have in common to be alike.
    pub enum Likeness {
        /// Their values: the cosine between them, of gradients alone.
        Cosine = "cosine",
        /// How their values vary: the correlation of all features.
        Correlation = "correlation",
    }
}

pursuit_parameters::choices! {
    /// By what the windows of a sweep over the frame are compared.
    pub enum SweepBy {
        /// The height of the response's peak.
        Height = "height",
        /// The score.
        Score = "score",
    }
}

pursuit_parameters::parameters! {
    /// The score: a logistic regression of what is known of the response and of the target's looks. Fitted to the overlap with
    /// the truth on real sequences, each weighing the same; a weight of 0 leaves its evidence out.
    pub struct ScoreParams {
        /// Constant.
        pub bias: f64 = 0.0, in Bounds::default(), source "ours, fitted";
        /// Weight of ln of the peak-to-sidelobe ratio.
        pub psr: f64 = 0.0, in Bounds::default(), source "ours, fitted";
        /// Weight of ln of the peak relative to the usual one where it has collapsed: a peak as usual says nothing new, one that
        /// collapses tells of an occlusion.
        pub collapse: f64 = 0.0, in Bounds::default(), source "ours, fitted";
        /// A peak below this share of the usual one has collapsed.
        pub collapsed_below: f64 = 0.6, in above(0.0), source "wang2017, section 3.3: 0.6";
        /// Share of a new peak in the usual one.
        pub usual_rate: f64 = 0.05, in 0.0..=1.0, source "ours";
        /// Weight of the likeness to the initial template.
        pub likeness: f64 = 0.0, in Bounds::default(), source "ours, fitted";
        /// How that likeness is measured.
        pub likeness_by: Likeness = Likeness::Correlation;
        /// Weight of ln of the response's peak, for filters whose peak is 1 at most.
        pub peak: f64 = 0.0, in Bounds::default(), source "ours, fitted";
        /// Weight of ln of the mean likelihood of the colours in the box.
        pub color: f64 = 0.0, in Bounds::default(), source "ours, fitted";
        /// Weight of how alike the colours in the box are to those of the first frame.
        pub first_colors: f64 = 0.0, in Bounds::default(), source "ours, fitted";
        /// By what the windows of a sweep over the frame are compared. The best score of many windows is a high score by chance;
        /// the height of the peak is no part of most scores, so that these still judge.
        pub sweep_by: SweepBy = SweepBy::Height, source "ours";
    }
}

pursuit_parameters::parameters! {
    /// Histograms of the colours of the target and of its surroundings.
    pub struct ColorParams {
        /// Share of the colours' response beside the filter's (α); 0: they are evidence for the score alone.
        pub share: f64 = 0.0, in 0.0..=1.0, source "bertinetto2016, section 3.1: 0.3";
        /// Share of the new histograms per frame (η_hist).
        pub learning_rate: f64 = 0.04, in 0.0..=1.0, source "bertinetto2016, table 1: 0.04";
        /// The target's colours are learned from its box less this share on each side.
        pub inner_margin: f64 = 0.1, in 0.0..=0.4, source "bertinetto2016, released code: 0.2 of the mean side in all";
        /// Added to every colour's share, so that unseen colours say nothing.
        pub prior: f64 = 1e-5, in above(0.0).at_most(1.0), source "ours";
    }
}

pursuit_parameters::parameters! {
    /// The alternating directions that solve a regularised filter.
    pub struct SolverParams {
        /// First penalty γ.
        pub penalty: f64 = 1.0, in above(0.0), source "galoogahi2017, section 4: 1";
        /// Growth of the penalty per iteration.
        pub penalty_growth: f64 = 10.0, in 1.0..=1000.0, source "galoogahi2017, section 4: 10; li2018, eq. 12";
        /// Iterations per frame.
        pub iterations: usize = 2, in 1..=10, source "galoogahi2017, section 4: 2; li2018, section 5.1: 2";
        /// Weight μ of staying near the last filter, relative to the features' mean energy in the first window.
        pub temporal_weight: f64 = 0.0, in 0.0.., source "li2018, eq. 4";
        /// Weight w² of the filter inside the target; outside it is infinite.
        pub spatial_weight: f64 = 0.0, in 0.0.., source "li2018, released code: 1e-3 squared";
    }
}

pursuit_parameters::parameters! {
    /// The filter that is confined to the target's cells, and how far its channels are relied upon.
    pub struct ReliabilityParams {
        /// Regularisation λ.
        pub lambda: f64 = 0.01, in above(0.0), source "lukezic2017, section 4.1: 0.01";
        /// First penalty μ of a filter that is not 0 outside of the target's cells.
        pub penalty: f64 = 5.0, in above(0.0), source "lukezic2017, section 4.1: 5";
        /// Growth β of the penalty per iteration.
        pub penalty_growth: f64 = 3.0, in 1.0..=100.0, source "lukezic2017, section 4.1: 3";
        /// Iterations per frame.
        pub iterations: usize = 4, in 1..=20, source "lukezic2017, section 3.2: 4";
        /// Share of a frame's reliabilities of the channels in those kept.
        pub rate: f64 = 0.02, in 0.0..=1.0, source "lukezic2017, released code: 0.02";
        /// Whether a channel with two peaks that are nearly as high counts less where the target is looked for.
        pub distinct: bool = true, source "lukezic2017, section 3.3";
    }
}
