//! Colour spaces and colour ranges.
