use super::difference::{Channels, check, check_sizes, mark_changed, replace_unless};
use super::{BackgroundModel, Learning};
use crate::Result;
use pursuit_imaging::{Image, ImageView};

/// Three-frame difference: foreground is what differs by more than a threshold both from the last frame and from the one
/// before it (Collins et al. 2000, “A system for video surveillance and monitoring”).
///
/// It has no memory beyond two frames, so rates and protection mean nothing to it; what stands still is background at
/// once, and of what moves slowly only the edges show.
#[derive(Debug, Clone)]
pub struct ThreeFrame<P> {
    threshold: u8,
    last: Option<Image<P>>,
    before_last: Option<Image<P>>,
    row: Vec<u8>,
}

impl<P: Channels> ThreeFrame<P> {
    /// A model; `threshold` in codes.
    pub const fn new(threshold: u8) -> Self {
        Self { threshold, last: None, before_last: None, row: Vec::new() }
    }
}

impl<P: Channels> BackgroundModel<P> for ThreeFrame<P> {
    fn apply(&mut self, frame: ImageView<'_, P>, learning: &Learning<'_>, mask: &mut Image<u8>) -> Result<()> {
        check(self.last.as_ref().map(Image::size), frame.size(), learning)?;
        mask.resize_for_overwrite(frame.size(), 0)?;
        self.row.resize(frame.width(), 0);
        if let (Some(last), Some(before)) = (&self.last, &self.before_last) {
            for (y, row) in frame.rows().enumerate() {
                mark_changed(row, last.row(y), self.threshold, mask.row_mut(y));
                mark_changed(row, before.row(y), self.threshold, &mut self.row);
                mask.row_mut(y).iter_mut().zip(&self.row).for_each(|(mask, other)| *mask &= other);
            }
        } else {
            mask.as_mut_slice().fill(0);
        }
        std::mem::swap(&mut self.last, &mut self.before_last);
        match &mut self.last {
            Some(last) => frame.rows().enumerate().for_each(|(y, row)| last.row_mut(y).copy_from_slice(row)),
            None => self.last = Some(frame.to_image()),
        }
        Ok(())
    }

    /// The last frame but one: what the last frame was compared with.
    fn background(&self, out: &mut Image<P>) -> Result<bool> {
        super::fixed::copy(self.before_last.as_ref().or(self.last.as_ref()), out)
    }

    fn sample(&self, x: usize, y: usize) -> Option<P> {
        super::fixed::sample(self.before_last.as_ref().or(self.last.as_ref()), x, y)
    }

    fn relearn(&mut self, frame: ImageView<'_, P>, gain: f64, keep: Option<ImageView<'_, u8>>) -> Result<()> {
        check_sizes(self.last.as_ref().map(Image::size), frame.size(), keep)?;
        for image in [&mut self.last, &mut self.before_last].into_iter().flatten() {
            for (y, row) in frame.rows().enumerate() {
                replace_unless(image.row_mut(y), row, gain, keep.map(|k| k.row(y)));
            }
        }
        Ok(())
    }
}
