//! Walks in several channels against exact answers.

use fredholm_core::{Channels, Equation as _};
use fredholm_scene::{Coloured, Colours, Sources};

use super::*;

const CHANNELS: usize = 3;
/// u in every channel.
const U: [f64; CHANNELS] = [1.0, 2.0, 0.5];
const WEIGHTS: [f64; CHANNELS] = [0.2126, 0.7152, 0.0722];

type Colour = [f64; CHANNELS];

/// A scene in which every surface has a reflectance and an emission of its own in every channel.
struct Painted {
    scene: Scene,
    reflectances: Vec<f64>,
    emissions: Vec<f64>,
}

/// The number with the largest size.
fn largest(colour: Colour) -> f64 {
    colour
        .into_iter()
        .fold(0.0, |a, b| if a.abs() >= b.abs() { a } else { b })
}

impl Painted {
    fn new<F: Real>(surfaces: &Surfaces, colours: &[[Colour; 2]]) -> Self {
        let scene = scene::<F>(surfaces, |s| Material {
            reflectance: largest(colours[s][0]),
            emission: largest(colours[s][1]),
        });
        let ratios = |which: usize| {
            let of_face = |face: usize| {
                let own = colours[scene.place(face).unwrap().surface][which];
                own.map(|x| if x == 0.0 { 0.0 } else { x / largest(own) })
            };
            (0..scene.faces().len()).flat_map(of_face).collect()
        };
        Self {
            reflectances: ratios(0),
            emissions: ratios(1),
            scene,
        }
    }

    /// The ratios in a scalar.
    fn ratios<F: Real>(&self) -> [Vec<F>; 2] {
        let rounded = |table: &[f64]| table.iter().map(|&x| F::from_f64(x)).collect();
        [rounded(&self.reflectances), rounded(&self.emissions)]
    }
}

fn coloured<'a, F: Real>(
    radiosity: Radiosity<'a, F>,
    [reflectances, emissions]: &'a [Vec<F>; 2],
) -> Coloured<'a, F, 4> {
    let colours = Colours {
        channels: reflectances.len() / radiosity.geometry().faces().len(),
        reflectances,
        emissions,
    };
    radiosity.with_colours(colours).unwrap()
}

/// F_c = (1 − ρ_c) U_c gives u_c = U_c in any closed scene, plain and preconditioned, in every channel and in their sum.
#[test]
fn furnaces_in_colours() {
    fn check_in<F: Real, const B: usize>(which: usize) {
        let mut rng = ChaCha8Rng::seed_from_u64(100 + which as u64);
        let (what, surfaces) = closed_scenes().swap_remove(which);
        let colour = |_| {
            let rho: Colour = core::array::from_fn(|_| 0.9 * rng.random::<f64>());
            [rho, core::array::from_fn(|c| (1.0 - rho[c]) * U[c])]
        };
        let colours: Vec<[Colour; 2]> = surfaces.iter().map(colour).collect();
        let painted = Painted::new::<F>(&surfaces, &colours);
        let place = Place::<F>::new(&painted.scene, 40);
        let wide = Place::new(&painted.scene, 40);
        let radiosity = place.radiosity();
        let shares = radiosity.visible_shares(8);
        let radiosity = radiosity.with_visible_shares(&shares).unwrap();
        let sum: f64 = U.iter().zip(WEIGHTS).map(|(u, weight)| u * weight).sum();
        let expected = Expected {
            what: &what,
            mean: place.mean(),
            weights: &WEIGHTS,
            values: &[U[0], U[1], U[2], sum],
        };
        let (ratios, of_wide) = (painted.ratios(), painted.ratios());
        let (radiosity, wide) = (
            coloured(radiosity, &ratios),
            coloured(wide.radiosity(), &of_wide),
        );
        check_all::<F, _, _, B>(&expected, &radiosity, &wide);
    }
    for (number, which) in [0, 2, 3, 6].into_iter().enumerate() {
        if by_turns(number, 0) {
            check_in::<f64, 3>(which);
        }
        if by_turns(number, 1) {
            check_in::<f32, 6>(which);
        }
        if by_turns(number, 2) {
            check_in::<f64, 1>(which);
        }
    }
}

/// The mean over a face of what a state scores is F_c besides lights, and the light of each colour that arrives there from
/// lights by form factors, behind obstacles, too.
#[test]
fn last_steps_have_the_colours_of_lights() {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let (_, surfaces) = closed_scenes().swap_remove(2);
    // Every third surface emits, in the colours that it reflects, and one takes light away.
    let size = |s: usize| match s {
        1 => -1.0,
        s if s.is_multiple_of(3) => 4.0,
        _ => 0.0,
    };
    let colours = (0..surfaces.len()).map(|s| {
        let own: Colour = core::array::from_fn(|_| rng.random::<f64>());
        [own.map(|x| 0.3 * x), own.map(|x| size(s) * x)]
    });
    let colours: Vec<[Colour; 2]> = colours.collect();
    let painted = Painted::new::<f64>(&surfaces, &colours);
    let (scene, ratios) = (&painted.scene, painted.ratios());
    let place = Place::<f64>::new(scene, 40);
    let radiosity = place.radiosity();
    let visible = radiosity.visible_shares(16);
    let coloured = coloured(radiosity.with_visible_shares(&visible).unwrap(), &ratios);
    let (last, factors) = (
        LastStep(&coloured),
        fredholm_factors::scene_factors(scene, 1e-9).unwrap(),
    );
    let known = |face: usize| {
        let position = scene.faces()[face].corners[0];
        let face = face as u32;
        coloured.known(&Point { face, position })
    };
    let faces = 0..scene.faces().len();
    let lights = faces.clone().filter(|&face| known(face).largest() > 0.0);
    assert!(lights.count() > 2);
    for face in faces.clone() {
        let own = Place::<f64>::of(scene, 40, vec![face as u32]);
        let (mut sums, mut squares) = (Channels::<f64, 4>::splat(CHANNELS, 0.0), [0.0; CHANNELS]);
        let n = 2000;
        for number in 0..n {
            let seeds = WalkSeeds::<DefaultGenerator>::new(3, face as u64);
            let mut draws = RngUniforms(seeds.generator(number));
            let start = own.mean().start(&coloured, &mut draws);
            let score = last.source(&start.point, &mut draws);
            sums = sums.plus(&score.scaled(1.0 / n as f64));
            for (square, score) in squares.iter_mut().zip(score.as_slice()) {
                *square += score * score / n as f64;
            }
        }
        let [reflected, emitted] = colours[scene.place(face).unwrap().surface];
        for channel in 0..CHANNELS {
            let of_light = |from: usize| known(from).get(channel);
            let arriving = faces
                .clone()
                .map(|from| factors.factor(face, from) * of_light(from));
            let arriving: f64 = arriving.sum();
            let expected = reflected[channel] * arriving + emitted[channel] - of_light(face);
            let (mean, square) = (sums.get(channel), squares[channel]);
            let error = ((square - mean * mean).max(0.0) / n as f64).sqrt();
            let off = (mean - expected).abs();
            assert!(
                off <= STANDARD_ERRORS * error + 1e-9,
                "face {face}, channel {channel}: {mean} for {expected}"
            );
        }
    }
}

/// Walks from the sources of a furnace to means over two surfaces, each of which is a channel: together with what receivers emit
/// themselves they bring u = 1. From a lamp they bring what walks to it bring.
#[test]
fn walks_from_sources() {
    let (_, surfaces) = closed_scenes().swap_remove(1);
    let receivers = [0, 6];
    let rho = |s: usize| 0.8 - 0.05 * s as f64;
    let areas = receivers.map(|s| {
        let faces = scene::<f64>(&surfaces, |_| Material::BLACK);
        let is_its = |face: &usize| faces.place(*face).unwrap().surface == s;
        let own = (0..faces.faces().len()).filter(is_its);
        own.map(|face| faces.faces()[face].area).sum::<f64>()
    });
    // Receivers send out ρ over their area.
    let colour = |s: usize| {
        let sent = |c: usize| f64::from(u8::from(receivers[c] == s)) * rho(s) / areas[c];
        [[rho(s), rho(s), 0.0], [sent(0), sent(1), 0.0]]
    };
    let colours: Vec<[Colour; 2]> = (0..surfaces.len()).map(colour).collect();
    let painted = Painted::new::<f64>(&surfaces, &colours);
    let (place, ratios) = (Place::<f64>::new(&painted.scene, 40), painted.ratios());
    let adjoint = coloured(place.radiosity(), &ratios);
    let last = LastStep(&adjoint);
    let own = tables::<f64, _, _, 3>(&last, &adjoint, 256);
    let neighbour = own.neighbour::<_, _, 2, 3>(&last, &adjoint, TWO).unwrap();
    let material = |emits: bool| {
        move |s: usize| Material {
            reflectance: rho(s),
            emission: if emits { 1.0 - rho(s) } else { 0.0 },
        }
    };
    let from = |scene: &Scene, absorption| {
        let sources = Sources::<f64>::new(scene).unwrap();
        let goal = Goal {
            functional: sources,
            control_mean: None,
            known: Channels::splat(CHANNELS, 0.0),
        };
        walk_all(&last, &neighbour, goal, &[], (absorption, 4000))
    };
    let furnace = scene::<f64>(&surfaces, material(true));
    let lamp = Beam::Point {
        at: [0.1, 0.2, 0.1],
        intensity: 1.0,
    };
    let lit = scene::<f64>(&surfaces, material(false))
        .with_beams(vec![lamp])
        .unwrap();
    for absorption in ENDS {
        let (emitted, from_lamp) = (from(&furnace, absorption), from(&lit, absorption));
        for (channel, surface) in receivers.into_iter().enumerate() {
            check_both("sources", &emitted[channel], rho(surface), 1e-9);
            let place = Place::<f64>::over(&lit, 40, surface);
            let radiosity = place.radiosity();
            let none = NoNeighbour::new(&radiosity);
            let to = walk(&radiosity, &none, &place.mean(), absorption, 20_000).plain();
            for from in [
                from_lamp[channel].plain(),
                from_lamp[channel].preconditioned(),
            ] {
                let error = to.std_error.unwrap().hypot(from.std_error.unwrap());
                let off = (to.estimate - from.estimate).abs();
                assert!(off < STANDARD_ERRORS * error, "{to:?} {from:?}");
            }
        }
    }
}
