//! All tests of the studio, in one program: it is linked once.

mod backward;
mod calls;
mod common;
mod detector;
mod flood;
mod live;
mod looks;
mod measuring;
mod runs;
mod safety;
mod trajectory;
