//! The tables that the firmware reads, as a workstation makes them.

use core::num::NonZeroU32;

use fredholm_circle::{Circle, Direction, Harmonic, OwnedTables, Tables as _};
use fredholm_core::galerkin::{DiagonalRule, PairKind};
use fredholm_core::sampled::{SampledSetup, SetupOptions};
use fredholm_core::{LastStep, Real};
use fredholm_embedded::{Number, TableBuilder};
use fredholm_scene::{
    Cells, Enclosure, Material, Radiosity, Scene, Surface, Tables, areas, shapes,
};

/// The circle of the paper with 48 cells, and its Galerkin neighbour equation with the diagonal pointwise.
///
/// # Panics
/// Never.
#[must_use]
pub fn circle<F: Real + Number>() -> TableBuilder {
    let light = Harmonic {
        constant: 5.0,
        amplitude: 1.0,
        frequency: 5,
    };
    let wide = Circle::new(OwnedTables::<f64>::new(&[0.3, 0.7], 48).unwrap(), light).unwrap();
    let narrow = OwnedTables::<F>::new(&[0.3, 0.7], 48).unwrap();
    let (system, diagonal) = (wide.system::<1>(), PairKind::Pointwise);
    let vectors = system.solve(1e-13, 1000).unwrap();
    let vectors = vectors.for_walks::<F, _>(&system, DiagonalRule { diagonal });
    let vectors = vectors.unwrap();
    let mut tables = TableBuilder::new("circle");
    let numbers = [light.constant, light.amplitude, f64::from(light.frequency)];
    tables.numbers("light", &numbers);
    tables.records("circle", &[*narrow.constants()], |of, fields| {
        fields.add(&[of.quarter, of.root, of.cosine, of.versine]);
        fields.add(of.moments.as_flattened());
        fields.add(&of.factors);
        fields.add(of.diagonal.as_flattened());
        fields.add(of.own.as_flattened());
        fields.add(&of.arcsine);
        fields.add(&of.own_terms);
        fields.add(&[of.arcsine_terms]);
    });
    tables.records("cells", narrow.cells(), |cell, fields| {
        let Direction {
            cos,
            sin,
            cos_low,
            sin_low,
        } = cell.middle;
        fields.add(&[cos, sin, cos_low, sin_low, cell.reflectance]);
    });
    tables.records("slots", narrow.slots(), |slot, fields| {
        fields.add(&[slot.end]);
        fields.add(&[slot.cell]);
    });
    tables.numbers("v", vectors.v());
    tables.numbers("source", vectors.source());
    tables
}

/// A cube of six cells, whose ceiling is a light, and its neighbour equation from steps: the arrays that `fredholm export` writes.
///
/// # Panics
/// Never.
#[must_use]
pub fn scene<F: Real + Number>() -> TableBuilder {
    let [floor, ceiling, walls @ ..] = &shapes::room([0.0; 3], [1.0; 3]).surfaces[..] else {
        unreachable!("a box has six sides")
    };
    let walls = walls.concat();
    let material = |reflectance, emission| {
        [Material {
            reflectance,
            emission,
        }]
    };
    let [grey, lamp, dark] = [material(0.8, 0.0), material(0.8, 1.0), material(0.5, 0.0)];
    let surfaces = [(floor, &grey), (ceiling, &lamp), (&walls, &dark)];
    let surfaces = surfaces.map(|(polygons, materials)| Surface {
        polygons,
        materials,
    });
    let scene = Scene::new::<F>(&surfaces, Enclosure::Closed).unwrap();
    let (wide_tables, wide_cells) = (Tables::<f64>::new(&scene), Cells::new(&scene, 6).unwrap());
    let wide = Radiosity::new(wide_tables.geometry(), &wide_cells).unwrap();
    let setup = SampledSetup::<_, 2, 1, _> {
        equation: &LastStep(&wide),
        events: &wide,
        options: SetupOptions {
            per_axis: Some(4),
            events: 4,
            ..SetupOptions::default()
        },
    };
    let solution = setup.solve_all().unwrap();
    let control = solution.for_walks::<F>().unwrap();
    let narrow_tables = Tables::<F>::new(&scene);
    let narrow_cells = Cells::<F>::new(&scene, 6).unwrap();
    let (geometry, cells) = (narrow_tables.geometry(), narrow_cells.tables());
    let narrow = Radiosity::new(geometry, &narrow_cells).unwrap();
    let mut tables = TableBuilder::new("scene");
    tables.numbers("open", &[u32::from(geometry.is_open())]);
    tables.records("faces", geometry.faces(), |face, fields| {
        fields.add(face.corners.as_flattened());
        fields.add(&face.vertices);
        fields.add(&[face.count, face.plane]);
        fields.add(&face.normal);
        fields.add(&[face.area, face.reflectance, face.emission]);
    });
    tables.records("triangle", geometry.triangles(), |triangle, fields| {
        fields.add(triangle.axes.as_flattened());
        fields.add(&[triangle.face, triangle.plane]);
    });
    tables.records("nodes", geometry.nodes(), |node, fields| {
        fields.add(&node.low);
        fields.add(&node.high);
        fields.add(&[node.first, node.count]);
    });
    tables.records("sides", cells.sides, |side, fields| {
        fields.add(side.tangents.as_flattened());
        fields.add(&[side.patch, side.patches]);
        fields.add(&[side.emission]);
    });
    tables.records("patches", cells.patches, |patch, fields| {
        fields.add(&patch.origin);
        fields.add(patch.spans.as_flattened());
        fields.add(patch.duals.as_flattened());
        fields.add(&patch.intervals);
        fields.add(&[patch.first, patch.triangle]);
    });
    tables.numbers("lights", cells.lights);
    tables.numbers("shares", &narrow.visible_shares(16));
    // Where the faces of each surface begin, and the last ones end; their numbers; their areas, added up.
    let (mut firsts, mut numbers, mut ends) = (vec![0_u32], Vec::new(), Vec::new());
    for surface in 0..scene.surfaces() {
        let faces: Vec<u32> = scene
            .faces_of(surface)
            .unwrap()
            .map(|face| face as u32)
            .collect();
        ends.extend(areas(geometry, &faces).unwrap());
        numbers.extend(faces);
        firsts.push(numbers.len() as u32);
    }
    tables.numbers("surfaces", &firsts);
    tables.numbers("numbers", &numbers);
    tables.numbers("ends", &ends);
    let rays = NonZeroU32::MIN.saturating_add(1);
    tables.step_control(&control.tables(), rays);
    tables
}
