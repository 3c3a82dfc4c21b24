use super::palette::BallColor;

pursuit_parameters::parameters! {
    /// Parameters of the ball localizer.
    pub struct BallParams {
        /// Colour of the ball: `auto` learns it from the box; the others are tolerant ranges of hue, saturation and value within
        /// which it is then learned.
        pub color: BallColor = BallColor::Auto;
        /// Whether a preset's range is narrowed to the colour seen in the box (`auto` always learns).
        pub learn_range: bool = true, source "ours";
        /// Radius of the erosion and the dilation, at least one pixel; 0.05 is the paper's two 3x3 iterations for a ball of 40
        /// pixels.
        pub opening_radius: f64 = 0.05, in 0.0..=0.2, unit "ball sizes", source "ball";
        /// Least squareness min(w/h, h/w), relative to the box started on, of a region that may be the ball come back after it
        /// was lost. Close to the prediction a streak or a part is accepted too.
        pub return_squareness: f64 = 0.75, in 0.0..=1.0, source "ball";
        /// Greatest factor by which the size may differ from the expected one close to the prediction; squared after the ball
        /// was lost.
        pub max_size_ratio: f64 = 1.8, in 1.0..=100.0, source "ours";
        /// How fast the remembered appearance follows what is seen.
        pub learning_rate: f64 = 0.05, in 0.0..=1.0, source "ours";
        /// How regions of the colour are judged.
        pub sight: SightParams = SightParams::default();
        /// Things of the ball's colour that stay where they are.
        pub distractors: DistractorParams = DistractorParams::default();
    }
}

pursuit_parameters::parameters! {
    /// How regions of the ball's colour are judged near the prediction and far from it.
    pub struct SightParams {
        /// Pixels that the ball keeps across when a large part of a picture is searched at a fraction of its size.
        pub pixels_across: f64 = 16.0, in 4.0.., unit "px", source "ours";
        /// Parts of a picture up to this many pixels are looked at as they are.
        pub whole_below: f64 = 921_600.0, in 1024.0.., unit "px", source "ours";
        /// Regions smaller than this share of the expected box are noise.
        pub least_area: f64 = 0.02, in 0.0..=1.0, source "ours";
        /// A region this much longer than wide, against the box started on, is a streak: the ball moved during the exposure.
        pub streak: f64 = 1.25, in 1.0..=10.0, source "ours";
        /// Least width of a streak against the ball's expected size.
        pub streak_narrowest: f64 = 0.6, in above(0.0).at_most(1.0), source "ours";
        /// Greatest width of a streak against the ball's expected size.
        pub streak_widest: f64 = 1.5, in 1.0..=10.0, source "ours";
        /// A region that reaches over its box by more than this is blurred or has grown together with something.
        pub overhang: f64 = 0.06, in 0.0..=1.0, unit "region sizes", source "ours";
        /// A box that reaches over its region by more than this is that of another thing.
        pub widest_margin: f64 = 0.35, in 0.0..=1.0, unit "region sizes", source "ours";
        /// Standard deviation of the centre of a ball that is seen whole.
        pub sigma_whole: f64 = 0.015, in above(0.0), unit "ball sizes", source "ours";
        /// Standard deviation of the centre of a ball that is partly hidden.
        pub sigma_part: f64 = 0.25, in above(0.0), unit "ball sizes", source "ours";
        /// Standard deviation of the centre of a streak, added per length beyond the ball's.
        pub sigma_streak: f64 = 0.1, in 0.0.., source "ours";
        /// A candidate's solidity may fall to this share of that of the region started on.
        pub solidity: f64 = 0.8, in 0.0..=0.99, source "ours";
        /// What the distance of a partly seen ball from its prediction counts: its completion takes what lies nearest, so it
        /// must lie really near.
        pub part_distance: f64 = 6.0, in 1.0.., source "ours";
        /// A sighting less confident than this has a second look with a wider opening: the ball may have grown together with
        /// like-coloured clutter.
        pub second_look_below: f64 = 0.7, in 0.0..=1.0, source "ours";
        /// How much wider that opening is.
        pub second_opening: f64 = 2.5, in 1.0..=10.0, source "ours";
        /// Least likeness of colours of what comes back after having been lost.
        pub return_likeness: f64 = 0.6, in 0.0..=1.0, source "ours";
        /// Least likeness to a ball of what comes back, where the thing started on was round.
        pub return_roundness: f64 = 0.5, in 0.0..=1.0, source "ours";
        /// Solidity from which the thing started on counts as round.
        pub round_from: f64 = 0.9, in 0.0..=1.0, source "ours";
        /// Likeness of colours that is worth nothing; `color_full` more is worth all.
        pub color_none: f64 = 0.3, in 0.0..=1.0, source "ours";
        /// Likeness of colours beyond `color_none` that is worth all.
        pub color_full: f64 = 0.5, in above(0.0).at_most(1.0), source "ours";
        /// What a region is worth whose solidity is the least allowed.
        pub ragged_worth: f64 = 0.4, in 0.0..=1.0, source "ours";
        /// How steeply the worth falls with the size, in deviations at the greatest ratio allowed.
        pub size_steepness: f64 = 1.5, in 0.0.., source "ours";
        /// What a partly hidden ball is worth.
        pub part_worth: f64 = 0.8, in 0.0..=1.0, source "ours";
        /// Share of the ball inside the frame from which it is worth all.
        pub shown_full: f64 = 0.25, in above(0.0).at_most(1.0), source "ours";
        /// Coverage by the colour from which a region is worth all.
        pub filled_full: f64 = 0.6, in above(0.0).at_most(1.0), source "ours";
        /// What lack of confidence counts against nearness when the best of several is chosen, in squared distances.
        pub doubt_distance: f64 = 8.0, in 0.0.., source "ours";
    }
}

pursuit_parameters::parameters! {
    /// Things of the ball's colour that are not the ball and stay where they are.
    pub struct DistractorParams {
        /// As many are remembered.
        pub most: usize = 48, in 0..=1000, source "ours";
        /// Seen in the same place this often, a thing is taken for part of the scene.
        pub settled: u32 = 3, in 1..=1000, unit "frames", source "ours";
        /// Looked for and not found this often, it is forgotten.
        pub forgotten: u32 = 5, in 1..=1000, unit "frames", source "ours";
        /// Overlap that makes two boxes the same thing.
        pub same: f64 = 0.4, in 0.0..=1.0, source "ours";
    }
}

pursuit_parameters::parameters! {
    /// Parameters of the ball detector.
    pub struct BallDetectorParams {
        /// Colour of the ball, or `auto` for whatever looks most like a ball in any of them but white.
        pub color: BallColor = BallColor::Auto;
        /// Least squareness min(w/h, h/w) of the bounding rectangle.
        pub min_squareness: f64 = 0.75, in 0.0..=1.0, source "ball";
        /// Least area (0.0003: a ball of 11 pixels in 640x480).
        pub min_area: f64 = 0.0003, in 0.0..=1.0, unit "share of the frame", source "ours";
        /// Pixels that the smallest ball sought keeps across when large pictures are searched at a fraction of their size.
        pub pixels_across: f64 = 16.0, in 4.0.., unit "px", source "ours";
        /// Greatest area.
        pub max_area: f64 = 0.25, in 0.0..=1.0, unit "share of the frame", source "ours";
        /// Least likeness to a ball (roundness, solidity, contrast to its surroundings) to be believed at once.
        pub min_likeness: f64 = 0.6, in 0.0..=1.0, source "ours";
        /// Least likeness of one that has been seen in the frame before too.
        pub min_likeness_again: f64 = 0.5, in 0.0..=1.0, source "ours";
        /// A detection this convincing ends the search.
        pub convincing: f64 = 0.85, in 0.0..=1.0, source "ours";
        /// Radius of the first opening; 0.004 is the paper's two iterations at 480 rows.
        pub opening: f64 = 0.004, in 0.0..=0.1, unit "shorter sides", source "ball";
        /// Radius of the second opening, which parts a large ball from like-coloured clutter that touches it.
        pub wider_opening: f64 = 0.01, in 0.0..=0.1, unit "shorter sides", source "ours";
        /// Radius of the third opening.
        pub widest_opening: f64 = 0.021, in 0.0..=0.1, unit "shorter sides", source "ours";
        /// An opening by a square makes squares of clutter; only what is this many times larger has a shape.
        pub shape_over_opening: f64 = 3.0, in 1.0.., source "ours";
        /// Chance of a region of clutter to look round.
        pub chance: f64 = 0.06, in 0.0..=1.0, source "ours";
        /// What the likeness of a region that touches the frame's border is worth: part of its outline is the border's.
        pub cut_worth: f64 = 0.9, in 0.0..=1.0, source "ours";
        /// Overlap from which two detections are one.
        pub same: f64 = 0.2, in 0.0..=1.0, source "ours";
        /// Greatest ratio of sizes of a ball in two frames.
        pub again_ratio: f64 = 1.4, in 1.0.., source "ours";
        /// Greatest distance of a ball in two frames.
        pub again_distance: f64 = 1.5, in 0.0.., unit "ball sizes", source "ours";
    }
    ordered { min_area <= max_area }
}
