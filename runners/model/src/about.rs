//! What a kind of model is like.

/// The properties of a kind of model.
#[derive(Clone, Copy, Debug)]
pub struct About {
    /// The word of files and results.
    pub kind: &'static str,
    /// d, of cubes.
    pub dimension: Option<usize>,
    /// The largest degree of polynomials on a cell.
    pub most_degree: usize,
    /// Advice on what needs less memory than this, other than fewer cells.
    pub less_memory: &'static str,
    /// Whether any number of cells will do.
    pub takes_any_cells: bool,
    /// Whether kernel evaluations tell the work; otherwise the clock does.
    pub counts_evaluations: bool,
    /// Whether an open method means resolvent walks: its kernel is a function on pairs of points, of few dimensions.
    pub takes_resolvent: bool,
    /// What the [global estimate](crate::System::whole) of a solved system tells.
    pub whole: WholeValues,
    /// The largest degree of a [lift](crate::System::lift); 0: it has none.
    pub most_lift: usize,
    /// Whether its walks may draw from a [sequence](fredholm_core::Sequence).
    pub has_sequences: bool,
}

/// What a global estimate tells of a function.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
pub enum WholeValues {
    /// There is no global estimate.
    None,
    /// Means over the cells and over what consists of them; it is used only if it is asked for.
    Means,
    /// Values at all points.
    Points,
}
