//! `pursuit.estimation`: filters on arrays of N tracks x T steps, one call for all.
//!
//! The Python side brings every array to its full shape; here shapes are checked, sizes become types, and tracks are shared
//! among the processors with the interpreter released.

mod arrays;
mod association;
mod imm;
mod kalman;
mod models;
mod particles;
mod sizes;

use pyo3::prelude::*;

pub fn add(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(kalman::kalman_filter, module)?)?;
    module.add_function(wrap_pyfunction!(kalman::smooth, module)?)?;
    module.add_function(wrap_pyfunction!(imm::imm_filter, module)?)?;
    module.add_function(wrap_pyfunction!(particles::particle_filter, module)?)?;
    module.add_function(wrap_pyfunction!(association::assign, module)?)?;
    module.add_function(wrap_pyfunction!(association::associate, module)?)?;
    module.add_function(wrap_pyfunction!(association::joint_probabilities, module)?)?;
    module.add_function(wrap_pyfunction!(models::constant, module)?)?;
    module.add_function(wrap_pyfunction!(models::singer, module)?)
}
