/// Numbers of 32 bits from a linear congruential generator: cheap, and without a pattern that a mistake could share. The
/// lower bits repeat soon.
#[derive(Debug, Clone)]
pub struct Noise(u32);

impl Noise {
    /// A sequence of its own for each seed.
    pub const fn new(seed: u32) -> Self {
        Self(seed)
    }

    /// The next number.
    pub const fn draw(&mut self) -> u32 {
        self.0 = self.0.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        self.0
    }

    /// Its upper eight bits.
    pub const fn byte(&mut self) -> u8 {
        (self.draw() >> 24) as u8
    }
}

/// Numbers of 64 good bits (SplitMix64, Steele et al. 2014).
#[derive(Debug, Clone)]
pub struct SplitMix(pub u64);

impl SplitMix {
    const STEP: u64 = 0x9E37_79B9_7F4A_7C15;

    /// The generator that has drawn `counter` numbers: random access, for tests that carry no state.
    pub const fn after(counter: u64) -> Self {
        Self(counter.wrapping_mul(Self::STEP))
    }

    /// The next number.
    pub const fn draw(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(Self::STEP);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// The next number, below `bound`.
    pub const fn below(&mut self, bound: usize) -> usize {
        (self.draw() % bound as u64) as usize
    }

    /// The next number in [0, 1).
    pub const fn unit(&mut self) -> f64 {
        (self.draw() >> 11) as f64 / (1_u64 << 53) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn splitmix_gives_the_published_numbers() {
        // Of the reference implementation (Vigna), seed 1234567.
        let mut numbers = SplitMix(1_234_567);
        assert_eq!(numbers.draw(), 6_457_827_717_110_365_317);
        assert_eq!(numbers.draw(), 3_203_168_211_198_807_973);
        let mut later = SplitMix::after(1);
        let mut first = SplitMix(0);
        first.draw();
        assert_eq!(later.draw(), first.draw());
        assert!((0.0..1.0).contains(&later.unit()) && later.below(3) < 3);
    }
}
