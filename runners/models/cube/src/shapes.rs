//! From dimensions and degrees at run time to constants.

/// An expression in which the dimension is a constant of this name.
macro_rules! in_dimension {
    ($d:expr, $name:ident => $then:expr) => {
        match $d {
            1 => in_dimension!(1 as $name => $then),
            2 => in_dimension!(2 as $name => $then),
            3 => in_dimension!(3 as $name => $then),
            4 => in_dimension!(4 as $name => $then),
            5 => in_dimension!(5 as $name => $then),
            // The model lets nothing above 6 pass.
            _ => in_dimension!(6 as $name => $then),
        }
    };
    ($value:literal as $name:ident => $then:expr) => {{
        const $name: usize = $value;
        $then
    }};
}
pub(super) use in_dimension;

/// An expression in which the number of functions on a cell of a dimension, which is a literal, is a constant of this
/// name. The model lets no other degrees pass.
macro_rules! of_functions {
    (1, $degree:expr, $functions:ident => $then:expr) => { of_functions!(1, $degree, [1 2 3 4], $functions => $then) };
    (2, $degree:expr, $functions:ident => $then:expr) => { of_functions!(2, $degree, [1 2 3 4], $functions => $then) };
    (3, $degree:expr, $functions:ident => $then:expr) => { of_functions!(3, $degree, [1 2 3 4], $functions => $then) };
    ($d:literal, $degree:expr, $functions:ident => $then:expr) => { of_functions!($d, $degree, [1 2], $functions => $then) };
    ($d:literal, $degree:expr, [$($p:literal)*], $functions:ident => $then:expr) => {
        match $degree {
            $($p => {
                const $functions: usize = fredholm_core::galerkin::functions($d, $p);
                $then
            })*
            _ => {
                const $functions: usize = 1;
                $then
            }
        }
    };
}
pub(super) use of_functions;

/// An expression in which dimension and number of functions on a cell are constants of these names.
macro_rules! in_shape {
    ($d:expr, $degree:expr, $dimension:ident, $functions:ident => $then:expr) => {
        match $d {
            1 => in_shape!(1 as $dimension, $degree, $functions => $then),
            2 => in_shape!(2 as $dimension, $degree, $functions => $then),
            3 => in_shape!(3 as $dimension, $degree, $functions => $then),
            4 => in_shape!(4 as $dimension, $degree, $functions => $then),
            5 => in_shape!(5 as $dimension, $degree, $functions => $then),
            _ => in_shape!(6 as $dimension, $degree, $functions => $then),
        }
    };
    ($d:tt as $dimension:ident, $degree:expr, $functions:ident => $then:expr) => {{
        const $dimension: usize = $d;
        of_functions!($d, $degree, $functions => $then)
    }};
}
pub(super) use in_shape;
