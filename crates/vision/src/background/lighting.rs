use super::difference::Channels;
use super::exposure::Exposure;
use super::noise::SensorNoise;
use super::registration::Registration;
use super::{BACKGROUND, BackgroundModel, Learning};
use crate::error::{VisionError, require_range};
use pursuit_imaging::{Image, ImageView};
use serde::{Deserialize, Serialize};
use std::num::NonZeroU32;

/// When [`Watched`] believes that the light has changed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LightingParams {
    /// Share of the unprotected pixels, 0 to 1, that must have changed (foreground or shadow).
    pub changed: f64,
    /// Share of the changed pixels, 0 to 1, that one gain for the whole picture must explain.
    pub explained: f64,
    /// Share of the unprotected pixels, 0 to 1, from which on the background is learnt anew even where no gain explains
    /// it: the camera was moved, or the scene cut.
    pub replaced: f64,
    /// A pixel is explained when background times gain is this near to it, codes.
    pub tolerance: u8,
    /// Frames after which the background is trusted enough to judge by it.
    pub settled_frames: u32,
    /// Whether the camera's exposure is followed: every frame is seen in the exposure of the background, by a gain and an offset
    /// a channel that the background in sight tells.
    pub exposure: bool,
    /// How far a camera that shakes may shift the picture, as a share of its longer side, 0 to 0.1: every frame is laid onto the
    /// background by its edges. 0: the camera does not shake.
    pub shake: f64,
    /// Standard deviation of the sensor's noise, in codes, that is tolerated: where there is more, every pixel is seen as the mean of
    /// those about it, of as many as bring the noise down to this. 0: frames are seen as they are.
    pub noise: f64,
}

impl Default for LightingParams {
    fn default() -> Self {
        Self {
            changed: 0.4,
            explained: 0.6,
            replaced: 0.8,
            tolerance: 20,
            settled_frames: 5,
            exposure: true,
            shake: 0.015,
            noise: 4.0,
        }
    }
}

/// A step of the light, or of the whole scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightingStep {
    /// Share of the unprotected pixels that had changed.
    pub changed: f64,
    /// Median brightness relative to the background.
    pub gain: f64,
    /// Share of the changed pixels that this gain explains.
    pub explained: f64,
}

/// What [`Watched::apply`] found besides the mask.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Report {
    /// Share of the unprotected pixels that changed (foreground or shadow), before a step was mended.
    pub changed: f64,
    /// The step that made the model learn the background anew.
    pub step: Option<LightingStep>,
}

/// A model that survives steps of the light: when most of the picture changes by one gain (or nearly all of it changes
/// anyhow), the mask is not flooded but the background learnt anew. Under a protecting mask the old background is kept,
/// brightened by the gain, so that a target that stands there is not learnt.
#[derive(Debug, Clone)]
pub struct Watched<M, P> {
    model: M,
    params: LightingParams,
    /// Frames since the background was last learnt anew.
    age: u32,
    background: Image<P>,
    ratios: Vec<f32>,
    exposure: Exposure<P>,
    /// The frame seen last in the exposure of the background, and whether that was another than its own.
    relit: Option<Image<P>>,
    differs: bool,
    registration: Registration<P>,
    /// The frame seen last as it lies on the background.
    registered: Option<Image<P>>,
    noise: SensorNoise,
    /// The frame seen last with no more noise than is tolerated.
    smoothed: Option<Image<P>>,
}

/// From this change of the gain in one frame on, a step of the light is reported.
const STEP: f64 = 0.12;

/// Every how many pixels, both ways, the gain is sampled.
const SPARSE: usize = 3;

impl<M: BackgroundModel<P>, P: Channels> Watched<M, P> {
    /// Watches `model`.
    ///
    /// # Errors
    /// When a share is not within 0 to 1.
    pub fn new(model: M, params: LightingParams) -> Result<Self, VisionError> {
        for (name, share) in
            [("changed", params.changed), ("explained", params.explained), ("replaced", params.replaced)]
        {
            require_range(name, share, (0.0, 1.0), "from 0 to 1")?;
        }
        require_range("shake", params.shake, (0.0, 0.1), "from 0 to 0.1")?;
        require_range("noise", params.noise, (0.0, 255.0), "from 0 to 255")?;
        Ok(Self {
            model,
            params,
            age: 0,
            background: Image::filled(1, 1, P::default())?,
            ratios: Vec::new(),
            exposure: Exposure::new(),
            relit: None,
            differs: false,
            registration: Registration::new()?,
            registered: None,
            noise: SensorNoise::default(),
            smoothed: None,
        })
    }

    /// The model.
    pub const fn model(&self) -> &M {
        &self.model
    }

    /// The model, to change.
    pub const fn model_mut(&mut self) -> &mut M {
        &mut self.model
    }

    /// The frame seen last as it lies on the background, in the exposure of the background, with no more noise than is tolerated;
    /// `None` where that is as it came.
    pub fn relit(&self) -> Option<ImageView<'_, P>> {
        let registered = self.registered.as_ref().filter(|_| self.registration.shifted());
        let changed = self.relit.as_ref().filter(|_| self.differs).or(registered);
        changed.or(self.smoothed.as_ref().filter(|_| self.noise.is_smoothing())).map(Image::view)
    }

    /// How fine the frame seen last is: the side of the square about each pixel whose mean it is, in pixels; 1: as it came.
    pub const fn fineness_px(&self) -> usize {
        self.noise.side()
    }

    /// How far the frame seen last was shifted by a camera that shakes, in pixels: what is at `p` of the background, and of the
    /// mask, is at `p` + shift of the frame.
    pub fn shift(&self) -> (f64, f64) {
        let (x, y) = self.registration.shift();
        (f64::from(x), f64::from(y))
    }

    /// As [`BackgroundModel::apply`], of the frame as it lies on the background, with no more noise than is tolerated.
    ///
    /// # Errors
    /// As [`BackgroundModel::apply`].
    pub fn apply(
        &mut self,
        frame: ImageView<'_, P>,
        learning: &Learning<'_>,
        mask: &mut Image<u8>,
    ) -> Result<Report, VisionError> {
        let measures = self.params.noise > 0.0 && learning.rate != Some(0.0);
        let changed = measures && self.noise.measure(frame, learning.rate, self.params.noise);
        if !self.noise.is_smoothing() {
            return self.apply_as_fine(frame, changed, learning, mask);
        }
        let mut smoothed = match self.smoothed.take() {
            Some(smoothed) => smoothed,
            None => frame.to_image(),
        };
        let applied = self.noise.smooth(frame, &mut smoothed);
        let applied = applied.and_then(|()| self.apply_as_fine(smoothed.view(), changed, learning, mask));
        self.smoothed = Some(smoothed);
        applied
    }

    /// As [`BackgroundModel::apply`], of the frame as it lies on the background. A background that was learnt from coarser frames,
    /// or finer ones, than this is learnt anew.
    ///
    /// # Errors
    /// As [`BackgroundModel::apply`].
    fn apply_as_fine(
        &mut self,
        frame: ImageView<'_, P>,
        anew: bool,
        learning: &Learning<'_>,
        mask: &mut Image<u8>,
    ) -> Result<Report, VisionError> {
        if anew {
            self.model.relearn(frame, 1.0, learning.protect)?;
            self.age = 0;
            self.registration.forget();
        }
        let known = self.params.shake > 0.0 && self.model.sample(frame.width() - 1, frame.height() - 1).is_some();
        if !known || learning.protect.is_some_and(|p| p.size() != frame.size()) {
            return self.apply_in_light(frame, learning, mask);
        }
        let light = self.exposure.mean();
        self.registration.measure(frame, &self.model, learning.protect, light, self.params.shake)?;
        let report = if self.registration.shifted() {
            let mut registered = match self.registered.take() {
                Some(registered) => registered,
                None => frame.to_image(),
            };
            let applied = self.registration.register(frame, &mut registered);
            let applied = applied.and_then(|()| self.apply_in_light(registered.view(), learning, mask));
            self.registered = Some(registered);
            applied?
        } else {
            self.apply_in_light(frame, learning, mask)?
        };
        if report.step.is_some() && self.age == 0 {
            self.registration.forget();
        } else if self.registration.unsteady() {
            let lies = self.relit().unwrap_or(frame);
            self.registration.admit_neighbours(lies, mask);
        }
        Ok(report)
    }

    /// As [`BackgroundModel::apply`], in the exposure of the background. A gain that jumps is reported as a step that the background
    /// has survived as it was.
    ///
    /// # Errors
    /// As [`BackgroundModel::apply`].
    fn apply_in_light(
        &mut self,
        frame: ImageView<'_, P>,
        learning: &Learning<'_>,
        mask: &mut Image<u8>,
    ) -> Result<Report, VisionError> {
        let settled = self.params.exposure && self.age >= self.params.settled_frames;
        let fits = |model: &M| model.sample(frame.width() - 1, frame.height() - 1).is_some();
        self.differs = false;
        if !settled || !fits(&self.model) {
            return self.apply_as_it_is(frame, learning, mask);
        }
        let before = self.exposure.gain();
        self.exposure.measure(frame, &self.model, learning.protect);
        if !self.exposure.differs() {
            return self.apply_as_it_is(frame, learning, mask);
        }
        let mut relit = match self.relit.take() {
            Some(relit) => relit,
            None => frame.to_image(),
        };
        let applied =
            self.exposure.relight(frame, &mut relit).and_then(|()| self.apply_as_it_is(relit.view(), learning, mask));
        (self.relit, self.differs) = (Some(relit), true);
        let mut report = applied?;
        if self.exposure.gain() > 1.0 {
            self.admit_clipped(frame, mask);
        }
        let gain = self.exposure.gain() / before;
        if report.step.is_none() && gain.ln().abs() >= STEP {
            let (changed, explained) = (1.0 - self.exposure.explained_before, self.exposure.explained);
            report.step = Some(LightingStep { changed, gain, explained });
        }
        Ok(report)
    }

    /// What is as bright as the picture can be, and should be, is background.
    fn admit_clipped(&self, frame: ImageView<'_, P>, mask: &mut Image<u8>) {
        for (y, row) in frame.rows().enumerate() {
            for (x, (pixel, told)) in
                row.iter().zip(mask.row_mut(y)).enumerate().filter(|(_, (_, m))| **m != BACKGROUND)
            {
                let bright = P::channels(&[*pixel]).iter().any(|v| *v >= 250);
                if bright && self.model.sample(x, y).is_some_and(|learnt| self.exposure.clipped(*pixel, learnt)) {
                    *told = BACKGROUND;
                }
            }
        }
    }

    /// As [`BackgroundModel::apply`]; after a step the mask is empty except where `learning` protects. With a rate of 0
    /// a step is reported, but nothing learnt and the mask left.
    ///
    /// # Errors
    /// As [`BackgroundModel::apply`].
    fn apply_as_it_is(
        &mut self,
        frame: ImageView<'_, P>,
        learning: &Learning<'_>,
        mask: &mut Image<u8>,
    ) -> Result<Report, VisionError> {
        self.model.apply(frame, learning, mask)?;
        self.age = self.age.saturating_add(1);
        let open = |y: usize, x: usize| learning.protect.is_none_or(|p| p.row(y)[x] == 0);
        let (mut changed, mut all) = (0usize, 0usize);
        for (y, row) in mask.view().rows().enumerate() {
            match learning.protect.map(|p| p.row(y)) {
                None => {
                    changed += row.iter().filter(|v| **v != BACKGROUND).count();
                    all += row.len();
                }
                Some(held) => {
                    // No row is too long for counts of 32 bits, of which more fit in a vector.
                    let open = held.iter().map(|held| u32::from(*held == 0)).sum::<u32>();
                    let both = row.iter().zip(held).map(|(v, held)| u32::from((*v != BACKGROUND) & (*held == 0)));
                    (all, changed) = (all + open as usize, changed + both.sum::<u32>() as usize);
                }
            }
        }
        let changed = changed as f64 / all.max(1) as f64;
        let flooded = changed >= self.params.changed && self.age > self.params.settled_frames;
        let step = if flooded { self.step(frame, mask, learning, changed)? } else { None };
        if let Some(step) = step.filter(|_| learning.rate != Some(0.0)) {
            self.model.relearn(frame, step.gain, learning.protect)?;
            self.age = 0;
            for y in 0..mask.height() {
                mask.row_mut(y).iter_mut().enumerate().filter(|(x, _)| open(y, *x)).for_each(|(_, v)| *v = BACKGROUND);
            }
        }
        Ok(Report { changed, step })
    }

    fn step(
        &mut self,
        frame: ImageView<'_, P>,
        mask: &Image<u8>,
        learning: &Learning<'_>,
        changed: f64,
    ) -> Result<Option<LightingStep>, VisionError> {
        if !self.model.background(&mut self.background)? {
            return Ok(None);
        }
        let background = &self.background;
        // (brightness now, brightness of the background) of changed pixels, on a grid.
        let samples = || {
            (0..frame.height()).step_by(SPARSE).flat_map(move |y| {
                let (now, was, mask) = (frame.row(y), background.row(y), mask.row(y));
                let protect = learning.protect.map(|p| p.row(y));
                let open = move |x: &usize| mask[*x] != BACKGROUND && protect.is_none_or(|p| p[*x] == 0);
                (0..frame.width()).step_by(SPARSE).filter(open).map(move |x| (brightness(now[x]), brightness(was[x])))
            })
        };
        self.ratios.clear();
        self.ratios.extend(samples().map(|(now, was)| (now + 1.0) / (was + 1.0)));
        let middle = self.ratios.len() / 2;
        let Some(n) = NonZeroU32::new(self.ratios.len() as u32) else { return Ok(None) };
        let gain = *self.ratios.select_nth_unstable_by(middle, f32::total_cmp).1;
        let tolerance = f32::from(self.params.tolerance);
        let near = samples().filter(|(now, was)| {
            // What is clipped at white is as the gain says.
            let expected = ((was + 1.0) * gain - 1.0).min(255.0);
            (now - expected).abs() <= tolerance
        });
        let explained = near.count() as f64 / f64::from(n.get());
        let step = LightingStep { changed, gain: f64::from(gain), explained };
        Ok((explained >= self.params.explained || changed >= self.params.replaced).then_some(step))
    }
}

/// Mean of the channels.
fn brightness<P: Channels>(pixel: P) -> f32 {
    let pixel = [pixel];
    let channels = P::channels(&pixel);
    channels.iter().map(|&v| f32::from(v)).sum::<f32>() / P::COUNT as f32
}
