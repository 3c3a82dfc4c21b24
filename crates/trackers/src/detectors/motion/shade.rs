//! Tells another light on the background from a thing before it: in a shadow, and where a lamp goes on or out, the grain of the
//! background is still seen. What hides it has a grain of its own. Where frames are smoothed, neighbours are pixels so far apart that
//! they have nothing in common.

use super::params::ShadeParams;
use pursuit_imaging::{Image, ImageView};
use pursuit_vision::background::{BACKGROUND, Channels, FOREGROUND};

/// Sums over the differences between neighbours of the background, of the frame, and of both.
#[derive(Debug, Clone, Copy, Default)]
struct Grain {
    learnt: f32,
    now: f32,
    both: f32,
    count: f32,
}

impl Grain {
    fn add(&mut self, learnt: f32, now: f32) {
        self.learnt += learnt * learnt;
        self.now += now * now;
        self.both += learnt * now;
        self.count += 1.0;
    }

    fn join(&mut self, other: &Self) {
        self.learnt += other.learnt;
        self.now += other.now;
        self.both += other.both;
        self.count += other.count;
    }

    /// Whether the frame shows the grain of the background.
    fn is_shown(&self, params: &ShadeParams) -> bool {
        let enough = self.count >= 16.0 && self.learnt >= (params.grain * params.grain) as f32 * self.count;
        let alike = self.both >= params.alike as f32 * (self.learnt * self.now).sqrt();
        let gain = self.both / self.learnt.max(f32::MIN_POSITIVE);
        enough && alike && (params.darkest as f32..=params.brightest as f32).contains(&gain)
    }
}

/// What is kept from frame to frame; scratch.
#[derive(Debug, Clone, Default)]
pub(super) struct Shade {
    blocks: Vec<Grain>,
    shaded: Vec<bool>,
}

impl Shade {
    /// Takes out of `mask` what shows the background in another light; frame and background are means over squares of a side of
    /// `fineness_px`.
    pub fn remove<P: Channels>(
        &mut self,
        params: &ShadeParams,
        frame: ImageView<'_, P>,
        (background, fineness_px): (ImageView<'_, P>, usize),
        mask: &mut Image<u8>,
    ) {
        let (width, height) = (mask.width(), mask.height());
        if background.size() != mask.size() || frame.size() != mask.size() || params.alike > 1.0 {
            return;
        }
        let side = (params.block * height as f64).round().max(6.0) as usize;
        let (columns, rows) = (width.div_ceil(side), height.div_ceil(side));
        self.blocks.clear();
        self.blocks.resize(columns * rows, Grain::default());
        for y in 0..height.saturating_sub(fineness_px) {
            let (marks, below) = (mask.row(y), mask.row(y + fineness_px));
            let (now, next) = (frame.row(y), frame.row(y + fineness_px));
            let (learnt, learnt_next) = (background.row(y), background.row(y + fineness_px));
            let blocks = &mut self.blocks[(y / side) * columns..][..columns];
            for x in (0..width.saturating_sub(fineness_px)).filter(|x| marks[*x] == FOREGROUND) {
                let block = &mut blocks[x / side];
                let (here, was) = (brightness(now[x]), brightness(learnt[x]));
                let beside = x + fineness_px;
                if marks[beside] == FOREGROUND {
                    block.add(brightness(learnt[beside]) - was, brightness(now[beside]) - here);
                }
                if below[x] == FOREGROUND {
                    block.add(brightness(learnt_next[x]) - was, brightness(next[x]) - here);
                }
            }
        }
        self.decide(params, columns, rows);
        for y in 0..height {
            let shaded = &self.shaded[(y / side) * columns..][..columns];
            for (pixels, _) in mask.row_mut(y).chunks_mut(side).zip(shaded).filter(|(_, shaded)| **shaded) {
                pixels.fill(BACKGROUND);
            }
        }
    }

    /// A block is shaded when it and its neighbours show the grain of the background together, and it does not speak against that.
    fn decide(&mut self, params: &ShadeParams, columns: usize, rows: usize) {
        self.shaded.clear();
        for row in 0..rows {
            for column in 0..columns {
                let own = self.blocks[row * columns + column];
                let mut about = Grain::default();
                if own.count > 0.0 {
                    for near in row.saturating_sub(1)..(row + 2).min(rows) {
                        let from = near * columns;
                        let near = &self.blocks[from + column.saturating_sub(1)..from + (column + 2).min(columns)];
                        near.iter().for_each(|g| about.join(g));
                    }
                }
                let own_alike = own.both >= 0.5 * params.alike as f32 * (own.learnt * own.now).sqrt();
                self.shaded.push(own.count > 0.0 && own_alike && about.is_shown(params));
            }
        }
    }
}

/// Mean of the channels.
fn brightness<P: Channels>(pixel: P) -> f32 {
    let pixel = [pixel];
    let channels = P::channels(&pixel);
    channels.iter().map(|&v| f32::from(v)).sum::<f32>() / P::COUNT as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_testkit::lattice;

    fn grained(seed: u64, gain: f64) -> Image<u8> {
        Image::from_fn(96, 64, |x, y| (gain * (90.0 + 50.0 * lattice(x as i64, y as i64, seed))) as u8).unwrap()
    }

    fn left_of(frame: &Image<u8>, background: &Image<u8>) -> usize {
        let mut mask =
            Image::from_fn(96, 64, |x, y| if (20..70).contains(&x) && (10..50).contains(&y) { 255 } else { 0 })
                .unwrap();
        Shade::default().remove(&ShadeParams::default(), frame.view(), (background.view(), 1), &mut mask);
        mask.as_slice().iter().filter(|v| **v != 0).count()
    }

    #[test]
    fn a_shadow_shows_the_grain_and_a_thing_hides_it() {
        let background = grained(1, 1.0);
        assert_eq!(left_of(&grained(1, 0.5), &background), 0, "a shadow");
        assert_eq!(left_of(&grained(1, 1.3), &background), 0, "a lamp");
        assert_eq!(left_of(&grained(2, 0.5), &background), 50 * 40, "something with a grain of its own");
        let plain = Image::filled(96, 64, 40u8).unwrap();
        assert_eq!(left_of(&plain, &background), 50 * 40, "something plain");
        assert_eq!(left_of(&plain, &Image::filled(96, 64, 90u8).unwrap()), 50 * 40, "nothing to tell by");
    }

    #[test]
    fn shadows_on_smoothed_frames_are_told_by_pixels_farther_apart() {
        // Grain of five pixels; of noise something is left.
        let coarse = |x: usize, y: usize| 90.0 + 50.0 * lattice((x / 5) as i64, (y / 5) as i64, 1);
        let background = Image::from_fn(96, 64, |x, y| coarse(x, y) as u8).unwrap();
        let noise = |x: usize, y: usize| 40.0 * lattice(x as i64, y as i64, 77) - 20.0;
        let shadow = Image::from_fn(96, 64, |x, y| (0.5 * coarse(x, y) + noise(x, y)).max(0.0) as u8).unwrap();
        let left = |fineness_px: usize| {
            let mut mask = Image::filled(96, 64, FOREGROUND).unwrap();
            let background = (background.view(), fineness_px);
            Shade::default().remove(&ShadeParams::default(), shadow.view(), background, &mut mask);
            mask.as_slice().iter().filter(|v| **v != 0).count() as f64 / (96.0 * 64.0)
        };
        assert!(left(5) < 0.25 && left(1) > 0.9, "{} {}", left(5), left(1));
    }
}
