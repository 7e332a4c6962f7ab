//! What a kind of model is like.

use crate::{LastSteps, Pairs};

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
    /// The unit of u and of what follows from it, if it has one.
    pub unit: Option<&'static str>,
    /// The unit of irradiances, if it has one: that of u, unless what arrives has a unit of its own.
    pub irradiance_unit: Option<&'static str>,
    /// The unit of net fluxes of whole surfaces: watts, in the plane per metre of depth.
    pub flux_unit: &'static str,
    /// Whether the walks of a way back start at the sources. For others a global estimate is the way back: its walks, too, go from what is
    /// left of the source to all receivers.
    pub has_adjoint: bool,
    /// Whether this is the model of the way back of another one.
    pub is_adjoint: bool,
    /// The ends of the only coordinate of a closed curve, of which there are means over [arcs](crate::Region::Arc).
    pub around: Option<[f64; 2]>,
    /// Whether the last step of its walks may lead to the light.
    pub last_steps: LastSteps,
    /// The kinds of pairs that an automatic choice looks at, unless one is given. The first is that of [`Pairs::Default`]. One alone: its
    /// neighbour equation comes from steps, and pairs make no difference.
    pub pairs_to_choose: &'static [Pairs],
    /// The pairs of a global estimate unless they are given.
    pub whole_pairs: Pairs,
}

impl About {
    /// Properties of a kind of which nothing else is known: functions are constant on cells, and what a model may have it has not.
    ///
    /// ```
    /// use fredholm_model::About;
    ///
    /// let mine = About { most_degree: 2, ..About::of_kind("mine") };
    /// assert!(mine.unit.is_none() && !mine.has_adjoint);
    /// ```
    #[must_use]
    pub const fn of_kind(kind: &'static str) -> Self {
        Self {
            kind,
            dimension: None,
            most_degree: 0,
            less_memory: ": use fewer cells",
            takes_any_cells: false,
            counts_evaluations: false,
            takes_resolvent: false,
            whole: WholeValues::None,
            most_lift: 0,
            has_sequences: false,
            unit: None,
            irradiance_unit: None,
            flux_unit: "W/m",
            has_adjoint: false,
            is_adjoint: false,
            around: None,
            last_steps: LastSteps::Never,
            pairs_to_choose: &[Pairs::Default, Pairs::Pointwise],
            whole_pairs: Pairs::Default,
        }
    }
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
