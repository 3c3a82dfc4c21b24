use crate::Result;
use crate::error::require;
use pursuit_imaging::ImageView;
use pursuit_vision::fourier::{
    Complex32, FftScratch, HannEnds, RealFft2, hann_plane, highest, parabola_peak, signed_shift,
};

/// Measures by how much the picture shifted from frame to frame, by phase correlation (Kuglin and Hines 1975) of its middle.
///
/// Nothing is allocated per frame.
pub struct ShiftMeter {
    plan: RealFft2,
    window: Vec<f32>,
    plane: Vec<f32>,
    spectrum: Vec<Complex32>,
    before: Vec<Complex32>,
    scratch: FftScratch,
    primed: bool,
}

impl ShiftMeter {
    /// How clearly the peak must stand out from the mean of the plane for a shift to be believed, in standard deviations.
    const CLEAR: f64 = 6.0;

    /// A meter that looks at `width` by `height` pixels in the middle of each picture; shifts up to a third of that are
    /// measured well.
    ///
    /// # Errors
    /// Unless both are in [16, 2048].
    pub fn new(width: usize, height: usize) -> Result<Self> {
        require("width", width as f64, (16..=2048).contains(&width), "between 16 and 2048 px")?;
        require("height", height as f64, (16..=2048).contains(&height), "between 16 and 2048 px")?;
        let plan = RealFft2::new(width, height);
        let spectrum = vec![Complex32::default(); plan.spectrum_len()];
        Ok(Self {
            plan,
            window: hann_plane(width, height, HannEnds::Zero),
            plane: vec![0.0; width * height],
            before: spectrum.clone(),
            spectrum,
            scratch: FftScratch::default(),
            primed: false,
        })
    }

    /// By how many pixels what is seen went to the right and down since the last picture; `None` for the first picture,
    /// one that is too small, and where no shift can be told.
    pub fn measure(&mut self, picture: &ImageView<'_, u8>) -> Option<(f64, f64)> {
        let (width, height) = (self.plan.size().width, self.plan.size().height);
        let (left, top) = (picture.width().checked_sub(width)? / 2, picture.height().checked_sub(height)? / 2);
        let middle = picture.crop(left, top, width, height)?;
        let sum: u64 = middle.rows().flatten().map(|&v| u64::from(v)).sum();
        let mean = sum as f32 / (width * height) as f32;
        for ((out, &pixel), &weight) in self.plane.iter_mut().zip(middle.rows().flatten()).zip(&self.window) {
            *out = (f32::from(pixel) - mean) * weight;
        }
        std::mem::swap(&mut self.spectrum, &mut self.before);
        self.plan.forward(&self.plane, &mut self.spectrum, &mut self.scratch);
        let primed = std::mem::replace(&mut self.primed, true);
        primed.then(|| self.peak(width, height)).flatten()
    }

    fn peak(&mut self, width: usize, height: usize) -> Option<(f64, f64)> {
        for (old, new) in self.before.iter_mut().zip(&self.spectrum) {
            let cross = old.conj() * new;
            let size = cross.norm();
            *old = if size > 1e-6 { cross / size } else { Complex32::default() };
        }
        self.plan.inverse(&self.before, &mut self.plane, &mut self.scratch);
        let (x, y, value) = highest(&self.plane, width);
        let count = self.plane.len() as f64;
        let mean = self.plane.iter().map(|&v| f64::from(v)).sum::<f64>() / count;
        let variance = self.plane.iter().map(|&v| (f64::from(v) - mean).powi(2)).sum::<f64>() / count;
        let clear = f64::from(value) - mean > Self::CLEAR * variance.sqrt();
        if !clear {
            return None;
        }
        let peak = parabola_peak(&self.plane, width, x, y);
        let part = |index: usize, fine: f64, side: usize| signed_shift(index, side) as f64 + (fine - index as f64);
        Some((part(x, peak.x, width), part(y, peak.y, height)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_imaging::Image;

    /// A picture of blobs, shifted.
    fn picture(right: f64, down: f64) -> Image<u8> {
        Image::from_fn(160, 120, |x, y| {
            let (x, y) = (x as f64 - right, y as f64 - down);
            let blob = |cx: f64, cy: f64, s: f64| (-((x - cx).powi(2) + (y - cy).powi(2)) / (2.0 * s * s)).exp();
            let light = blob(60.0, 50.0, 4.0) + blob(95.0, 70.0, 3.0) - blob(75.0, 65.0, 6.0) + blob(85.0, 40.0, 2.0);
            (120.0 + 60.0 * light).clamp(0.0, 255.0) as u8
        })
        .unwrap()
    }

    #[test]
    fn shifts_are_measured_to_a_fraction_of_a_pixel() {
        for (right, down) in [(0.0, 0.0), (5.0, -3.0), (-11.0, 6.0), (2.5, 0.0), (-0.5, 4.25)] {
            let mut meter = ShiftMeter::new(128, 96).unwrap();
            assert_eq!(meter.measure(&picture(0.0, 0.0).view()), None, "the first");
            let (x, y) = meter.measure(&picture(right, down).view()).unwrap();
            assert!((x - right).abs() < 0.35 && (y - down).abs() < 0.35, "{right} {down}: {x} {y}");
            let (x, y) = meter.measure(&picture(0.0, 0.0).view()).unwrap();
            assert!((x + right).abs() < 0.35 && (y + down).abs() < 0.35, "and back: {x} {y}");
        }
    }

    #[test]
    fn what_shows_no_shift_gives_none() {
        let mut meter = ShiftMeter::new(128, 96).unwrap();
        let flat = Image::filled(160, 120, 77u8).unwrap();
        meter.measure(&flat.view());
        assert_eq!(meter.measure(&flat.view()), None);
        let small = Image::filled(100, 120, 77u8).unwrap();
        assert_eq!(meter.measure(&small.view()), None);
        assert!(ShiftMeter::new(8, 96).is_err() && ShiftMeter::new(128, 4096).is_err());
    }
}
