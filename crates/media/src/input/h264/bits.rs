/// Reads bits from the front of a slice; `None` when it ends.
#[derive(Debug, Clone)]
pub(super) struct Bits<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Bits<'a> {
    pub const fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0 }
    }

    pub fn flag(&mut self) -> Option<bool> {
        let bit = self.bytes.get(self.at / 8)? >> (7 - self.at % 8) & 1;
        self.at += 1;
        Some(bit == 1)
    }

    /// An unsigned number of up to 32 bits.
    pub fn unsigned(&mut self, bits: u32) -> Option<u32> {
        (0..bits).try_fold(0u32, |value, _| Some(value << 1 | u32::from(self.flag()?)))
    }

    /// An unsigned Exp-Golomb number below 2³² − 1 (ITU-T H.264 §9.1).
    pub fn exp_golomb(&mut self) -> Option<u32> {
        let mut zeros = 0;
        while !self.flag()? {
            zeros += 1;
            if zeros > 31 {
                return None;
            }
        }
        Some((1u32 << zeros) - 1 + self.unsigned(zeros)?)
    }

    /// A signed Exp-Golomb number (ITU-T H.264 §9.1.1).
    pub fn signed_exp_golomb(&mut self) -> Option<i64> {
        let code = i64::from(self.exp_golomb()?);
        Some(if code % 2 == 1 { (code + 1) / 2 } else { -code / 2 })
    }
}

/// Writes bits to the end of a unit.
#[derive(Debug, Default)]
pub(super) struct BitWriter {
    bytes: Vec<u8>,
    /// Bits of the last byte that are taken.
    taken: u32,
}

impl BitWriter {
    /// The low `bits` of a number.
    pub fn unsigned(&mut self, value: u32, bits: u32) {
        for bit in (0..bits).rev() {
            if self.taken.is_multiple_of(8) {
                self.bytes.push(0);
                self.taken = 0;
            }
            if let Some(last) = self.bytes.last_mut() {
                *last |= ((value >> bit & 1) as u8) << (7 - self.taken);
            }
            self.taken += 1;
        }
    }

    /// An unsigned Exp-Golomb number below 2³¹ (ITU-T H.264 §9.1).
    pub fn exp_golomb(&mut self, value: u32) {
        let bits = (value + 1).ilog2();
        self.unsigned(0, bits);
        self.unsigned(value + 1, bits + 1);
    }

    /// The unit under its first byte: ended by a one and zeros, with what would look like a start code broken up (§7.4.1).
    pub fn unit(mut self, head: u8) -> Vec<u8> {
        self.unsigned(1, 1);
        let (mut out, mut zeros) = (vec![head], 0);
        for byte in self.bytes {
            if zeros == 2 && byte <= 3 {
                out.push(3);
                zeros = 0;
            }
            zeros = if byte == 0 { zeros + 1 } else { 0 };
            out.push(byte);
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read() {
        let mut writer = BitWriter::default();
        let numbers = [0, 1, 2, 254, 255, 65_535, 139_264];
        numbers.iter().for_each(|n| writer.exp_golomb(*n));
        writer.unsigned(0b1011, 5);
        let unit = writer.unit(0x41);
        let content = super::super::units::content(&unit, 99);
        let mut bits = Bits::new(&content);
        assert!(numbers.iter().all(|n| bits.exp_golomb() == Some(*n)));
        assert_eq!((bits.unsigned(5), bits.flag()), (Some(0b1011), Some(true)));
        let mut zeros = BitWriter::default();
        zeros.unsigned(0, 32);
        assert_eq!(zeros.unit(0x68), [0x68, 0, 0, 3, 0, 0, 0x80]);
    }

    #[test]
    fn codes_of_table_9_2() {
        // 1 | 010 | 011 | 00100 | 00101, padded.
        let bytes = [0b1010_0110, 0b0100_0010, 0b1000_0000];
        let mut bits = Bits::new(&bytes);
        let codes: Vec<_> = (0..5).map(|_| bits.exp_golomb().unwrap()).collect();
        assert_eq!(codes, [0, 1, 2, 3, 4]);
        let mut bits = Bits::new(&bytes);
        let codes: Vec<_> = (0..5).map(|_| bits.signed_exp_golomb().unwrap()).collect();
        assert_eq!(codes, [0, 1, -1, 2, -2]);
        assert_eq!(Bits::new(&[0; 16]).exp_golomb(), None);
        assert_eq!(Bits::new(&[]).flag(), None);
    }
}
