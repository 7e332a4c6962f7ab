//! What the statistics of walks say besides u.

use fredholm_core::Estimate;

/// The results of a room other than u: irradiances and net fluxes.
#[derive(Clone, Debug, Default)]
pub struct Derived {
    /// Irradiance and net flux of each goal; empty for others than rooms.
    pub heat: Vec<Heat>,
    /// The net flux out of every part, if there are temperatures.
    pub fluxes: Vec<Flux>,
}

/// The net flux out of a part.
#[derive(Clone, Debug)]
pub struct Flux {
    /// The part's name.
    pub name: String,
    /// The number of walks.
    pub walks: u64,
    /// The net flux in the [flux unit](crate::About::flux_unit); `None` where its material changes.
    pub net_flux: Option<Estimate>,
    /// Whether that is given, so that it takes no walks.
    pub is_given: bool,
}

/// Irradiance and net flux of a goal.
#[derive(Clone, Copy, Debug, Default)]
pub struct Heat {
    /// The irradiance H.
    pub irradiance: Option<Estimate>,
    /// The net flux out of the wall in W/m², of a surface in the mean.
    pub net_flux: Option<Estimate>,
    /// Whether the net flux is given.
    pub is_flux_given: bool,
    /// The temperature in kelvin of a wall from which the net flux is given; of several points that of the mean of T⁴.
    pub temperature: Option<Estimate>,
    /// By how much more than u the σT⁴ of that temperature grows with the net flux: 1/ε − 1, if ε is known.
    pub hidden_by_flux: Option<f64>,
    /// The mean radiant temperature in kelvin, of a point in the air; the plane radiant one of what faces in a direction there.
    pub radiant_temperature: Option<Estimate>,
}
