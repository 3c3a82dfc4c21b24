//! The filters of the papers this project implements, one folder for each, named by the paper's key. They are also at the
//! crate's root under the same names.

pub mod gao2007;
pub mod qu2010;
pub mod zhai2024;
pub mod zhu2014;
