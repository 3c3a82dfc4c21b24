//! Histograms of oriented gradients.
