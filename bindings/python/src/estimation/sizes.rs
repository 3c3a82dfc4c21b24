//! From sizes known at run time to sizes that are types.

/// Calls `$function::<N, M>(…)` for a state of `$n` and a measurement of `$m` components, or says which sizes there are.
macro_rules! by_size {
    ($n:expr, $m:expr, $function:ident $arguments:tt) => {
        match $n {
            1 => by_size!(@m 1, $m, $function $arguments),
            2 => by_size!(@m 2, $m, $function $arguments),
            3 => by_size!(@m 3, $m, $function $arguments),
            4 => by_size!(@m 4, $m, $function $arguments),
            5 => by_size!(@m 5, $m, $function $arguments),
            6 => by_size!(@m 6, $m, $function $arguments),
            7 => by_size!(@m 7, $m, $function $arguments),
            8 => by_size!(@m 8, $m, $function $arguments),
            9 => by_size!(@m 9, $m, $function $arguments),
            n => Err($crate::errors::usage(format!("a state of {n} components; there are filters of 1 to 9"))),
        }
    };
    (@m $n:literal, $m:expr, $function:ident $arguments:tt) => {
        match $m {
            1 => $function::<$n, 1> $arguments,
            2 => $function::<$n, 2> $arguments,
            3 => $function::<$n, 3> $arguments,
            4 => $function::<$n, 4> $arguments,
            m => Err($crate::errors::usage(format!("a measurement of {m} components; there are filters of 1 to 4"))),
        }
    };
}

/// As [`by_size`], of the estimators that are large and made for fewer sizes.
macro_rules! by_small_size {
    ($n:expr, $m:expr, $function:ident $arguments:tt) => {
        match $n {
            1 => by_small_size!(@m 1, $m, $function $arguments),
            2 => by_small_size!(@m 2, $m, $function $arguments),
            3 => by_small_size!(@m 3, $m, $function $arguments),
            4 => by_small_size!(@m 4, $m, $function $arguments),
            6 => by_small_size!(@m 6, $m, $function $arguments),
            n => Err($crate::errors::usage(format!("a state of {n} components; of this estimator there are 1 to 4 and 6"))),
        }
    };
    (@m $n:literal, $m:expr, $function:ident $arguments:tt) => {
        match $m {
            1 => $function::<$n, 1> $arguments,
            2 => $function::<$n, 2> $arguments,
            3 => $function::<$n, 3> $arguments,
            m => Err($crate::errors::usage(format!("a measurement of {m} components; of this estimator there are 1 to 3"))),
        }
    };
}

/// Calls `$function::<N>(…)` for a state of `$n` components.
macro_rules! by_state {
    ($n:expr, $function:ident $arguments:tt) => {
        match $n {
            1 => $function::<1> $arguments,
            2 => $function::<2> $arguments,
            3 => $function::<3> $arguments,
            4 => $function::<4> $arguments,
            5 => $function::<5> $arguments,
            6 => $function::<6> $arguments,
            7 => $function::<7> $arguments,
            8 => $function::<8> $arguments,
            9 => $function::<9> $arguments,
            n => Err($crate::errors::usage(format!("vectors of {n} components; there are functions for 1 to 9"))),
        }
    };
}

pub(crate) use {by_size, by_small_size, by_state};
