//! Inputs that something else has read from where they are, such as an object store.

use pursuit_address::Locator;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Where on this machine the files lie that a configuration names by an address elsewhere. Results name the address alone, so
/// that they are the same wherever the copy lay.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Fetched(BTreeMap<String, PathBuf>);

impl Fetched {
    /// By the address, as the configuration has it: the copy.
    pub fn new(copies: BTreeMap<String, PathBuf>) -> Self {
        Self(copies)
    }

    /// Where to read what this address names.
    pub(crate) fn place(&self, address: &Locator) -> Locator {
        self.0.get(address.reveal()).map_or_else(|| address.clone(), |path| path.clone().into_os_string().into())
    }

    /// A message about a copy as one about the address.
    pub(crate) fn renamed(&self, message: String) -> String {
        self.0.iter().fold(message, |text, (address, path)| match path.to_str() {
            Some(path) => text.replace(path, &Locator::new(address.as_str()).to_string()),
            None => text,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn copies_are_read_and_addresses_are_named_without_their_secrets() {
        let address = "s3://bucket/a.mp4?token=abc";
        let fetched = Fetched::new(BTreeMap::from([(address.to_owned(), "/tmp/x/a.mp4".into())]));
        assert_eq!(fetched.place(&address.into()).reveal(), "/tmp/x/a.mp4");
        assert_eq!(fetched.place(&"b.mp4".into()).reveal(), "b.mp4");
        assert_eq!(fetched.renamed("/tmp/x/a.mp4: no video".to_owned()), "s3://bucket/a.mp4?token=***: no video");
    }
}
