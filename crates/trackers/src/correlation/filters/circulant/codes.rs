use multiversion::multiversion;
use pursuit_vision::fourier::Complex32;

/// A small square matrix in every bin.
#[derive(Debug, Clone)]
pub(super) struct Bins {
    side: usize,
    bins: usize,
    /// Entry after entry, row by row; all bins of an entry side by side.
    values: Vec<Complex32>,
}

/// The greatest side of a matrix.
const MOST: usize = 4;

impl Bins {
    pub fn new(side: usize, bins: usize) -> Self {
        let side = side.min(MOST);
        Self { side, bins, values: vec![Complex32::default(); side * side * bins] }
    }

    pub fn get(&self, row: usize, column: usize) -> &[Complex32] {
        &self.values[(row * self.side + column) * self.bins..][..self.bins]
    }

    pub fn entry(&mut self, row: usize, column: usize) -> &mut [Complex32] {
        &mut self.values[(row * self.side + column) * self.bins..][..self.bins]
    }

    /// Adds `ridge` to the diagonals and inverts all matrices, which are Hermitian and nowhere negative.
    pub fn invert(&mut self, ridge: f32) {
        for bin in 0..self.bins {
            let mut matrix = [[Complex32::default(); MOST]; MOST];
            for (i, j) in self.places() {
                matrix[i][j] = self.values[(i * self.side + j) * self.bins + bin];
            }
            (0..self.side).for_each(|i| matrix[i][i] += ridge);
            let inverse = inverted(matrix, self.side);
            for (i, j) in self.places() {
                self.values[(i * self.side + j) * self.bins + bin] = inverse[i][j];
            }
        }
    }

    fn places(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        let side = self.side;
        (0..side).flat_map(move |i| (0..side).map(move |j| (i, j)))
    }
}

/// By elimination (Gauss–Jordan): what is positive definite needs no exchange of rows.
fn inverted(matrix: [[Complex32; MOST]; MOST], side: usize) -> [[Complex32; MOST]; MOST] {
    type Row = [(f64, f64); 2 * MOST];
    let mul = |a: (f64, f64), b: (f64, f64)| (a.0 * b.0 - a.1 * b.1, a.0 * b.1 + a.1 * b.0);
    let mut rows = [Row::default(); MOST];
    for (i, row) in rows.iter_mut().enumerate().take(side) {
        for (j, v) in matrix[i].iter().enumerate().take(side) {
            row[j] = (f64::from(v.re), f64::from(v.im));
        }
        row[MOST + i] = (1.0, 0.0);
    }
    for i in 0..side {
        let pivot = rows[i][i];
        let length = (pivot.0 * pivot.0 + pivot.1 * pivot.1).max(f64::MIN_POSITIVE);
        let factor = (pivot.0 / length, -pivot.1 / length);
        rows[i].iter_mut().for_each(|v| *v = mul(*v, factor));
        let own = rows[i];
        for row in rows.iter_mut().take(side).enumerate().filter(|(j, _)| *j != i).map(|(_, row)| row) {
            let by = row[i];
            for (v, o) in row.iter_mut().zip(own) {
                let taken = mul(by, o);
                *v = (v.0 - taken.0, v.1 - taken.1);
            }
        }
    }
    let mut out = [[Complex32::default(); MOST]; MOST];
    for (out, row) in out.iter_mut().zip(&rows).take(side) {
        for (out, v) in out.iter_mut().zip(&row[MOST..]).take(side) {
            *out = Complex32::new(v.0 as f32, v.1 as f32);
        }
    }
    out
}

/// The step of y and of the dual: y = S(z + u), which draws what is added towards nothing by `by`, and u takes in what is left.
#[multiversion(targets("x86_64+avx2+fma", "x86_64+sse4.1", "aarch64+neon"))]
pub(super) fn shrink(z: &[f32], codes: &mut [f32], duals: &mut [f32], by: f32) {
    for ((z, y), u) in z.iter().zip(codes).zip(duals) {
        let v = z + *u;
        *y = v - v.clamp(-by, by);
        *u = v - *y;
    }
}

/// The sum of planes that stand one after the other.
pub(super) fn sum_planes(planes: &[f32], out: &mut [f32]) {
    out.fill(0.0);
    for plane in planes.chunks_exact(out.len()) {
        out.iter_mut().zip(plane).for_each(|(out, v)| *out += v);
    }
}
