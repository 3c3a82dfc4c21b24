//! Where something is: a file name, or a network address with its scheme, login, host, port and path. A [`Locator`] keeps
//! what the user wrote and shows its secrets to nobody; its [`Server`] is the part that a connection needs.
//!
//! Strict parsers of addresses (RFC 3986) refuse passwords that are written as they are, with `/`, `?` or `@` in them, and
//! file names that look like addresses; a camera's address is often such a one.

mod locator;
mod server;

pub use locator::Locator;
pub use server::{AddressError, Server};
