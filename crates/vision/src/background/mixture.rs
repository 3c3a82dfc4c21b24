//! The mixture of Gaussians of one pixel.

/// The most components of a mixture.
pub(super) const MOST: usize = 8;

/// One Gaussian of the mixture of a pixel with up to three channels.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Mode {
    pub weight: f32,
    pub variance: f32,
    pub mean: [f32; 3],
}

/// What does not change from pixel to pixel; see [`Mog2Params`](super::Mog2Params).
#[derive(Debug, Clone, Copy)]
pub(super) struct Rule {
    pub most_modes: usize,
    /// Weight of this frame, α.
    pub rate: f32,
    /// α · complexity reduction: what every weight loses, and below which a mode is dropped.
    pub prune: f32,
    pub background_ratio: f32,
    pub background_distance: f32,
    pub match_distance: f32,
    pub initial_variance: f32,
    pub least_variance: f32,
    pub most_variance: f32,
    /// Least brightness of a shadow relative to the background; above 1 where shadows are not looked for.
    pub shadow_ratio: f32,
}

/// The modes of a pixel, the heaviest first.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Mixture {
    pub modes: [Mode; MOST],
    pub count: usize,
}

/// Squared distance of a value of `C` channels from a mean.
#[inline(always)]
fn squared_distance<const C: usize>(mode: &Mode, value: &[f32; 3]) -> f32 {
    (0..C).map(|c| (mode.mean[c] - value[c]).powi(2)).sum()
}

impl Mixture {
    /// Whether `value` is background, and learns it: equations (5) to (11) of Zivkovic and van der Heijden 2006. Distances
    /// are compared with one variance for all channels; that variance is the mean *sum* of squares over the channels.
    #[inline]
    pub fn update<const C: usize>(&mut self, value: &[f32; 3], rule: &Rule) -> bool {
        let (mut background, mut matched, mut total) = (false, false, 0.0f32);
        let (mut k, known) = (0, self.count);
        while k < self.count {
            let mut weight = (1.0 - rule.rate) * self.modes[k].weight - rule.prune;
            let mut place = k;
            if !matched {
                let distance = squared_distance::<C>(&self.modes[k], value);
                let variance = self.modes[k].variance;
                background |= total < rule.background_ratio && distance < rule.background_distance * variance;
                if distance < rule.match_distance * variance {
                    matched = true;
                    weight += rule.rate;
                    self.modes[k].learn::<C>(value, distance, rule.rate / weight, rule);
                    // Only this weight has grown: it moves up past those it has overtaken.
                    while place > 0 && weight >= self.modes[place - 1].weight {
                        self.modes.swap(place, place - 1);
                        place -= 1;
                    }
                }
            }
            if weight < rule.prune {
                weight = 0.0;
                self.count -= 1;
            }
            self.modes[place].weight = weight;
            total += weight;
            k += 1;
        }
        debug_assert!(self.count <= known);
        let scale = if total.abs() > f32::EPSILON { 1.0 / total } else { 0.0 };
        self.modes[..self.count].iter_mut().for_each(|m| m.weight *= scale);
        if !matched {
            self.add_mode(value, rule);
        }
        background
    }

    /// A new mode for a value that fits none, in the place of the lightest when there are as many as there may be.
    fn add_mode(&mut self, value: &[f32; 3], rule: &Rule) {
        if self.count < rule.most_modes {
            self.count += 1;
        }
        let last = self.count - 1;
        let weight = if self.count == 1 { 1.0 } else { rule.rate };
        self.modes[..last].iter_mut().for_each(|m| m.weight *= 1.0 - rule.rate);
        self.modes[last] = Mode { weight, variance: rule.initial_variance, mean: *value };
        let mut place = last;
        while place > 0 && rule.rate >= self.modes[place - 1].weight {
            self.modes.swap(place, place - 1);
            place -= 1;
        }
    }

    /// Whether `value` is background, learning nothing.
    pub fn is_background<const C: usize>(&self, value: &[f32; 3], rule: &Rule) -> bool {
        let mut total = 0.0;
        for mode in &self.modes[..self.count] {
            let distance = squared_distance::<C>(mode, value);
            if total < rule.background_ratio && distance < rule.background_distance * mode.variance {
                return true;
            }
            // A value belongs to the first mode it fits, background or not.
            if distance < rule.match_distance * mode.variance {
                return false;
            }
            total += mode.weight;
        }
        self.count == 0
    }

    /// Whether `value` is a background colour darkened by at most the shadow ratio (Prati, Mikic, Trivedi and Cucchiara
    /// 2003): a·mean is the nearest point on the line from black to the mean, and the value lies near it.
    pub fn is_shadow<const C: usize>(&self, value: &[f32; 3], rule: &Rule) -> bool {
        let mut total = 0.0;
        for mode in &self.modes[..self.count] {
            let along: f32 = (0..C).map(|c| value[c] * mode.mean[c]).sum();
            let length: f32 = (0..C).map(|c| mode.mean[c] * mode.mean[c]).sum();
            if length == 0.0 {
                return false;
            }
            if along <= length && along >= rule.shadow_ratio * length {
                let a = along / length;
                let off: f32 = (0..C).map(|c| (a * mode.mean[c] - value[c]).powi(2)).sum();
                if off < rule.background_distance * mode.variance * a * a {
                    return true;
                }
            }
            total += mode.weight;
            if total > rule.background_ratio {
                return false;
            }
        }
        false
    }
}

impl Mode {
    #[inline(always)]
    fn learn<const C: usize>(&mut self, value: &[f32; 3], distance: f32, k: f32, rule: &Rule) {
        for c in 0..C {
            self.mean[c] -= k * (self.mean[c] - value[c]);
        }
        let variance = self.variance + k * (distance - self.variance);
        self.variance = variance.max(rule.least_variance).min(rule.most_variance);
    }
}
