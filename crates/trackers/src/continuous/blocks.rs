//! How the coefficients of a sample or a filter lie in memory.

use super::coefficients::{count, inner};
use pursuit_vision::fourier::Complex32;

/// Channels of one resolution.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Block {
    /// The number of channels.
    pub channels: usize,
    /// The highest order of their coefficients.
    pub order: usize,
}

impl Block {
    /// Coefficients of a channel.
    pub(super) const fn each(&self) -> usize {
        count(self.order)
    }

    /// Coefficients of all channels.
    pub(super) const fn len(&self) -> usize {
        self.channels * self.each()
    }
}

/// Coefficients of all channels of all blocks, one channel after the other.
pub(super) fn len(blocks: &[Block]) -> usize {
    blocks.iter().map(Block::len).sum()
}

/// The channels of `all`.
pub(super) fn channels<'a>(blocks: &'a [Block], mut all: &'a [Complex32]) -> impl Iterator<Item = &'a [Complex32]> {
    blocks.iter().flat_map(move |block| {
        let (own, rest) = all.split_at(block.len());
        all = rest;
        own.chunks_exact(block.each())
    })
}

/// The channels of `all`, to change.
pub(super) fn channels_mut<'a>(
    blocks: &'a [Block],
    all: &'a mut [Complex32],
) -> impl Iterator<Item = &'a mut [Complex32]> {
    let mut all = Some(all);
    blocks.iter().flat_map(move |block| {
        let (own, rest) = all.take().unwrap_or_default().split_at_mut(block.len());
        all = Some(rest);
        own.chunks_exact_mut(block.each())
    })
}

/// Σ over all channels of ∫ a·b.
pub(super) fn inner_product(blocks: &[Block], a: &[Complex32], b: &[Complex32]) -> f64 {
    channels(blocks, a).zip(channels(blocks, b)).map(|(a, b)| inner(a, b)).sum()
}
