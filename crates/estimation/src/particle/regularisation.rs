//! How wide to blur resampled particles so that copies part again (Musso, Oudjane, Le Gland 2001).

/// The optimal bandwidth of a Gaussian kernel for `count` samples of a Gaussian in `dimensions` dimensions, in units of
/// its standard deviation: `(4 / (n + 2))^(1/(n+4)) N^(−1/(n+4))`.
pub(super) fn optimal_bandwidth(count: usize, dimensions: usize) -> f64 {
    let n = dimensions as f64;
    (4.0 / ((n + 2.0) * count as f64)).powf(1.0 / (n + 4.0))
}
