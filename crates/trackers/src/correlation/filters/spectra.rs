use pursuit_vision::fourier::{Complex32, RealFft2};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Spectra of one or several planes, one after the other; saved as pairs of real and imaginary part.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Spectra(pub Vec<Complex32>);

/// Mean over the whole spectrum of what is given for the bins of the half that is kept.
pub fn mean_power(fft: &RealFft2, power: &[f32]) -> f32 {
    let column = |(u, bins): (usize, &[f32])| fft.multiplicity(u) as f32 * bins.iter().sum::<f32>();
    power.chunks_exact(fft.size().height).enumerate().map(column).sum::<f32>() / fft.size().area() as f32
}

impl Serialize for Spectra {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.0.iter().map(|c| (c.re, c.im)))
    }
}

impl<'de> Deserialize<'de> for Spectra {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let pairs = Vec::<(f32, f32)>::deserialize(deserializer)?;
        Ok(Self(pairs.into_iter().map(|(re, im)| Complex32::new(re, im)).collect()))
    }
}
