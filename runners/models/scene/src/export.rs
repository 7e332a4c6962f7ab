//! The tables of a scene for a device.

use fredholm_core::{LastStep, Real};
use fredholm_embedded::{Number, TableBuilder};
use fredholm_model::{Error, Region, Subject};
use fredholm_scene::{Grey, Radiosity};

use crate::of_degree;
use crate::partition::Cut;
use crate::places::Place;
use crate::system::{SceneSystem, best_rays};

/// The tables of a scene.
pub(crate) fn scene<F: Real + Number>(system: &SceneSystem<'_>) -> Result<TableBuilder, Error> {
    let cut = &*system.cut;
    let own = &cut.model.scene;
    if own.sky().is_some() || !own.beams().is_empty() || !own.is_straight() {
        return Err(Error::Option {
            subject: Subject::Problem,
            message: "device tables of a scene have the light of its surfaces alone, no mirrors and no period: leave `sky`, `light`, `specular` and `period` out"
                .to_owned(),
        });
    }
    let walks = cut.tables::<F>()?;
    let radiosity = walks.radiosity()?;
    let geometry = radiosity.geometry();
    let mut tables = TableBuilder::new("scene");
    tables.numbers("open", &[u32::from(geometry.is_open())]);
    tables.records("faces", geometry.faces(), |face, to| {
        to.add(face.corners.as_flattened());
        to.add(&face.vertices);
        to.add(&[face.count, face.plane]);
        to.add(&face.normal);
        to.add(&[face.area, face.reflectance, face.emission]);
    });
    tables.records("triangle", geometry.triangles(), |triangle, to| {
        to.add(triangle.axes.as_flattened());
        to.add(&[triangle.face, triangle.plane]);
    });
    tables.records("nodes", geometry.nodes(), |node, to| {
        to.add(&node.low);
        to.add(&node.high);
        to.add(&[node.first, node.count]);
    });
    let of_cells = walks.cells.tables();
    tables.records("sides", of_cells.sides, |side, to| {
        to.add(side.tangents.as_flattened());
        to.add(&[side.patch, side.patches]);
        to.add(&[side.emission]);
    });
    tables.records("patches", of_cells.patches, |patch, to| {
        to.add(&patch.origin);
        to.add(patch.spans.as_flattened());
        to.add(patch.duals.as_flattened());
        to.add(&patch.intervals);
        to.add(&[patch.first, patch.triangle]);
    });
    tables.numbers("lights", of_cells.lights);
    tables.numbers("shares", &walks.shares);
    let (vectors, equation) = (system.solution.for_walks::<F>()?, LastStep(&radiosity));
    add_surfaces(&mut tables, cut, vectors.v(), &radiosity)?;
    let rays = of_degree!(cut.degree, B => best_rays::<F, Grey, B>(&vectors, &equation)?);
    tables.numbers("degree", &[cut.degree as u32]);
    tables.step_control(&vectors.tables(), rays);
    Ok(tables)
}

/// The faces of every surface, and of its mean what is known before any walk.
fn add_surfaces<F: Real + Number>(
    tables: &mut TableBuilder,
    cut: &Cut<'_>,
    v: &[F],
    radiosity: &Radiosity<'_, F>,
) -> Result<(), Error> {
    let (mut surfaces, mut numbers) = (vec![0_u32], Vec::<u32>::new());
    let (mut all_ends, mut known, mut means) = (Vec::<F>::new(), Vec::new(), Vec::new());
    for surface in 0..cut.model.names().len() {
        let place = Place::new(&cut.model.scene, &Region::Part(surface))?;
        let Place::Faces(faces) = &place else {
            return Err(Error::Internal("the mean over a surface is one over faces"));
        };
        let ends = place.ends(radiosity.geometry())?;
        let own = place.origin(radiosity, &ends, None)?.known(radiosity);
        known.push(own);
        means.push(own + cut.mean::<F, f64>(faces, v));
        all_ends.extend(ends);
        numbers.extend(faces);
        surfaces.push(numbers.len() as u32);
    }
    tables.numbers("surfaces", &surfaces);
    tables.numbers("numbers", &numbers);
    tables.numbers("ends", &all_ends);
    tables.numbers("known", &known);
    tables.numbers("means", &means);
    Ok(())
}
