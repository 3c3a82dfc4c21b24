//! Where frames and results go to: encoders and drawing.
