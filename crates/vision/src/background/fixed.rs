use super::difference::{Channels, check, check_sizes, mark_changed, replace_unless};
use super::{BackgroundModel, Learning};
use crate::Result;
use pursuit_imaging::{Image, ImageView};

/// Difference to a background that never changes (qu2010's background frame difference): foreground is what differs by
/// more than a threshold in some channel.
///
/// Learns its first frame, whatever the rate and protection, unless a background was given; after that nothing, whatever
/// the rate.
#[derive(Debug, Clone)]
pub struct FixedBackground<P> {
    threshold: u8,
    background: Option<Image<P>>,
}

impl<P: Channels> FixedBackground<P> {
    /// Takes the first frame for the background; `threshold` in codes.
    pub const fn from_first_frame(threshold: u8) -> Self {
        Self { threshold, background: None }
    }

    /// A model with a known background; `threshold` in codes.
    pub const fn new(background: Image<P>, threshold: u8) -> Self {
        Self { threshold, background: Some(background) }
    }
}

impl<P: Channels> BackgroundModel<P> for FixedBackground<P> {
    fn apply(&mut self, frame: ImageView<'_, P>, learning: &Learning<'_>, mask: &mut Image<u8>) -> Result<()> {
        check(self.background.as_ref().map(Image::size), frame.size(), learning)?;
        mask.resize_for_overwrite(frame.size(), 0)?;
        let background = self.background.get_or_insert_with(|| frame.to_image());
        for (y, row) in frame.rows().enumerate() {
            mark_changed(row, background.row(y), self.threshold, mask.row_mut(y));
        }
        Ok(())
    }

    fn background(&self, out: &mut Image<P>) -> Result<bool> {
        copy(self.background.as_ref(), out)
    }

    fn sample(&self, x: usize, y: usize) -> Option<P> {
        sample(self.background.as_ref(), x, y)
    }

    fn relearn(&mut self, frame: ImageView<'_, P>, gain: f64, keep: Option<ImageView<'_, u8>>) -> Result<()> {
        check_sizes(self.background.as_ref().map(Image::size), frame.size(), keep)?;
        let background = self.background.get_or_insert_with(|| frame.to_image());
        for (y, row) in frame.rows().enumerate() {
            replace_unless(background.row_mut(y), row, gain, keep.map(|k| k.row(y)));
        }
        Ok(())
    }
}

/// A pixel of `image`, if there is one.
pub(super) fn sample<P: Channels>(image: Option<&Image<P>>, x: usize, y: usize) -> Option<P> {
    image.filter(|i| y < i.height()).and_then(|i| i.row(y).get(x)).copied()
}

/// Copies `image`, if there is one, to `out`.
pub(super) fn copy<P: Channels>(image: Option<&Image<P>>, out: &mut Image<P>) -> Result<bool> {
    let Some(image) = image else { return Ok(false) };
    out.resize_for_overwrite(image.size(), P::default())?;
    out.as_mut_slice().copy_from_slice(image.as_slice());
    Ok(true)
}
