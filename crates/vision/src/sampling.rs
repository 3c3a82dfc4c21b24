//! Subwindow sampling and resizing.
