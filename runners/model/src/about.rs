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
}
