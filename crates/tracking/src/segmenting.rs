//! Which pixels of a target's box are the target's: a role after the loop, for any tracker.

use crate::searcher::{Appearance, Told};
use crate::{Belief, Estimate, Figure, Forecast, Measurement, Needs, Prior, Recipe, Result, Tracker, snapshot};
use pursuit_geometry::{BBox, Mask};
use pursuit_imaging::Frame;
use pursuit_parameters::{Parameter, Parameters, merge, nested};
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use std::sync::Arc;

/// Says which pixels are the target's, once it has been found.
pub trait Segmenter: Clone + Send + Serialize + DeserializeOwned + 'static {
    /// The target's pixels in `frame`, where `estimate` says where it is; `None` where that cannot be told. It is asked in every frame
    /// and may learn from it; a target that is predicted or lost is not seen, and must have no mask.
    ///
    /// # Errors
    /// When the method fails on this frame.
    fn segment(&mut self, frame: &Frame, estimate: &Estimate) -> Result<Option<Mask>>;

    /// Forgets the target and starts on the one at `bbox`, with the same parameters; the frame may have a new size.
    ///
    /// # Errors
    /// When the frame lacks what the method needs.
    fn restart(&mut self, frame: &Frame, bbox: BBox) -> Result<()>;
}

/// What an implementer writes to have masks: one group of parameters that makes a segmenter.
pub trait SegmenterRecipe: Parameters {
    /// The segmenter made.
    type Segmenter: Segmenter;

    /// A segmenter of the target at `bbox`; `None` where these parameters want no masks.
    ///
    /// # Errors
    /// When the frame lacks what the method needs.
    fn segmenter(&self, frame: &Frame, bbox: BBox) -> Result<Option<Self::Segmenter>>;
}

/// A recipe whose trackers say, where its own group of parameters wants it, which pixels are the target's
/// ([`Estimate::mask`]). Where it does not, they are the trackers of the recipe inside, and cost nothing more.
#[derive(Clone)]
pub struct SegmentingRecipe<P> {
    recipe: Box<dyn Recipe>,
    mask: P,
}

impl Clone for Box<dyn Recipe> {
    fn clone(&self) -> Self {
        self.boxed_clone()
    }
}

impl<P: SegmenterRecipe> SegmentingRecipe<P> {
    /// The recipe with a group of parameters more.
    pub const fn new(recipe: Box<dyn Recipe>, mask: P) -> Self {
        Self { recipe, mask }
    }

    /// A segmenter with its tracker or appearance, where one is wanted.
    fn with_segmenter<T>(&self, inner: T, frame: &Frame, bbox: BBox) -> Result<Made<T, P::Segmenter>> {
        Ok(match self.mask.segmenter(frame, bbox)? {
            Some(segmenter) => Made::Segmenting(Segmenting { name: self.name().to_owned(), inner, segmenter }),
            None => Made::Plain(inner),
        })
    }

    /// What was saved with masks; `None` where the bytes are of the recipe inside.
    fn saved(&self, saved: &[u8]) -> Result<Option<(Vec<u8>, P::Segmenter)>> {
        if !snapshot::is_segmenting(saved) {
            return Ok(None);
        }
        let State { inner, segmenter } = snapshot::read(&snapshot::segmenting(self.name()), saved)?;
        Ok(Some((inner, segmenter)))
    }
}

enum Made<T, S> {
    Plain(T),
    Segmenting(Segmenting<T, S>),
}

impl<P: SegmenterRecipe> Recipe for SegmentingRecipe<P> {
    fn name(&self) -> &str {
        self.recipe.name()
    }

    fn needs(&self) -> Needs {
        self.recipe.needs()
    }

    fn schema(&self) -> Vec<Parameter> {
        self.recipe.schema().into_iter().chain(self.mask.schema()).collect()
    }

    fn figures(&self) -> Vec<&'static Figure> {
        self.recipe.figures()
    }

    fn renamed(&self, path: &str) -> Option<Vec<String>> {
        self.recipe.renamed(path).or_else(|| self.mask.renamed(path))
    }

    fn parameters(&self) -> Result<toml::Table> {
        let mut table = self.recipe.parameters()?;
        merge(&mut table, self.mask.to_table(self.name())?);
        Ok(table)
    }

    fn with(&self, changes: &toml::Table) -> Result<Box<dyn Recipe>> {
        let own = self.mask.schema();
        let (mask, others): (toml::Table, toml::Table) =
            nested(changes).into_iter().partition(|(key, _)| own.iter().any(|p| p.name == key));
        let mask = self.mask.with(self.name(), &mask)?;
        Ok(Box::new(Self { recipe: self.recipe.with(&others)?, mask }))
    }

    fn init(&self, frame: &Frame, bbox: BBox) -> Result<Box<dyn Tracker>> {
        let inner = self.recipe.init(frame, bbox)?;
        Ok(match self.with_segmenter(inner, frame, bbox)? {
            Made::Plain(tracker) => tracker,
            Made::Segmenting(tracker) => Box::new(tracker),
        })
    }

    fn appearance(&self, frame: &Frame, bbox: BBox) -> Result<Box<dyn Appearance>> {
        let inner = self.recipe.appearance(frame, bbox)?;
        Ok(match self.with_segmenter(inner, frame, bbox)? {
            Made::Plain(appearance) => appearance,
            Made::Segmenting(appearance) => Box::new(appearance),
        })
    }

    fn restore_appearance(&self, saved: &[u8]) -> Result<Box<dyn Appearance>> {
        let Some((inner, segmenter)) = self.saved(saved)? else { return self.recipe.restore_appearance(saved) };
        let inner = self.recipe.restore_appearance(&inner)?;
        Ok(Box::new(Segmenting { name: self.name().to_owned(), inner, segmenter }))
    }

    fn restore(&self, saved: &[u8]) -> Result<Box<dyn Tracker>> {
        let Some((inner, segmenter)) = self.saved(saved)? else { return self.recipe.restore(saved) };
        let inner = self.recipe.restore(&inner)?;
        Ok(Box::new(Segmenting { name: self.name().to_owned(), inner, segmenter }))
    }

    fn boxed_clone(&self) -> Box<dyn Recipe> {
        Box::new(self.clone())
    }
}

/// A tracker or an appearance, and what says which pixels are the target's.
struct Segmenting<T, S> {
    name: String,
    inner: T,
    segmenter: S,
}

impl<T, S: Segmenter> Segmenting<T, S> {
    fn segment(&mut self, frame: &Frame, estimate: Estimate) -> Result<Estimate> {
        let mask = self.segmenter.segment(frame, &estimate)?;
        let mask = mask.map(|mask| mask.clipped_to(frame.size())).filter(|mask| !mask.is_empty()).map(Arc::new);
        Ok(Estimate { mask, ..estimate })
    }

    fn saved(&self, inner: Vec<u8>) -> Result<Vec<u8>> {
        snapshot::write(&snapshot::segmenting(&self.name), &State { inner, segmenter: &self.segmenter })
    }
}

/// What is saved.
#[derive(Serialize, Deserialize)]
struct State<S> {
    inner: Vec<u8>,
    segmenter: S,
}

impl<S: Segmenter> Tracker for Segmenting<Box<dyn Tracker>, S> {
    fn update(&mut self, frame: &Frame) -> Result<Estimate> {
        let estimate = self.inner.update(frame)?;
        self.segment(frame, estimate)
    }

    fn peek(&mut self, frame: &Frame) -> Result<Option<Measurement>> {
        self.inner.peek(frame)
    }

    fn forecast(&self, seconds: f64) -> Result<Forecast> {
        self.inner.forecast(seconds)
    }

    fn reinit(&mut self, frame: &Frame, bbox: BBox) -> Result<()> {
        self.inner.reinit(frame, bbox)?;
        self.segmenter.restart(frame, bbox)
    }

    fn change(&mut self, changes: &toml::Table) -> Result<()> {
        self.inner.change(changes)
    }

    fn save(&self) -> Result<Vec<u8>> {
        self.saved(self.inner.save()?)
    }

    fn boxed_clone(&self) -> Box<dyn Tracker> {
        let (name, inner) = (self.name.clone(), self.inner.boxed_clone());
        Box::new(Self { name, inner, segmenter: self.segmenter.clone() })
    }
}

impl<S: Segmenter> Appearance for Segmenting<Box<dyn Appearance>, S> {
    fn follow(
        &mut self,
        frame: &Frame,
        belief: &mut Belief,
        prior: &Prior,
        told: Option<&Told<'_>>,
        believable: &dyn Fn(&Measurement) -> bool,
    ) -> Result<Estimate> {
        let estimate = self.inner.follow(frame, belief, prior, told, believable)?;
        self.segment(frame, estimate)
    }

    fn restart(&mut self, frame: &Frame, bbox: BBox) -> Result<()> {
        self.inner.restart(frame, bbox)?;
        self.segmenter.restart(frame, bbox)
    }

    fn carry(&mut self, shift: (f64, f64)) {
        self.inner.carry(shift);
    }

    fn save(&self) -> Result<Vec<u8>> {
        self.saved(self.inner.save()?)
    }
}
