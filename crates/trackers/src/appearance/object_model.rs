use pursuit_vision::patch::dot;
use serde::{Deserialize, Serialize};

pursuit_parameters::choices! {
    /// How similarities to what is the object and to what is not become one number in `[0, 1]`.
    pub enum SimilarityForm {
        /// `(1 − S⁻) / ((1 − S⁻) + (1 − S⁺))`, of distances: the form of the released TLD, whose thresholds suit it.
        Distance = "distance",
        /// `S⁺ / (S⁺ + S⁻)` (kalal2012, section 5.2): always near one half, for no two grey patches are unlike.
        Ratio = "ratio",
    }
}

/// How much a patch resembles what is known to be the object, and what is known not to be; each in `[0, 1]`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Similarity {
    /// To the nearest patch of the object, S⁺.
    pub positive: f64,
    /// To the nearest of the earliest half of these, S⁺₅₀.
    pub early: f64,
    /// To the nearest patch that is not the object, S⁻; one half (no correlation) where none is known.
    pub negative: f64,
}

impl Similarity {
    /// The relative similarity, Sʳ.
    pub fn relative(&self, form: SimilarityForm) -> f64 {
        join(form, self.positive, self.negative)
    }

    /// The conservative similarity, Sᶜ: relative to the earliest half, which drift has not reached.
    pub fn conservative(&self, form: SimilarityForm) -> f64 {
        join(form, self.early, self.negative)
    }
}

fn join(form: SimilarityForm, positive: f64, negative: f64) -> f64 {
    let (a, b) = match form {
        SimilarityForm::Distance => (1.0 - negative, 1.0 - positive),
        SimilarityForm::Ratio => (positive, negative),
    };
    // Both may be 0 only where the patch is in both sets.
    if a + b > 0.0 { a / (a + b) } else { 0.5 }
}

/// Where a patch was found to be nearest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resemblance {
    /// How much.
    pub similarity: Similarity,
    /// Index of the nearest patch of the object.
    pub nearest: Option<usize>,
}

/// The object model of TLD (kalal2012, section 5.2): patches of the object in the order of their time, and patches that are
/// not the object. Patches are of mean zero and length one (or all zero), so that dot products are correlations.
///
/// Both sets are bounded. What is forgotten to make room is drawn at random from the later half: the earliest half, by
/// which drift is told, stays.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(remote = "ObjectModel")]
pub struct ObjectModel {
    length: usize,
    capacity: usize,
    positives: Vec<f32>,
    negatives: Vec<f32>,
    random: u64,
}

pursuit_estimation::checked!(ObjectModel);

impl ObjectModel {
    fn restored(self) -> Result<Self, &'static str> {
        let Self { length, capacity, positives, negatives, .. } = &self;
        if *length == 0 || *capacity < 2 {
            return Err("an object model needs patches and room for two");
        }
        for set in [positives, negatives] {
            if set.len() % length != 0 || set.len() / length > *capacity || set.iter().any(|v| !v.is_finite()) {
                return Err("the patches of an object model do not fit it");
            }
        }
        Ok(self)
    }
}

impl ObjectModel {
    /// A model of patches of `length` values, at most `capacity` (at least 2) of either kind; `seed` chooses what is
    /// forgotten.
    pub fn new(length: usize, capacity: usize, seed: u64) -> Self {
        let (length, capacity) = (length.max(1), capacity.max(2));
        let room = || Vec::with_capacity(length * capacity);
        Self { length, capacity, positives: room(), negatives: room(), random: seed }
    }

    /// Values of a patch.
    pub const fn patch_len(&self) -> usize {
        self.length
    }

    /// How many patches of the object are known, and how many of what is not.
    pub const fn len(&self) -> (usize, usize) {
        (self.positives.len() / self.length, self.negatives.len() / self.length)
    }

    /// Whether nothing is known.
    pub const fn is_empty(&self) -> bool {
        self.positives.is_empty() && self.negatives.is_empty()
    }

    /// What `patch` resembles.
    pub fn resemblance(&self, patch: &[f32]) -> Resemblance {
        let count = self.positives.len() / self.length;
        let (mut positive, mut early, mut nearest) = (-1.0f32, -1.0f32, None);
        for (i, own) in self.positives.chunks_exact(self.length).enumerate() {
            let ncc = dot(patch, own);
            if ncc > positive {
                (positive, nearest) = (ncc, Some(i));
            }
            if i < count.div_ceil(2) {
                early = early.max(ncc);
            }
        }
        let negatives = self.negatives.chunks_exact(self.length).map(|other| dot(patch, other));
        let negative = negatives.reduce(f32::max).unwrap_or(0.0);
        let similarity =
            Similarity { positive: similarity(positive), early: similarity(early), negative: similarity(negative) };
        Resemblance { similarity, nearest }
    }

    /// The patch of the object that `patch` is nearest to, of the earliest half alone if `early`.
    pub fn nearest(&self, patch: &[f32], early: bool) -> Option<usize> {
        let count = self.positives.len() / self.length;
        let known = if early { count.div_ceil(2) } else { count };
        let own = self.positives.chunks_exact(self.length).take(known).map(|own| dot(patch, own));
        own.enumerate().max_by(|(_, a), (_, b)| a.total_cmp(b)).map(|(index, _)| index)
    }

    /// How much `patch` resembles the patch of the object with that index, in `[0, 1]`; 0 where there is none.
    pub fn likeness(&self, index: usize, patch: &[f32]) -> f64 {
        let own = self.positives.chunks_exact(self.length).nth(index);
        own.map_or(0.0, |own| similarity(dot(patch, own)))
    }

    /// Adds a patch of the object. Patches of another length are left out.
    pub fn add_positive(&mut self, patch: &[f32]) {
        add(&mut self.positives, patch, self.length, self.capacity, &mut self.random);
    }

    /// Adds a patch of what is not the object. Patches of another length are left out.
    pub fn add_negative(&mut self, patch: &[f32]) {
        add(&mut self.negatives, patch, self.length, self.capacity, &mut self.random);
    }
}

/// A correlation as a similarity.
fn similarity(ncc: f32) -> f64 {
    (0.5 * (f64::from(ncc) + 1.0)).clamp(0.0, 1.0)
}

fn add(set: &mut Vec<f32>, patch: &[f32], length: usize, capacity: usize, random: &mut u64) {
    if patch.len() != length || patch.iter().any(|v| !v.is_finite()) {
        return;
    }
    let count = set.len() / length;
    if count >= capacity {
        let kept = count.div_ceil(2);
        let victim = kept + (draw(random) % (count - kept).max(1) as u64) as usize;
        set.copy_within((victim + 1) * length.., victim * length);
        set.truncate((count - 1) * length);
    }
    set.extend_from_slice(patch);
}

/// The next of a sequence of well mixed numbers (Steele, Lea and Flood 2014, SplitMix64).
pub(crate) fn draw(state: &mut u64) -> u64 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_vision::patch::normalize;
    use serde_json::Value;

    fn patch(value: &Value) -> Vec<f32> {
        let rows = value.as_array().unwrap().iter();
        let mut patch: Vec<f32> =
            rows.flat_map(|r| r.as_array().unwrap()).map(|v| v.as_f64().unwrap() as f32).collect();
        assert!(normalize(&mut patch));
        patch
    }

    #[test]
    fn similarities_are_those_of_the_fixture() {
        let fixture: Value = serde_json::from_str(include_str!("../../tests/fixtures/tld_nn.json")).unwrap();
        let mut model = ObjectModel::new(225, 100, 0);
        fixture["positives"].as_array().unwrap().iter().for_each(|p| model.add_positive(&patch(p)));
        fixture["negatives"].as_array().unwrap().iter().for_each(|p| model.add_negative(&patch(p)));
        assert_eq!((model.len(), model.patch_len(), model.is_empty()), ((6, 5), 225, false));
        let queries = fixture["queries"].as_array().unwrap();
        for (query, want) in queries.iter().zip(fixture["results"].as_array().unwrap()) {
            let Resemblance { similarity: got, nearest } = model.resemblance(&patch(query));
            let near = |got: f64, key: &str| {
                let want = want[key].as_f64().unwrap();
                // Patches are stored in single precision.
                assert!((got - want).abs() < 2e-6, "{key}: {got} is not {want}");
            };
            near(got.positive, "S_plus");
            near(got.negative, "S_minus");
            near(got.early, "S_plus_half");
            near(got.relative(SimilarityForm::Ratio), "relative");
            near(got.conservative(SimilarityForm::Ratio), "conservative");
            near(got.relative(SimilarityForm::Distance), "distance_relative");
            let correlations = want["ncc_pos"].as_array().unwrap().iter().map(|v| v.as_f64().unwrap());
            let best = correlations.enumerate().max_by(|a, b| a.1.total_cmp(&b.1)).map(|(i, _)| i);
            assert_eq!(nearest, best);
        }
    }

    fn unit(i: usize) -> Vec<f32> {
        let mut patch = vec![0.0; 16];
        patch[i % 16] = 1.0;
        patch
    }

    #[test]
    fn the_earliest_half_is_never_forgotten() {
        let mut model = ObjectModel::new(16, 6, 3);
        (0..6).for_each(|i| model.add_positive(&unit(i)));
        let similar = |model: &ObjectModel, i: usize| model.resemblance(&unit(i)).similarity;
        assert_eq!((similar(&model, 2).early, similar(&model, 3).early), (1.0, 0.5));
        for k in 0..200 {
            model.add_positive(&unit(6 + k % 10));
            model.add_negative(&unit(6 + k % 10));
            assert_eq!(model.len().0, 6);
            assert!(model.len().1 <= 6);
        }
        assert!((0..3).all(|i| similar(&model, i).positive == 1.0 && similar(&model, i).early == 1.0));
        assert!((3..6).all(|i| similar(&model, i).positive == 0.5));
        // The one added last is known.
        assert_eq!(similar(&model, 15).positive, 1.0);
        assert_eq!(similar(&model, 6).negative, 1.0);
    }

    #[test]
    fn what_is_forgotten_varies_and_is_the_seeds() {
        let after = |seed| {
            let mut model = ObjectModel::new(16, 8, seed);
            (0..12).for_each(|i| model.add_positive(&unit(i)));
            model
        };
        assert_eq!(after(5), after(5));
        let models: Vec<_> = (0..8).map(|seed| after(seed).positives).collect();
        assert!(models.iter().any(|m| m != &models[0]));
    }

    #[test]
    fn nothing_known_resembles_nothing() {
        let mut model = ObjectModel::new(16, 0, 0);
        assert!(model.is_empty());
        let none = model.resemblance(&unit(0));
        assert_eq!(none.nearest, None);
        assert_eq!(none.similarity, Similarity { positive: 0.0, early: 0.0, negative: 0.5 });
        assert!((none.similarity.relative(SimilarityForm::Distance) - 1.0 / 3.0).abs() < 1e-12);
        model.add_positive(&[1.0; 3]);
        model.add_negative(&[f32::NAN; 16]);
        assert!(model.is_empty());
        model.add_positive(&unit(0));
        model.add_negative(&unit(0));
        assert!(!model.is_empty());
        // Object and not: even odds.
        let both = model.resemblance(&unit(0)).similarity;
        assert_eq!((both.relative(SimilarityForm::Distance), both.relative(SimilarityForm::Ratio)), (0.5, 0.5));
    }

    #[test]
    fn states_that_do_not_fit_are_refused() {
        let mut model = ObjectModel::new(16, 4, 0);
        model.add_positive(&unit(1));
        let saved = serde_json::to_value(&model).unwrap();
        assert_eq!(serde_json::from_value::<ObjectModel>(saved.clone()).unwrap(), model);
        for (key, value) in
            [("length", 0.into()), ("length", 7.into()), ("capacity", 1.into()), ("positives", vec![0.0; 80].into())]
        {
            let mut bad = saved.clone();
            bad[key] = value;
            assert!(serde_json::from_value::<ObjectModel>(bad).is_err(), "{key}");
        }
    }
}
