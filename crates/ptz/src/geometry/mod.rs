//! Between pixels and angles: the lens, the pose of the camera, and how the field of view depends on the zoom.

mod direction;
mod distortion;
mod fields_of_view;
mod lens;
mod pose;
pub mod qu2010;

pub use direction::Direction;
pub use distortion::Distortion;
pub use fields_of_view::{FieldOfView, FieldsOfView};
pub use lens::Lens;
pub use pose::{direction_of, pixel_of};

pursuit_parameters::choices! {
    /// How a pixel becomes an angle.
    pub enum AngleFormula {
        /// The exact angles of a head that pans about the vertical and tilts the camera on top of it.
        PanThenTilt = "pan_then_tilt",
        /// The paper `qu2010`'s formula, its equations (1) to (3): both angles apart, added to those of the head. It is exact
        /// for the pan of a level camera only.
        Qu2010 = "qu2010",
    }
}
