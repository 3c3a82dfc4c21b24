//! Raw figures of a method: each is declared once, with its unit and a sentence.

use std::cell::RefCell;
use std::fmt;

/// A figure that a localizer or a detector reports beside what it found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Figure {
    /// Its name in files.
    pub name: &'static str,
    /// Its unit; empty of pure numbers.
    pub unit: &'static str,
    /// What it is.
    pub text: &'static str,
    /// How a judge takes it, of figures that are evidence.
    pub weight: Option<Weight>,
}

/// How a logistic regression takes a figure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weight {
    /// The parameter that holds the weight.
    pub parameter: &'static str,
    /// What is multiplied by the weight.
    pub taken: Taken,
}

/// What of a figure is multiplied by its weight.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Taken {
    /// The figure itself.
    AsIs,
    /// Its natural logarithm; figures below [`Taken::LEAST`] count as that much.
    Ln,
    /// The natural logarithm of 1 and the figure.
    Ln1p,
}

impl Taken {
    /// The least figure of which a logarithm is taken.
    pub const LEAST: f64 = 1e-3;

    /// What is multiplied by the weight.
    pub fn of(self, figure: f64) -> f64 {
        match self {
            Self::AsIs => figure,
            Self::Ln => figure.max(Self::LEAST).ln(),
            Self::Ln1p => figure.ln_1p(),
        }
    }

    /// The word used in files: `as-is`, `ln` or `ln-1p`.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::AsIs => "as-is",
            Self::Ln => "ln",
            Self::Ln1p => "ln-1p",
        }
    }
}

/// Figures that are reported together; made by [`figures!`](crate::figures).
pub trait Figures {
    /// What is reported, in order.
    const ALL: &'static [Figure];

    /// Adds them to what is reported of a frame.
    fn report(&self, into: &mut Diagnostics);
}

/// Declares a struct of figures, all of them `f64`: a sentence, the name, and the unit (`in "px"`) of those that have one. The
/// struct implements [`Figures`](crate::Figures) and becomes [`Diagnostics`](crate::Diagnostics) by `into()`.
///
/// ```
/// pursuit_tracking::figures! {
///     /// What the example says.
///     pub struct ExampleFigures {
///         /// How far its points disagree.
///         error in "px";
///         /// How many points there are.
///         points;
///     }
/// }
/// let said = pursuit_tracking::Diagnostics::from(ExampleFigures { error: 0.5, points: 12.0 });
/// assert_eq!((said.get("error"), said.get("lines")), (Some(0.5), None));
/// ```
#[macro_export]
macro_rules! figures {
    (
        $(#[$attribute:meta])*
        $vis:vis struct $name:ident {
            $($(#[doc = $doc:literal])+ $figure:ident $(in $unit:literal)?;)+
        }
    ) => {
        $(#[$attribute])*
        #[derive(Debug, Clone, Copy, PartialEq)]
        $vis struct $name {
            $($(#[doc = $doc])+ pub $figure: f64,)+
        }

        impl $crate::Figures for $name {
            const ALL: &'static [$crate::Figure] = &[$($crate::Figure {
                name: stringify!($figure),
                unit: concat!($($unit)?),
                text: concat!($($doc),+).trim_ascii(),
                weight: None,
            }),+];

            fn report(&self, into: &mut $crate::Diagnostics) {
                into.extend(<Self as $crate::Figures>::ALL.iter().zip([$(self.$figure),+]));
            }
        }

        impl From<$name> for $crate::Diagnostics {
            fn from(figures: $name) -> Self {
                let mut said = Self::default();
                $crate::Figures::report(&figures, &mut said);
                said
            }
        }
    };
}

/// Figures that a list has room for from the start: the most that a tracker here has, with those of a detector.
const ROOM: usize = 56;
/// Lists that a thread keeps at most.
const SPARE: usize = 64;

type Reported = (&'static Figure, f64);

thread_local! {
    /// Lists that are done with: a frame's figures are written into those of a frame before.
    static DONE: RefCell<Vec<Vec<Reported>>> = const { RefCell::new(Vec::new()) };
}

/// The raw figures of a frame, each with its declaration. None is ever dropped. Small as long as there are none, and without an
/// allocation where a thread drops as many as it makes.
#[derive(PartialEq, Default)]
pub struct Diagnostics {
    figures: Vec<Reported>,
}

impl Diagnostics {
    /// A list for a frame's first figure.
    fn begin(&mut self) {
        if self.figures.capacity() == 0 {
            let done = DONE.try_with(|lists| lists.borrow_mut().pop()).ok().flatten();
            self.figures = done.unwrap_or_else(|| Vec::with_capacity(ROOM));
        }
    }
}

impl Drop for Diagnostics {
    fn drop(&mut self) {
        if self.figures.capacity() == 0 {
            return;
        }
        let mut figures = std::mem::take(&mut self.figures);
        figures.clear();
        // A thread that ends keeps nothing.
        let _ = DONE.try_with(|lists| {
            let mut lists = lists.borrow_mut();
            if lists.len() < SPARE && figures.capacity() <= 2 * ROOM {
                lists.push(figures);
            }
        });
    }
}

impl Clone for Diagnostics {
    fn clone(&self) -> Self {
        let mut clone = Self::default();
        clone.extend(self.figures());
        clone
    }
}

impl fmt::Debug for Diagnostics {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_map().entries(self.iter()).finish()
    }
}

impl Extend<(&'static Figure, f64)> for Diagnostics {
    fn extend<T: IntoIterator<Item = (&'static Figure, f64)>>(&mut self, figures: T) {
        for figure in figures {
            self.begin();
            self.figures.push(figure);
        }
    }
}

impl Diagnostics {
    /// All figures with their declarations, in the order they were added.
    pub fn figures(&self) -> impl Iterator<Item = (&'static Figure, f64)> + '_ {
        self.figures.iter().copied()
    }

    /// All figures by name, in the order they were added.
    pub fn iter(&self) -> impl Iterator<Item = (&'static str, f64)> + '_ {
        self.figures().map(|(figure, value)| (figure.name, value))
    }

    /// The figure of that name.
    pub fn get(&self, name: &str) -> Option<f64> {
        self.iter().find(|(n, _)| *n == name).map(|(_, v)| v)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    crate::figures! {
        /// Two figures.
        struct Two {
            /// One, of a sentence
            /// in two lines.
            one in "px";
            /// Another.
            other;
        }
    }

    #[test]
    fn no_figure_is_ever_dropped() {
        let mut said = Diagnostics::default();
        for k in 0..2 * ROOM {
            Two { one: k as f64, other: -1.0 }.report(&mut said);
        }
        let values: Vec<f64> = said.iter().filter(|(name, _)| *name == "one").map(|(_, v)| v).collect();
        assert_eq!(values, (0..2 * ROOM).map(|k| k as f64).collect::<Vec<_>>());
        assert_eq!((said.iter().count(), said.get("other"), said.get("third")), (4 * ROOM, Some(-1.0), None));
    }

    #[test]
    fn a_list_is_written_into_again() {
        let two = |n: usize| {
            let mut said = Diagnostics::default();
            (0..n).for_each(|_| Two { one: 1.0, other: 2.0 }.report(&mut said));
            said
        };
        let before = two(3);
        let at = before.figures.as_ptr();
        let copy = before.clone();
        assert!(copy == before && copy.figures.as_ptr() != at);
        drop(before);
        let after = two(1);
        assert_eq!((after.figures.as_ptr(), after.iter().count()), (at, 2), "what was in it is gone");
        assert_eq!(Diagnostics::default().figures.capacity(), 0);
        // Any number may be dropped; few are kept.
        drop((0..3 * SPARE).map(|_| two(1)).collect::<Vec<_>>());
        assert_eq!(DONE.with(|lists| lists.borrow().len()), SPARE);
    }

    #[test]
    fn a_declaration_says_name_unit_and_sentence() {
        let [one, other] = Two::ALL else { unreachable!() };
        assert_eq!((one.name, one.unit, one.text), ("one", "px", "One, of a sentence in two lines."));
        assert_eq!((other.name, other.unit, other.text), ("other", "", "Another."));
        let said = Diagnostics::from(Two { one: 1.0, other: 2.0 });
        assert_eq!(said.figures().map(|(f, _)| f).collect::<Vec<_>>(), [one, other]);
    }

    #[test]
    fn logarithms_are_of_positive_numbers() {
        assert_eq!((Taken::AsIs.of(-2.0), Taken::Ln1p.of(0.0)), (-2.0, 0.0));
        assert_eq!(Taken::Ln.of(-2.0), Taken::LEAST.ln());
        assert!((Taken::Ln.of(2.0) - 2.0_f64.ln()).abs() < 1e-15);
    }
}
