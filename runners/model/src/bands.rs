//! Bands of wavelengths.

use fredholm_room::Material;

use crate::heat::{part_below, slope_below};

/// Bands of wavelengths, between which surfaces with temperatures send out different parts of their heat.
///
/// ```
/// use fredholm_model::channels::Bands;
///
/// let bands = Bands::new(vec![3.0, 8.0]).unwrap();
/// assert_eq!(bands.names(), ["below 3 um", "3 to 8 um", "above 8 um"]);
/// assert!((bands.parts(300.0).iter().sum::<f64>() - 1.0).abs() < 1e-15);
/// assert_eq!(Bands::new(vec![8.0, 3.0]), None);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Bands {
    edges: Vec<f64>,
}

impl Bands {
    /// The bands that begin and end at these wavelengths in micrometres. `None`: they are not more than 0 and in ascending order.
    #[must_use]
    pub fn new(edges: Vec<f64>) -> Option<Self> {
        let ascend = edges.is_sorted_by(|a, b| a < b);
        let positive = edges.iter().all(|edge| *edge > 0.0 && edge.is_finite());
        (ascend && positive).then_some(Self { edges })
    }

    /// The names of the bands.
    #[must_use]
    pub fn names(&self) -> Vec<String> {
        let (first, last) = (self.edges.first(), self.edges.last());
        let below = first.map(|edge| format!("below {edge} um"));
        let between = self.edges.windows(2);
        let between = between.map(|pair| match pair {
            [from, to] => format!("{from} to {to} um"),
            _ => String::new(),
        });
        let above = last.map(|edge| format!("above {edge} um"));
        below.into_iter().chain(between).chain(above).collect()
    }

    /// The parts of the heat of a black body of this temperature in kelvin that are in each band.
    #[must_use]
    pub fn parts(&self, temperature: f64) -> Vec<f64> {
        self.differences(&|edge| part_below(edge, temperature), 1.0)
    }

    /// The derivatives of these [parts](Self::parts) by the temperature, per kelvin.
    #[must_use]
    pub fn slopes(&self, temperature: f64) -> Vec<f64> {
        self.differences(&|edge| slope_below(edge, temperature), 0.0)
    }

    /// What a function of wavelengths, which is 0 at 0 and has this limit, gains over each band.
    fn differences(&self, of: &dyn Fn(f64) -> f64, limit: f64) -> Vec<f64> {
        let ends: Vec<f64> = self
            .edges
            .iter()
            .map(|edge| of(*edge))
            .chain([limit])
            .collect();
        let starts = [0.0].iter().chain(&ends);
        ends.iter()
            .zip(starts)
            .map(|(end, start)| end - start)
            .collect()
    }

    /// The material of a surface in every band, from its emissivity there and its temperature in kelvin: ε times the part of its heat in the band.
    #[must_use]
    pub fn materials(&self, emissivity: &dyn Fn(usize) -> f64, kelvin: f64) -> Vec<Material> {
        let parts = self.parts(kelvin).into_iter().enumerate();
        let of = |(band, part)| {
            let grey = Material::grey(emissivity(band), kelvin);
            Material {
                emission: part * grey.emission,
                ..grey
            }
        };
        parts.map(of).collect()
    }

    /// The temperature in kelvin of a surface of these [materials](Self::materials): from the band in which it would emit most if it were black.
    /// `None`: it emits nothing.
    #[must_use]
    pub fn temperature(&self, materials: &[Material]) -> Option<f64> {
        let black = materials
            .iter()
            .map(|own| own.emission / (1.0 - own.reflectance));
        let black = black.map(|own| if own.is_finite() { own } else { 0.0 });
        let (band, most) = black.enumerate().max_by(|a, b| a.1.total_cmp(&b.1))?;
        let below = |kelvin: f64| {
            let part = self.parts(kelvin).get(band).map_or(f64::NAN, |part| *part);
            part * Material::grey(1.0, kelvin).emission < most
        };
        // What a band has of the heat of a black body grows with the temperature.
        let (mut low, mut high) = (0.0, 1.0);
        while below(high) && high < f64::MAX {
            (low, high) = (high, 2.0 * high);
        }
        loop {
            let middle = 0.5 * (low + high);
            if middle <= low || middle >= high {
                return (most > 0.0).then_some(high);
            }
            match below(middle) {
                true => low = middle,
                false => high = middle,
            }
        }
    }
}
