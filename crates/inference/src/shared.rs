//! Layers that the networks of a thread share.

use crate::Result;
use std::cell::Cell;
use std::thread::LocalKey;

/// All layers of a network that do not depend on a template, and the maps that they overwrite. They are constants and scratch: what
/// a network answers does not depend on who had them before.
pub trait Layers: Sized + 'static {
    /// Where a thread keeps them.
    const SLOT: &'static LocalKey<Slot<Self>>;

    /// With the weights that are built in.
    fn new() -> Result<Self>;
}

/// The layers of a thread, while none of its networks holds an image.
pub struct Slot<L>(Cell<Option<Box<L>>>);

impl<L> Slot<L> {
    /// A place without layers.
    pub const fn empty() -> Self {
        Self(Cell::new(None))
    }
}

/// A network's access to the layers of its thread. It has them from the first row of an image until that has been looked at.
#[derive(Debug, Clone)]
pub struct Shared<L>(Option<Box<L>>);

impl<L: Layers> Shared<L> {
    /// Makes the layers of this thread if it has none.
    pub fn new() -> Result<Self> {
        let layers = of_thread()?;
        L::SLOT.with(|slot| slot.0.set(Some(layers)));
        Ok(Self(None))
    }

    /// The layers, which nobody else has until [`release`](Self::release).
    pub fn hold(&mut self) -> &mut L {
        self.0.get_or_insert_with(|| match of_thread() {
            Ok(layers) => layers,
            Err(_) => unreachable!("`new` has read the same weights"),
        })
    }

    /// The next on this thread may have the layers.
    pub fn release(&mut self) {
        if let Some(layers) = self.0.take() {
            L::SLOT.with(|slot| slot.0.set(Some(layers)));
        }
    }

    /// Uses the layers without writing an image: one that is held stays.
    pub fn with<R>(&mut self, use_of: impl FnOnce(&mut L) -> R) -> R {
        let holds_an_image = self.0.is_some();
        let result = use_of(self.hold());
        if !holds_an_image {
            self.release();
        }
        result
    }
}

/// The layers of this thread, or new ones.
fn of_thread<L: Layers>() -> Result<Box<L>> {
    match L::SLOT.with(|slot| slot.0.take()) {
        Some(layers) => Ok(layers),
        None => L::new().map(Box::new),
    }
}
