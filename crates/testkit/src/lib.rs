//! What the tests of several crates share: numbers without a pattern, textures, checksums. A development dependency only:
//! nothing that is installed contains it.

mod numbers;
mod onnx;
mod siamese;
mod texture;

pub use numbers::{Noise, SplitMix};
pub use onnx::{NetworkFile, network_that_answers};
pub use siamese::SiameseFile;
pub use texture::{PixelTable, lattice, value_noise};

/// CRC-32 as in PNG and zip, bit by bit.
pub fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0, |c, &b| {
        (0..8).fold(c ^ u32::from(b), |c, _| if c & 1 == 1 { 0xEDB8_8320 ^ (c >> 1) } else { c >> 1 })
    })
}

#[cfg(test)]
mod tests {
    #[test]
    fn crc32_is_the_published_check_value() {
        assert_eq!(super::crc32(b"123456789"), 0xCBF4_3926);
    }
}
