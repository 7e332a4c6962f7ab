//! Scattering on the sphere passes the kit.

use core::f64::consts::PI;

use fredholm_conformance::quadrature::{gauss_legendre, tensor};
use fredholm_conformance::{Description, Neighbours, Offers, examine_both, examine_masses};
use fredholm_core::galerkin::{DiagonalRule, PairKind};
use fredholm_core::sampled::{NoEvents, SampledSetup, SetupOptions};
use fredholm_core::{Located, Real};
use fredholm_sphere::{Parameters, Point, Sphere, point};

const SCATTERING: Parameters = Parameters {
    albedo: 0.6,
    asymmetry: 0.3,
    emission: [1.0, 0.5, -0.7, 0.4],
    forward: 0.4,
};

/// The sphere as the kit sees it.
struct Described<F> {
    sphere: Sphere<F>,
    bands: usize,
    sectors: usize,
    parameters: Parameters,
    /// Rules of 12 and of 24 points.
    rules: [Vec<(f64, f64)>; 2],
    /// Nodes of the cells, which do not depend on x, where they are few.
    nodes: Vec<Vec<(Point<F>, f64)>>,
}

/// A parameter as the scalar F holds it.
fn held<F: Real>(parameter: f64) -> f64 {
    F::from_f64(parameter).to_f64()
}

impl<F: Real> Described<F> {
    fn new(bands: u32, sectors: u32, parameters: Parameters) -> Self {
        let mut described = Self {
            sphere: Sphere::new(bands, sectors, &parameters).expect("a valid equation"),
            bands: bands as usize,
            sectors: sectors as usize,
            parameters,
            rules: [12, 24].map(gauss_legendre),
            nodes: Vec::new(),
        };
        let cells = described.bands * described.sectors;
        if cells < 100 {
            described.nodes = (0..cells).map(|cell| described.nodes_of(cell)).collect();
        }
        described
    }

    /// The nodes of a cell, with weights that sum to its measure.
    fn nodes_of(&self, cell: usize) -> Vec<(Point<F>, f64)> {
        let band = cell / self.sectors;
        let colatitudes = self.height(band + 1).acos() - self.height(band).acos();
        let jacobian = colatitudes * 2.0 * PI / self.sectors as f64;
        let rule = tensor(&[self.rules[0].clone(), self.rules[0].clone()]).into_iter();
        rule.map(|(t, w)| {
            let (colatitude, azimuth) = self.angles(cell, &t);
            let point = point(colatitude, azimuth).map(F::from_f64);
            (point, w * jacobian * colatitude.sin())
        })
        .collect()
    }

    /// The height of the upper edge of a band.
    fn height(&self, band: usize) -> f64 {
        1.0 - 2.0 * band as f64 / self.bands as f64
    }

    /// The first azimuth of a sector.
    fn azimuth(&self, sector: usize) -> f64 {
        2.0 * PI * sector as f64 / self.sectors as f64 - PI
    }

    /// Colatitude and azimuth at the parameters t of a cell. In the height itself the distance from
    /// the axis would have a root at the poles, and no rule of Gauss and Legendre would be exact.
    fn angles(&self, cell: usize, t: &[f64]) -> (f64, f64) {
        let (band, sector) = (cell / self.sectors, cell % self.sectors);
        let (upper, lower) = (self.height(band).acos(), self.height(band + 1).acos());
        let azimuth = 2.0 * PI * (sector as f64 + t[1]) / self.sectors as f64 - PI;
        (upper + t[0] * (lower - upper), azimuth)
    }
}

impl<F: Real> Description for Described<F> {
    type Equation = Sphere<F>;

    fn equation(&self) -> &Sphere<F> {
        &self.sphere
    }

    fn contains(&self, cell: usize, x: &Point<F>) -> bool {
        let edge = 8.0 * F::EPSILON.to_f64();
        let [x, y, z] = x.map(F::to_f64);
        let (band, sector) = (cell / self.sectors, cell % self.sectors);
        let heights = self.height(band + 1) - edge..=self.height(band) + edge;
        let azimuths = self.azimuth(sector) - edge..=self.azimuth(sector + 1) + edge;
        let azimuth = y.atan2(x);
        heights.contains(&z)
            // At a pole all sectors meet; at the seam −π is π.
            && (x.hypot(y) <= edge
                || [-2.0 * PI, 0.0, 2.0 * PI].iter().any(|turn| azimuths.contains(&(azimuth + turn))))
    }

    fn nodes(&self, _: &Point<F>, cell: usize) -> Vec<(Point<F>, f64)> {
        let known = self.nodes.get(cell);
        known.map_or_else(|| self.nodes_of(cell), Clone::clone)
    }

    fn solution(&self, x: &Point<F>) -> Option<f64> {
        let a = held::<F>(self.parameters.albedo);
        let g = held::<F>(self.parameters.asymmetry);
        let [e0, e1, e2, e3] = self.parameters.emission.map(held::<F>);
        let [x, y, z] = x.map(F::to_f64);
        Some(e0 / (1.0 - a) + (e1 * x + e2 * y + e3 * z) / (1.0 - a * g))
    }

    fn constant(&self) -> Option<f64> {
        let [e0, rest @ ..] = self.parameters.emission;
        (rest == [0.0; 3]).then(|| held::<F>(e0) / (1.0 - held::<F>(self.parameters.albedo)))
    }

    fn cumulative(&self, x: &Point<F>, y: &Point<F>) -> Option<f64> {
        // Of the height of y: its density is (1 + b x₃z)/2.
        let (height, z) = (x[2].to_f64(), y[2].to_f64());
        let b = held::<F>(self.parameters.forward);
        Some((z + 1.0) / 2.0 + b * height * (z - 1.0) * (z + 1.0) / 4.0)
    }

    fn mass(&self, x: &Located<Point<F>>, cell: usize) -> Option<f64> {
        // (1 + b m)/n with the mean m of x·y by quadrature: a mean keeps its digits in the
        // tiniest cell.
        let [x, y, z] = x.point.map(F::to_f64);
        let b = held::<F>(self.parameters.forward);
        let [_, rule] = &self.rules;
        // Products of what depends on the azimuth and on the colatitude; weights sum to 1.
        let across: f64 = rule
            .iter()
            .map(|&(t, w)| {
                let (_, azimuth) = self.angles(cell, &[0.0, t]);
                w * (x * azimuth.cos() + y * azimuth.sin())
            })
            .sum();
        let (mut weights, mut sum) = (0.0, 0.0);
        for &(t, w) in rule {
            let (colatitude, _) = self.angles(cell, &[t, 0.0]);
            let (radius, height) = colatitude.sin_cos();
            weights += w * radius;
            sum += w * radius * (radius * across + z * height);
        }
        let cells = (self.bands * self.sectors) as f64;
        Some((1.0 + b * sum / weights) / cells)
    }
}

impl<F: Real> Neighbours for Described<F> {
    fn offers(&self, offers: &mut Offers<'_, Self>) {
        offers.starts(&self.sphere);
        let [all, outside] =
            [PairKind::Galerkin, PairKind::Dropped].map(|diagonal| DiagonalRule { diagonal });
        offers.pairs("all in S", all);
        offers.pairs("diagonal outside", outside);

        // As a user makes it: all in f64, with v and what steps bring rounded to the scalar of the walks.
        let wide = Described::<f64>::new(self.bands as u32, self.sectors as u32, self.parameters);
        let setup = SampledSetup::<_, 2, 1> {
            equation: &wide.sphere,
            events: &NoEvents::NEW,
            options: SetupOptions {
                events: 0,
                ..SetupOptions::default()
            },
        };
        let solved = setup.solve_all().and_then(|solved| solved.for_walks::<F>());
        let tables = solved.expect("a contraction");
        let once = 1.try_into().expect("one draw");
        let neighbour =
            tables.neighbour::<_, _, 2, 1>(&self.sphere, &NoEvents::<Sphere<F>>::NEW, once);
        offers.neighbour("from steps", &neighbour.expect("its cells"));
    }
}

/// The kit's work grows with the square of the cells, of 144 nodes each.
fn long() -> bool {
    std::env::var_os("FREDHOLM_LONG").is_some()
}

/// One seed by day, three with `FREDHOLM_LONG`.
fn seeds() -> core::ops::RangeInclusive<u64> {
    1..=if long() { 3 } else { 1 }
}

fn passes(name: &str, bands: u32, sectors: u32, parameters: Parameters) {
    for seed in seeds() {
        let narrow = Described::<f32>::new(bands, sectors, parameters);
        let wide = Described::<f64>::new(bands, sectors, parameters);
        let report = examine_both(&narrow, &wide, seed);
        println!("{name}, seed {seed}\n{report}");
        report.assert_passed(name);
    }
}

#[test]
fn scattering_passes_the_kit() {
    passes("sphere, 4 bands, 6 sectors", 4, 6, SCATTERING);
    if long() {
        passes("sphere, 6 bands, 8 sectors", 6, 8, SCATTERING);
    }
}

#[test]
fn a_constant_comes_out_constant() {
    let parameters = Parameters {
        emission: [1.0, 0.0, 0.0, 0.0],
        ..SCATTERING
    };
    passes("sphere, constant, 3 bands, 5 sectors", 3, 5, parameters);
    if long() {
        passes("sphere, constant, 4 bands, 8 sectors", 4, 8, parameters);
    }
}

#[test]
fn many_cells_keep_the_digits_of_their_masses() {
    for (bands, sectors) in [
        (1, 1),
        (1, 7),
        (2, 1),
        (300, 500),
        (3, 1 << 20),
        (1 << 20, 3),
    ] {
        let name = format!("sphere, {bands} bands, {sectors} sectors");
        for seed in seeds() {
            let mut report =
                examine_masses(&Described::<f32>::new(bands, sectors, SCATTERING), seed);
            report.extend(examine_masses(
                &Described::<f64>::new(bands, sectors, SCATTERING),
                seed,
            ));
            println!("{name}, seed {seed}\n{report}");
            report.assert_passed(&name);
        }
    }
}
