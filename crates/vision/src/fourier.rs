//! Frequency-domain correlation.
