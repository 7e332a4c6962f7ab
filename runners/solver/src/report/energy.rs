//! The report of net fluxes.

use fredholm_core::Estimate;
use fredholm_model::Flux;

use super::{EnergyReport, EstimateReport, SurfaceReport};

impl EnergyReport {
    /// The report of these fluxes, if there are any.
    pub(super) fn new(fluxes: Vec<Flux>, unit: &'static str) -> Option<Self> {
        if fluxes.is_empty() {
            return None;
        }
        // Every surface has walks of its own: errors are independent.
        let known: Option<Vec<Estimate>> = fluxes.iter().map(|flux| flux.net_flux).collect();
        let walked = fluxes.iter().filter(|flux| !flux.is_given);
        let walks = walked.map(|flux| flux.walks).min().unwrap_or(0);
        let square = |x: Option<f64>| x.map(|x| x * x);
        let energy_balance = known.map(|known| {
            let squares: Option<f64> = known.iter().map(|e| square(e.std_error)).sum();
            let sum = Estimate {
                estimate: known.iter().map(|e| e.estimate).sum(),
                std_error: squares.map(f64::sqrt),
                std_dev: None,
            };
            EstimateReport::new(sum, walks, Some(unit))
        });
        let surface = |flux: Flux| SurfaceReport {
            name: flux.name,
            walks: flux.walks,
            net_flux: flux.net_flux.map(|estimate| {
                // A given flux is known without walks.
                let walks = flux.walks.max(u64::from(flux.is_given));
                EstimateReport::new(estimate, walks, Some(unit))
            }),
            is_given: flux.is_given,
        };
        Some(Self {
            surfaces: fluxes.into_iter().map(surface).collect(),
            energy_balance,
            unit,
        })
    }
}
