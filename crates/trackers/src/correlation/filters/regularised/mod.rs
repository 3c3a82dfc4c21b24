//! Background-aware, spatially regularised correlation filters: `bacf` and `strcf`, and the filter inside `pursuit`.
//!
//! A filter f of D channels minimises (galoogahi2017, eq. 2; li2018, eq. 4)
//!
//! ```text
//! ½ ‖Σ_d x_d ⋆ f_d − y‖²  +  ½ Σ_d ‖w · f_d‖²  +  μ/2 Σ_d ‖f_d − f_d,last‖²
//! ```
//!
//! where ⋆ is correlation over the whole window, y the label, and w is infinite outside the target: the filter has the
//! target's size, but every shift of it over the window, background included, is a training sample. It is split by f = g,
//! with f free in the frequency domain and g confined in space, and solved by a few alternating directions; every bin of f
//! is one rank-one system, solved by the Sherman–Morrison formula.

mod filter;
#[cfg(test)]
pub(super) mod reference;
mod solve;

pub use filter::RegularisedFilter;
