//! Channel features of patches.
