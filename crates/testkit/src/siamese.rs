//! A small Siamese network that draws masks.

use crate::NetworkFile;

/// One that knows what is red: of 9 × 9 points of a search image of 64 pixels the score is how much redder a square of 16 pixels is than what is
/// about it, the box that square, and the mask how red every second of the 32 × 32 pixels about the point is. The template counts for nothing.
#[derive(Debug)]
pub struct SiameseFile;

impl SiameseFile {
    const TEMPLATE: usize = 32;
    const SEARCH: usize = 64;
    const STRIDE: u64 = 4;
    const ANSWER: usize = 9;
    /// Rows and columns of the mask.
    const MASK: usize = 16;
    /// Rows and columns of the square.
    const SQUARE: usize = 16;

    /// How red a pixel is: 1 of pure red, below 0 of other colours.
    const RED: [f32; 3] = [1.0 / 255.0, -0.5 / 255.0, -0.5 / 255.0];

    /// What of a pixel of the template's size counts for a plane.
    fn weights(planes: usize, of: impl Fn(usize, usize, usize) -> f32) -> Vec<f32> {
        let t = Self::TEMPLATE;
        let pixels = (0..planes).flat_map(|plane| (0..3 * t * t).map(move |k| (plane, k / (t * t), k / t % t, k % t)));
        pixels.map(|(plane, c, y, x)| Self::RED[c] * of(plane, y, x)).collect()
    }

    /// The bytes of the file. `mask` makes the output `masks` of the logits `drawn`.
    pub fn bytes(mask: impl FnOnce(NetworkFile) -> NetworkFile) -> Vec<u8> {
        let (t, m) = (Self::TEMPLATE, Self::MASK);
        let edge = (t - Self::SQUARE) / 2;
        let (inside, outside) = ((Self::SQUARE * Self::SQUARE) as f32, (t * t - Self::SQUARE * Self::SQUARE) as f32);
        let within = |k: usize| (edge..t - edge).contains(&k);
        let score = Self::weights(1, |_, y, x| if within(y) && within(x) { 1.0 / inside } else { -1.0 / outside });
        // As SiamMask is trained, the first place is the first pixel.
        let every = t / m;
        let drawn = Self::weights(m * m, |plane, y, x| {
            let is_here = y == every * (plane / m) && x == every * (plane % m);
            if is_here { 1.0 } else { 0.0 }
        });
        let (kernel, strides) = ([t as u64; 2], [Self::STRIDE; 2]);
        let sides: [(&str, &[u64]); 2] = [("kernel_shape", &kernel), ("strides", &strides)];
        let file = NetworkFile::default()
            .input("template", &[1, 3, t, t])
            .input("search", &[1, 3, Self::SEARCH, Self::SEARCH])
            .floats("score_weights", &[1, 3, t, t], &score)
            .floats("drawn_weights", &[m * m, 3, t, t], &drawn)
            .floats("edges", &[1, 4, 1, 1], &[Self::SQUARE as f32 / 2.0; 4])
            .floats("nothing", &[], &[0.0])
            .floats("enough", &[], &[0.35])
            .floats("steep", &[], &[40.0])
            .node("ReduceMean", &["template"], "mean", &[("keepdims", 0)])
            .node("Mul", &["mean", "nothing"], "unseen", &[])
            .listed("Conv", &["search", "score_weights"], "redder", &sides)
            .node("Sub", &["redder", "enough"], "more", &[])
            .node("Mul", &["more", "steep"], "steeper", &[])
            .node("Add", &["steeper", "unseen"], "scores", &[])
            .node("Mul", &["redder", "nothing"], "none", &[])
            .node("Add", &["none", "edges"], "boxes", &[])
            .listed("Conv", &["search", "drawn_weights"], "red", &sides)
            .node("Sub", &["red", "enough"], "so_red", &[])
            .node("Mul", &["so_red", "steep"], "drawn", &[]);
        mask(file).output("scores", 4).output("boxes", 4).output("masks", 4).to_bytes()
    }

    /// What describes it, as the file `name`.
    pub fn description(name: &str) -> String {
        let (template, search, answer) = (Self::TEMPLATE, Self::SEARCH, Self::ANSWER);
        format!(
            "search = '{name}'\n[config]\ntemplate_side_px = {template}\nsearch_side_px = {search}\nanswer_side = {answer}\n\
             stride_px = 4.0\nchannels = 'rgb'\nscores = 'sigmoid'\ncontext = 0.5\nwindow = 0.05\npenalty = 0.05\nrate = 0.3\n\
             min_side_px = 4.0\nmask_side = {}\n",
            Self::MASK
        )
    }
}
