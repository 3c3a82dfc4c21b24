//! The Python module `pursuit._native`: calls of the facade, on numpy arrays. What users import is `pursuit`, whose Python
//! part lies beside this crate.

mod associate;
mod batch;
mod clip;
mod detect;
mod errors;
mod estimate;
mod estimation;
mod evaluate;
mod foreign;
mod iterated;
mod many;
mod measure;
mod networks;
mod pixels;
mod registry;
mod saved;
mod strip;
mod tracker;
mod values;

use pyo3::prelude::*;

#[pymodule]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("COCO", pursuit::inference::detection::COCO)?;
    errors::add(module)?;
    module.add_class::<estimate::Estimate>()?;
    module.add_class::<tracker::Tracker>()?;
    module.add_class::<many::MultiTracker>()?;
    module.add_class::<associate::Associator>()?;
    module.add_class::<associate::Tracks>()?;
    module.add_class::<detect::Detector>()?;
    module.add_class::<clip::Clip>()?;
    registry::add(module)?;
    evaluate::add(module)?;
    measure::add(module)?;
    batch::add(module)?;
    estimation::add(module)
}
