//! A field of flow from every frame to the next.

#[cfg(feature = "encode")]
use super::drawing;
use super::folder::{Folder, Rows};
use super::{Seen, refused};
use crate::RunError;
use crate::timing::Timing;
use pursuit_geometry::{Point, Size};
use pursuit_imaging::Frame;
use pursuit_media::output::VideoWriter;
use pursuit_vision::flow::Pyramid;
use pursuit_vision::flow::dense::{DenseFlow, DenseFlowParams, FlowField};
use serde::Serialize;
use std::path::PathBuf;
use std::time::Instant;

/// How a field is shown in the overlay video.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Shown {
    /// By the colours of the wheel of baker2007, over the picture.
    #[default]
    Wheel,
    /// By arrows, so many pixels apart.
    Arrows(f64),
}

/// How a field is computed, and what is written of it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FieldOptions {
    /// How it is computed.
    pub params: DenseFlowParams,
    /// How the overlay shows it.
    pub shown: Shown,
    /// The motion that has the fullest colour, pixels; without, that of the fastest pixels lately.
    pub longest_px: Option<f64>,
    /// Whether a `.flo` file is written for every frame but the last, of what is seen and in its pixels.
    pub flo: bool,
    /// Motions on a grid, so many pixels of the input apart, are written as CSV, in the input's pixels.
    pub grid_px: Option<f64>,
}

/// How the fields were.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct FieldFacts {
    /// How many there were.
    pub fields: u64,
    /// Mean length of a motion, pixels of the input.
    pub mean_px: f64,
    /// The longest motion, pixels of the input.
    pub longest_px: f64,
}

/// A run over fields.
pub(super) struct FieldRun {
    options: FieldOptions,
    dense: DenseFlow,
    field: FlowField,
    pyramids: Option<[Pyramid; 2]>,
    facts: FieldFacts,
    rows: Option<Rows>,
    fields: Option<PathBuf>,
    #[cfg(feature = "encode")]
    overlay: Option<(Box<dyn VideoWriter>, drawing::Fields)>,
    timing: Timing,
}

impl FieldRun {
    pub fn new(options: FieldOptions) -> Result<Self, RunError> {
        let arrows = if let Shown::Arrows(step) = options.shown { Some(step) } else { None };
        for step in [arrows, options.grid_px].into_iter().flatten() {
            if !(1.0..=1e6).contains(&step) {
                return Err(RunError::usage(format!("a step of {step} pixels makes no sense; give at least 1")));
            }
        }
        if options.longest_px.is_some_and(|px| !(px > 0.0 && px.is_finite())) {
            return Err(RunError::usage("the motion with the fullest colour must be longer than 0 pixels"));
        }
        Ok(Self {
            dense: DenseFlow::new(options.params).map_err(refused)?,
            field: FlowField::zero(Size::new(1, 1)).map_err(refused)?,
            options,
            pyramids: None,
            facts: FieldFacts::default(),
            rows: None,
            fields: None,
            #[cfg(feature = "encode")]
            overlay: None,
            timing: Timing::default(),
        })
    }

    /// Opens the files.
    ///
    /// # Errors
    /// When they cannot be written.
    pub fn begin(
        &mut self,
        folder: &Folder,
        overlay: Option<Box<dyn VideoWriter>>,
        seen: &Seen,
    ) -> Result<(), RunError> {
        self.rows = self.options.grid_px.map(|_| folder.grid()).transpose()?;
        self.fields = self.options.flo.then(|| folder.fields()).transpose()?;
        #[cfg(feature = "encode")]
        {
            let longest_px = self.options.longest_px.map(|px| px / seen.length(1.0));
            let fields = || drawing::Fields::new(self.options.shown, longest_px);
            self.overlay = overlay.map(|video| (video, fields()));
        }
        #[cfg(not(feature = "encode"))]
        drop((overlay, seen));
        Ok(())
    }

    /// The field from one frame to the next, written where it is wanted.
    ///
    /// # Errors
    /// A picture smaller than a patch, or a file that cannot be written.
    pub fn step(&mut self, [before, frame]: [&Frame; 2], seen: &Seen) -> Result<(), RunError> {
        let begun = Instant::now();
        let levels = self.dense.levels(frame.size());
        let pyramids = match self.pyramids.take() {
            Some([from, mut to]) => {
                // The newest becomes the older one.
                let mut old = from;
                std::mem::swap(&mut old, &mut to);
                to.build(frame.gray(), levels).map_err(refused)?;
                [old, to]
            }
            None => {
                let of = |frame: &Frame| Pyramid::of(frame.gray(), levels).map_err(refused);
                [of(before)?, of(frame)?]
            }
        };
        let [from, to] = self.pyramids.insert(pyramids);
        self.dense.estimate(from, to, &mut self.field).map_err(refused)?;
        self.timing.add(begun.elapsed().as_secs_f64() * 1e3);
        self.count(seen);
        if let Some(fields) = &self.fields {
            let path = fields.join(format!("{:06}.flo", before.index()));
            std::fs::write(&path, self.field.to_flo()).map_err(RunError::output(&path))?;
        }
        if let (Some(rows), Some(step)) = (&mut self.rows, self.options.grid_px) {
            let dt = frame.time_s() - before.time_s();
            for point in seen.grid(step).1 {
                let ([dx, dy], Point { x, y }) = (seen.motion(self.field.at(seen.of_input(point))), point);
                let (index, time) = (before.index(), before.time_s());
                rows.add(&format!("{index},{time:.6},{x},{y},{dx:.3},{dy:.3},{dt:.6}"))?;
            }
            rows.flush()?;
        }
        #[cfg(feature = "encode")]
        if let Some((video, fields)) = &mut self.overlay {
            let picture = fields.draw(before, &self.field).map_err(|e| RunError::usage(e.to_string()))?;
            video.write(picture.view(), before.time_s())?;
        }
        Ok(())
    }

    fn count(&mut self, seen: &Seen) {
        let length = |motion: &[f32; 2]| {
            let [u, v] = seen.motion(*motion);
            u.hypot(v)
        };
        let lengths = self.field.image().as_slice().iter().map(length);
        let (sum, longest) = lengths.fold((0.0, 0.0), |(sum, longest): (f64, f64), l| (sum + l, longest.max(l)));
        let mean = sum / self.field.size().area() as f64;
        self.facts.fields += 1;
        self.facts.mean_px += (mean - self.facts.mean_px) / self.facts.fields as f64;
        self.facts.longest_px = self.facts.longest_px.max(longest);
    }

    /// Closes the files.
    ///
    /// # Errors
    /// When they cannot be written.
    pub fn finish(&mut self) -> Result<FieldFacts, RunError> {
        #[cfg(feature = "encode")]
        if let Some((video, _)) = &mut self.overlay {
            video.finish()?;
        }
        Ok(self.facts)
    }

    pub fn mean_ms(&self) -> f64 {
        self.timing.summary().mean
    }
}
